//! Covariance of angle and rate, kept as its factors `P = U D U'`.
//!
//! | index | state | unit | variance |
//! |---|---|---|---|
//! | 0 | angle | rad | P11 |
//! | 1 | rate | rad/s | P22 |
//!
//! ```text
//! U = [1 u; 0 1],  D = diag(d1, d2):    P11 = d1 + u^2 d2,   P12 = u d2,   P22 = d2
//! ```
//!
//! The factors `d1`, `d2` are products and sums of positive numbers, so `P` is positive definite by construction, in
//! `f32` too. [`ud_filter::UdCovariance`] is the same for any number of states; written out, it saves a tenth of a
//! filter's time. A test compares the two.
//!
//! Sources: Bierman, "Factorization Methods for Discrete Sequential Estimation" (1977), chapter V (update); Thornton's
//! modified weighted Gram-Schmidt prediction, written out for two states.

use motor_model::Real;
use nalgebra::SVector;
use ud_filter::UdCovariance;

use crate::camera::track_covariance::{SmoothedCovariance, TrackCovariance};

/// Factors of the covariance of (angle, rate), in rad and rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleRateCovariance<T> {
    d1: T,
    d2: T,
    u: T,
}

impl<T: Real> AngleRateCovariance<T> {
    /// Independent angle and rate with these variances, both positive.
    pub fn diagonal(angle_rad2: T, rate_rad2_s2: T) -> Self {
        Self { d1: angle_rad2, d2: rate_rad2_s2, u: T::zero() }
    }

    /// Covariance of angle and rate in rad^2/s.
    pub fn angle_rate_rad2_s(&self) -> T {
        self.u * self.d2
    }

    /// Updates by an angle measured with variance `noise_rad2`, positive. The answer is the Kalman gain: corrections of
    /// angle and rate per innovation. The variance of the innovation ([`TrackCovariance::innovation_rad2`]) must be
    /// finite.
    pub fn update_angle(&mut self, noise_rad2: T) -> [T; 2] {
        let a = noise_rad2 + self.d1;
        let g2 = self.u * self.d2;
        let s = a + self.u * g2;
        let per_s = T::one() / s;
        let gain = [(s - noise_rad2) * per_s, g2 * per_s];
        let kept = noise_rad2 / a;
        self.d1 *= kept;
        self.d2 *= a * per_s;
        self.u *= kept;
        gain
    }
}

impl<T: Real> TrackCovariance<T> for AngleRateCovariance<T> {
    fn begin(angle_rad2: T, rate_rad2_s2: T, _before: Option<&Self>) -> Self {
        Self::diagonal(angle_rad2, rate_rad2_s2)
    }

    fn angle_rad2(&self) -> T {
        self.d1 + self.u * self.u * self.d2
    }

    fn innovation_rad2(&self, noise_rad2: T) -> T {
        // As in the update, so that both together cost no more.
        noise_rad2 + self.d1 + self.u * (self.u * self.d2)
    }

    fn rate_rad2_s2(&self) -> T {
        self.d2
    }

    fn moments_after(&self, dt_s: T) -> [T; 3] {
        let ahead = self.u + dt_s;
        let angle_rate_rad2_s = ahead * self.d2;
        [self.d1 + ahead * angle_rate_rad2_s, angle_rate_rad2_s, self.d2]
    }

    /// The covariance of the random walk `q [dt^3/3 dt^2/2; dt^2/2 dt]` has the factors `u = dt/2`, `d = (q dt^3/12, q
    /// dt)`, and two factorised matrices add without leaving factorised form.
    fn predict(&mut self, dt_s: T, noise_rad2_s3: T) {
        let q2 = noise_rad2_s3 * dt_s;
        let q1 = q2 * dt_s * dt_s * T::from_f64(1.0 / 12.0);
        let (u, half_dt) = (self.u + dt_s, dt_s * T::from_f64(0.5));
        let sum = self.d2 + q2;
        if sum > T::zero() {
            let apart = u - half_dt;
            let share = q2 / sum;
            self.d1 += q1 + apart * apart * self.d2 * share;
            self.u = u - apart * share;
        } else {
            self.u = u;
        }
        self.d2 = sum;
    }

