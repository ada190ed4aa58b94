//! The four states of the rotor filter: angle, rate, friction and tooth factor.
//!
//! | index | symbol | unit | meaning | prior standard deviation |
//! |---|---|---|---|---|
//! | 0 | angle | rad | angle of the rotor | that of the first frame, [`crate::TrackTuning::camera_rad2`] |
//! | 1 | rate | rad/s | angular rate of the rotor | 20 |
//! | 2 | f | 1 | friction per its nominal value | 0.29 |
//! | 3 | a | 1 | tangential velocity of the teeth per that of the stator filter | 0.03; 0.01 at a change of mode |
//!
//! ```text
//! prediction     angle' = rate;    kick = clamp(a S - rate, -f L, f L) at an impact       S, L: super::kick_record
//! measurement    the angle of a camera frame
//! ```
//!
//! Friction and tooth factor are constant in a run, and there are hundreds of kicks a second: the camera determines
//! both to some percent within a tenth of a second. The tooth factor also takes up errors of other parameters in the
//! stator filter's tangential velocity. Those differ between the modes by a percent, so a change of mode widens it.
//! Kicks that impacts or frames have contradicted have taught both wrongly, so both have the variance of their prior
//! again at the next kick.
//!
//! The covariance is kept as `P = U D U'`. Prediction and kick are written out in its factors: see
//! [`RotorCovariance::merge_rate_noise`].

use motor_model::Real;
use nalgebra::Vector4;
use ud_filter::{UdCovariance, reciprocal};

use crate::camera::track_covariance::{Carried, SmoothedCovariance, TrackCovariance};

/// Prior standard deviation of the friction: uniform from 0.2 to 0.6 about 0.4 is 0.115, per 0.4.
pub(super) const FRICTION_PRIOR: f64 = 0.29;
/// Prior standard deviation of the tooth factor: the tolerances of thickness, height and angle of the teeth.
pub(super) const TOOTH_FACTOR_PRIOR: f64 = 0.03;
/// Standard deviation of the tooth factor under one mode about that under the other: 0.009 over 30 motors drawn within
/// the tolerances.
const MODE_CHANGE: f64 = 0.01;

/// Largest difference from 1 that an update can lead to: friction from 0.16 to 0.64, beyond its uniform prior on either
/// side; five standard deviations of the tooth factor.
const FRICTION_RANGE: f64 = 0.6;
const TOOTH_FACTOR_RANGE: f64 = 0.15;

/// Covariance of the four states, and the values of the last two.
#[derive(Clone, Copy, Debug)]
pub(super) struct RotorCovariance<T> {
    covariance: UdCovariance<T, 4>,
    /// Friction per its nominal value.
    pub(super) friction: T,
    /// Tangential velocity of the teeth per that of the stator filter.
    pub(super) tooth_factor: T,
}

/// What is still known of friction and tooth factor at a kick.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum FactorKnowledge {
    /// As much as after the kick before.
    #[default]
    AsBefore,
    /// The drive's mode is another than at the kick before.
    OfAnotherMode,
    /// What the prior says: the kicks before were contradicted.
    Prior,
}

/// Jacobian of a kick by rate, friction and tooth factor, and the noise beside.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct KickJacobian<T> {
    pub(super) by_rate: T,
    pub(super) by_friction: T,
    pub(super) by_tooth_factor: T,
    pub(super) variance_rad2_s2: T,
    /// Variance of the angle by the uncertain instant of the kick.
    pub(super) angle_rad2: T,
}

/// A covariance of angle, rate, friction and tooth factor that kicks change.
pub(super) trait KickedCovariance<T>: TrackCovariance<T> {
    /// The covariance itself, and the values of friction and tooth factor.
    fn rotor(&self) -> &RotorCovariance<T>;

    /// Widens the factors to what is still known of them.
    fn doubt_factors(&mut self, known: FactorKnowledge);

    /// `P <- F P F' + Q` at a kick.
    fn kick(&mut self, jacobian: &KickJacobian<T>);
}

impl<T: Real> KickedCovariance<T> for RotorCovariance<T> {
    #[inline]
    fn rotor(&self) -> &RotorCovariance<T> {
        self
    }

    fn doubt_factors(&mut self, known: FactorKnowledge) {
        let (friction, tooth_factor) = match known {
            FactorKnowledge::AsBefore => return,
            FactorKnowledge::OfAnotherMode => (0.0, MODE_CHANGE),
            FactorKnowledge::Prior => (FRICTION_PRIOR, TOOTH_FACTOR_PRIOR),
        };
        self.covariance.add_rank_one(&Vector4::z(), T::from_f64(friction * friction));
        self.covariance.add_rank_one(&Vector4::w(), T::from_f64(tooth_factor * tooth_factor));
    }

