//! What tracker, track and smoother need of the covariance of a filter.

use motor_model::Real;
use nalgebra::{SMatrix, SVector};
use ud_filter::UdCovariance;

/// Covariance of angle and rate, and in a richer filter the further states that are correlated with them.
pub trait TrackCovariance<T>: Copy {
    /// Independent angle and rate of these variances. Further states are kept from `before`.
    fn begin(angle_rad2: T, rate_rad2_s2: T, before: Option<&Self>) -> Self;

    /// A copy, field by field where it is large: a copy as a whole is a call that costs as much as an update.
    #[must_use]
    fn copied(&self) -> Self {
        *self
    }

    /// Variance of the angle, in rad^2.
    fn angle_rad2(&self) -> T;

    /// Variance of the innovation of an angle measured with variance `noise_rad2`, in rad^2.
    fn innovation_rad2(&self, noise_rad2: T) -> T
    where
        T: Real,
    {
        self.angle_rad2() + noise_rad2
    }

    /// Variance of the rate, in rad^2/s^2.
    fn rate_rad2_s2(&self) -> T;

    /// Variance of the angle, covariance of angle and rate and variance of the rate after `dt_s` at the rate as it is:
    /// sums of products that are not negative.
    fn moments_after(&self, dt_s: T) -> [T; 3];

    /// `dt_s`, not negative, passes, in which the rate is a random walk of intensity `noise_rad2_s3`, not negative.
    fn predict(&mut self, dt_s: T, noise_rad2_s3: T);

    /// Adds `variance_rad2_s2`, not negative, to the variance of the rate: a kick of unknown size.
    fn widen_rate(&mut self, variance_rad2_s2: T);

    /// Multiplies the error of the rate by `kept` and adds an independent error of variance `variance_rad2_s2`.
    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T);

    /// Fuses an angle measured with variance `noise_rad2`, positive; the corrections of angle and rate. Where the
    /// innovation's variance is infinite or NaN, they are zero and the covariance stays as it is: nothing becomes
    /// certain.
    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2];

    /// As [`Self::correct_by_angle`], of a rate.
    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2];
}

/// A covariance of `N` states, of which angle and rate are the first, as the smoother needs it.
pub(crate) trait SmoothedCovariance<T, const N: usize>: TrackCovariance<T> {
    fn ud_covariance(&self) -> UdCovariance<T, N>;

    /// The same of states that are known exactly.
    fn exact(&self) -> Self;

    /// The values of the states with this rate, and 0 in place of the angle.
    fn states(&self, rate_rad_s: T) -> SVector<T, N>;
}

/// A covariance that is carried along, and what becomes of an error on the way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Carried<T, B, const N: usize> {
    pub(crate) covariance: B,
    /// The covariance Q of states that were known exactly at the start.
    pub(crate) noise: B,
    /// Rows of the Jacobian F: angle and rate by the errors of all states at the start.
    angle_row: SVector<T, N>,
    rate_row: SVector<T, N>,
}

impl<T: Real, B: SmoothedCovariance<T, N>, const N: usize> Carried<T, B, N> {
    pub(crate) fn along(covariance: B) -> Self {
        let [angle_row, rate_row] =
            [0, 1].map(|own| SVector::from_fn(|state, _| if state == own { T::one() } else { T::zero() }));
        Self { covariance, noise: covariance.exact(), angle_row, rate_row }
    }

    pub(crate) fn both(&mut self) -> [&mut B; 2] {
        [&mut self.covariance, &mut self.noise]
    }

    /// The Jacobian F. States after angle and rate stay what they are.
    pub(crate) fn jacobian(&self) -> SMatrix<T, N, N> {
        let mut jacobian = SMatrix::<T, N, N>::identity();
        for (mut row, values) in jacobian.row_iter_mut().zip([&self.angle_row, &self.rate_row]) {
            row.copy_from(&values.transpose());
        }
        jacobian
    }

    /// The rate becomes `kept` of its own error, and takes up the errors of further states by `row`.
    pub(crate) fn turn_rate(&mut self, kept: T, row: &SVector<T, N>) {
        self.rate_row = self.rate_row * kept + row;
    }
}

impl<T: Real, B: SmoothedCovariance<T, N>, const N: usize> TrackCovariance<T> for Carried<T, B, N> {
    fn begin(angle_rad2: T, rate_rad2_s2: T, before: Option<&Self>) -> Self {
        Self::along(B::begin(angle_rad2, rate_rad2_s2, before.map(|before| &before.covariance)))
    }

    fn angle_rad2(&self) -> T {
        self.covariance.angle_rad2()
    }

    fn rate_rad2_s2(&self) -> T {
        self.covariance.rate_rad2_s2()
    }

    fn moments_after(&self, dt_s: T) -> [T; 3] {
        self.covariance.moments_after(dt_s)
    }

    fn predict(&mut self, dt_s: T, noise_rad2_s3: T) {
        self.both().into_iter().for_each(|covariance| covariance.predict(dt_s, noise_rad2_s3));
        self.angle_row += self.rate_row * dt_s;
    }

    fn widen_rate(&mut self, variance_rad2_s2: T) {
        self.both().into_iter().for_each(|covariance| covariance.widen_rate(variance_rad2_s2));
    }

    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T) {
        self.both().into_iter().for_each(|covariance| covariance.kick_rate(kept, variance_rad2_s2));
        self.turn_rate(kept, &SVector::zeros());
    }

    /// Nothing is measured on the way.
    fn correct_by_angle(&mut self, _innovation_rad: T, _noise_rad2: T) -> [T; 2] {
        [T::zero(); 2]
    }

    fn correct_by_rate(&mut self, _innovation_rad_s: T, _noise_rad2_s2: T) -> [T; 2] {
        [T::zero(); 2]
    }
}
