//! What the loop needs of the hardware, real or simulated.

use estimator::{CameraFrame, LdvSample};
use motor_model::DriveCommand;

use crate::loop_timing::LoopTiming;

/// Most vibrometer samples that a decision fuses for each tick since the one before: eight times those of a vibrometer
/// of 200 kHz. A sensor that has more keeps them for the next decision.
pub const LDV_SAMPLES_PER_TICK_MAX: usize = 16;

/// The sensors. Neither method blocks.
pub trait Sense {
    /// The next camera frame that has arrived, oldest first. `None` when there is none, and when the camera is absent
    /// or has failed: the estimator tells these apart by when frames come.
    fn camera_frame(&mut self) -> Option<CameraFrame>;

    /// The next vibrometer sample, oldest first; `None` as for the camera.
    fn ldv_sample(&mut self) -> Option<LdvSample>;
}

/// The amplifier of the coil.
pub trait Drive {
    /// Applies `command` once the latency of [`Self::timing`] is over, and returns what is really applied then: the
    /// command itself, or a weaker one where the amplifier limits it, or [`DriveCommand::OFF`] when the amplifier is
    /// absent or has failed. The filter predicts by what is returned. It is called in the ticks that decide.
    fn drive(&mut self, command: DriveCommand) -> DriveCommand;

    /// When the loop decides, and when its commands act; the same throughout a run. Within the latency a processor has
    /// to be done with the work of a tick; the loop estimates and decides for the time when its command acts.
    fn timing(&self) -> LoopTiming {
        LoopTiming::default()
    }
}
