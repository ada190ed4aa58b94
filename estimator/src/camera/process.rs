//! How angle and rate change between frames: by kicks, and between them the rate wanders.
//!
//! ```text
//! angle' = rate,   rate' = white noise of intensity q(t),   q constant piece by piece
//! ```
//!
//! Each filter brings a [`Process`] of its own. A state that only wanders is predicted in closed form, without the
//! factors of its covariance ([`State::predicted`]): that is what an estimate of the present costs at every tick.

use motor_model::{Real, Time};

use crate::camera::angle_rate_covariance::AngleRateCovariance;
use crate::camera::track::State;
use crate::camera::track_covariance::TrackCovariance;
use crate::filter::Estimate;

/// Variances of the part of angle and rate that changes faster than frames can show. They are added to the variances of
/// every estimate, of the present and of the past: a filter with white process noise takes every innovation as evidence
/// of a rate that persists, and kicks that soon undo each other do not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jitter<T> {
    /// Variance of the angle's part, in rad^2.
    pub angle_rad2: T,
    /// Variance of the rate's part, in rad^2/s^2.
    pub rate_rad2_s2: T,
}

impl<T: Real> Jitter<T> {
    pub(crate) fn times(self, factor: T) -> Self {
        Self { angle_rad2: self.angle_rad2 * factor, rate_rad2_s2: self.rate_rad2_s2 * factor }
    }

    pub(crate) fn plus(self, other: Self) -> Self {
        let Self { angle_rad2, rate_rad2_s2 } = other;
        Self { angle_rad2: self.angle_rad2 + angle_rad2, rate_rad2_s2: self.rate_rad2_s2 + rate_rad2_s2 }
    }

    /// Zero: the states hold all motion.
    pub fn none() -> Self {
        Self { angle_rad2: T::zero(), rate_rad2_s2: T::zero() }
    }
}

/// A piece of a random walk of the rate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wandering<T> {
    /// Its intensity, in rad^2/s^3.
    pub(crate) intensity_rad2_s3: T,
    /// Until when it has this intensity. Where the rate returns to a mean it has none: the piece ends where it begins.
    pub(crate) until: Time,
}

/// A piece in which the rate returns to a mean: `rate' = (mean - rate) / T`, beside its random walk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReturnToMean<T> {
    pub(crate) walk: Wandering<T>,
    pub(crate) mean_rad_s: T,
    /// `1 / T`.
    pub(crate) per_s: T,
    /// `T / 3`, the longest step unless the time is longer than [`Self::STEPS_MAX`] of them.
    pub(crate) third_nanos: u64,
}

impl<T: Real> ReturnToMean<T> {
    /// Most steps of a time.
    const STEPS_MAX: u64 = 16;

    /// Carries `state` to `until`, or to its end.
    fn carry<B: TrackCovariance<T>>(&self, state: &mut State<T, B>, until: Time) {
        let until = until.min(self.walk.until);
        let step_nanos = self.third_nanos.max(until.nanos_since(state.at) / Self::STEPS_MAX);
        while until > state.at {
            let next = until.min(state.at.plus_nanos(step_nanos));
            let x: T = next.seconds_since::<T>(state.at) * self.per_s;
            // exp(-x) to third order in x, and positive for any x.
            let kept = T::one() / (T::one() + x + T::from_f64(0.5) * x * x);
            state.propagate(next, self.walk.intensity_rad2_s3);
            state.rate_rad_s = self.mean_rad_s + (state.rate_rad_s - self.mean_rad_s) * kept;
            state.covariance.kick_rate(kept, T::zero());
        }
    }
}

/// How the rate wanders between kicks. `resting` is whether the rotor lies still.
pub(crate) trait Wander<T: Real> {
    /// The random walk right after `at`.
    fn wandering(&self, at: Time, resting: bool) -> Wandering<T>;

    /// The piece right after `at` in which the rate returns to a mean, if it does.
    fn returning(&self, _at: Time, _resting: bool) -> Option<ReturnToMean<T>> {
        None
    }

    /// Whether the rate only wanders from `at` on, without kicks.
    fn only_wanders(&self, at: Time, resting: bool) -> bool;

    /// Propagates `state` to `until`, if that is later.
    fn wander<B: TrackCovariance<T>>(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        let wandering = self.wandering(state.at, resting);
        if wandering.until >= until {
            state.propagate(until, wandering.intensity_rad2_s3);
        } else {
            self.wander_on(state, resting, until);
        }
    }

