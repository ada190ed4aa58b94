//! What the board tells the program of itself: its clock, its stack, its converter, why it started.

use link::ResetCause;

use super::Application;
use crate::design::DesignedDrive;

impl<D: DesignedDrive> Application<'_, D> {
    /// The same on a board whose own timer makes the ticks: a step of the host would be one too many.
    #[must_use]
    pub fn timed(self) -> Self {
        Self { in_lock_step: false, ..self }
    }

    /// Keeps the most bytes that the stack has taken, for [`link::HostMessage::Count`].
    pub fn record_stack(&mut self, bytes_max: u32) {
        self.stack_bytes_max = bytes_max;
    }

    /// Keeps how many bytes there are for the stack, for [`link::HostMessage::SelfTest`].
    pub fn record_stack_size(&mut self, bytes: u32) {
        self.stack_bytes = bytes;
    }

    /// Keeps whether the board has a converter for a vibrometer, for [`link::HostMessage::SelfTest`].
    pub fn record_converter(&mut self, is_installed: bool) {
        self.has_converter = is_installed;
    }

    /// Keeps why the board started, for [`link::HostMessage::Identify`].
    pub fn record_reset(&mut self, cause: ResetCause) {
        self.reset_cause = cause;
    }
}
