//! The factors and their yardstick, and how far they are apart.

use motor_model::Real;
use nalgebra::{SMatrix, SVector};
use ud_filter::{NoiseSource, Transition, UdCovariance};

use crate::support::precise_filter::PreciseFilter;

/// The unit of rounding.
pub(super) fn epsilon<T: Real>() -> f64 {
    if size_of::<T>() == 4 { f64::from(f32::EPSILON) } else { f64::EPSILON }
}

/// Largest entry of `p - q` in the scale of its own place, `sqrt(Q_ii Q_jj)`.
pub(super) fn distance<T: Real, const N: usize>(p: &SMatrix<T, N, N>, q: &SMatrix<f64, N, N>) -> f64 {
    let error = |i: usize, j: usize| (p[(i, j)].to_f64() - q[(i, j)]).abs() / (q[(i, i)] * q[(j, j)]).sqrt();
    (0..N * N)
        .map(|k| error(k / N, k % N))
        .fold(0.0, |worst: f64, error| if error <= worst { worst } else { error })
}

pub(super) fn all_positive<T: Real, const N: usize>(p: &UdCovariance<T, N>) -> bool {
    p.weights().iter().all(|&weight| weight > T::zero())
}

pub(super) fn symmetric<T: Real, const N: usize>(p: &SMatrix<T, N, N>) -> bool {
    *p == p.transpose()
}

pub(super) fn rounded<T: Real, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> SMatrix<T, R, C> {
    m.map(T::from_f64)
}

/// A filter and its yardstick, taken through the same steps.
pub(super) struct Pair<T: Real, const N: usize> {
    pub(super) factors: UdCovariance<T, N>,
    pub(super) state: SVector<T, N>,
    pub(super) precise: PreciseFilter<N>,
}

impl<T: Real, const N: usize> Pair<T, N> {
    pub(super) fn new(variances: [f64; N]) -> Self {
        let variances = SVector::from(variances).map(T::from_f64);
        Self {
            factors: UdCovariance::from_diagonal(&variances),
            state: SVector::zeros(),
            precise: PreciseFilter::new(&SMatrix::from_diagonal(&variances.map(Real::to_f64))),
        }
    }

    pub(super) fn predict<F: Transition<T, N>, const M: usize>(
        &mut self,
        transition: &F,
        matrix: &SMatrix<T, N, N>,
        noise: &[NoiseSource<T, N>; M],
    ) {
        self.state = transition.carry(&self.state);
        self.factors.predict(transition, noise).expect("a plain model");
        self.precise.predict(matrix, noise);
    }

    /// Takes a measurement in; the gains' largest distance, in the scale `sqrt(P_ii / variance)` of the prior.
    pub(super) fn update(&mut self, row: [f64; N], noise: f64, measured: f64) -> f64 {
        let (row, noise, measured) =
            (rounded(&SVector::from(row)), T::from_f64(noise), T::from_f64(measured));
        let sigma = self.precise.sigma();
        let trace = self.factors.variances().sum();
        let innovation = measured - row.dot(&self.state);
        let correction =
            self.factors.update(&row, noise, innovation, &mut self.state).expect("a plain measurement");
        let (gain, variance) = self.precise.update(&row, noise, measured);
        let bound = trace * T::from_f64(1.0 + 4.0 * epsilon::<T>());
        assert!(self.factors.variances().sum() <= bound, "a measurement made the trace larger");
        let error = |i: usize| (correction.gain[i].to_f64() - gain[i]).abs() / (sigma[i] / variance.sqrt());
        (0..N).map(error).fold(0.0, f64::max)
    }

    pub(super) fn distance(&self) -> f64 {
        assert!(symmetric(&self.factors.covariance()));
        distance(&self.factors.covariance(), &self.precise.covariance())
    }

    /// Largest difference of the states, in standard errors.
    pub(super) fn sigmas(&self) -> f64 {
        let errors =
            (self.state.map(Real::to_f64) - self.precise.state()).component_div(&self.precise.sigma());
        errors.abs().max()
    }
}
