//! Other crates' filters, each used as its documentation says. Where a crate has several forms, the name says which.

use adskalman::{
    CovarianceUpdateMethod, ObservationModel, StateAndCovariance, TransitionModelLinearNoControl,
};
use bayes_estimate::estimators::ud::UDState;
use bayes_estimate::models::{ExtendedLinearObserver, ExtendedLinearPredictor, KalmanState};
use bayes_estimate::noise::{CorrelatedNoise, CoupledNoise, UncorrelatedNoise};
use kfilter::kalman::{Kalman, KalmanFilter as _, KalmanPredict, KalmanUpdate};
use kfilter::measurement::{LinearMeasurement, Measurement};
use kfilter::system::LinearNoInputSystem;
use minikalman::prelude::*;
use minikalman::regular::builder::{KalmanFilterBuilder, KalmanFilterObservationType, KalmanFilterType};
use motor_model::Real;
use nalgebra::{Const, DimMin, RealField, SMatrix, SVector};
use nalgebra_0_33 as na33;
use nalgebra_0_34 as na34;

use crate::problem::{Filter, Problem};

/// adskalman: the covariance is a matrix, updated by Joseph's form or conventionally.
pub struct Adskalman<T: Real + RealField, const N: usize, const M: usize, const JOSEPH: bool> {
    f: SMatrix<T, N, N>,
    f_transposed: SMatrix<T, N, N>,
    q: SMatrix<T, N, N>,
    h: SMatrix<T, M, N>,
    h_transposed: SMatrix<T, N, M>,
    r: SMatrix<T, M, M>,
    estimate: StateAndCovariance<T, Const<N>>,
}

impl<T: Real + RealField, const N: usize, const M: usize, const JOSEPH: bool>
    TransitionModelLinearNoControl<T, Const<N>> for Adskalman<T, N, M, JOSEPH>
{
    fn F(&self) -> &SMatrix<T, N, N> {
        &self.f
    }
    fn FT(&self) -> &SMatrix<T, N, N> {
        &self.f_transposed
    }
    fn Q(&self) -> &SMatrix<T, N, N> {
        &self.q
    }
}

impl<T: Real + RealField, const N: usize, const M: usize, const JOSEPH: bool>
    ObservationModel<T, Const<N>, Const<M>> for Adskalman<T, N, M, JOSEPH>
where
    Const<M>: DimMin<Const<M>, Output = Const<M>>,
{
    fn H(&self) -> &SMatrix<T, M, N> {
        &self.h
    }
    fn HT(&self) -> &SMatrix<T, N, M> {
        &self.h_transposed
    }
    fn R(&self) -> &SMatrix<T, M, M> {
        &self.r
    }
}

impl<T: Real + RealField, const N: usize, const M: usize, const JOSEPH: bool> Filter<T, N, M>
    for Adskalman<T, N, M, JOSEPH>
where
    Const<M>: DimMin<Const<M>, Output = Const<M>>,
{
    fn new(problem: &Problem<T, N, M>) -> Self {
        Self {
            f: problem.transition,
            f_transposed: problem.transition.transpose(),
            q: problem.noise(),
            h: problem.rows,
            h_transposed: problem.rows.transpose(),
            r: SMatrix::identity(),
            estimate: StateAndCovariance::new(SVector::zeros(), start_covariance(problem)),
        }
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        let form =
            if JOSEPH { CovarianceUpdateMethod::JosephForm } else { CovarianceUpdateMethod::OptimalKalman };
        let prior = TransitionModelLinearNoControl::predict(self, &self.estimate);
        self.estimate = self.update(&prior, &(*measured).into(), form).expect("a plain measurement");
    }

    fn state(&self) -> [T; N] {
        (*self.estimate.state()).into()
    }
}

/// minikalman: the covariance is a matrix, conventionally.
pub struct Minikalman<T, const N: usize, const M: usize> {
    filter: KalmanFilterType<N, T>,
    measurement: KalmanFilterObservationType<N, M, T>,
}

