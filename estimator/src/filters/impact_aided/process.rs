//! How angle and rate change under the kicks that the vibrometer shows.

use heapless::Deque;
use motor_model::{Real, Time};

use super::ImpactAidedTuning;
use crate::camera::angle_rate_covariance::AngleRateCovariance;
use crate::camera::process::{Jitter, Process, ReturnToMean, Wander, Wandering};
use crate::camera::track::State;
use crate::camera::track_covariance::{Carried, TrackCovariance};
use crate::filters::checkpoints::Checkpoints;
use crate::filters::kick::KickMoments;
use crate::filters::kicks_kept::IMPACTS_KEPT_MAX;
use crate::filters::mean_rate::MeanRates;
use crate::vibrometer::motion::Motion;
use crate::vibrometer::motion_history::{MotionPiece, Motions};
use crate::vibrometer::next_impact::UnseenImpacts;

/// Variance of the friction, per its nominal value squared.
const FRICTION_PART2: f64 = 0.04;

/// What an impact does to the rate.
#[derive(Clone, Copy, Debug, Default)]
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
        Self { at, half_width_rad_s: T::one(), variance_rad2_s2, ..Self::default() }
    }

    pub(super) fn apply<B: TrackCovariance<T>>(&self, state: &mut State<T, B>) {
        if self.kick_max_rad_s > T::zero() {
            let (width, limit) = (self.half_width_rad_s, self.kick_max_rad_s);
            let kick = KickMoments::new(self.tooth_rate_rad_s - state.rate_rad_s, width, limit);
            let square = |x: T| x * x;
            let variance = kick.scatter
                + square(kick.per_slip * width) * T::from_f64(1.0 / 3.0)
                + square(kick.per_limit * limit) * T::from_f64(FRICTION_PART2)
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
    pub(super) checkpoints: &'a Checkpoints<T, AngleRateCovariance<T>>,
    pub(super) motions: Motions<'a>,
    pub(super) mean_rates: &'a MeanRates<T>,
    /// Since when kicks are taken; before that the rate wanders as in [`crate::ConstantRate`].
    pub(super) taken_since: Time,
    pub(super) unseen: UnseenImpacts<'a, T>,
}

impl<T: Real> Wander<T> for KickedRate<'_, T> {
    /// While impacts are detected and kicks are taken only the kicks of those that are missed make the rate wander, and
    /// after the newest sample those of the impacts that may come.
    fn wandering(&self, at: Time, resting: bool) -> Wandering<T> {
        let mut piece = self.motions.piece(at);
        if let Some(known) = self.known(&mut piece, at) {
            return known;
        }
        self.tuning.constant_rate.random_walk.wandering(&piece, at, resting)
    }

    fn returning(&self, at: Time, resting: bool) -> Option<ReturnToMean<T>> {
        let random_walk = &self.tuning.constant_rate.random_walk;
        let mut piece = Some(self.motions.piece(at)).filter(|_| random_walk.returns(resting))?;
        if self.known(&mut piece, at).is_some() {
            return None;
        }
        Some(self.mean_rates.returning(&piece, at, random_walk.wandering(&piece, at, resting)))
    }

    /// If there are no kicks. A rotor that lies still is not kicked.
    fn only_wanders(&self, at: Time, resting: bool) -> bool {
        let kicked = self.kicks.back().is_some_and(|kick| kick.at > at);
        !kicked || resting && self.motions.throughout(at) == Motion::Quiet
    }
}

impl<T: Real> KickedRate<'_, T> {
    /// How the rate wanders right after `at` in `piece` where all kicks are known but those that are missed. Where they
    /// are not, the piece ends when they are taken.
    #[inline]
    fn known(&self, piece: &mut MotionPiece, at: Time) -> Option<Wandering<T>> {
        let mut known = self.unseen.wandering_in(piece, self.taken_since, at)?;
        let [missed_b, missed_c] = self.tuning.missed_rad2_s3;
        known.intensity_rad2_s3 += piece.motion.of(missed_b, missed_c, T::zero());
        Some(known)
    }

    /// Carries the state to `until`, through the kicks up to it.
    fn through_kicks<B: TrackCovariance<T>>(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        if !self.only_wanders(state.at, resting) {
            self.pass_kicks(state, resting, until);
        }
        self.wander(state, resting, until);
    }

    /// Index of the first kick after `from`. Most are older than the track, so it counts from the newest.
    pub(super) fn first_after(&self, from: Time) -> usize {
        self.kicks.len() - self.kicks.iter().rev().take_while(|kick| kick.at > from).count()
    }

    /// Carries the state through the kicks until `until`, up to the last of them.
    #[inline(never)]
    fn pass_kicks<B: TrackCovariance<T>>(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        for index in self.first_after(state.at)..self.kicks.len() {
            let Some(kick) = self.kicks.get(index).filter(|kick| kick.at <= until) else { break };
            self.wander(state, resting, kick.at);
            kick.apply(state);
        }
    }

    /// What is added to the variances of an estimate at `at`.
    fn unstated(&self, at: Time) -> Jitter<T> {
        let motion = self.motions.piece(at).motion;
        if at > self.unseen.known_until && !self.unseen.covers(at) {
            return self.tuning.constant_rate.random_walk.jitter(motion);
        }
        // The part of the kicks under mode C that the next kick undoes.
        let of_c = Jitter { angle_rad2: T::from_f64(4e-10), rate_rad2_s2: T::from_f64(1.2e-3) };
        let undone = motion.of(Jitter::none(), of_c, Jitter::none());
        self.tuning.between_samples(motion, at, self.unseen.known_until).plus(undone)
    }
}

