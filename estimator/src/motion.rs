//! What is known of the rotor's motion beside the camera: the drive, and what the vibrometer hears.

use motor_model::{DriveCommand, DriveMode, Real, Time};

use crate::measurement::LdvSample;
use crate::rest::{RestDetector, RestTuning};

/// What moves the rotor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Struck by teeth in this mode, or in flight after it.
    Struck(DriveMode),
    /// Lying on the teeth, perhaps still sliding to a stop.
    Quiet,
}

/// Tells the motion from the drive really applied and the vibrometer's samples.
#[derive(Clone, Copy, Debug)]
pub struct MotionWatch<T> {
    rest: RestDetector<T>,
    applied: DriveCommand,
    struck_by: DriveMode,
}

impl<T: Real> MotionWatch<T> {
    /// A watch that has seen nothing: until the rotor is seen to be quiet it may be moving in the wilder mode, B.
    pub fn new(tuning: &RestTuning<T>) -> Self {
        Self { rest: RestDetector::new(tuning), applied: DriveCommand::OFF, struck_by: DriveMode::B }
    }

    /// The drive that is really applied from now on.
    #[inline]
    pub fn drive(&mut self, command: DriveCommand) {
        self.applied = command;
        self.struck_by = command.mode().unwrap_or(self.struck_by);
    }

    /// Takes a sample in; whether it was used, see [`RestDetector::observe`].
    #[inline]
    pub fn observe(&mut self, sample: &LdvSample) -> bool {
        self.rest.observe(sample)
    }

    /// The motion at `now`: that of the drive that is on, otherwise what the vibrometer hears.
    #[inline]
    pub fn motion(&self, now: Time) -> Motion {
        match (self.applied.mode(), self.rest.quiet_since(now)) {
            (Some(mode), _) => Motion::Struck(mode),
            (None, Some(_)) => Motion::Quiet,
            (None, None) => Motion::Struck(self.struck_by),
        }
    }

    /// Whether the vibrometer has been silent for a millisecond before `now`.
    #[inline]
    pub fn silent(&self, now: Time) -> bool {
        self.rest.silent(now)
    }
}
