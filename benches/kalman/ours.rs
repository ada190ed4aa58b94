//! The cores of the estimator, as filters that can be timed.

use std::hint::black_box;

use benches::matrix_covariance::CovarianceForm;
use estimator::{AngleRateCovariance, TrackCovariance as _};
use motor_model::Real;
use nalgebra::SVector;
use ud_filter::{Blocks2, Dense, NoiseSource, Transition, UdCovariance, UpperTriangular};

use crate::problem::{Filter, Problem};

/// A filter whose covariance has the form C and whose transition has the structure F, with S noise sources.
pub struct Ours<T, C, F, const N: usize, const S: usize, const M: usize> {
    transition: F,
    noise: [NoiseSource<T, N>; S],
    rows: [SVector<T, N>; M],
    measured_variance: T,
    covariance: C,
    state: SVector<T, N>,
}

/// A transition that can be built from a problem.
pub trait FromProblem<T, const N: usize, const M: usize> {
    /// The problem's F in this structure.
    fn of(problem: &Problem<T, N, M>) -> Self;
}

impl<T: Real, const N: usize, const M: usize> FromProblem<T, N, M> for Dense<T, N> {
    fn of(problem: &Problem<T, N, M>) -> Self {
        Self(problem.transition)
    }
}

impl<T: Real, const N: usize, const M: usize> FromProblem<T, N, M> for UpperTriangular<T, N> {
    fn of(problem: &Problem<T, N, M>) -> Self {
        Self(problem.transition)
    }
}

impl<T: Real, const N: usize, const B: usize, const M: usize> FromProblem<T, N, M> for Blocks2<T, B> {
    fn of(problem: &Problem<T, N, M>) -> Self {
        Self(std::array::from_fn(|b| problem.transition.fixed_view::<2, 2>(2 * b, 2 * b).into_owned()))
    }
}

impl<T, C, F, const N: usize, const S: usize, const M: usize> Filter<T, N, M> for Ours<T, C, F, N, S, M>
where
    T: Real,
    C: CovarianceForm<T, N>,
    F: Transition<T, N> + FromProblem<T, N, M>,
{
    fn new(problem: &Problem<T, N, M>) -> Self {
        Self {
            transition: F::of(problem),
            noise: problem.sources(),
            rows: std::array::from_fn(|m| problem.rows.row(m).transpose()),
            measured_variance: black_box(T::one()),
            covariance: C::from_diagonal(&SVector::repeat(problem.start_variance)),
            state: SVector::zeros(),
        }
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        self.state = self.transition.carry(&self.state);
        self.covariance.predict(&self.transition, &self.noise);
        for (row, &z) in self.rows.iter().zip(measured) {
            let innovation = z - row.dot(&self.state);
            let taken = self.covariance.take_in(row, self.measured_variance, innovation, &mut self.state);
            assert!(taken, "a plain measurement");
        }
    }

    fn state(&self) -> [T; N] {
        let [state] = self.state.data.0;
        state
    }
}

/// The filter F of a modal problem with each mode as `(v / w, g)`: the state that noise drives is first, as
/// [`NoiseSource`] advises.
pub struct NoiseDrivenFirst<F>(F);

impl<T: Real, F: Filter<T, N, M>, const N: usize, const M: usize> Filter<T, N, M> for NoiseDrivenFirst<F> {
    fn new(problem: &Problem<T, N, M>) -> Self {
        Self(F::new(&problem.noise_driven_first()))
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        self.0.step(measured);
    }

    fn state(&self) -> [T; N] {
        let state = self.0.state();
        std::array::from_fn(|i| state[i ^ 1])
    }
}

/// Two states, of which the first is measured.
pub struct MeasuredState<T>(Ours<T, UdCovariance<T, 2>, UpperTriangular<T, 2>, 2, 2, 1>);

impl<T: Real> Filter<T, 2, 1> for MeasuredState<T> {
    fn new(problem: &Problem<T, 2, 1>) -> Self {
        Self(Ours::new(problem))
    }

    #[inline]
    fn step(&mut self, &[z]: &[T; 1]) {
        let filter = &mut self.0;
        filter.state = filter.transition.carry(&filter.state);
        filter.covariance.predict(&filter.transition, &filter.noise).expect("a plain model");
        let innovation = z - filter.state.x;
        let variance = filter.measured_variance;
        filter
            .covariance
            .update_state::<0>(variance, innovation, &mut filter.state)
            .expect("a plain measurement");
    }

    fn state(&self) -> [T; 2] {
        self.0.state.into()
    }
}

/// The covariance of the filters of angle and rate, written out for two states.
pub struct AngleAndRate<T> {
    dt: T,
    noise: T,
    measured_variance: T,
    covariance: AngleRateCovariance<T>,
    angle: T,
    rate: T,
}

impl<T: Real> Filter<T, 2, 1> for AngleAndRate<T> {
    fn new(problem: &Problem<T, 2, 1>) -> Self {
        let dt = problem.transition.m12;
        Self {
            dt,
            // The intensity: the variance of the second source is its effect on the rate in a step.
            noise: problem.noise_variance.y / dt,
            measured_variance: black_box(T::one()),
            covariance: AngleRateCovariance::diagonal(problem.start_variance, problem.start_variance),
            angle: T::zero(),
            rate: T::zero(),
        }
    }

    #[inline]
    fn step(&mut self, &[z]: &[T; 1]) {
        self.angle += self.dt * self.rate;
        let innovation = z - self.angle;
        self.covariance.predict(self.dt, self.noise);
        let [angle, rate] = self.covariance.update_angle(self.measured_variance);
        self.angle += angle * innovation;
        self.rate += rate * innovation;
    }

    fn state(&self) -> [T; 2] {
        [self.angle, self.rate]
    }
}
