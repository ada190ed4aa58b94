//! How each parameter's error has moved a mode since the covariance was last predicted.
//!
//! The mode `x = (g, g')` with parameter error `p` moves as `x' = A x + b(t) p`. Its sensitivity `s = dx/dp` obeys the
//! same equation with `b` as input, `s' = A s + b(t)`, from `s = 0`. Two numbers a parameter and mode are kept beside
//! the transition matrix, so that the covariance of 24 states is predicted only when a measurement needs it.
//!
//! A sensitivity needs less accuracy than the motion itself. It is stepped over [`SENSITIVITY_PERIODS`] sample periods
//! at a time, in which a mode turns by less than a radian, with the trapezoidal sum of its input: [`InputSums`].

use motor_model::{ModalState, Real};
use nalgebra::{Matrix2, Vector2};

/// Periods of the stator's step in one step of the sensitivities: 20 us, 0.94 rad of mode C.
pub(super) const SENSITIVITY_PERIODS: u8 = 4;

/// Trapezoidal sums of the inputs by which the parameters act, over the periods since the last sensitivity step.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct InputSums<T: Real> {
    pub(super) modes: ModalState<T>,
    /// Sine and cosine of the drive's phase.
    pub(super) phasor: Vector2<T>,
}

impl<T: Real> InputSums<T> {
    /// Adds the inputs at one instant; `weight` is a half at the ends.
    #[inline]
    pub(super) fn add(&mut self, modes: &ModalState<T>, [sin, cos]: [T; 2], weight: T) {
        self.modes.displacement_m += modes.displacement_m * weight;
        self.modes.velocity_m_s += modes.velocity_m_s * weight;
        self.phasor += Vector2::new(sin, cos) * weight;
    }
}

/// Sensitivities of one mode's displacement and velocity, in m and m/s per part, and per rad of the drive's phase.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ModeSensitivities<T: Real> {
    pub(super) stiffness: Vector2<T>,
    pub(super) damping: Vector2<T>,
    pub(super) amplitude: Vector2<T>,
    pub(super) drive_phase: Vector2<T>,
    /// Transition matrix of the mode since then.
    pub(super) transition: Matrix2<T>,
}

impl<T: Real> ModeSensitivities<T> {
    /// Those of a covariance that belongs to the present.
    pub(super) fn none() -> Self {
        Self { transition: Matrix2::identity(), ..Self::default() }
    }

    /// One step of the homogeneous equation.
    #[inline]
    pub(super) fn step(&mut self, step: &Matrix2<T>) {
        self.stiffness = step * self.stiffness;
        self.damping = step * self.damping;
        self.amplitude = step * self.amplitude;
        self.drive_phase = step * self.drive_phase;
        self.transition = step * self.transition;
    }
}
