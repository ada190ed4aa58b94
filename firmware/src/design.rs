//! What a board takes from the design of the motor that it drives: the frequencies.

use controller::Drive;
use motor_model::{MotorParams, OutOfBounds};

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
}