    fn kick(&mut self, jacobian: &KickJacobian<T>) {
        let kept = T::one() + jacobian.by_rate;
        let [_, [u01, ..], [_, u12, ..], [_, u13, u23, _]] = &mut self.covariance.unit;
        *u13 = kept * *u13 + jacobian.by_friction * *u23 + jacobian.by_tooth_factor;
        *u12 = kept * *u12 + jacobian.by_friction;
        let own = [*u01, kept];
        self.merge_rate_noise(own, T::zero(), jacobian.variance_rad2_s2);
        self.widen_angle(jacobian.angle_rad2);
    }
}

impl<T: Real> KickedCovariance<T> for Carried<T, RotorCovariance<T>, 4> {
    fn rotor(&self) -> &RotorCovariance<T> {
        &self.covariance
    }

    fn doubt_factors(&mut self, known: FactorKnowledge) {
        self.both().into_iter().for_each(|covariance| covariance.doubt_factors(known));
    }

    fn kick(&mut self, jacobian: &KickJacobian<T>) {
        self.both().into_iter().for_each(|covariance| covariance.kick(jacobian));
        let (kept, o) = (T::one() + jacobian.by_rate, T::zero());
        self.turn_rate(kept, &Vector4::new(o, o, jacobian.by_friction, jacobian.by_tooth_factor));
    }
}

impl<T: Real> SmoothedCovariance<T, 4> for RotorCovariance<T> {
    fn ud_covariance(&self) -> UdCovariance<T, 4> {
        self.covariance
    }

    fn exact(&self) -> Self {
        Self { covariance: UdCovariance::known(), ..*self }
    }

    fn states(&self, rate_rad_s: T) -> Vector4<T> {
        Vector4::new(T::zero(), rate_rad_s, self.friction, self.tooth_factor)
    }
}

impl<T: Real> RotorCovariance<T> {
    /// Variances of friction and tooth factor.
    #[inline]
    pub(super) fn factor_variances(&self) -> [T; 2] {
        let ([_, _, _, [_, _, u23, _]], [_, _, d2, d3]) = (&self.covariance.unit, &self.covariance.weights);
        [*d2 + *u23 * *u23 * *d3, *d3]
    }

    /// Merges the rate's own independent error with a noise of this variance into one error, and the part of the angle
    /// that does not follow the rate. The effects of the own error on angle and rate are given; those of the noise are
    /// `noise_angle` and 1. Where the teeth stick, the rate's error has no effect on the rate after the kick and
    /// remains in the angle alone.
    #[inline]
    fn merge_rate_noise(&mut self, [own_angle, own_rate]: [T; 2], noise_angle: T, variance: T) {
        let variance = if variance > T::zero() { variance } else { T::zero() };
        let [_, [u01, ..], ..] = &mut self.covariance.unit;
        let [angle, rate, ..] = &mut self.covariance.weights;
        let by_own = own_rate * *rate;
        let sum = own_rate * by_own + variance;
        let Some(per_sum) = reciprocal(sum) else {
            *angle += own_angle * own_angle * *rate;
            (*u01, *rate) = (T::zero(), sum);
            return;
        };
        let determinant = own_angle - noise_angle * own_rate;
        // The noise's part of the sum, at most 1 as its effect on the rate is 1, comes first: however small the
        // variances are, nothing overflows.
        *angle += variance * per_sum * *rate * (determinant * determinant);
        *u01 = (own_angle * by_own + noise_angle * variance) * per_sum;
        *rate = sum;
    }

    /// Adds an independent variance to the angle.
    #[inline]
    fn widen_angle(&mut self, variance_rad2: T) {
        let [angle, ..] = &mut self.covariance.weights;
        if variance_rad2 > T::zero() {
            *angle += variance_rad2;
        }
    }

    /// Corrects friction and tooth factor; returns the corrections of angle and rate. Where a factor would leave its
    /// range, all states are the most probable ones with that factor at its bound.
    fn corrected(&mut self, mut errors: Vector4<T>) -> [T; 2] {
        let [friction, tooth_factor] = [self.friction, self.tooth_factor].map(|factor| factor - T::one());
        for (state, before, range) in [(2, friction, FRICTION_RANGE), (3, tooth_factor, TOOTH_FACTOR_RANGE)] {
            let after = before + errors.as_slice().get(state).copied().unwrap_or_default();
            let bound = after.clamp_magnitude(T::from_f64(range));
            if bound != after {
                self.covariance.constrain(state, bound - before, &mut errors);
            }
        }
        self.friction += errors.z;
        self.tooth_factor += errors.w;
        [errors.x, errors.y]
    }
}

