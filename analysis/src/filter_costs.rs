//! What each filter costs on this machine, and how far it is off: a [recording](mod@recording) of a motor's
//! instruments, and filters [replayed](replay) over it.

pub mod recording;
pub mod replay;

use motor_model::OutOfBounds;

use crate::filter_errors::error_sums::ErrorSums;
use recording::Recording;
use simulation::runs::simulate::Precision;

/// A filter with its precision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilterVariant {
    /// Its name, as a scene picks it.
    pub filter: &'static str,
    /// Its arithmetic.
    pub precision: Precision,
}

impl FilterVariant {
    /// The error sums in steady motion.
    ///
    /// # Errors
    /// When the model refuses the motor.
    pub fn error_sums(&self, recording: &Recording) -> Result<ErrorSums, OutOfBounds> {
        Ok(match self.precision {
            Precision::F32 => replay::error_sums(recording.filter::<f32>(self.filter)?, recording),
            Precision::F64 => replay::error_sums(recording.filter::<f64>(self.filter)?, recording),
        })
    }
}
