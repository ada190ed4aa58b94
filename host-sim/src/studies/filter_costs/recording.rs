//! What the instruments of one motor deliver, and the truth, written down.

use estimator::{CameraFrame, LdvSample};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use crate::scene::Scene;
use crate::studies::StudyError;
use crate::world::rig::Desk;

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
        let mut desk = Desk::new(scene)?;
        let mut events = Vec::new();
        let mut ticks = 0_u64;
        while desk.plant().now().nanos() < END_NANOS {
            for _ in 0..desk.steps_per_tick() {
                desk.step(command);
            }
            ticks += 1;
            events.extend(std::iter::from_fn(|| desk.ldv_sample()).map(Event::Sample));
            events.extend(std::iter::from_fn(|| desk.camera_frame()).map(Event::Frame));
            let (at, rotor) = (desk.plant().now(), desk.plant().state().rotor);
            if ticks.is_multiple_of(TICKS_PER_LOOK) && at.nanos() >= STEADY_NANOS {
                events.push(Event::Truth { at, angle: rotor.angle.angle(), rate_rad_s: rotor.rate_rad_s });
            }
        }
        Ok(Self { command, events })
    }
}
