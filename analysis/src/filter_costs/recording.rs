//! A recording: what the instruments of one motor deliver, and the truth.

use std::ops::ControlFlow;

use controller::Sense as _;
use estimator::{CameraFrame, Instruments, LdvSample};
use motor_model::{Angle, DriveCommand, DriveMode, MotorParams, OutOfBounds, Real, Time};

use simulation::runs::RunError;
use simulation::runs::filter::AnyFilter;
use simulation::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use simulation::scene::Scene;
use simulation::world::instruments::assumed;

/// From the start at rest until the motion counts as steady.
const STEADY_NANOS: u64 = 250_000_000;

/// From the start until the end of the recording.
const END_NANOS: u64 = 500_000_000;

/// Ticks from one record of the truth to the next. 7 is prime to the 10 ticks of a camera period, so that frames of all
/// ages occur.
const TICKS_PER_TRUTH: u64 = 7;

/// A measurement for a filter, or an instant of comparison.
#[derive(Clone, Copy, Debug)]
pub enum RecordedEvent {
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
    /// The events, in order of time.
    pub events: Vec<RecordedEvent>,
    /// What a filter assumes of the motor.
    pub design: MotorParams,
    /// What a filter assumes of the instruments.
    pub instruments: Instruments,
}

impl Recording {
    /// The filter `name` for the motor and the instruments of the recording.
    ///
    /// # Errors
    /// When the model refuses the motor.
    pub fn filter<T: Real>(&self, name: &str) -> Result<AnyFilter<T>, OutOfBounds> {
        AnyFilter::new(name, &self.design, &self.instruments)
    }

    /// Runs the motor of `scene` at full drive of `mode`.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn make(scene: &Scene, mode: DriveMode) -> Result<Self, RunError> {
        let command = DriveCommand::full(mode);
        let mut driver = TickDriver::new(scene, Recorder { events: Vec::new() })?;
        driver.overrule(command);
        let mut ticks = 0_u64;
        driver.run(|driver, moment| {
            ticks += 1;
            driver.overrule(command);
            let at = moment.at;
            if ticks.is_multiple_of(TICKS_PER_TRUTH) && at.nanos() >= STEADY_NANOS {
                let truth = RecordedEvent::Truth { at, angle: moment.angle, rate_rad_s: moment.rate_rad_s };
                driver.program_mut().events.push(truth);
            }
            if at.nanos() < END_NANOS { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        Ok(Self {
            command,
            events: driver.into_program().events,
            design: scene.motor_params(),
            instruments: assumed(scene),
        })
    }
}

/// Records what arrives.
struct Recorder {
    events: Vec<RecordedEvent>,
}

impl TickProgram for Recorder {
    type Report = ();

    /// The motor is driven all the time, so that the plant takes no long steps in any case.
    const OBSERVES_STEPS: bool = true;

    fn tick(&mut self, _: Time, ports: &mut RigPorts) {
        self.events.extend(std::iter::from_fn(|| ports.ldv_sample()).map(RecordedEvent::Sample));
        self.events.extend(std::iter::from_fn(|| ports.camera_frame()).map(RecordedEvent::Frame));
    }
}
