//! An impact as the vibrometer measures it, and as the stator filter explains it.

use motor_model::Real;

use crate::innovation::ContactInnovation;

/// A value and the variance of its error.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Uncertain<T> {
    pub(super) value: T,
    pub(super) variance: T,
}

/// An impact as the vibrometer measures it.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredImpact<T> {
    /// Vertical velocity of the rotor before, extrapolated to the end of the period, in m/s.
    pub(super) before_m_s: T,
    /// Jump of that velocity, in m/s.
    pub(super) jump_m_s: T,
    /// Variance of the jump.
    pub(super) jump_m2_s2: T,
    /// Time since the sample before, within which the impact happened, in s: a period, or more where samples were lost.
    pub(super) within_s: T,
    /// How far the stator, which moves in whole periods, is behind the sample, in s: 0 where samples come with its
    /// periods.
    pub(super) behind_s: T,
    /// Sum of the corrections of the flight's velocity since the impact before, in m/s: undetected impacts, mostly.
    pub(super) drift_m_s: T,
}

impl<T: Real> MeasuredImpact<T> {
    /// How long before the end of the period the impact was, in s, from its instant after the middle of the period.
    pub(super) fn back_s(&self, instant_s: T) -> T {
        T::from_f64(0.5) * self.within_s - instant_s
    }

    /// Whether the jump may be the vibrometer's noise: eight standard deviations are exceeded once in 10^15 samples.
    pub(super) fn may_be_noise(&self) -> bool {
        self.jump_m_s * self.jump_m_s <= T::from_f64(64.0) * self.jump_m2_s2
    }

    /// An instant, clamped to the period.
    pub(super) fn clamp_instant_s(&self, instant_s: T) -> T {
        instant_s.clamp_magnitude(T::from_f64(0.5) * self.within_s)
    }
}

/// An impact as the stator filter explains it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExplainedImpact<T> {
    /// How long before the end of the period it was, in s.
    pub(super) back: Uncertain<T>,
    /// Jump of the rotor's vertical velocity, in m/s.
    pub(super) jump: Uncertain<T>,
    /// Tangential velocity of the tooth, in m/s.
    pub(super) tooth_velocity: Uncertain<T>,
    /// Its innovations, and the sum of their normalised squares.
    pub(super) innovation: ContactInnovation<T>,
    pub(super) misfit: T,
}

/// An impact that the stator filter associates with no pair: it misfits both by more than it misfits noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnassociatedImpact<T> {
    /// The smaller misfit of the pairs less that of noise.
    pub(super) excess_misfit: T,
    /// The innovations under that pair.
    pub(super) innovation: ContactInnovation<T>,
}
