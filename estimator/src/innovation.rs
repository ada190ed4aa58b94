//! The record of a measurement: its innovation, and whether it was used.

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
    /// Exposed before the oldest frame kept: too late.
    OutOfHorizon,
    /// A frame of this exposure has arrived already.
    Duplicate,
    /// Exposed after the filter's own time: its clock is wrong.
    Future,
    /// Beyond the gate: too far from its prediction.
    Gate,
    /// At rest, the same code without dither: it holds no information beyond the quantisation.
    Repeated,
    /// The same code again and again while the rotor is driven: the camera is stuck.
    Stuck,
}

/// What became of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Verdict {
    /// It corrected the estimate.
    Used,
    /// It started the estimate, or restarted it after too many rejections in a row.
    Restarted,
    /// It did not correct the estimate.
    Rejected(Rejection),
}

/// A measurement, its prediction, and what became of it.
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
