//! What rides along with angle and rate: the motor's friction, and how far its teeth reach.
//!
//! ```text
//! kick = clamp(a S - rate, -f L, f L)       f: friction, a: the teeth's tangential velocity, both per the nominal value
//! ```
//!
//! Neither changes in a motor's run, and there are hundreds of kicks a second: both are learnt from the camera to some percent within a tenth of a second. What the reach
//! really scales, though, is what the twin makes of the teeth's velocity, a percent of which is the fault of other parameters: under another mode it is another percent.

use motor_model::Real;
use nalgebra::Vector4;

use crate::camera::track_covariance::TrackCovariance;
use crate::factorised::ud_covariance::{UdCovariance, reciprocal};

/// Standard deviation of the friction before anything is known, as a part: uniform from 0.2 to 0.6 about 0.4.
const FRICTION_PART: f64 = 0.29;
/// The same of the teeth's reach: thickness and height of the teeth, the tooth angle.
const REACH_PART: f64 = 0.03;
/// Standard deviation of the reach under one mode about that under the other: 0.009 over 30 motors drawn within the tolerances.
const OTHER_MODE_PART: f64 = 0.01;

/// Beyond these parts no motor differs: friction from 0.16 to 0.64, five standard deviations of the reach.
const FRICTION_MOST: f64 = 0.6;
const REACH_MOST: f64 = 0.15;

/// Covariance of angle, rate, friction and reach, and the values of the latter two.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScaledBelief<T> {
    covariance: UdCovariance<T, 4>,
    /// Friction per its nominal value.
    pub(super) friction: T,
    /// The teeth's tangential velocity per that of the twin.
    pub(super) reach: T,
}

/// How a kick answers rate, friction and reach, and what varies beside.
#[derive(Clone, Copy, Debug)]
pub(super) struct KickSlopes<T> {
    pub(super) per_rate: T,
    pub(super) per_friction: T,
    pub(super) per_reach: T,
    pub(super) variance_rad2_s2: T,
    /// Variance of the angle by the kick's instant.
    pub(super) angle_rad2: T,
}

/// How much of one error angle and rate have.
#[derive(Clone, Copy)]
struct Own<T> {
    angle: T,
    rate: T,
}

impl<T: Real> ScaledBelief<T> {
    /// Variances of friction and reach.
    #[inline]
    pub(super) fn scales2(&self) -> [T; 2] {
        let ([_, _, _, [_, _, u23, _]], [_, _, d2, d3]) = (&self.covariance.unit, &self.covariance.weights);
        [*d2 + *u23 * *u23 * *d3, *d3]
    }

    /// The teeth swing in another mode now.
    pub(super) fn change_mode(&mut self) {
        self.covariance.add_rank_one(&Vector4::w(), T::from_f64(OTHER_MODE_PART * OTHER_MODE_PART));
    }

    /// A kick of these slopes.
    pub(super) fn kick(&mut self, slopes: &KickSlopes<T>) {
        let left = T::one() + slopes.per_rate;
        let [_, [u01, ..], [_, u12, ..], [_, u13, u23, _]] = &mut self.covariance.unit;
        *u13 = left * *u13 + slopes.per_friction * *u23 + slopes.per_reach;
        *u12 = left * *u12 + slopes.per_friction;
        let own = Own { angle: *u01, rate: left };
        self.renew(own, Own { angle: T::zero(), rate: T::one() }, slopes.variance_rad2_s2);
        self.widen_angle(slopes.angle_rad2);
    }

    /// What the rate alone brings to angle and rate is `own` times its error, and a `noise` of this variance comes beside it: both as one error and what the angle
    /// does not share with the rate. Where teeth stick the rate brings nothing to itself, and the angle alone remembers.
    #[inline]
    fn renew(&mut self, own: Own<T>, noise: Own<T>, variance: T) {
        let variance = if variance > T::zero() { variance } else { T::zero() };
        let [_, [u01, ..], ..] = &mut self.covariance.unit;
        let [angle, rate, ..] = &mut self.covariance.weights;
        let (by_own, by_noise) = (own.rate * *rate, noise.rate * variance);
        let sum = own.rate * by_own + noise.rate * by_noise;
        let Some(per_sum) = reciprocal(sum) else {
            *angle += own.angle * own.angle * *rate;
            (*u01, *rate) = (T::zero(), sum);
            return;
        };
        let apart = own.angle * noise.rate - noise.angle * own.rate;
        *angle += *rate * variance * (apart * apart * per_sum);
        *u01 = (own.angle * by_own + noise.angle * by_noise) * per_sum;
        *rate = sum;
    }

    /// The angle becomes less certain by itself.
    #[inline]
    fn widen_angle(&mut self, variance_rad2: T) {
        let [angle, ..] = &mut self.covariance.weights;
        if variance_rad2 > T::zero() {
            *angle += variance_rad2;
        }
    }

    fn corrected(&mut self, errors: Vector4<T>) -> [T; 2] {
        let within = |x: T, part: f64| T::one() + (x - T::one()).clamp_magnitude(T::from_f64(part));
        self.friction = within(self.friction + errors.z, FRICTION_MOST);
        self.reach = within(self.reach + errors.w, REACH_MOST);
        [errors.x, errors.y]
    }
}

impl<T: Real> TrackCovariance<T> for ScaledBelief<T> {
    fn begin(angle_rad2: T, rate_rad2_s2: T, before: Option<&Self>) -> Self {
        let square = |part: f64| T::from_f64(part * part);
        let (friction, reach) = before.map_or((T::one(), T::one()), |belief| (belief.friction, belief.reach));
        let variances = Vector4::new(angle_rad2, rate_rad2_s2, square(FRICTION_PART), square(REACH_PART));
        Self { covariance: UdCovariance::from_diagonal(&variances), friction, reach }
    }

