//! The border between the loop and the hardware, real or simulated.

use estimator::{CameraFrame, LdvSample};
use motor_model::DriveCommand;

/// Most vibrometer samples that one tick takes in; a sensor that has more keeps them for the next tick.
pub const LDV_SAMPLES_PER_TICK_MAX: usize = 16;

/// What the loop asks of the sensors. Neither method blocks.
pub trait Sense {
    /// The next camera frame that has arrived, oldest first; `None` when there is none, when the camera is absent and when it has failed:
    /// the estimator judges by what comes and when.
    fn camera_frame(&mut self) -> Option<CameraFrame>;

    /// The next vibrometer sample, oldest first; `None` as above.
    fn ldv_sample(&mut self) -> Option<LdvSample>;
}

/// What the loop asks of the coil's amplifier.
pub trait Drive {
    /// Applies `command` from now on and returns what is really applied, which the next prediction builds on: the command itself,
    /// or [`DriveCommand::OFF`] when the amplifier is absent, limited to nothing or faulty.
    fn drive(&mut self, command: DriveCommand) -> DriveCommand;
}
