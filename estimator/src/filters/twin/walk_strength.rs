//! How strongly the rate wanders where no kicks are taken, per what motors of this design do: learnt from the frames.
//!
//! With the camera alone, kicks are a random walk of the rate ([`crate::ConstantRate`]). Its intensity is that of a
//! rotor that keeps level. Where impacts or frames contradict the kicks, the rotor is another one: one that tilts
//! spends a part of each impact on the tilt, and its rate wanders up to thirty times less. A filter that expects too
//! strong a walk follows the camera's noise and turns back in the next frames. The mean of neighbouring innovations is
//! smaller then than that of white ones. `T_1` is its square per its variance
//! ([`crate::camera::innovation_correlation`]):
//!
//! ```text
//! w <- w (1 + g (min(T_1, 8) - T_w)),   1/32 <= w <= 1,   g = 1 / (32 n): 0.1 s,   n: 3.2 ms of frames       (F19)
//! ```
//!
//! w rests where the mean of `T_1` is `T_w`. That would be 1 for a white walk. Real kicks undo a part of each other, so
//! that the best filter with a walk still turns back a little: `T_w = 0.75`. Each mode of the drive has its own
//! strength. It multiplies intensity and jitter of the walk. A walk that is stronger than expected is not believed: the
//! camera may shake.

use motor_model::Real;

use crate::vibrometer::motion::Motion;

/// What one frame counts, per its share in the mean of its neighbours.
const FRAME_PART: f64 = 1.0 / 32.0;
/// Most that a frame counts.
const SQUARE_MAX: f64 = 8.0;
/// Mean of `T_1` at which the strength rests: found by simulation of level and of tilting rotors.
const SETTLED_SQUARE: f64 = 0.75;
/// Least strength.
const LEAST: f64 = 1.0 / 32.0;

/// Strength of the walk under modes B and C.
#[derive(Clone, Copy, Debug)]
pub(super) struct WalkStrength<T> {
    b: T,
    c: T,
}

impl<T: Real> WalkStrength<T> {
    /// That of a motor whose rotor keeps level.
    pub(super) fn expected() -> Self {
        Self { b: T::one(), c: T::one() }
    }

    /// The strength under `motion`; 1 without drive.
    #[inline]
    pub(super) fn under(&self, motion: Motion) -> T {
        motion.of(self.b, self.c, T::one())
    }

    /// Takes in a frame that was predicted by the walk alone: `square` is its `T_1`, `per_neighbours` its share in the
    /// mean.
    #[inline]
    pub(super) fn learn(&mut self, motion: Motion, square: T, per_neighbours: T) {
        let Some(strength) = motion.of(Some(&mut self.b), Some(&mut self.c), None) else { return };
        let most = T::from_f64(SQUARE_MAX);
        // Compared this way round, so that NaN counts as large.
        let square = if square < most { square } else { most };
        let learnt = *strength
            * (T::one() + T::from_f64(FRAME_PART) * per_neighbours * (square - T::from_f64(SETTLED_SQUARE)));
        let (least, one) = (T::from_f64(LEAST), T::one());
        let learnt = if learnt < one { learnt } else { one };
        *strength = if learnt < least { least } else { learnt };
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveMode, math};
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;
    use crate::camera::angle_rate_covariance::AngleRateCovariance;
    use crate::camera::innovation_correlation::InnovationCorrelation;
    use crate::camera::track_covariance::TrackCovariance as _;
    use crate::camera::track_tuning::TrackTuning;

    const B: Motion = Motion::Impacted(DriveMode::B);

    /// Mean strength over the last two of five seconds of frames of a rate that wanders `strength` times as the filter
    /// expects.
    fn learnt(strength: f64) -> f64 {
        let tuning = TrackTuning::<f64>::default();
        let (dt_s, walk_rad2_s3, camera_rad2) = (1e-4, 3200.0, tuning.camera_rad2);
        let mut rng = Pcg64::seed_from_u64(3);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (mut truth, mut estimate) = ([0.0; 2], [0.0; 2]);
        let mut covariance = AngleRateCovariance::diagonal(camera_rad2, 1.0);
        let (mut walk, mut correlation) = (WalkStrength::expected(), InnovationCorrelation::white());
        let mut mean = 0.0;
        for frame in 0..50_000 {
            for angle_rate in [&mut truth, &mut estimate] {
                angle_rate[0] += dt_s * angle_rate[1];
            }
            truth[1] += math::sqrt(strength * walk_rad2_s3 * dt_s) * normal();
            covariance.predict(dt_s, walk.under(B) * walk_rad2_s3);
            let innovation = truth[0] + math::sqrt(camera_rad2) * normal() - estimate[0];
            correlation.take(innovation, 1.0 / (covariance.angle_rad2() + camera_rad2), &tuning);
            let [angle, rate] = covariance.update_angle(camera_rad2);
            estimate[0] += angle * innovation;
            estimate[1] += rate * innovation;
            walk.learn(B, correlation.last_square.take().unwrap(), tuning.per_neighbours);
            mean += if frame >= 30_000 { walk.under(B) / 20_000.0 } else { 0.0 };
        }
        mean
    }

    /// The strength of a white walk is found from above, since `T_w` leaves it larger: up to three times. The standard
    /// deviation of the angle goes with its power of 1/8, and so is 15 % too large at most.
    #[test]
    fn law_the_strength_of_a_white_walk_is_found() {
        for strength in [1.0, 0.25, 1.0 / 16.0] {
            let found = learnt(strength);
            assert!(found <= 1.0 && (0.9..3.0).contains(&(found / strength)), "{strength}: {found}");
        }
    }

    #[test]
    fn exact_strengths_are_bounded_and_of_their_mode() {
        let mut walk = WalkStrength::<f32>::expected();
        (0..200_000).for_each(|_| walk.learn(B, 0.0, 1.0 / 32.0));
        assert!((walk.under(B) - 1.0 / 32.0).abs() < 1e-9);
        let one = |walk: &WalkStrength<f32>, motion| (walk.under(motion) - 1.0).abs() < f32::MIN_POSITIVE;
        assert!([Motion::Impacted(DriveMode::C), Motion::Quiet].into_iter().all(|motion| one(&walk, motion)));
        (0..200_000).for_each(|_| walk.learn(B, f32::NAN, 1.0 / 32.0));
        assert!(one(&walk, B));
    }
}