impl<T: Real> Process<T> for KickedRate<'_, T> {
    fn carry(&self, state: &mut State<T>, resting: bool, until: Time) {
        self.through_kicks(state, resting, until);
    }

    fn carry_track(&self, state: &mut State<T>, resting: bool, until: Time) {
        self.checkpoints.go_on(state, resting, until);
        self.through_kicks(state, resting, until);
    }

    fn jitter(&self, at: Time) -> Jitter<T> {
        self.unstated(at)
    }
}

impl<T: Real> Process<T, Carried<T, AngleRateCovariance<T>, 2>> for KickedRate<'_, T> {
    fn carry(&self, state: &mut State<T, Carried<T, AngleRateCovariance<T>, 2>>, resting: bool, until: Time) {
        self.through_kicks(state, resting, until);
    }

    fn jitter(&self, at: Time) -> Jitter<T> {
        self.unstated(at)
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, AngleAccumulator, DriveCommand, DriveMode, MotorParams};

    use super::*;
    use crate::camera::angle_rate_covariance::AngleRateCovariance;
    use crate::instruments::Instruments;
    use crate::vibrometer::next_impact::tests::flying;

    fn exact_state() -> State<f64> {
        State {
            at: Time::from_micros(1000),
            angle: AngleAccumulator::at(Angle::ZERO),
            rate_rad_s: 0.0,
            covariance: AngleRateCovariance::diagonal(0.0, 0.0),
        }
    }

    /// Friction that could give far more than the slip takes the rotor to the tooth: its rate is the tooth's, uniform
    /// over twice the half width `w`, of variance `w^2 / 3`, and the further variance.
    #[test]
    fn exact_a_rotor_that_sticks_has_the_tooth_s_rate() {
        let kick = ImpactKick {
            at: Time::from_micros(1000),
            tooth_rate_rad_s: 2.0,
            half_width_rad_s: 0.6,
            kick_max_rad_s: 50.0,
            variance_rad2_s2: 0.01,
        };
        let mut state = exact_state();
        state.covariance = AngleRateCovariance::diagonal(0.0, 9.0);
        kick.apply(&mut state);
        let variance = TrackCovariance::rate_rad2_s2(&state.covariance);
        assert!((state.rate_rad_s - 2.0).abs() < 1e-12, "{}", state.rate_rad_s);
        assert!((variance - (0.6 * 0.6 / 3.0 + 0.01)).abs() < 1e-12, "{variance}");
    }

    /// All impacts are known until 3 ms, and a flight is believed for 0.2 ms more. Until 3 ms only missed impacts make
    /// the rate wander, and after the flight all, with the jitter of their kicks. In between a rotor that falls fast
    /// onto the teeth is struck by 4000 kicks of 3.5 rad/s in a second, and one high above by a two-hundredth of that.
    #[test]
    fn exact_the_rate_wanders_by_the_impacts_that_may_come() {
        let tuning = ImpactAidedTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default());
        let [missed, _] = tuning.missed_rad2_s3;
        let walk = &tuning.constant_rate.random_walk;
        let high = flying(tuning.detector, Time::from_micros(3000), 0.03).moved(1e-4, 0.1);
        for (detector, ahead) in [(high, 240.0), (high.moved(0.0, -0.1), 48_000.0)] {
            let drive = DriveCommand::full(DriveMode::B);
            let process = KickedRate {
                tuning: &tuning,
                kicks: &ImpactKicks::new(),
                checkpoints: &Checkpoints::none(),
                motions: Motions::always(Motion::Impacted(DriveMode::B)),
                mean_rates: &MeanRates::new(),
                taken_since: Time::ZERO,
                unseen: tuning.next_impact.unseen(&detector, drive, true),
            };
            let mut state = exact_state();
            process.wander(&mut state, false, Time::from_micros(4200));
            let expected = 2.2e-3 * missed + 0.2e-3 * ahead + 1e-3 * walk.impacted_b_rad2_s3;
            let own = TrackCovariance::rate_rad2_s2(&state.covariance);
            assert!((own / expected - 1.0).abs() < 1e-9, "{own} {expected}");
            let jitter = |micros| Process::<f64>::jitter(&process, Time::from_micros(micros));
            assert_eq!((jitter(3000), jitter(3199)), (Jitter::none(), Jitter::none()));
            assert_eq!(jitter(3200), walk.jitter_b);
        }
    }
}
