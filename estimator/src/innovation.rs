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

/// How an impact that the vibrometer shows differs from what the twin predicts of the pair of teeth that made it.
///
/// It is two scalar innovations that are independent in a consistent filter: the gap, and the approach given the gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactInnovation<T> {
    /// Gap between rotor and tooth at the impact: measured (none) less predicted, in m.
    pub gap_m: T,
    /// Variance predicted for it, in m^2.
    pub gap_m2: T,
    /// Speed at which the tooth approaches the rotor: measured by the jump less predicted from the gap, in m/s.
    pub approach_m_s: T,
    /// Variance predicted for it, in m^2/s^2.
    pub approach_m2_s2: T,
}

impl<T: Real> ContactInnovation<T> {
    /// Normalised innovations squared of gap and approach, whose means are 1 in a consistent filter.
    pub fn normalised_squared(&self) -> [T; 2] {
        [self.gap_m * self.gap_m / self.gap_m2, self.approach_m_s * self.approach_m_s / self.approach_m2_s2]
    }
}

/// An impact as a measurement, and what became of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactInnovation<T> {
    /// When the sample was taken that showed it.
    pub taken_at: Time,
    /// Its innovations under the pair of teeth that it fits better.
    pub contact: ContactInnovation<T>,
    /// Whether its kick was used; [`Verdict::Restarted`] when it ended the trust in the model.
    pub verdict: Verdict,
}

impl<T: Real> Innovation<T> {
    /// Normalised innovation squared, whose mean is 1 in a consistent filter; `None` when nothing was predicted.
    pub fn normalised_squared(&self) -> Option<T> {
        (self.variance_rad2 > T::zero())
            .then(|| self.innovation_rad * self.innovation_rad / self.variance_rad2)
    }
}
