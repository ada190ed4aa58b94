//! The covariance kept as a matrix: what tests and benchmarks compare the factors of `estimator` with.
//!
//! ```text
//! conventional   P <- P - K h'P                           indefinite in f32 once h'P h / R passes some 1e6
//! Joseph         P <- (I - K h') P (I - K h')' + K R K'   indefinite later, at twice the cost
//! ```
//!
//! Both are the textbook's; neither makes P symmetric again. Sources: Kalman (1960); Bucy and Joseph, "Filtering for
//! Stochastic Processes with Applications to Guidance" (1968).

use estimator::{Correction, NoiseSource, Refusal, Transition, UdCovariance};
use motor_model::Real;
use nalgebra::{SMatrix, SVector};

/// What a Kalman filter needs of its covariance, in whatever form it is kept.
pub trait CovarianceForm<T: Real, const N: usize>: Copy {
    /// Independent states.
    fn from_diagonal(variances: &SVector<T, N>) -> Self;
    /// P itself.
    fn covariance(&self) -> SMatrix<T, N, N>;
    /// `P <- F P F' + sum c a a'`.
    fn predict<F: Transition<T, N>, const M: usize>(
        &mut self,
        transition: &F,
        noise: &[NoiseSource<T, N>; M],
    );
    /// Takes in `z = h'x + noise`.
    ///
    /// # Errors
    /// When the measurement cannot be used; nothing has changed then.
    fn update(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal>;
}

/// The covariance as a matrix, updated by Joseph's form or conventionally.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatrixForm<T, const N: usize, const JOSEPH: bool>(pub SMatrix<T, N, N>);

/// `P <- P - K h'P`.
pub type Conventional<T, const N: usize> = MatrixForm<T, N, false>;

/// `P <- (I - K h') P (I - K h')' + K R K'`.
pub type Joseph<T, const N: usize> = MatrixForm<T, N, true>;

impl<T: Real, const N: usize> CovarianceForm<T, N> for UdCovariance<T, N> {
    fn from_diagonal(variances: &SVector<T, N>) -> Self {
        Self::from_diagonal(variances)
    }
    fn covariance(&self) -> SMatrix<T, N, N> {
        self.covariance()
    }
    fn predict<F: Transition<T, N>, const M: usize>(
        &mut self,
        transition: &F,
        noise: &[NoiseSource<T, N>; M],
    ) {
        self.predict(transition, noise);
    }
    fn update(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal> {
        self.update(row, noise, innovation, state)
    }
}

impl<T: Real, const N: usize, const JOSEPH: bool> CovarianceForm<T, N> for MatrixForm<T, N, JOSEPH> {
    fn from_diagonal(variances: &SVector<T, N>) -> Self {
        Self(SMatrix::from_diagonal(variances))
    }
    fn covariance(&self) -> SMatrix<T, N, N> {
        self.0
    }
    fn predict<F: Transition<T, N>, const M: usize>(
        &mut self,
        transition: &F,
        noise: &[NoiseSource<T, N>; M],
    ) {
        self.0 = predicted(&self.0, transition, noise);
    }
    fn update(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal> {
        let correction = correction(&self.0, row, noise, innovation)?;
        let gain = correction.gain;
        if JOSEPH {
            let kept = SMatrix::<T, N, N>::identity() - gain * row.transpose();
            self.0 = kept * self.0 * kept.transpose() + gain * gain.transpose() * noise;
        } else {
            self.0 -= gain * (row.transpose() * self.0);
        }
        *state += gain * innovation;
        Ok(correction)
    }
}

/// `F P F' + sum c a a'`.
fn predicted<T: Real, const N: usize, F: Transition<T, N>, const M: usize>(
    covariance: &SMatrix<T, N, N>,
    transition: &F,
    noise: &[NoiseSource<T, N>; M],
) -> SMatrix<T, N, N> {
    let carried = |matrix: &SMatrix<T, N, N>| -> SMatrix<T, N, N> {
        let columns = matrix.data.0.map(|column| {
            let [carried] = transition.carry(&column.into()).data.0;
            carried
        });
        SMatrix::from(columns)
    };
    let mut sum: SMatrix<T, N, N> = carried(&carried(covariance).transpose()).transpose();
    for source in noise {
        sum += source.gain * source.gain.transpose() * source.variance;
    }
    sum
}

/// Gain and innovation variance by the textbook. Refuses what [`UdCovariance::update`] refuses, and a negative
/// variance.
fn correction<T: Real, const N: usize>(
    covariance: &SMatrix<T, N, N>,
    row: &SVector<T, N>,
    noise: T,
    innovation: T,
) -> Result<Correction<T, N>, Refusal> {
    let noise_known = noise >= T::zero();
    if !noise_known {
        return Err(Refusal::Noise);
    }
    let cross = covariance * row;
    let [[variance]] = (row.transpose() * cross).data.0;
    let variance = variance + noise;
    if !is_finite(variance) {
        return Err(Refusal::Uncertain);
    }
    let per_variance = T::one() / variance;
    if !(is_finite(per_variance) && per_variance > T::zero()) {
        return Err(Refusal::Certain);
    }
    let normalised_squared = innovation * per_variance * innovation;
    if !is_finite(normalised_squared) {
        return Err(Refusal::Innovation);
    }
    Ok(Correction { variance, gain: cross * per_variance, normalised_squared })
}

/// Whether `x` is neither infinite nor NaN.
fn is_finite<T: Real>(x: T) -> bool {
    x * T::zero() == T::zero()
}
