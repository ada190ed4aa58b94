//! The record that every measurement leaves.

use motor_model::{Real, Time};

/// Which instrument a measurement came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// Camera: angle.
    Camera,
}

/// Why a measurement was not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Rejection {
    /// From before the oldest measurement that is kept: too late.
    OutOfHorizon,
    /// One of this time has come already.
    Duplicate,
    /// From after the filter's own time: its clock is wrong.
    Future,
    /// Too far from its prediction to be believed.
    Gate,
    /// At rest, the same code again without a sign of dither: it tells no more than quantisation lets it.
    Repeated,
    /// The same code again and again of a rotor that is being struck: the camera is stuck.
    Stuck,
}

/// What became of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// It corrected the estimate.
    Used,
    /// It began the estimate, or began it anew after too many rejections in a row.
    Restarted,
    /// It did not correct the estimate.
    Rejected(Rejection),
}

/// A measurement as the filter saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation<T> {
    /// Where it came from.
    pub source: Source,
    /// When it was taken.
    pub taken_at: Time,
    /// Measurement less prediction, in rad; 0 when nothing was predicted.
    pub innovation_rad: T,
    /// Variance predicted for the innovation, in rad^2; 0 when nothing was predicted.
    pub variance_rad2: T,
    /// What became of it.
    pub verdict: Verdict,
}

impl<T: Real> Innovation<T> {
    /// Normalised innovation squared, whose mean is 1 in a consistent filter; `None` when nothing was predicted.
    pub fn normalised_squared(&self) -> Option<T> {
        (self.variance_rad2 > T::zero())
            .then(|| self.innovation_rad * self.innovation_rad / self.variance_rad2)
    }
}
