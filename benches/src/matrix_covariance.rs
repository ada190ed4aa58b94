//! The covariance kept as a matrix: what tests and benchmarks compare the factors of `estimator` with.
//!
//! ```text
//! conventional   P <- P - K h'P                           indefinite in f32 once h'P h / R passes some 1e6
//! Joseph         P <- (I - K h') P (I - K h')' + K R K'   indefinite later, at twice the cost
//! ```
//!
//! Both are the textbook's; neither makes P symmetric again. Sources: Kalman (1960); Bucy and Joseph, "Filtering for
//! Stochastic Processes with Applications to Guidance" (1968).

use motor_model::Real;
use nalgebra::{SMatrix, SVector};
use ud_filter::{NoiseSource, Transition, UdCovariance};

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
    /// Takes in `z = h'x + noise`; false when the measurement cannot be used and nothing has changed.
    fn take_in(&mut self, row: &SVector<T, N>, noise: T, innovation: T, state: &mut SVector<T, N>) -> bool;
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
        self.predict(transition, noise).expect("a plain model");
    }
    fn take_in(&mut self, row: &SVector<T, N>, noise: T, innovation: T, state: &mut SVector<T, N>) -> bool {
        self.update(row, noise, innovation, state).is_ok()
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
    fn take_in(&mut self, row: &SVector<T, N>, noise: T, innovation: T, state: &mut SVector<T, N>) -> bool {
        let cross = self.0 * row;
        let variance = (row.transpose() * cross).x + noise;
        let usable = variance > T::zero() && variance * T::zero() == T::zero();
        if usable {
            let gain = cross * (T::one() / variance);
            if JOSEPH {
                let kept = SMatrix::<T, N, N>::identity() - gain * row.transpose();
                self.0 = kept * self.0 * kept.transpose() + gain * gain.transpose() * noise;
            } else {
                self.0 -= gain * (row.transpose() * self.0);
            }
            *state += gain * innovation;
        }
        usable
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
