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

    /// Fuses an angle; the corrections of angle and rate.
    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2];

    /// Fuses a rate; the corrections of angle and rate.
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
        let gain = self.update_angle(noise_rad2);
        [gain.angle * innovation_rad, gain.rate * innovation_rad]
    }

    #[inline]
    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2] {
        let gain = self.update_rate(noise_rad2_s2);
        [gain.angle * innovation_rad_s, gain.rate * innovation_rad_s]
    }
}