    /// The same through several pieces, or while the rate returns to a mean.
    #[cold]
    #[inline(never)]
    fn wander_on<B: TrackCovariance<T>>(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        while state.at < until {
            if let Some(returning) = self.returning(state.at, resting) {
                returning.carry(state, until);
            } else {
                let wandering = self.wandering(state.at, resting);
                state.propagate(until.min(wandering.until), wandering.intensity_rad2_s3);
            }
        }
    }
}

/// How angle and rate change between frames.
pub(crate) trait Process<T: Real, B: TrackCovariance<T> = AngleRateCovariance<T>>: Wander<T> {
    /// Propagates `state` to `until`, if that is later. `resting` is whether the rotor lies still.
    fn carry(&self, state: &mut State<T, B>, resting: bool, until: Time);

    /// As [`Self::carry`], of the track, which may have been carried a part of the way already.
    fn carry_track(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        self.carry(state, resting, until);
    }

    /// A state between `state` and `until` that has been propagated already; `state` itself, if there is none.
    fn cached_state<'a>(&'a self, state: &'a State<T, B>, _resting: bool, _until: Time) -> &'a State<T, B> {
        state
    }

    /// What is added to the variances of an estimate at `at`.
    fn jitter(&self, at: Time) -> Jitter<T>;

    /// What `state` has become at `until`.
    fn predict(&self, state: &State<T, B>, resting: bool, until: Time) -> Estimate<T> {
        let wandering = self.wandering(state.at, resting);
        if wandering.until >= until && self.only_wanders(state.at, resting) {
            state.predicted(until, wandering.intensity_rad2_s3, resting)
        } else {
            self.predict_by_carrying(state, resting, until)
        }
    }

    /// The same by carrying a copy.
    #[cold]
    #[inline(never)]
    fn predict_by_carrying(&self, state: &State<T, B>, resting: bool, until: Time) -> Estimate<T> {
        let mut ahead = state.copied();
        self.carry(&mut ahead, resting, until);
        ahead.predicted(until, T::zero(), resting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use motor_model::{Angle, AngleAccumulator};
    use proptest::prelude::*;

    /// A walk of one intensity until 1 s, and of another from then on.
    struct TwoPieces([f64; 2]);

    impl Wander<f64> for TwoPieces {
        fn wandering(&self, at: Time, _resting: bool) -> Wandering<f64> {
            let (change, never) = (Time::from_nanos(1_000_000_000), Time::from_nanos(u64::MAX));
            let [first, then] = self.0;
            if at < change {
                Wandering { intensity_rad2_s3: first, until: change }
            } else {
                Wandering { intensity_rad2_s3: then, until: never }
            }
        }

        fn only_wanders(&self, _at: Time, _resting: bool) -> bool {
            true
        }
    }

    impl Process<f64> for TwoPieces {
        fn carry(&self, state: &mut State<f64>, resting: bool, until: Time) {
            self.wander(state, resting, until);
        }

        fn jitter(&self, _at: Time) -> Jitter<f64> {
            Jitter::none()
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// A prediction in closed form and one through the factors, within a piece and from one to the next.
        #[test]
        fn dual_a_prediction_equals_the_state_carried(
            from in 0..2_000_000_000_u64, to in 0..3_000_000_000_u64, rate in -1.0..1.0_f64,
            walks in [0.0..1e3_f64, 0.0..1e3_f64], p in [1e-8..1.0_f64, 1e-4..1e2_f64], before in 0.0..1.0_f64,
        ) {
            let process = TwoPieces(walks);
            let mut covariance = AngleRateCovariance::diagonal(p[0], p[1]);
            covariance.predict(before, walks[0]);
            let angle = AngleAccumulator::at(Angle::ZERO);
            let mut state = State { at: Time::from_nanos(from), angle, rate_rad_s: rate, covariance };
            let until = Time::from_nanos(to);
            let predicted = process.predict(&state, false, until);
            process.carry(&mut state, false, until);
            let expected = state.covariance.moments_after(0.0);
            // Two units of an angle, 2^-32 turn each.
            let off: f64 = predicted.angle.radians_since(state.angle.angle());
            prop_assert!(off.abs() < 3e-9 && predicted.rate_rad_s.to_bits() == rate.to_bits());
            let moments = [predicted.angle_rad2, predicted.angle_rate_rad2_s, predicted.rate_rad2_s2];
            for (moment, expected) in moments.into_iter().zip(expected) {
                prop_assert!((moment - expected).abs() <= 1e-9 * expected.abs(), "{moment} {expected}");
            }
        }
    }
}