impl<T: Real> TrackCovariance<T> for RotorCovariance<T> {
    fn begin(angle_rad2: T, rate_rad2_s2: T, before: Option<&Self>) -> Self {
        let square = |part: f64| T::from_f64(part * part);
        let (friction, tooth_factor) =
            before.map_or((T::one(), T::one()), |before| (before.friction, before.tooth_factor));
        let variances =
            Vector4::new(angle_rad2, rate_rad2_s2, square(FRICTION_PRIOR), square(TOOTH_FACTOR_PRIOR));
        Self { covariance: UdCovariance::from_diagonal(&variances), friction, tooth_factor }
    }

    #[inline]
    fn copied(&self) -> Self {
        let (one, o) = (T::one(), T::zero());
        let UdCovariance { unit: [_, [u01, ..], [u02, u12, ..], [u03, u13, u23, _]], weights } =
            self.covariance;
        let unit = [[one, o, o, o], [u01, one, o, o], [u02, u12, one, o], [u03, u13, u23, one]];
        Self { covariance: UdCovariance { unit, weights }, ..*self }
    }

    #[inline]
    fn angle_rad2(&self) -> T {
        self.covariance.variance::<0>()
    }

    #[inline]
    fn rate_rad2_s2(&self) -> T {
        self.covariance.variance::<1>()
    }

    #[inline]
    fn moments_after(&self, dt_s: T) -> [T; 3] {
        let [_, [u01, ..], [u02, u12, ..], [u03, u13, ..]] = self.covariance.unit;
        let [d0, d1, d2, d3] = self.covariance.weights;
        let [a1, a2, a3] = [u01 + dt_s, u02 + dt_s * u12, u03 + dt_s * u13];
        let [r2, r3] = [u12 * d2, u13 * d3];
        [
            d0 + a1 * a1 * d1 + a2 * a2 * d2 + a3 * a3 * d3,
            a1 * d1 + a2 * r2 + a3 * r3,
            d1 + u12 * r2 + u13 * r3,
        ]
    }

    fn predict(&mut self, dt_s: T, noise_rad2_s3: T) {
        let noise_rad2_s2 = noise_rad2_s3 * dt_s;
        let [_, [u01, ..], [u02, u12, ..], [u03, u13, ..]] = &mut self.covariance.unit;
        *u02 += dt_s * *u12;
        *u03 += dt_s * *u13;
        let own = [*u01 + dt_s, T::one()];
        self.merge_rate_noise(own, T::from_f64(0.5) * dt_s, noise_rad2_s2);
        self.widen_angle(noise_rad2_s2 * dt_s * dt_s * T::from_f64(1.0 / 12.0));
    }

    fn widen_rate(&mut self, variance_rad2_s2: T) {
        self.covariance.add_rank_one(&Vector4::y(), variance_rad2_s2);
    }

