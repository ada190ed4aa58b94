//! What rides along with angle and rate: the motor's friction, and how far its teeth reach.
//!
//! ```text
//! kick = clamp(a S - rate, -f L, f L)       f: friction, a: the teeth's tangential velocity, both per the nominal value
//! ```
//!
//! Neither changes in a motor's run, and there are hundreds of kicks a second: both are learnt from the camera to some percent within a tenth of a second.

use motor_model::Real;
use nalgebra::{Matrix4, Vector4};

use crate::belief::Belief;
use crate::factors::{NoiseSource, UdCovariance};

use crate::transition::{Transition as _, UpperTriangular};

/// Standard deviation of the friction before anything is known, as a part: uniform from 0.2 to 0.6 about 0.4.
const FRICTION_PART: f64 = 0.29;
/// The same of the teeth's reach: thickness and height of the teeth, the tooth angle.
const REACH_PART: f64 = 0.03;

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

impl<T: Real> ScaledBelief<T> {
    /// A kick of these slopes.
    pub(super) fn kick(&mut self, slopes: &KickSlopes<T>) {
        let mut map = Matrix4::identity();
        map.m22 = T::one() + slopes.per_rate;
        map.m23 = slopes.per_friction;
        map.m24 = slopes.per_reach;
        UpperTriangular(map).carry_factors(&mut self.covariance);
        self.covariance.add_rank_one(&Vector4::y(), slopes.variance_rad2_s2);
        self.covariance.add_rank_one(&Vector4::x(), slopes.angle_rad2);
    }

    fn corrected(&mut self, errors: Vector4<T>) -> [T; 2] {
        let within = |x: T, part: f64| T::one() + (x - T::one()).clamp_magnitude(T::from_f64(part));
        self.friction = within(self.friction + errors.z, FRICTION_MOST);
        self.reach = within(self.reach + errors.w, REACH_MOST);
        [errors.x, errors.y]
    }
}

impl<T: Real> Belief<T> for ScaledBelief<T> {
    fn begin(angle_rad2: T, rate_rad2_s2: T, before: Option<&Self>) -> Self {
        let square = |part: f64| T::from_f64(part * part);
        let (friction, reach) = before.map_or((T::one(), T::one()), |belief| (belief.friction, belief.reach));
        let variances = Vector4::new(angle_rad2, rate_rad2_s2, square(FRICTION_PART), square(REACH_PART));
        Self { covariance: UdCovariance::from_diagonal(&variances), friction, reach }
    }

    #[inline]
    fn angle_rad2(&self) -> T {
        self.covariance.variance::<0>()
    }

    #[inline]
    fn angle_rate_rad2_s(&self) -> T {
        self.covariance.covariance().m12
    }

    #[inline]
    fn rate_rad2_s2(&self) -> T {
        self.covariance.variance::<1>()
    }

    fn predict(&mut self, dt_s: T, noise_rad2_s3: T) {
        let (zero, half) = (T::zero(), T::from_f64(0.5));
        let mut flow = Matrix4::identity();
        flow.m12 = dt_s;
        let wander = noise_rad2_s3 * dt_s;
        let noise = [
            NoiseSource { gain: Vector4::new(half * dt_s, T::one(), zero, zero), variance: wander },
            NoiseSource { gain: Vector4::x(), variance: wander * dt_s * dt_s * T::from_f64(1.0 / 12.0) },
        ];
        self.covariance.predict(&UpperTriangular(flow), &noise);
    }

    fn widen_rate(&mut self, variance_rad2_s2: T) {
        self.covariance.add_rank_one(&Vector4::y(), variance_rad2_s2);
    }

    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T) {
        let mut map = Matrix4::identity();
        map.m22 = kept;
        UpperTriangular(map).carry_factors(&mut self.covariance);
        self.widen_rate(variance_rad2_s2);
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
