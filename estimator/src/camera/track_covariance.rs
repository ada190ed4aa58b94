//! What tracker and track need of the covariance of a filter.

use motor_model::Real;

use crate::camera::angle_rate_covariance::AngleRateCovariance;

/// Covariance of angle and rate, and in a richer filter the further states that are correlated with them.
pub(crate) trait TrackCovariance<T>: Copy {
    /// Independent angle and rate of these variances. Further states are kept from `before`.
    fn begin(angle_rad2: T, rate_rad2_s2: T, before: Option<&Self>) -> Self;

    /// A copy, field by field where it is large: a copy as a whole is a call that costs as much as an update.
    #[inline]
    fn copied(&self) -> Self {
        *self
    }

    /// Variance of the angle.
    fn angle_rad2(&self) -> T;

    /// Variance of the innovation of an angle measured with variance `noise_rad2`.
    #[inline]
    fn innovation_rad2(&self, noise_rad2: T) -> T
    where
        T: Real,
    {
        self.angle_rad2() + noise_rad2
    }

    /// Covariance of angle and rate.
    fn angle_rate_rad2_s(&self) -> T;

    /// Variance of the rate.
    fn rate_rad2_s2(&self) -> T;

    /// `dt_s` passes, in which the rate is a random walk of this intensity.
    fn predict(&mut self, dt_s: T, noise_rad2_s3: T);

    /// Adds `variance_rad2_s2` to the variance of the rate.
    fn widen_rate(&mut self, variance_rad2_s2: T);

    /// Multiplies the error of the rate by `kept` and adds an independent error of `variance_rad2_s2`.
    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T);

    /// Fuses an angle; the corrections of angle and rate. Where the innovation's variance is infinite or NaN, they are
    /// zero and the covariance stays as it is: nothing becomes certain.
    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2];

    /// As [`Self::correct_by_angle`], of a rate.
    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2];
}

impl<T: Real> TrackCovariance<T> for AngleRateCovariance<T> {
    #[inline]
    fn begin(angle_rad2: T, rate_rad2_s2: T, _before: Option<&Self>) -> Self {
        Self::diagonal(angle_rad2, rate_rad2_s2)
    }

    #[inline]
    fn angle_rad2(&self) -> T {
        self.angle_rad2()
    }

    #[inline]
    fn innovation_rad2(&self, noise_rad2: T) -> T {
        self.angle_innovation_rad2(noise_rad2)
    }

    #[inline]
    fn angle_rate_rad2_s(&self) -> T {
        self.angle_rate_rad2_s()
    }

    #[inline]
    fn rate_rad2_s2(&self) -> T {
        self.rate_rad2_s2()
    }

    #[inline]
    fn predict(&mut self, dt_s: T, noise_rad2_s3: T) {
        self.predict(dt_s, noise_rad2_s3);
    }

    #[inline]
    fn widen_rate(&mut self, variance_rad2_s2: T) {
        self.widen_rate(variance_rad2_s2);
    }

    #[inline]
    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T) {
        self.kick_rate(kept, variance_rad2_s2);
    }

    #[inline]
    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2] {
        let is_finite = self.angle_innovation_rad2(noise_rad2) <= T::MAX;
        if !is_finite {
            return [T::zero(); 2];
        }
        let gain = self.update_angle(noise_rad2);
        [gain.angle * innovation_rad, gain.rate * innovation_rad]
    }

    #[inline]
    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2] {
        let is_finite = self.rate_rad2_s2() + noise_rad2_s2 <= T::MAX;
        if !is_finite {
            return [T::zero(); 2];
        }
        let gain = self.update_rate(noise_rad2_s2);
        [gain.angle * innovation_rad_s, gain.rate * innovation_rad_s]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
