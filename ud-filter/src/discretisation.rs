//! From a model in continuous time to one step of it.
//!
//! ```text
//! x' = A x + sum g w,   w: white noise of intensity c      F = exp(A dt),   Q = sum c int exp(A s) g g' exp(A s)' ds
//! ```
//!
//! F is a Taylor series over a short step h, squared until the step is dt. Over h the integral is Gauss's rule of six
//! nodes. Each node adds `w c (exp(A s) g)(exp(A s) g)'`, a source of noise, to the factors of Q. Doubling the step is
//! a prediction, `Q <- F Q F' + Q`. So Q stays positive semidefinite whatever the rounding, as Van Loan's exponential
//! of twice the size (IEEE Trans. Automatic Control 23 (1978) 395-404) does not. The error is that of rounding.
//!
//! It is done once, before a filter runs, in `f64`.

use nalgebra::SMatrix;

use crate::prediction::PredictionRefusal;
use crate::real::is_finite;
use crate::transition::Dense;
use crate::ud_covariance::{NoiseSource, UdCovariance, are_usable};

/// One step of a model in continuous time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DiscreteModel<const N: usize> {
    /// F.
    pub transition: SMatrix<f64, N, N>,
    /// Sources whose sum is Q.
    #[cfg_attr(feature = "serde", serde(with = "crate::serialised_array"))]
    pub noise: [NoiseSource<f64, N>; N],
}

/// `|A| h` of the short step is at most this. The first term left out of the series is then 2e-17, and the error of the
/// rule 2e-16.
const SHORT: f64 = 0.5;
/// Terms of the series of exp: 0.5^15 / 15! = 2e-17.
const TERMS: u8 = 15;
/// Gauss's rule of six nodes on 0 to 1: nodes and weights. Its error is `(2 |A| h)^12 (6!)^4 / (13 (12!)^3)`, 2e-16.
const RULE: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

impl<const N: usize> DiscreteModel<N> {
    /// A step of `dt`, positive, of `x' = A x` with sources of white noise, whose `variance` is an intensity: variance
    /// per unit of time.
    ///
    /// # Errors
    /// When A, `dt` or a source is no usable number, or F is too large for `f64`.
    pub fn new<const M: usize>(
        dynamics: &SMatrix<f64, N, N>,
        noise: &[NoiseSource<f64, N>; M],
        dt: f64,
    ) -> Result<Self, PredictionRefusal> {
        let size = norm(dynamics) * dt;
        if !(size >= 0.0 && is_finite(size) && is_finite(dt)) {
            return Err(PredictionRefusal::Transition);
        }
        if !are_usable(noise) {
            return Err(PredictionRefusal::Noise);
        }
        let (mut h, mut doublings, mut short) = (dt, 0_u16, size);
        while short > SHORT {
            (h, short, doublings) = (0.5 * h, 0.5 * short, doublings + 1);
        }
        let mut covariance = UdCovariance::<f64, N>::known();
        for (node, weight) in RULE {
            let carried = exponential(&(dynamics * (node * h)));
            covariance.add_noise(&noise.map(|source| NoiseSource {
                gain: carried * source.gain,
                variance: source.variance * (weight * h),
            }));
        }
        let mut transition = exponential(&(dynamics * h));
        for _ in 0..doublings {
            let sources = covariance.sources();
            // Only an unstable model over a very long step has an F or a Q too large for `f64`.
            covariance.predict(&Dense(transition), &sources).map_err(|_| PredictionRefusal::Transition)?;
            transition *= transition;
        }
        let noise = covariance.sources();
        if is_finite(norm(&transition)) && are_usable(&noise) {
            Ok(Self { transition, noise })
        } else {
            Err(PredictionRefusal::Transition)
        }
    }
}

/// The largest sum of magnitudes in a row.
fn norm<const N: usize>(matrix: &SMatrix<f64, N, N>) -> f64 {
    let sums = matrix.data.0.iter().fold([0.0; N], |mut sums, column| {
        for (sum, entry) in sums.iter_mut().zip(column) {
            *sum += entry.abs();
        }
        sums
    });
    // Not `f64::max`, which leaves NaN out.
    sums.into_iter().fold(0.0, |most, sum| if sum <= most { most } else { sum })
}

