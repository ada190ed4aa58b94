//! What a board takes from the bench that it drives: the frequencies of the motor, and the timing of its loop.

use controller::{Drive, LoopTiming};
use motor_model::{DriveCommand, MotorParams, OutOfBounds};

/// An amplifier that drives the modes of a design.
pub trait DesignedDrive: Drive {
    /// What it takes from the design.
    type Design;

    /// What it takes from the design `motor`.
    ///
    /// # Errors
    /// When it cannot drive these modes.
    fn design(motor: &MotorParams) -> Result<Self::Design, OutOfBounds>;

    /// From the next command on it drives the modes of `design`. The drive is off.
    fn follow(&mut self, design: Self::Design);

    /// From the next command on this is its timing ([`Drive::timing`]). The drive is off.
    fn keep_time(&mut self, timing: LoopTiming);

    /// Whether it works: no error has occurred since the start.
    fn works(&self) -> bool {
        true
    }

    /// Switches the drive off at once, whatever the latency. Commands that do not act yet never will.
    fn switch_off(&mut self) {
        self.drive(DriveCommand::OFF);
    }
}
