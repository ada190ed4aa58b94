//! What the instruments of one motor deliver, and the truth, written down.

use std::ops::ControlFlow;

use controller::Sense as _;
use estimator::{CameraFrame, LdvSample};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use crate::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use crate::scene::Scene;
use crate::studies::StudyError;

/// From rest until the motion counts as steady.
const STEADY_NANOS: u64 = 250_000_000;

/// Steady motion that is recorded.
const END_NANOS: u64 = 500_000_000;

/// Ticks from one look at the truth to the next: 70 us, so that all ages of the last frame have their turn.
const TICKS_PER_LOOK: u64 = 7;

/// Something that a filter is told or asked, in the order in which it happens.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// A vibrometer sample has come.
    Sample(LdvSample),
    /// A camera frame has arrived.
    Frame(CameraFrame),
    /// The truth at an instant of steady motion.
    Truth {
        /// The instant.
        at: Time,
        /// The rotor's angle.
        angle: Angle,
        /// Its rate in rad/s.
        rate_rad_s: f64,
    },
}

/// A run from rest under full drive.
#[derive(Clone, Debug)]
pub struct Recording {
    /// The drive.
    pub command: DriveCommand,
    /// What happened.
    pub events: Vec<Event>,
}

impl Recording {
    /// Runs the motor of `scene` at full drive of `mode`.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn make(scene: &Scene, mode: DriveMode) -> Result<Self, StudyError> {
        let command = DriveCommand::full(mode);
        let mut driver = TickDriver::new(scene, Recorder { events: Vec::new() })?;
        driver.overrule(command);
        let mut ticks = 0_u64;
        driver.run(|driver, moment| {
            ticks += 1;
            driver.overrule(command);
            let at = moment.at;
            if ticks.is_multiple_of(TICKS_PER_LOOK) && at.nanos() >= STEADY_NANOS {
                let truth = Event::Truth { at, angle: moment.angle, rate_rad_s: moment.rate_rad_s };
                driver.program_mut().events.push(truth);
            }
            if at.nanos() < END_NANOS { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        Ok(Self { command, events: driver.into_program().events })
    }
}

/// Writes down what arrives.
struct Recorder {
    events: Vec<Event>,
}

impl TickProgram for Recorder {
    type Report = ();

    /// The motor is driven all the time: it has no rest to take long steps in.
    const OBSERVES_STEPS: bool = true;

    fn tick(&mut self, _: Time, ports: &mut RigPorts) {
        self.events.extend(std::iter::from_fn(|| ports.ldv_sample()).map(Event::Sample));
        self.events.extend(std::iter::from_fn(|| ports.camera_frame()).map(Event::Frame));
    }
}