/// `exp(A)` of a small A.
fn exponential<const N: usize>(a: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let mut sum = SMatrix::<f64, N, N>::identity();
    // Horner's order: 1 + A (1 + A/2 (1 + A/3 (...))).
    for k in (1..TERMS).rev() {
        sum = SMatrix::identity() + a * sum / f64::from(k);
    }
    sum
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix1, Matrix2, Matrix3, Vector1, Vector2, Vector3};
    use proptest::prelude::*;

    use super::*;

    fn sum<const N: usize>(noise: &[NoiseSource<f64, N>; N]) -> SMatrix<f64, N, N> {
        noise.iter().map(|source| source.gain * source.gain.transpose() * source.variance).sum()
    }

    /// Over seven decades of the step.
    #[test]
    fn exact_a_random_walk_of_the_rate() {
        for dt in [1e-6, 1e-3, 1.0, 40.0] {
            let source = NoiseSource { gain: Vector2::new(0.0, 1.0), variance: 3.0 };
            let model = DiscreteModel::new(&Matrix2::new(0.0, 1.0, 0.0, 0.0), &[source], dt).unwrap();
            let expected = Matrix2::new(dt * dt * dt / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt) * 3.0;
            assert!((model.transition - Matrix2::new(1.0, dt, 0.0, 1.0)).abs().max() < 1e-15 * dt);
            let error = (sum(&model.noise) - expected).component_div(&expected).abs().max();
            assert!(error < 1e-13, "{dt} {error:e}");
        }
    }

    /// `F = exp(-dt / tau)` and `Q = (1 - F^2) q tau / 2`, for steps much shorter and much longer than `tau`.
    #[test]
    fn exact_a_state_that_decays() {
        for ratio in [1e-6, 0.1, 0.5, 3.0, 100.0] {
            let source = NoiseSource { gain: Vector1::new(2.0), variance: 0.25 };
            let model = DiscreteModel::new(&Matrix1::new(-4.0), &[source], 0.25 * ratio).unwrap();
            let expected = -libm::expm1(-2.0 * ratio) / 8.0;
            assert!((model.transition.x / libm::exp(-ratio) - 1.0).abs() < 1e-13 * (1.0 + ratio), "{ratio}");
            assert!((sum(&model.noise).x / expected - 1.0).abs() < 1e-13, "{ratio}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Van Loan: `exp([-A W; 0 A'] dt) = [. F^-1 Q; 0 F']`.
        #[test]
        fn dual_a_step_is_van_loans(
            a in prop::array::uniform9(-1.0..1.0_f64),
            gain in prop::array::uniform3(-1.0..1.0_f64), other in prop::array::uniform3(-1.0..1.0_f64),
            dt in 0.01..2.0_f64,
        ) {
            let (a, gain, other) = (Matrix3::from_column_slice(&a), Vector3::from(gain), Vector3::from(other));
            let noise = [NoiseSource { gain, variance: 2.0 }, NoiseSource { gain: other, variance: 0.5 }];
            let w = gain * gain.transpose() * 2.0 + other * other.transpose() * 0.5;
            let mut twice = SMatrix::<f64, 6, 6>::zeros();
            twice.fixed_view_mut::<3, 3>(0, 0).copy_from(&(-a * dt));
            twice.fixed_view_mut::<3, 3>(0, 3).copy_from(&(w * dt));
            twice.fixed_view_mut::<3, 3>(3, 3).copy_from(&(a.transpose() * dt));
            // A power of a Taylor series of its own, as plain as it gets.
            let short = twice / 1024.0;
            let mut twice = (1..12_u8).rev().fold(SMatrix::<f64, 6, 6>::identity(), |sum, k| {
                SMatrix::identity() + short * sum / f64::from(k)
            });
            (0..10).for_each(|_| twice *= twice);
            let f = twice.fixed_view::<3, 3>(3, 3).transpose();
            let q = f * twice.fixed_view::<3, 3>(0, 3);
            let model = DiscreteModel::new(&a, &noise, dt).unwrap();
            prop_assert!((model.transition - f).abs().max() < 1e-12 * (1.0 + f.abs().max()));
            // Van Loan's has the rounding of F^-1 and of F in it.
            let scale = 1.0 + q.abs().max() + f.abs().max() * f.abs().max();
            prop_assert!((sum(&model.noise) - q).abs().max() < 1e-11 * scale);
            prop_assert!(model.noise.iter().all(|source| source.variance >= 0.0));
        }
    }

    #[test]
    fn law_a_model_that_is_no_number_is_refused() {
        let a = Matrix2::new(0.0, 1.0, -1.0, -0.1);
        let source = NoiseSource { gain: Vector2::new(0.0, 1.0), variance: 1.0 };
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0] {
            assert_eq!(DiscreteModel::new(&a, &[source], bad), Err(PredictionRefusal::Transition));
            let noisy = NoiseSource { variance: bad, ..source };
            assert_eq!(DiscreteModel::new(&a, &[noisy], 0.1), Err(PredictionRefusal::Noise));
        }
        let bad = Matrix2::new(0.0, 1.0, f64::NAN, 0.0);
        assert_eq!(DiscreteModel::new(&bad, &[source], 0.1), Err(PredictionRefusal::Transition));
        let unstable = DiscreteModel::new(&Matrix2::identity(), &[source], 1e4);
        assert_eq!(unstable, Err(PredictionRefusal::Transition));
    }
}