impl<T: Real + num_traits::Float + MatrixDataType, const N: usize, const M: usize> Filter<T, N, M>
    for Minikalman<T, N, M>
{
    fn new(problem: &Problem<T, N, M>) -> Self {
        let builder = KalmanFilterBuilder::<N, T>::default();
        let (mut filter, mut measurement) = (builder.build(), builder.observations().build::<M>());
        let q = problem.noise();
        for i in 0..N {
            for j in 0..N {
                filter.state_transition_mut().set_at(i, j, problem.transition[(i, j)]);
                filter.direct_process_noise_mut().set_at(i, j, q[(i, j)]);
                let start = if i == j { problem.start_variance } else { T::zero() };
                filter.estimate_covariance_mut().set_at(i, j, start);
            }
            for m in 0..M {
                measurement.observation_matrix_mut().set_at(m, i, problem.rows[(m, i)]);
            }
        }
        measurement.measurement_noise_covariance_mut().make_identity();
        Self { filter, measurement }
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        self.filter.predict();
        self.measurement.measurement_vector_mut().apply(|z| {
            for (row, &value) in measured.iter().enumerate() {
                z.set_row(row, value);
            }
        });
        self.filter.correct(&mut self.measurement);
    }

    fn state(&self) -> [T; N] {
        std::array::from_fn(|i| self.filter.state_vector().get_row(i))
    }
}

/// kfilter: the covariance is a matrix, conventionally, then made symmetric.
pub struct Kfilter<T: na34::RealField, const N: usize, const M: usize> {
    filter: Kalman<T, N, 0, LinearNoInputSystem<T, N>>,
    measurement: LinearMeasurement<T, N, M>,
}

impl<T: Real + na34::RealField, const N: usize, const M: usize> Filter<T, N, M> for Kfilter<T, N, M> {
    fn new(problem: &Problem<T, N, M>) -> Self {
        let [transition, noise, start] = matrices(problem).map(na34::SMatrix::from);
        let rows: na34::SMatrix<T, M, N> = problem.rows.data.0.into();
        Self {
            filter: Kalman::new(transition, noise, na34::SVector::zeros(), start),
            measurement: LinearMeasurement::new(rows, na34::SMatrix::identity(), na34::SVector::zeros()),
        }
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        self.filter.predict().expect("a plain model");
        self.measurement.set_measurement((*measured).into());
        self.filter.update(&self.measurement).expect("a plain measurement");
    }

    fn state(&self) -> [T; N] {
        (*self.filter.state()).into()
    }
}

/// kalmanfilt: the covariance is a matrix, by Joseph's form.
pub struct Kalmanfilt<T, const N: usize, const M: usize>(
    kalmanfilt::kalman::kalman_filter::KalmanFilter<T, na33::Const<N>, na33::Const<M>, na33::Const<1>>,
)
where
    T: Real + na33::RealField + num_traits::Float;

impl<T, const N: usize, const M: usize> Filter<T, N, M> for Kalmanfilt<T, N, M>
where
    T: Real + na33::RealField + num_traits::Float,
{
    fn new(problem: &Problem<T, N, M>) -> Self {
        let [transition, noise, start] = matrices(problem).map(na33::SMatrix::from);
        Self(kalmanfilt::kalman::kalman_filter::KalmanFilter {
            x: na33::SVector::zeros(),
            F: transition,
            Q: noise,
            P: start,
            H: problem.rows.data.0.into(),
            R: na33::SMatrix::identity(),
            ..Default::default()
        })
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        self.0.predict(None, None, None, None);
        self.0.update(&(*measured).into(), None, None).expect("a plain measurement");
    }

    fn state(&self) -> [T; N] {
        self.0.x.into()
    }
}

/// `kalman_filters`: the covariance is a matrix, conventionally, then made symmetric.
pub struct KalmanFilters<T, const N: usize, const M: usize>(
    kalman_filters::filter::StaticKalmanFilter<T, M, N>,
)
where
    T: kalman_filters::types::KalmanScalar + na34::RealField;

impl<T, const N: usize, const M: usize> Filter<T, N, M> for KalmanFilters<T, N, M>
where
    T: Real + kalman_filters::types::KalmanScalar + na34::RealField,
{
    fn new(problem: &Problem<T, N, M>) -> Self {
        let [transition, noise, start] = matrices(problem).map(na34::SMatrix::from);
        Self(kalman_filters::filter::StaticKalmanFilter::new(
            na34::SVector::zeros(),
            start,
            transition,
            noise,
            problem.rows.data.0.into(),
            na34::SMatrix::identity(),
        ))
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        self.0.predict();
        self.0.update(&(*measured).into()).expect("a plain measurement");
    }

    fn state(&self) -> [T; N] {
        (*self.0.state()).into()
    }
}