    fn widen_rate(&mut self, variance_rad2_s2: T) {
        self.kick_rate(T::one(), variance_rad2_s2);
    }

    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T) {
        let before = self.d2;
        let sum = kept * kept * before + variance_rad2_s2;
        if sum > T::zero() {
            let share = before / sum;
            self.d1 += self.u * self.u * variance_rad2_s2 * share;
            self.u *= kept * share;
        }
        self.d2 = sum;
    }

    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2] {
        let is_finite = self.innovation_rad2(noise_rad2) <= T::MAX;
        if !is_finite {
            return [T::zero(); 2];
        }
        self.update_angle(noise_rad2).map(|gain| gain * innovation_rad)
    }

    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2] {
        let sum = noise_rad2_s2 + self.d2;
        let is_finite = sum <= T::MAX;
        if !is_finite {
            return [T::zero(); 2];
        }
        let per_s = T::one() / sum;
        let corrections = [self.u * self.d2 * per_s * innovation_rad_s, self.d2 * per_s * innovation_rad_s];
        self.d2 *= noise_rad2_s2 * per_s;
        corrections
    }
}

impl<T: Real> SmoothedCovariance<T, 2> for AngleRateCovariance<T> {
    fn ud_covariance(&self) -> UdCovariance<T, 2> {
        let (one, o) = (T::one(), T::zero());
        UdCovariance { unit: [[one, o], [self.u, one]], weights: [self.d1, self.d2] }
    }

    fn exact(&self) -> Self {
        Self::diagonal(T::zero(), T::zero())
    }

    fn states(&self, rate_rad_s: T) -> SVector<T, 2> {
        SVector::from([T::zero(), rate_rad_s])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix2, RowVector2, Vector2};
    use proptest::prelude::*;
    use ud_filter::{NoiseSource, UdCovariance, UpperTriangular};

    fn dense(p: &AngleRateCovariance<f64>) -> Matrix2<f64> {
        Matrix2::new(p.angle_rad2(), p.angle_rate_rad2_s(), p.angle_rate_rad2_s(), p.rate_rad2_s2())
    }

    fn close(a: &Matrix2<f64>, b: &Matrix2<f64>) -> bool {
        // Relative to each entry's own scale, sqrt(P_ii P_jj).
        let scale = |i: usize, j: usize| (b[(i, i)] * b[(j, j)]).sqrt();
        (0..2).all(|i| (0..2).all(|j| (a[(i, j)] - b[(i, j)]).abs() <= 1e-9 * scale(i, j)))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The factors against the textbook's matrices, through random sequences.
        #[test]
        fn dual_factors_equal_the_matrix_equations(
            p1 in 1e-6..1e3_f64, p2 in 1e-6..1e3_f64,
            steps in prop::collection::vec((1e-4..1.0_f64, 0.0..10.0_f64, 1e-4..1e2_f64, any::<bool>()), 1..30),
            kick in 0.0..1e3_f64
        ) {
            let mut factored = AngleRateCovariance::diagonal(p1, p2);
            let mut p = Matrix2::new(p1, 0.0, 0.0, p2);
            for (dt, q, r, of_angle) in steps {
                factored.predict(dt, q);
                let f = Matrix2::new(1.0, dt, 0.0, 1.0);
                let noise = Matrix2::new(dt * dt * dt / 3.0, dt * dt / 2.0, dt * dt / 2.0, dt) * q;
                p = f * p * f.transpose() + noise;
                prop_assert!(close(&dense(&factored), &p));
                factored.widen_rate(kick);
                p[(1, 1)] += kick;
                prop_assert!(close(&dense(&factored), &p));
                let h = if of_angle { RowVector2::new(1.0, 0.0) } else { RowVector2::new(0.0, 1.0) };
                let k: Vector2<f64> = p * h.transpose() / ((h * p * h.transpose())[0] + r);
                let gain = if of_angle { factored.correct_by_angle(1.0, r) } else { factored.correct_by_rate(1.0, r) };
                prop_assert!((gain[0] - k[0]).abs() <= 1e-9 * (1.0 + k[0].abs()));
                prop_assert!((gain[1] - k[1]).abs() <= 1e-9 * (1.0 + k[1].abs()));
                let kept = Matrix2::identity() - k * h;
                p = kept * p * kept.transpose() + k * r * k.transpose();
                prop_assert!(close(&dense(&factored), &p));
            }
        }

        /// In f32, over sixteen decades of prior and noise: definite, and never larger after a measurement.
        #[test]
        fn law_factors_stay_positive_in_f32(
            prior in -8.0..8.0_f64, noise in -14.0..2.0_f64, q in 0.0..1e4_f32, n in 1..200_usize
        ) {
            let mut p = AngleRateCovariance::<f32>::diagonal(10_f64.powf(prior) as f32, 10_f64.powf(prior) as f32);
            let r = 10_f64.powf(noise) as f32;
            for _ in 0..n {
                p.predict(1e-4, q);
                let before = p.angle_rad2();
                p.update_angle(r);
                prop_assert!(p.d1 > 0.0 && p.d2 > 0.0 && p.u.is_finite());
                prop_assert!(p.angle_rad2() <= before * 1.000_01 && p.angle_rad2() <= r * 1.000_01);
            }
        }
    }

