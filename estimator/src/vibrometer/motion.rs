//! What moves the rotor, from the drive and the vibrometer; and the filter's clock.
//!
//! | drive | vibrometer | motion |
//! |---|---|---|
//! | B | any | `Impacted(B)` |
//! | C, within 25 ms of mode B | any | `Impacted(B)` |
//! | C, later | any | `Impacted(C)` |
//! | off | not quiet, or silent | `Impacted` by the mode driven last; B before the first drive |
//! | off | quiet | `Quiet` |
//!
//! # Which samples are used
//!
//! A vibrometer that has lost its light, or whose range is exceeded, may deliver zeros or repeat one value without a
//! flag. Noise of 0.2 mm/s makes two equal neighbours in `f32` one in 10^5, and an exact zero rarer still. So neither
//! is used: a sample lost by chance costs nothing, and a dead vibrometer counts as silent. A sample from more than a
//! millisecond after the clock has a wrong time and is not used. Neither is one no newer than the last, unless
//! [`MotionWatch::OLD_SAMPLES_MAX`] of those come in a row: then the time of the last one was wrong, and the watch
//! starts again at the next sample.

use motor_model::{DriveCommand, DriveMode, Real, Time};

use crate::measurement::{CLOCK_TOLERANCE_NANOS, LdvSample};
use crate::vibrometer::rest::{RestDetector, RestTuning};

/// What moves the rotor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Impacts act on the rotor, of teeth that move in this mode; or it is in flight after one.
    Impacted(DriveMode),
    /// The rotor lies on the teeth. It may still slide to a stop.
    Quiet,
}

/// Finds the motion from the drive really applied and the vibrometer's samples, and keeps the clock.
#[derive(Clone, Copy, Debug)]
pub struct MotionWatch<T> {
    rest: RestDetector<T>,
    applied: DriveCommand,
    impact_mode: DriveMode,
    /// Until when the motion counts as that of mode B under another drive.
    mode_b_until: Time,
    /// The latest time of a drive.
    drive_told_at: Time,
    /// The last value that arrived, used or not.
    last_value_m_s: f32,
    /// Samples in a row no newer than the last one used.
    old_samples: u8,
}

impl<T: Real> MotionWatch<T> {
    /// After so many samples in a row no newer than the last one used, the watch starts again: 1 ms at 200 kHz.
    pub const OLD_SAMPLES_MAX: u8 = 200;

    /// How long the motion remains that of mode B when mode C follows, in ns: high flights and a rate ten times that of
    /// C decay in 20 to 30 ms.
    const MODE_B_NANOS: u64 = 25_000_000;

    /// A watch without measurements. Until the rotor is found quiet it may move as in mode B, the faster mode.
    pub fn new(tuning: &RestTuning<T>) -> Self {
        Self {
            rest: RestDetector::new(tuning),
            applied: DriveCommand::OFF,
            impact_mode: DriveMode::B,
            mode_b_until: Time::ZERO,
            drive_told_at: Time::ZERO,
            last_value_m_s: 0.0,
            old_samples: 0,
        }
    }

    /// The drive that is really applied from `at` on.
    #[inline]
    pub fn drive(&mut self, at: Time, command: DriveCommand) {
        self.drive_told_at = self.drive_told_at.max(at);
        if self.applied.mode() == Some(DriveMode::B) {
            self.mode_b_until = at.plus_nanos(Self::MODE_B_NANOS);
        }
        self.applied = command;
        self.impact_mode = command.mode().unwrap_or(self.impact_mode);
    }

    /// The latest time of drive or vibrometer.
    #[inline]
    pub fn clock(&self) -> Time {
        self.rest.newest().map_or(self.drive_told_at, |newest| newest.max(self.drive_told_at))
    }

    /// Takes in a sample; whether it was used.
    #[inline]
    pub fn observe(&mut self, sample: &LdvSample) -> bool {
        let value = sample.velocity_m_s;
        let lifeless = value.to_bits() == self.last_value_m_s.to_bits() || value.to_bits() << 1 == 0;
        self.last_value_m_s = value;
        if lifeless {
            return false;
        }
        if let Some(newest) = self.rest.newest() {
            // The usual case: a little newer than the last sample, which the clock is not behind.
            let timely = sample.taken_at.nanos_soon_after(newest, CLOCK_TOLERANCE_NANOS).is_some();
            if !timely && self.mistimed(sample.taken_at, newest) {
                return false;
            }
        }
        self.old_samples = 0;
        self.rest.take(sample)
    }

    /// Whether a sample that is no newer than the last one, or much newer, is to be dropped.
    #[cold]
    fn mistimed(&mut self, taken_at: Time, newest: Time) -> bool {
        if taken_at <= newest {
            self.old_samples += 1;
            if self.old_samples < Self::OLD_SAMPLES_MAX {
                return true;
            }
            self.rest.reset();
        }
        taken_at > self.drive_told_at.plus_nanos(CLOCK_TOLERANCE_NANOS.into()) && self.drive_told_at > newest
    }

    /// The motion at `now`: that of the drive, or still that of mode B soon after it; with the drive off what the
    /// vibrometer shows.
    #[inline]
    pub fn motion(&self, now: Time) -> Motion {
        match self.applied.mode() {
            Some(DriveMode::C) if now < self.mode_b_until => Motion::Impacted(DriveMode::B),
            Some(mode) => Motion::Impacted(mode),
            None if self.rest.quiet_since(now).is_some() => Motion::Quiet,
            None => Motion::Impacted(self.impact_mode),
        }
    }

    /// Whether the vibrometer has been silent for a millisecond before `now`.
    #[inline]
    pub fn silent(&self, now: Time) -> bool {
        self.rest.silent(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// C after B counts as B for 25 ms, C after rest does not; B counts as B from its first instant.
    #[test]
    fn exact_what_mode_b_left_goes_on_under_c() {
        let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
        let mut watch = MotionWatch::<f32>::new(&RestTuning::default());
        watch.drive(Time::ZERO, c);
        assert_eq!(watch.motion(Time::from_micros(1)), Motion::Impacted(DriveMode::C));
        watch.drive(Time::from_micros(1000), b);
        assert_eq!(watch.motion(Time::from_micros(1000)), Motion::Impacted(DriveMode::B));
        // Called at every tick or only at changes: the same.
        watch.drive(Time::from_micros(3000), b);
        watch.drive(Time::from_micros(5000), c);
        watch.drive(Time::from_micros(5010), c);
        for (micros, expected) in [(5000, DriveMode::B), (29_999, DriveMode::B), (30_000, DriveMode::C)] {
            assert_eq!(watch.motion(Time::from_micros(micros)), Motion::Impacted(expected), "{micros}");
        }
    }
}
