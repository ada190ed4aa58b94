//! Shapes of F that are written outside of the crate: one by its map alone, one with work of its own.

#![allow(clippy::unwrap_used, clippy::disallowed_methods, reason = "a test fails by panicking")]

use nalgebra::{Matrix4, SVector, Vector4};
use proptest::prelude::*;
use ud_filter::{
    Dense, KalmanFilter, NoiseSource, PredictionRefusal, Real, SmootherStep, Transition, UdCovariance, smooth,
};

type Vector = Vector4<f64>;

/// Each state becomes the one before it, and the first a combination of all: an autoregressive series.
struct Series([f64; 4]);

impl Transition<f64, 4> for Series {
    fn carry(&self, state: &Vector) -> Vector {
        let newest = self.0.iter().zip(state).map(|(a, x)| a * x).sum();
        Vector::new(newest, state.x, state.y, state.z)
    }
}

impl Series {
    fn matrix(&self) -> Matrix4<f64> {
        let [a, b, c, d] = self.0;
        Matrix4::new(a, b, c, d, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0)
    }
}

/// The last state is added to the first, `rate` times: one entry, and the factors change by one row.
#[derive(Clone, Copy)]
struct Drift<T> {
    rate: T,
}

impl<T: Real, const N: usize> Transition<T, N> for Drift<T> {
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N> {
        let mut carried = *state;
        carried[0] += self.rate * state[N - 1];
        carried
    }
    fn is_finite(&self) -> bool {
        ud_filter::is_finite(self.rate)
    }
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>) {
        covariance.add_effects(0, &[(N - 1, [self.rate])]);
    }
}

fn covariance(numbers: &[f64; 16]) -> UdCovariance<f64, 4> {
    let a = Matrix4::from_column_slice(numbers);
    UdCovariance::from_covariance(&(a * a.transpose() + Matrix4::identity() * 0.1)).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Filter and smoother, beside the same F as a matrix.
    #[test]
    fn dual_an_own_shape_is_its_matrix(
        p in prop::array::uniform16(-1.0..1.0_f64), a in prop::array::uniform4(-1.0..1.0_f64),
        x in prop::array::uniform4(-1.0..1.0_f64), rate in -2.0..2.0_f64, z in -2.0..2.0_f64,
    ) {
        let noise = [NoiseSource { gain: Vector::x(), variance: 0.3 }];
        let start = KalmanFilter::new(Vector::from(x), covariance(&p));
        let (series, mut drift) = (Series(a), Matrix4::identity());
        drift[(0, 3)] = rate;
        let (mut own, mut dense) = (start, start);
        own.predict(&series, &noise).unwrap();
        dense.predict(&Dense(series.matrix()), &noise).unwrap();
        // The same code at the same numbers; the sum of a state may round in another order.
        prop_assert_eq!(own.covariance, dense.covariance);
        prop_assert!((own.state - dense.state).abs().max() < 1e-14);

        let mut steps = [SmootherStep { filter: own, transition: Drift { rate }, noise, predicted: own.state }];
        own.predict(&Drift { rate }, &noise).unwrap();
        let mut by_matrix = steps.map(|step| SmootherStep {
            filter: step.filter,
            transition: Dense(drift),
            noise,
            predicted: own.state,
        });
        steps[0].predicted = own.state;
        dense.predict(&Dense(drift), &noise).unwrap();
        prop_assert!((own.covariance.covariance() - dense.covariance.covariance()).abs().max() < 1e-12);
        own.update(&Vector::new(1.0, 0.5, 0.0, 0.0), 0.1, z).unwrap();
        smooth(&mut steps, &own).unwrap();
        smooth(&mut by_matrix, &own).unwrap();
        let [one, other] = [steps[0].filter, by_matrix[0].filter];
        prop_assert!((one.state - other.state).abs().max() < 1e-9);
        prop_assert!((one.covariance.covariance() - other.covariance.covariance()).abs().max() < 1e-9);
    }
}

#[test]
fn law_an_own_shape_that_is_no_number_is_refused() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for place in 0..4 {
            let mut series = Series([0.1, 0.2, 0.3, 0.4]);
            series.0[place] = bad;
            let mut p = covariance(&[0.3; 16]);
            assert_eq!(p.predict(&series, &[]), Err(PredictionRefusal::Transition));
            assert_eq!(p, covariance(&[0.3; 16]));
            series.carry_factors(&mut p);
            assert!(!p.variance::<0>().is_finite());
        }
        let mut p = UdCovariance::<f64, 4>::from_diagonal(&Vector::repeat(1.0));
        assert_eq!(p.predict(&Drift { rate: bad }, &[]), Err(PredictionRefusal::Transition));
    }
}
