//! The extended Kalman filter: models that are not linear, given as functions with their Jacobians.

use nalgebra::{SMatrix, SVector};

use super::KalmanFilter;
use crate::prediction::PredictionRefusal;
use crate::real::Real;
use crate::transition::Transition;
use crate::ud_covariance::{InnovationRecord, NoiseSource, VectorInnovationRecord};

impl<T: Real, const N: usize> KalmanFilter<T, N> {
    /// A step passes: `x <- f(x)`, `P <- F P F' + sum c a a'`.
    ///
    /// `model` gives f(x) and its Jacobian F = df/dx at a state. F has the shape that saves most work:
    /// [`crate::Dense`] if it has none.
    ///
    /// # Errors
    /// When F, a noise source or the state that follows is no usable number; nothing has changed then.
    #[inline]
    pub fn predict_extended<F: Transition<T, N>, const S: usize>(
        &mut self,
        model: impl FnOnce(&SVector<T, N>) -> (SVector<T, N>, F),
        noise: &[NoiseSource<T, N>; S],
    ) -> Result<(), PredictionRefusal> {
        let (next, transition) = model(&self.state);
        self.move_to(next, &transition, noise)
    }

    /// Corrects by a measurement `measured = h(x) + noise` of the variance `noise`, zero or more, unless the innovation
    /// squared exceeds `gate` times its variance. A gate of 9 is three standard deviations; an infinite one uses each.
    ///
    /// `model` gives h(x) and its Jacobian dh/dx at a state. An angle is to be `measured` within half a turn of h(x).
    #[inline]
    pub fn update_extended(
        &mut self,
        model: impl FnOnce(&SVector<T, N>) -> (T, SVector<T, N>),
        noise: T,
        measured: T,
        gate: T,
    ) -> InnovationRecord<T> {
        let (expected, row) = model(&self.state);
        self.covariance.update_gated(&row, noise, measured - expected, gate, &mut self.state)
    }

    /// Corrects by M measurements at once, `measured = h(x) + noise` of the covariance `noise`, unless their normalised
    /// innovation squared exceeds `gate`, as [`crate::UdCovariance::update_vector_gated`].
    ///
    /// `model` gives h(x) and the rows of its Jacobian dh/dx at a state, all at the state before.
    pub fn update_vector_extended<const M: usize>(
        &mut self,
        model: impl FnOnce(&SVector<T, N>) -> (SVector<T, M>, [SVector<T, N>; M]),
        noise: &SMatrix<T, M, M>,
        measured: &SVector<T, M>,
        gate: T,
    ) -> VectorInnovationRecord<T, M> {
        let (expected, rows) = model(&self.state);
        self.covariance.update_vector_gated(&rows, noise, &(measured - expected), gate, &mut self.state)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};
    use proptest::prelude::*;

    use super::*;
    use crate::{Dense, Outcome, Refusal, UdCovariance};

    fn swing(x: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(x.x + 0.1 * x.y, x.y - 0.4 * libm::sin(x.x))
    }

    fn shadow(x: &Vector2<f64>) -> f64 {
        libm::sin(x.x) + 0.1 * x.y * x.y
    }

