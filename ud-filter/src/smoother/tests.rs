//! Tests against least squares over the whole interval, and in single precision.

extern crate std;
use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};
use proptest::prelude::*;

use super::*;
use crate::test_support::Rounded;
use crate::{Dense, UpperTriangular};

/// Steps of the interval.
const STEPS: usize = 6;
/// Unknowns of least squares: three states at the start, and two sources of noise in each step.
const UNKNOWNS: usize = 3 + 2 * STEPS;

/// A model with an input, whose two sources do not reach every state, and what was measured after each step.
#[derive(Debug)]
struct Interval {
    prior: KalmanFilter<f64, 3>,
    transition: Matrix3<f64>,
    noise: [NoiseSource<f64, 3>; 2],
    input: Vector3<f64>,
    row: Vector3<f64>,
    variance: f64,
    measured: [f64; STEPS],
}

impl Interval {
    fn control(step: usize) -> f64 {
        1.0 - 0.5 * step as f64
    }

    /// The filter's steps, and the filter after them.
    fn filtered<T: Rounded>(&self) -> ([SmootherStep<T, Dense<T, 3>, 3, 2>; STEPS], KalmanFilter<T, 3>) {
        let vector = |v: &Vector3<f64>| v.map(T::rounded);
        let covariance = UdCovariance {
            unit: self.prior.covariance.unit.map(|column| column.map(T::rounded)),
            weights: self.prior.covariance.weights.map(T::rounded),
        };
        let mut filter = KalmanFilter::new(vector(&self.prior.state), covariance);
        let transition = Dense(self.transition.map(T::rounded));
        let noise = self
            .noise
            .map(|source| NoiseSource { gain: vector(&source.gain), variance: T::rounded(source.variance) });
        let mut step = 0;
        let steps = self.measured.map(|measured| {
            let before = filter;
            let control = SVector::from([T::rounded(Self::control(step))]);
            filter.predict_with_input(&transition, &vector(&self.input), &control, &noise).unwrap();
            let predicted = filter.state;
            filter.update(&vector(&self.row), T::rounded(self.variance), T::rounded(measured)).unwrap();
            step += 1;
            SmootherStep { filter: before, transition, noise, predicted }
        });
        (steps, filter)
    }

    /// Mean and covariance of the state before each step and at the end: the normal equations of all unknowns, with
    /// each state a linear function of them.
    fn least_squares(&self) -> [(Vector3<f64>, Matrix3<f64>); STEPS + 1] {
        let mut normal = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::identity();
        let prior = self.prior.covariance.covariance().cholesky().unwrap().l();
        let mut of = SMatrix::<f64, 3, UNKNOWNS>::zeros();
        of.fixed_columns_mut::<3>(0).copy_from(&prior);
        let (mut right, mut constant) = (SVector::<f64, UNKNOWNS>::zeros(), self.prior.state);
        let mut states = [(of, constant); STEPS + 1];
        for (step, &measured) in self.measured.iter().enumerate() {
            of = self.transition * of;
            constant = self.transition * constant + self.input * Self::control(step);
            for (s, source) in self.noise.iter().enumerate() {
                of.set_column(3 + 2 * step + s, &(source.gain * libm::sqrt(source.variance)));
            }
            let row = of.transpose() * self.row;
            normal += row * row.transpose() / self.variance;
            right += row * ((measured - self.row.dot(&constant)) / self.variance);
            states[step + 1] = (of, constant);
        }
        let covariance = normal.cholesky().unwrap().inverse();
        states.map(|(of, constant)| (constant + of * (covariance * right), of * covariance * of.transpose()))
    }
}