    fn kick_rate(&mut self, kept: T, variance_rad2_s2: T) {
        self.kick(&KickJacobian { by_rate: kept - T::one(), variance_rad2_s2, ..KickJacobian::default() });
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

    fn rotor(p: &Matrix4<f64>) -> RotorCovariance<f64> {
        let covariance = UdCovariance::from_covariance(p).unwrap();
        RotorCovariance { covariance, friction: 1.0, tooth_factor: 1.0 }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// A prediction and a kick against the full matrices; teeth that stick, `1 + by_rate = 0`, among them.
        #[test]
        fn dual_predictions_and_kicks_equal_the_matrices(
            p in full(), dt in 0.0..2.0_f64, q in 0.0..2.0_f64, slip in prop_oneof![Just(1.0), 0.0..1.0_f64],
            by_friction in -1.0..1.0_f64, by_tooth_factor in -1.0..1.0_f64,
            variance in prop_oneof![Just(0.0), 0.0..1.0_f64], angle_rad2 in 0.0..1.0_f64,
        ) {
            let mut moved = rotor(&p);
            moved.predict(dt, q);
            let mut f = Matrix4::identity();
            f.m12 = dt;
            let mut expected = f * p * f.transpose();
            expected.fixed_view_mut::<2, 2>(0, 0).add_assign(
                nalgebra::Matrix2::new(dt * dt / 3.0, dt / 2.0, dt / 2.0, 1.0).scale(q * dt),
            );
            prop_assert!(close(&moved.covariance.covariance(), &expected));
            let [friction2, tooth_factor2] = rotor(&p).factor_variances();
            prop_assert!((friction2 - p.m33).abs() < 1e-12 && (tooth_factor2 - p.m44).abs() < 1e-12);
            let [p11, p12, p22] = rotor(&p).moments_after(dt);
            let drifted = [
                (p11 + q * dt * dt * dt / 3.0, expected.m11),
                (p12 + q * dt * dt / 2.0, expected.m12),
                (p22 + q * dt, expected.m22),
            ];
            for (moment, expected) in drifted {
                prop_assert!((moment - expected).abs() < 1e-12 * (1.0 + expected.abs()));
            }

            let mut kicked = rotor(&p);
            let by_rate = -slip;
            let jacobian =
                KickJacobian { by_rate, by_friction, by_tooth_factor, variance_rad2_s2: variance, angle_rad2 };
            kicked.kick(&jacobian);
            let mut f = Matrix4::identity();
            (f.m22, f.m23, f.m24) = (1.0 - slip, by_friction, by_tooth_factor);
            let mut expected = f * p * f.transpose();
            expected.m22 += variance;
            expected.m11 += angle_rad2;
            prop_assert!(close(&kicked.covariance.covariance(), &expected));
            prop_assert!(kicked.covariance.weights().iter().all(|d| *d >= 0.0));

            // On the way through both, the Jacobian is their product, and the covariance is F P F' + Q.
            let mut carried = Carried::along(rotor(&p));
            carried.predict(dt, q);
            carried.kick(&jacobian);
            let mut before = Matrix4::identity();
            before.m12 = dt;
            let (jacobian, noise) = (carried.jacobian(), carried.noise.ud_covariance().covariance());
            prop_assert!(close(&jacobian, &(f * before)));
            let sum = jacobian * p * jacobian.transpose() + noise;
            prop_assert!(close(&carried.covariance.ud_covariance().covariance(), &sum));
        }

        /// Doubt adds the prior's variances of friction and tooth factor, and a change of mode its own to the latter.
        #[test]
        fn exact_doubt_widens_the_factors_alone(p in full()) {
            for (known, friction, tooth_factor) in [
                (FactorKnowledge::AsBefore, 0.0, 0.0),
                (FactorKnowledge::OfAnotherMode, 0.0, 0.01),
                (FactorKnowledge::Prior, 0.29, 0.03),
            ] {
                let mut doubted = rotor(&p);
                doubted.doubt_factors(known);
                let mut expected = p;
                expected.m33 += friction * friction;
                expected.m44 += tooth_factor * tooth_factor;
                prop_assert!(close(&doubted.covariance.covariance(), &expected));
            }
        }

        /// Teeth that nearly stick leave next to nothing of the rate's error, kick after kick: where its variance
        /// underflows in `f32`, the covariance remains finite and that of `f64`.
        #[test]
        fn dual_a_rate_variance_that_underflows_leaves_the_covariance_finite(
            rate_rad2_s2 in prop_oneof![Just(1e-30_f32), Just(1e-12), Just(1.0), Just(400.0)],
            steps in proptest::collection::vec(
                (0..4_usize, prop_oneof![Just(0.0_f32), Just(1e-36), Just(1e-20), Just(1e-6)]), 1..12),
        ) {
            let mut single = RotorCovariance::<f32>::begin(1e-8, rate_rad2_s2, None);
            let mut double = RotorCovariance::<f64>::begin(1e-8, rate_rad2_s2.into(), None);
            single.predict(1e-4, 0.0);
            double.predict(1e-4, 0.0);
            for (kind, noise) in steps {
                if let Some(kept) = [0.0_f32, f32::EPSILON, 0.5].get(kind) {
                    single.kick_rate(*kept, noise);
                    double.kick_rate((*kept).into(), noise.into());
                } else {
                    single.predict(1e-5, noise);
                    double.predict(1e-5, noise.into());
                }
                let entries = single.covariance.covariance();
                prop_assert!(entries.iter().all(|entry| entry.is_finite()), "{entries}");
                let ratio = f64::from(single.angle_rad2()) / double.angle_rad2();
                prop_assert!((0.999..1.001).contains(&ratio), "{ratio}");
            }
        }
    }

    /// A friction that would leave its range is at its bound, and the rate is the most probable one with it there: by
    /// the regression of the rate on the friction.
    #[test]
    fn exact_a_friction_out_of_range_is_at_its_bound() {
        let mut p = Matrix4::from_diagonal(&Vector4::new(1e-8, 4.0, 0.09, 1e-4));
        (p.m23, p.m32) = (0.3, 0.3);
        for (error, bound) in [(1.0, 0.6), (-1.0, -0.6), (0.5, 0.5)] {
            let mut corrected = rotor(&p);
            let [_, rate] = corrected.corrected(Vector4::new(0.0, 2.0, error, 0.0));
            assert!((corrected.friction - (1.0 + bound)).abs() < 1e-12, "{}", corrected.friction);
            let expected = 2.0 + p.m23 / p.m33 * (bound - error);
            assert!((rate - expected).abs() < 1e-12, "{rate} {expected}");
        }
    }
}
