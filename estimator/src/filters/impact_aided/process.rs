//! How angle and rate change under the kicks that the vibrometer shows.

use heapless::Deque;
use motor_model::{Real, Time};

use super::{IMPACTS_KEPT_MAX, ImpactAidedTuning};
use crate::camera::process::{Jitter, Process, Wander, Wandering};
use crate::camera::track::State;
use crate::camera::track_covariance::TrackCovariance;
use crate::filters::kick::KickMoments;
use crate::vibrometer::motion::Motion;
use crate::vibrometer::motion_history::{MotionPiece, Motions};

/// Variance of the friction, per its nominal value squared.
const FRICTION_PART2: f64 = 0.04;

/// What an impact does to the rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct ImpactKick<T> {
    pub(super) at: Time,
    /// Rate of the tooth, towards which friction drives the rotor, in rad/s.
    pub(super) tooth_rate_rad_s: T,
    /// Half the width of its uniform distribution, in rad/s.
    pub(super) half_width_rad_s: T,
    /// Largest kick, `c dv`, in rad/s; 0 where the sign is unknown.
    pub(super) kick_max_rad_s: T,
    /// Further variance of the kick, in rad^2/s^2.
    pub(super) variance_rad2_s2: T,
}

impl<T: Real> ImpactKick<T> {
    pub(super) fn unknown(at: Time, variance_rad2_s2: T) -> Self {
        Self {
            at,
            tooth_rate_rad_s: T::zero(),
            half_width_rad_s: T::one(),
            kick_max_rad_s: T::zero(),
            variance_rad2_s2,
        }
    }

    pub(super) fn apply<B: TrackCovariance<T>>(&self, state: &mut State<T, B>) {
        if self.kick_max_rad_s > T::zero() {
            let kick = KickMoments::new(
                self.tooth_rate_rad_s - state.rate_rad_s,
                self.half_width_rad_s,
                self.kick_max_rad_s,
            );
            let square = |x: T| x * x;
            let variance = kick.scatter
                + square(kick.per_slip * self.half_width_rad_s) * T::from_f64(1.0 / 3.0)
                + square(kick.per_limit * self.kick_max_rad_s) * T::from_f64(FRICTION_PART2)
                + self.variance_rad2_s2;
            state.rate_rad_s += kick.mean;
            state.covariance.kick_rate(T::one() - kick.per_slip, variance);
        } else {
            state.covariance.widen_rate(self.variance_rad2_s2);
        }
    }
}

/// The kicks since the oldest frame kept, in the order of time.
pub(super) type ImpactKicks<T> = Deque<ImpactKick<T>, IMPACTS_KEPT_MAX>;

pub(super) struct KickedRate<'a, T> {
    pub(super) tuning: &'a ImpactAidedTuning<T>,
    pub(super) kicks: &'a ImpactKicks<T>,
    pub(super) motions: Motions<'a>,
    /// Until when impacts would have been detected.
    pub(super) detecting_until: Time,
}

impl<T: Real> Wander<T> for KickedRate<'_, T> {
    /// While impacts are detected only the kicks of those that are missed make the rate wander.
    fn wandering(&self, at: Time, resting: bool) -> Wandering<T> {
        let MotionPiece { motion, until, .. } = self.motions.piece(at);
        let [missed_b, missed_c] = self.tuning.missed_rad2_s3;
        let missed_rad2_s3 = motion.of(missed_b, missed_c, T::zero());
        if motion != Motion::Quiet && at < self.detecting_until {
            return Wandering { intensity_rad2_s3: missed_rad2_s3, until: until.min(self.detecting_until) };
        }
        let random_walk = &self.tuning.constant_rate.random_walk;
        Wandering { intensity_rad2_s3: random_walk.intensity_rad2_s3(motion, resting), until }
    }

    /// If there are no kicks. A rotor that lies still is not kicked.
    fn only_wanders(&self, at: Time, resting: bool) -> bool {
        let kicked = self.kicks.back().is_some_and(|kick| kick.at > at);
        !kicked || resting && self.motions.throughout(at) == Motion::Quiet
    }
}

impl<T: Real> KickedRate<'_, T> {
    /// Carries the state through the kicks until `until`, up to the last of them.
    #[inline(never)]
    fn pass_kicks<B: TrackCovariance<T>>(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        let from = state.at;
        // Most are older than the track: counted from the newest.
        let newer = self.kicks.iter().rev().take_while(|kick| kick.at > from).count();
        for index in self.kicks.len() - newer..self.kicks.len() {
            let Some(kick) = self.kicks.get(index).filter(|kick| kick.at <= until) else { break };
            self.wander(state, resting, kick.at);
            kick.apply(state);
        }
    }
}

impl<T: Real, B: TrackCovariance<T>> Process<T, B> for KickedRate<'_, T> {
    fn carry(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        if !self.only_wanders(state.at, resting) {
            self.pass_kicks(state, resting, until);
        }
        self.wander(state, resting, until);
    }

    fn jitter(&self, at: Time) -> Jitter<T> {
        let motion = self.motions.piece(at).motion;
        if at > self.detecting_until {
            return self.tuning.constant_rate.random_walk.jitter(motion);
        }
        let undone = motion.of(Jitter::none(), self.tuning.jitter_c, Jitter::none());
        self.tuning.unseen(motion, at, self.detecting_until).plus(undone)
    }
}