    /// The general core on the same two states.
    #[test]
    fn dual_factors_equal_the_general_core() {
        let mut by_hand = AngleRateCovariance::<f64>::diagonal(1e-6, 400.0);
        let mut general = UdCovariance::<f64, 2>::from_diagonal(&Vector2::new(1e-6, 400.0));
        for n in 0..100 {
            let (dt, q) = (1e-4 * f64::from(1 + n % 3), 3000.0);
            by_hand.predict(dt, q);
            let kick = NoiseSource { gain: Vector2::new(0.5 * dt, 1.0), variance: q * dt };
            let timing = NoiseSource { gain: Vector2::new(1.0, 0.0), variance: q * dt * dt * dt / 12.0 };
            general.predict(&UpperTriangular(Matrix2::new(1.0, dt, 0.0, 1.0)), &[timing, kick]).unwrap();
            if n % 10 == 0 {
                by_hand.widen_rate(200.0);
                general.add_rank_one(&Vector2::new(0.0, 1.0), 200.0);
            }
            let [angle, rate] = by_hand.update_angle(8.8e-8);
            let by_core = general.update_state::<0>(8.8e-8, 0.0, &mut Vector2::zeros()).unwrap().gain;
            assert!((angle / by_core.x - 1.0).abs() < 1e-12 && (rate / by_core.y - 1.0).abs() < 1e-12);
            assert!(close(&dense(&by_hand), &general.covariance()));
        }
    }

    /// Steady state of the continuous filter: var(angle) = sqrt 2 r^(3/4) q^(1/4), r = R dt (Kalman-Bucy).
    #[test]
    fn exact_steady_state_approaches_the_continuous_filter() {
        let (q, r_dt) = (3000.0_f64, 9e-12_f64);
        let expected = 2_f64.sqrt() * r_dt.powf(0.75) * q.powf(0.25);
        let mut errors = [0.0; 2];
        for (error, dt) in errors.iter_mut().zip([1e-6, 5e-7]) {
            let mut p = AngleRateCovariance::<f64>::diagonal(1e-6, 100.0);
            for _ in 0..200_000 {
                p.predict(dt, q);
                p.update_angle(r_dt / dt);
            }
            *error = (p.angle_rad2() - expected).abs() / expected;
        }
        assert!(errors[0] < 0.01, "{errors:?}");
        // First order in the sampling interval.
        assert!((errors[0] / errors[1] - 2.0).abs() < 0.1, "{errors:?}");
    }

    /// A measurement whose variance, or whose innovation's, is infinite or NaN: not used, and nothing becomes certain.
    #[test]
    fn law_numbers_out_of_range_are_no_certainty() {
        let plain = AngleRateCovariance::<f32>::diagonal(1.0, 4.0);
        // P11 is 1e40, no number of this precision.
        let mut far = AngleRateCovariance::<f32>::diagonal(1.0, 1e30);
        far.predict(1e5, 0.0);
        let wide = AngleRateCovariance::<f32>::diagonal(1.0, 3e38);
        for (start, noise) in [(plain, f32::INFINITY), (plain, f32::NAN), (far, 1.0), (wide, 3e38)] {
            let (mut by_angle, mut by_rate) = (start, start);
            let corrections = [by_angle.correct_by_angle(1.0, noise), by_rate.correct_by_rate(1.0, noise)];
            assert!(
                corrections.as_flattened().iter().all(|x| x.is_finite()),
                "{start:?} {noise} {corrections:?}"
            );
            assert!(by_angle.rate_rad2_s2() > 0.1 * start.rate_rad2_s2(), "{start:?} {noise} {by_angle:?}");
            assert!(by_rate.rate_rad2_s2() > 0.0, "{start:?} {noise} {by_rate:?}");
        }
        // What is no number stays none.
        for bad in [f32::NAN, f32::INFINITY] {
            let (mut widened, mut kicked, mut moved) = (plain, plain, plain);
            widened.widen_rate(bad);
            kicked.kick_rate(0.5, bad);
            moved.predict(1e-4, bad);
            for mut p in [widened, kicked, moved, AngleRateCovariance::diagonal(1.0, bad)] {
                let before = p.rate_rad2_s2();
                assert!(!before.is_finite() && !p.angle_rad2().is_finite(), "{p:?}");
                assert_eq!(p.correct_by_angle(1.0, 1.0).map(f32::to_bits), [0; 2], "{p:?}");
                assert_eq!(p.rate_rad2_s2().to_bits(), before.to_bits());
            }
        }
    }
}