/// `bayes_estimate`: the covariance is a matrix, conventionally.
pub struct BayesMatrix<T: RealField, const N: usize, const M: usize> {
    f: SMatrix<T, N, N>,
    q: CorrelatedNoise<T, Const<N>>,
    h: SMatrix<T, M, N>,
    r: CorrelatedNoise<T, Const<M>>,
    estimate: KalmanState<T, Const<N>>,
}

impl<T: Real + RealField, const N: usize, const M: usize> Filter<T, N, M> for BayesMatrix<T, N, M> {
    fn new(problem: &Problem<T, N, M>) -> Self {
        Self {
            f: problem.transition,
            q: CorrelatedNoise { Q: problem.noise() },
            h: problem.rows,
            r: CorrelatedNoise { Q: SMatrix::identity() },
            estimate: start(problem),
        }
    }

    #[inline]
    fn step(&mut self, measured: &[T; M]) {
        let predicted = self.f * self.estimate.x;
        self.estimate.predict(&predicted, &self.f, &self.q).expect("a plain model");
        let innovation = SVector::from(*measured) - self.h * self.estimate.x;
        self.estimate.observe_innovation(&innovation, &self.h, &self.r).expect("a plain measurement");
    }

    fn state(&self) -> [T; N] {
        self.estimate.x.into()
    }
}

/// `bayes_estimate`: factors U D U', S noise sources. Measurements are given one by one: with several at a time, its
/// innovations do not include the updates by the earlier ones.
pub struct BayesFactors<T: RealField, const N: usize, const S: usize, const M: usize> {
    f: SMatrix<T, N, N>,
    q: CoupledNoise<T, Const<N>, Const<S>>,
    h: [SMatrix<T, 1, N>; M],
    r: UncorrelatedNoise<T, Const<1>>,
    estimate: UDState<T, Const<N>>,
}

/// For given numbers of states and of sources, because the crate needs their sum as a type.
macro_rules! bayes_factors {
    ($n:literal, $s:literal) => {
        impl<T: Real + RealField, const M: usize> Filter<T, $n, M> for BayesFactors<T, $n, $s, M> {
            fn new(problem: &Problem<T, $n, M>) -> Self {
                let q = problem.noise_variance.fixed_rows::<$s>(0).into_owned();
                let gain = problem.noise_gain.fixed_columns::<$s>(0).into_owned();
                Self {
                    f: problem.transition,
                    q: CoupledNoise { q, G: gain },
                    h: std::array::from_fn(|m| problem.rows.row(m).into_owned()),
                    r: UncorrelatedNoise { q: SVector::from([T::one()]) },
                    estimate: UDState::try_from(start(problem)).expect("a covariance"),
                }
            }

            #[inline]
            fn step(&mut self, measured: &[T; M]) {
                let predicted = self.f * self.estimate.x;
                self.estimate.predict(&self.f, &predicted, &self.q).expect("a plain model");
                for (h, &z) in self.h.iter().zip(measured) {
                    let innovation = SVector::from([z]) - h * self.estimate.x;
                    self.estimate.observe_innovation(&innovation, h, &self.r).expect("a plain measurement");
                }
            }

            fn state(&self) -> [T; $n] {
                self.estimate.x.into()
            }
        }
    };
}

bayes_factors!(2, 2);
bayes_factors!(3, 3);
bayes_factors!(6, 3);
bayes_factors!(10, 5);

fn start<T: Real + RealField, const N: usize, const M: usize>(
    problem: &Problem<T, N, M>,
) -> KalmanState<T, Const<N>> {
    KalmanState { x: SVector::zeros(), X: start_covariance(problem) }
}

fn start_covariance<T: Real, const N: usize, const M: usize>(problem: &Problem<T, N, M>) -> SMatrix<T, N, N> {
    SMatrix::from_diagonal(&SVector::repeat(problem.start_variance))
}

/// F, Q and the first P by columns, for crates that use another version of nalgebra.
fn matrices<T: Real, const N: usize, const M: usize>(problem: &Problem<T, N, M>) -> [[[T; N]; N]; 3] {
    [problem.transition, problem.noise(), start_covariance(problem)].map(|matrix| matrix.data.0)
}