    /// By central differences: independent of the Jacobians written out.
    fn slope(of: impl Fn(&Vector2<f64>) -> f64, at: &Vector2<f64>) -> Vector2<f64> {
        let h = 1e-5;
        let along = |step: Vector2<f64>| (of(&(at + step)) - of(&(at - step))) / (2.0 * h);
        Vector2::new(along(Vector2::new(h, 0.0)), along(Vector2::new(0.0, h)))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The textbook's matrices, with Jacobians by differences.
        #[test]
        fn dual_a_step_equals_the_matrix_equations(
            x in prop::array::uniform2(-1.5..1.5_f64), z in -1.5..1.5_f64, correlation in -0.9..0.9_f64,
        ) {
            let p = Matrix2::new(0.5, correlation, correlation, 2.0);
            let mut filter = KalmanFilter::new(Vector2::from(x), UdCovariance::from_covariance(&p).unwrap());
            let noise = [NoiseSource { gain: Vector2::new(0.1, 1.0), variance: 0.05 }];
            let f = Matrix2::from_rows(&[0, 1].map(|i| slope(|x| swing(x)[i], &x.into()).transpose()));
            let jacobian = |x: &Vector2<f64>| Matrix2::new(1.0, 0.1, -0.4 * libm::cos(x.x), 1.0);
            filter.predict_extended(|x| (swing(x), Dense(jacobian(x))), &noise).unwrap();
            let (x, p) = (swing(&x.into()), f * p * f.transpose() + noise[0].gain * noise[0].gain.transpose() * 0.05);
            prop_assert!((filter.state - x).abs().max() < 1e-15);
            prop_assert!((filter.covariance.covariance() - p).abs().max() < 1e-8);

            let h = slope(shadow, &x);
            let variance = h.dot(&(p * h)) + 0.2;
            let (gain, innovation) = (p * h / variance, z - shadow(&x));
            let model = |x: &Vector2<f64>| (shadow(x), Vector2::new(libm::cos(x.x), 0.2 * x.y));
            let predicted = filter;
            let record = filter.update_extended(model, 0.2, z, f64::INFINITY);
            prop_assert_eq!(record.outcome, Outcome::Used);
            prop_assert!((record.variance / variance - 1.0).abs() < 1e-7);
            prop_assert!((record.normalised_squared - innovation * innovation / variance).abs() < 1e-6);
            prop_assert!((filter.state - (x + gain * innovation)).abs().max() < 1e-7);
            prop_assert!((filter.covariance.covariance() - (p - gain * h.transpose() * p)).abs().max() < 1e-7);

            // Two shadows, whose noises are correlated: from another side the cosine.
            let side = |x: &Vector2<f64>| libm::cos(x.x) - x.y;
            let h = Matrix2::from_rows(&[h.transpose(), slope(side, &x).transpose()]);
            let noise = Matrix2::new(0.2, 0.1, 0.1, 0.3);
            let s = h * p * h.transpose() + noise;
            let both = Vector2::new(z, 0.3);
            let (gain, innovation) =
                (p * h.transpose() * s.try_inverse().unwrap(), both - Vector2::new(shadow(&x), side(&x)));
            let square = innovation.dot(&(s.try_inverse().unwrap() * innovation));
            let of_both = |x: &Vector2<f64>| {
                let rows = [Vector2::new(libm::cos(x.x), 0.2 * x.y), Vector2::new(-libm::sin(x.x), -1.0)];
                (Vector2::new(shadow(x), side(x)), rows)
            };
            let mut seen = predicted;
            let of_vector = seen.update_vector_extended(of_both, &noise, &both, f64::INFINITY);
            prop_assert_eq!(of_vector.outcome, Outcome::Used);
            prop_assert!((of_vector.normalised_squared - square).abs() < 1e-6 * (1.0 + square));
            prop_assert!((seen.state - (x + gain * innovation)).abs().max() < 1e-7);
            prop_assert!((seen.covariance.covariance() - (p - gain * h * p)).abs().max() < 1e-7);
            let mut gated = predicted;
            let outside = gated.update_vector_extended(of_both, &noise, &both, 0.999 * of_vector.normalised_squared);
            prop_assert_eq!(outside.outcome, Outcome::OutsideGate);
            prop_assert_eq!(gated, predicted);

            let mut gated = predicted;
            let record = gated.update_extended(model, 0.2, z, 0.999 * record.normalised_squared);
            prop_assert_eq!(record.outcome, Outcome::OutsideGate);
            prop_assert_eq!(gated, predicted);
        }
    }

    #[test]
    fn law_a_model_that_is_no_number_is_refused() {
        let start =
            KalmanFilter::new(Vector2::new(1.0, 2.0), UdCovariance::from_diagonal(&Vector2::repeat(1.0)));
        let (mut filter, f) = (start, Dense(Matrix2::identity()));
        for bad in [f64::NAN, f64::INFINITY] {
            let refused = filter.predict_extended(|_| (Vector2::new(bad, 0.0), f), &[]);
            assert_eq!(refused, Err(PredictionRefusal::State));
            let refused = filter.predict_extended(|x| (*x, Dense(Matrix2::identity() * bad)), &[]);
            assert_eq!(refused, Err(PredictionRefusal::Transition));
            let record = filter.update_extended(|_| (bad, Vector2::new(1.0, 0.0)), 1.0, 0.0, 9.0);
            assert_eq!(record.outcome, Outcome::Refused(Refusal::Innovation));
            let record = filter.update_extended(|_| (0.0, Vector2::new(bad, 0.0)), 1.0, 0.0, 9.0);
            assert_eq!(record.outcome, Outcome::Refused(Refusal::Uncertain));
            assert_eq!(filter, start);
        }
    }
}