prop_compose! {
    fn interval()(
        p in prop::array::uniform9(-1.0..1.0_f64), x in prop::array::uniform3(-1.0..1.0_f64),
        f in prop::array::uniform9(-1.0..1.0_f64), singular in any::<bool>(),
        gains in prop::array::uniform6(-1.0..1.0_f64), noise in prop::array::uniform2(0.01..1.0_f64),
        row in prop::array::uniform3(-1.0..1.0_f64), variance in 0.01..1.0_f64,
        measured in prop::array::uniform6(-2.0..2.0_f64),
    ) -> Interval {
        let a = Matrix3::from_column_slice(&p);
        let prior = UdCovariance::from_covariance(&(a * a.transpose() + Matrix3::identity() * 0.1)).unwrap();
        let mut transition = Matrix3::from_column_slice(&f);
        if singular {
            let first = transition.row(0) * 0.5;
            transition.set_row(2, &first);
        }
        let gains = Matrix2x3::from_column_slice(&gains).transpose();
        Interval {
            prior: KalmanFilter::new(x.into(), prior),
            transition,
            noise: [0, 1].map(|s| NoiseSource { gain: gains.column(s).into(), variance: noise[s] }),
            input: Vector3::new(0.3, -0.2, 1.0),
            row: row.into(),
            variance,
            measured,
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Two sources for three states: Q is singular, and so is F in half of the cases.
    #[test]
    fn dual_smoothed_states_are_those_of_least_squares(interval in interval()) {
        let (mut steps, last) = interval.filtered::<f64>();
        let filtered = steps;
        smooth(&mut steps, &last).unwrap();
        let expected = interval.least_squares();
        let filters = steps.iter().map(|step| &step.filter).chain([&last]);
        for (filter, (state, covariance)) in filters.zip(&expected) {
            let scale = 1.0 + covariance.abs().max() + state.abs().max();
            prop_assert!((filter.state - state).abs().max() < 1e-8 * scale, "{filter:?} {state}");
            let difference = filter.covariance.covariance() - covariance;
            prop_assert!(difference.abs().max() < 1e-8 * scale, "{filter:?} {covariance}");
            prop_assert!(filter.covariance.weights().iter().all(|&weight| weight >= 0.0));
        }
        for (smoothed, filtered) in steps.iter().zip(&filtered) {
            let [after, before] = [smoothed, filtered].map(|step| step.filter.covariance.variances());
            prop_assert!(after.iter().zip(&before).all(|(after, before)| after <= &(before * (1.0 + 1e-9))));
        }
    }
}

/// Position and rate under measurements a million times better than the prior, and their steps.
fn precise_positions<T: Rounded>() -> ([SmootherStep<T, UpperTriangular<T, 2>, 2, 1>; 200], KalmanFilter<T, 2>)
{
    let rounded = |a: f64, b: f64| Vector2::new(T::rounded(a), T::rounded(b));
    let f = SMatrix::<T, 2, 2>::new(T::one(), T::rounded(0.125), T::zero(), T::one());
    let transition = UpperTriangular(f);
    let noise = [NoiseSource { gain: rounded(0.0, 1.0), variance: T::rounded(1e-10) }];
    let covariance = UdCovariance::from_diagonal(&rounded(1e4, 1e4));
    let (mut filter, mut k) = (KalmanFilter::new(rounded(0.0, 0.0), covariance), 0_u8);
    let steps = [(); 200].map(|()| {
        k += 1;
        let before = filter;
        filter.predict(&transition, &noise).unwrap();
        let predicted = filter.state;
        let measured = 0.125 * f64::from(k) + 1e-4 * f64::from(k % 5);
        filter.update(&rounded(1.0, 0.0), T::rounded(1e-8), T::rounded(measured)).unwrap();
        SmootherStep { filter: before, transition, noise, predicted }
    });
    (steps, filter)
}

/// In single precision the textbook's difference, `P + C (Ps+ - P-) C'`, loses definiteness.
#[test]
fn dual_smoothing_in_single_precision_stays_definite() {
    let ((mut single, last), (mut double, last_double)) =
        (precise_positions::<f32>(), precise_positions::<f64>());
    let mut by_difference = last.covariance.covariance();
    let is_definite = single.iter().rev().all(|step| {
        let (p, f) = (step.filter.covariance.covariance(), step.transition.0);
        let predicted = f * p * f.transpose() + step.noise[0].gain * step.noise[0].gain.transpose() * 1e-10;
        let Some(inverse) = predicted.try_inverse() else { return false };
        let gain = p * f.transpose() * inverse;
        by_difference = p + gain * (by_difference - predicted) * gain.transpose();
        let factors = UdCovariance::from_covariance(&by_difference.map(f64::from));
        factors.is_ok_and(|factors| factors.weights.iter().all(|&weight| weight > 0.0))
    });
    assert!(!is_definite);

    smooth(&mut single, &last).unwrap();
    smooth(&mut double, &last_double).unwrap();
    for (k, (single, double)) in single.iter().zip(&double).enumerate() {
        let [single, double] =
            [single.filter.covariance.variances().map(f64::from), double.filter.covariance.variances()];
        let error = single.component_div(&double).map(|ratio| (ratio - 1.0).abs()).max();
        std::println!("{k} {error:e}");
        assert!(error < 0.01, "{k} {single} {double}");
    }
    assert!(single.iter().all(|step| step.filter.covariance.weights.iter().all(|&weight| weight > 0.0)));
}

#[test]
fn law_a_step_that_is_no_number_is_refused_and_named() {
    let source = NoiseSource { gain: Vector3::new(0.0, 1.0, 0.5), variance: 0.1 };
    let interval = Interval {
        prior: KalmanFilter::new(Vector3::zeros(), UdCovariance::from_diagonal(&Vector3::repeat(1.0))),
        transition: Matrix3::identity(),
        noise: [source; 2],
        input: Vector3::zeros(),
        row: Vector3::new(1.0, 0.0, 0.0),
        variance: 0.5,
        measured: [0.5; STEPS],
    };
    let (start, last) = interval.filtered::<f64>();
    let mut whole = start;
    smooth(&mut whole, &last).unwrap();
    let mut steps = start;
    steps[2].transition.0[(1, 1)] = f64::NAN;
    let refused = smooth(&mut steps, &last);
    assert_eq!(refused, Err(SmootherRefusal { step: 2, reason: PredictionRefusal::Transition }));
    assert_eq!(steps[..2], start[..2]);
    assert_eq!(steps[2].filter, start[2].filter);
    assert_eq!(steps[3..], whole[3..]);
    let mut steps = start;
    steps[4].predicted.x = f64::NAN;
    let refused = smooth(&mut steps, &last);
    assert_eq!(refused, Err(SmootherRefusal { step: 4, reason: PredictionRefusal::State }));
    assert_eq!(steps[..4], start[..4]);
    assert_eq!(steps[4].filter, start[4].filter);
}