    #[inline]
    fn copied(&self) -> Self {
        let (one, o) = (T::one(), T::zero());
        let UdCovariance { unit: [_, [u01, ..], [u02, u12, ..], [u03, u13, u23, _]], weights } =
            self.covariance;
        let unit = [[one, o, o, o], [u01, one, o, o], [u02, u12, one, o], [u03, u13, u23, one]];
        Self { covariance: UdCovariance { unit, weights }, friction: self.friction, reach: self.reach }
    }

    #[inline]
    fn angle_rad2(&self) -> T {
        self.covariance.variance::<0>()
    }

    #[inline]
    fn angle_rate_rad2_s(&self) -> T {
        let [_, [u01, ..], [u02, u12, ..], [u03, u13, ..]] = &self.covariance.unit;
        let [_, d1, d2, d3] = &self.covariance.weights;
        *u01 * *d1 + *u02 * *u12 * *d2 + *u03 * *u13 * *d3
    }

    #[inline]
    fn rate_rad2_s2(&self) -> T {
        self.covariance.variance::<1>()
    }

    fn predict(&mut self, dt_s: T, noise_rad2_s3: T) {
        let wander = noise_rad2_s3 * dt_s;
        let [_, [u01, ..], [u02, u12, ..], [u03, u13, ..]] = &mut self.covariance.unit;
        *u02 += dt_s * *u12;
        *u03 += dt_s * *u13;
        let own = Own { angle: *u01 + dt_s, rate: T::one() };
        self.renew(own, Own { angle: T::from_f64(0.5) * dt_s, rate: T::one() }, wander);
        self.widen_angle(wander * dt_s * dt_s * T::from_f64(1.0 / 12.0));
    }

    fn widen_rate(&mut self, variance_rad2_s2: T) {
        self.covariance.add_rank_one(&Vector4::y(), variance_rad2_s2);
    }

    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T) {
        let (per_rate, zero) = (kept - T::one(), T::zero());
        self.kick(&KickSlopes {
            per_rate,
            per_friction: zero,
            per_reach: zero,
            variance_rad2_s2,
            angle_rad2: zero,
        });
    }

    fn correct_by_angle(&mut self, innovation_rad: T, noise_rad2: T) -> [T; 2] {
        let mut errors = Vector4::zeros();
        let _ = self.covariance.update_state::<0>(noise_rad2, innovation_rad, &mut errors);
        self.corrected(errors)
    }

    fn correct_by_rate(&mut self, innovation_rad_s: T, noise_rad2_s2: T) -> [T; 2] {
        let mut errors = Vector4::zeros();
        let _ = self.covariance.update_state::<1>(noise_rad2_s2, innovation_rad_s, &mut errors);
        self.corrected(errors)
    }
}

#[cfg(test)]
mod tests {
    use core::ops::AddAssign as _;

    use nalgebra::Matrix4;
    use proptest::prelude::*;

    use super::*;

    fn close(a: &Matrix4<f64>, b: &Matrix4<f64>) -> bool {
        (a - b).abs().max() < 1e-12 * (1.0 + b.abs().max())
    }

    fn full() -> impl Strategy<Value = Matrix4<f64>> {
        proptest::array::uniform16(-1.0..1.0_f64).prop_map(|entries| {
            let root = Matrix4::<f64>::from_row_slice(&entries);
            root * root.transpose() + Matrix4::identity() * 1e-3
        })
    }

    fn belief(p: &Matrix4<f64>) -> ScaledBelief<f64> {
        ScaledBelief { covariance: UdCovariance::from_covariance(p).unwrap(), friction: 1.0, reach: 1.0 }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// A prediction and a kick against the full matrices; teeth that stick, `1 + per_rate = 0`, among them.
        #[test]
        fn dual_predictions_and_kicks_equal_the_matrices(
            p in full(), dt in 0.0..2.0_f64, q in 0.0..2.0_f64, slip in prop_oneof![Just(1.0), 0.0..1.0_f64],
            per_friction in -1.0..1.0_f64, per_reach in -1.0..1.0_f64, variance in prop_oneof![Just(0.0), 0.0..1.0_f64],
            angle_rad2 in 0.0..1.0_f64,
        ) {
            let mut moved = belief(&p);
            moved.predict(dt, q);
            let mut f = Matrix4::identity();
            f.m12 = dt;
            let mut expected = f * p * f.transpose();
            expected.fixed_view_mut::<2, 2>(0, 0).add_assign(
                nalgebra::Matrix2::new(dt * dt / 3.0, dt / 2.0, dt / 2.0, 1.0).scale(q * dt),
            );
            prop_assert!(close(&moved.covariance.covariance(), &expected));
            prop_assert!((belief(&p).scales2()[0] - p.m33).abs() < 1e-12 && (belief(&p).scales2()[1] - p.m44).abs() < 1e-12);
            prop_assert!((moved.angle_rate_rad2_s() - expected.m12).abs() < 1e-12 * (1.0 + expected.m12.abs()));

            let mut kicked = belief(&p);
            kicked.kick(&KickSlopes { per_rate: -slip, per_friction, per_reach, variance_rad2_s2: variance, angle_rad2 });
            let mut f = Matrix4::identity();
            (f.m22, f.m23, f.m24) = (1.0 - slip, per_friction, per_reach);
            let mut expected = f * p * f.transpose();
            expected.m22 += variance;
            expected.m11 += angle_rad2;
            prop_assert!(close(&kicked.covariance.covariance(), &expected));
            prop_assert!(kicked.covariance.weights().iter().all(|d| *d >= 0.0));
        }
    }
}
