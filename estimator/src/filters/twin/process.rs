//! The rotor filter's prediction from frame to frame: through the kicks, with process noise between them.

use motor_model::{Real, Time};

use super::kick_record::{KickRecords, RotorState};
use super::rotor::{KickedCovariance, RotorCovariance};
use super::tuning::TwinTuning;
use super::walk_strength::WalkStrength;
use crate::camera::process::{Jitter, Process, ReturnToMean, Wander, Wandering};
use crate::camera::track::State;
use crate::camera::track_covariance::Carried;
use crate::filters::checkpoints::{Checkpoints, KICKS_PER_SAMPLE};
use crate::filters::mean_rate::MeanRates;
use crate::vibrometer::motion::Motion;
use crate::vibrometer::motion_history::{MotionPiece, Motions};
use crate::vibrometer::next_impact::UnseenImpacts;

/// Prediction of angle and rate under the kicks of the stator filter.
pub(super) struct TwinProcess<'a, T> {
    pub(super) tuning: &'a TwinTuning<T>,
    pub(super) kicks: &'a KickRecords<T>,
    pub(super) checkpoints: &'a Checkpoints<T, RotorCovariance<T>>,
    pub(super) motions: Motions<'a>,
    pub(super) mean_rates: &'a MeanRates<T>,
    /// Strength of the walk without kicks.
    pub(super) strength: &'a WalkStrength<T>,
    /// Since when kicks are taken; before that the rate wanders as in [`crate::ConstantRate`].
    pub(super) taken_since: Time,
    /// The impacts after the newest sample; where nothing is known of them the rate wanders as in
    /// [`crate::ConstantRate`].
    pub(super) unseen: UnseenImpacts<'a, T>,
    /// A prediction made before, from which a later one can go on.
    pub(super) propagated: Option<&'a PropagatedTrack<T>>,
}

/// The process of a filter up to an instant; it goes on from a propagated track, if any. A macro borrows no more than
/// the fields that it names, so that the tracker can change meanwhile.
macro_rules! twin_process {
    ($filter:ident, $until:expr, $propagated:expr) => {{
        let next_impact = &$filter.tuning.without_stator.next_impact;
        $crate::filters::twin::process::TwinProcess {
            tuning: &$filter.tuning,
            kicks: &$filter.kicks,
            checkpoints: &$filter.checkpoints,
            motions: $filter.watch.motions($until),
            mean_rates: &$filter.mean_rates,
            strength: &$filter.walk,
            taken_since: $filter.kick_use.since,
            unseen: next_impact.unseen(&$filter.detector, $filter.drive, $filter.kick_use.taken),
            propagated: $propagated,
        }
    }};
}
pub(super) use twin_process;

/// The track after all kicks known, so that an estimate of the present costs no more after many kicks than after one.
///
/// The newest kick may still be refined, so the track before it is kept too. Each kick is applied under the motion in
/// which it came.
#[derive(Clone, Copy, Debug)]
pub(super) struct PropagatedTrack<T> {
    /// Time of the track from which it was propagated, and whether the rotor rested there.
    pub(super) from: Time,
    pub(super) resting: bool,
    /// Before the newest kick, and after it.
    pub(super) before_newest: RotorState<T>,
    pub(super) state: RotorState<T>,
}

impl<T: Real> PropagatedTrack<T> {
    /// Whether it lies on the prediction of a track from `from` to `until`.
    pub(super) fn serves(&self, from: Time, until: Time, resting: bool) -> bool {
        self.from == from && self.state.at <= until && self.resting == resting
    }
}

impl<T: Real> Wander<T> for TwinProcess<'_, T> {
    /// While impacts are detected and kicks are taken the rate wanders only by the impacts that may come after the
    /// newest sample.
    #[inline]
    fn wandering(&self, at: Time, resting: bool) -> Wandering<T> {
        let mut piece = self.motions.piece(at);
        if let Some(known) = self.unseen.wandering_in(&mut piece, self.taken_since, at) {
            return known;
        }
        self.by_the_camera(&piece, at, resting)
    }

    fn returning(&self, at: Time, resting: bool) -> Option<ReturnToMean<T>> {
        let random_walk = &self.tuning.without_stator.constant_rate.random_walk;
        let mut piece = Some(self.motions.piece(at)).filter(|_| random_walk.returns(resting))?;
        if self.unseen.wandering_in(&mut piece, self.taken_since, at).is_some() {
            return None;
        }
        Some(self.mean_rates.returning(&piece, at, self.by_the_camera(&piece, at, resting)))
    }

    /// If there are no kicks.
    #[inline]
    fn only_wanders(&self, at: Time, _resting: bool) -> bool {
        self.kicks.back().is_none_or(|kick| kick.at <= at)
    }
}

impl<T: Real> TwinProcess<'_, T> {
    /// The random walk right after `at` in `piece` where kicks are not known.
    #[inline]
    fn by_the_camera(&self, piece: &MotionPiece, at: Time, resting: bool) -> Wandering<T> {
        let mut walk = self.tuning.without_stator.constant_rate.random_walk.wandering(piece, at, resting);
        walk.intensity_rad2_s3 *= self.strength.under(piece.motion);
        walk
    }

    fn is_after(&self, kick: usize, at: Time) -> bool {
        self.kicks.get(kick).is_some_and(|kick| kick.at > at)
    }

    /// Index of the first kick after `from`, found from the newest backwards, since most are older.
    fn first_after(&self, from: Time) -> usize {
        let newer = self.kicks.iter().rev().take_while(|kick| kick.at > from).count();
        self.kicks.len() - newer
    }

    /// Predicts to a kick and applies it, unless the rotor lies still.
    fn predict_through<B: KickedCovariance<T>>(&self, state: &mut State<T, B>, resting: bool, kick: usize) {
        if let Some(kick) = self.kicks.get(kick)
            && !(resting && self.motions.throughout(state.at) == Motion::Quiet)
        {
            self.wander(state, resting, kick.at);
            kick.apply(state);
        }
    }

    /// The track `state`, propagated through all kicks; `None` if there are none after it.
    pub(super) fn propagate(&self, state: &RotorState<T>, resting: bool) -> Option<PropagatedTrack<T>> {
        let first = self.first_after(state.at);
        let newest = self.kicks.len().checked_sub(1).filter(|&newest| newest >= first)?;
        let mut before_newest = state.copied();
        (first..newest).for_each(|kick| self.predict_through(&mut before_newest, resting, kick));
        Some(self.with_newest(state.at, resting, &before_newest))
    }

    /// Carries `state` through the next kicks, as many as a sample passes but not the newest; whether that is the next.
    /// A rotor that lies still takes none of them.
    pub(super) fn go_on(&self, state: &mut RotorState<T>, resting: bool) -> bool {
        if resting && self.motions.throughout(state.at) == Motion::Quiet {
            return true;
        }
        let (first, newest) = (self.first_after(state.at), self.kicks.len().saturating_sub(1));
        let mut next = first;
        // Kicks of one instant are passed together: the next ones are found by the instant.
        while next < newest && (next < first + KICKS_PER_SAMPLE || !self.is_after(next, state.at)) {
            self.predict_through(state, resting, next);
            next += 1;
        }
        next >= newest
    }

    /// The track that is propagated `from` an instant on: it stands `before` the newest kick, which is applied.
    pub(super) fn with_newest(
        &self,
        from: Time,
        resting: bool,
        before: &RotorState<T>,
    ) -> PropagatedTrack<T> {
        let mut state = before.copied();
        if let Some(newest) = self.kicks.len().checked_sub(1) {
            self.predict_through(&mut state, resting, newest);
        }
        PropagatedTrack { from, resting, before_newest: before.copied(), state }
    }

    /// Predicts through all kicks up to `until`, and to it.
    fn through_kicks<B: KickedCovariance<T>>(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        (self.first_after(state.at)..self.kicks.len())
            .take_while(|&kick| self.kicks.get(kick).is_some_and(|kick| kick.at <= until))
            .for_each(|kick| self.predict_through(state, resting, kick));
        self.wander(state, resting, until);
    }

    /// What is added to the variances of an estimate at `at`.
    fn unstated(&self, at: Time) -> Jitter<T> {
        let (motion, tuning) = (self.motions.piece(at).motion, &self.tuning.without_stator);
        if at > self.unseen.known_until && !self.unseen.covers(at) {
            return tuning.constant_rate.random_walk.jitter(motion).times(self.strength.under(motion));
        }
        tuning.between_samples(motion, at, self.unseen.known_until)
    }
}

impl<T: Real> Process<T, RotorCovariance<T>> for TwinProcess<'_, T> {
    fn carry(&self, state: &mut RotorState<T>, resting: bool, until: Time) {
        self.through_kicks(state, resting, until);
    }

    fn carry_track(&self, state: &mut RotorState<T>, resting: bool, until: Time) {
        self.checkpoints.go_on(state, resting, until);
        self.through_kicks(state, resting, until);
    }

    #[inline]
    fn cached_state<'a>(&'a self, state: &'a RotorState<T>, resting: bool, until: Time) -> &'a RotorState<T> {
        let propagated = self.propagated.filter(|propagated| propagated.serves(state.at, until, resting));
        propagated.map_or(state, |propagated| &propagated.state)
    }

    fn jitter(&self, at: Time) -> Jitter<T> {
        self.unstated(at)
    }
}

impl<T: Real> Process<T, Carried<T, RotorCovariance<T>, 4>> for TwinProcess<'_, T> {
    fn carry(&self, state: &mut State<T, Carried<T, RotorCovariance<T>, 4>>, resting: bool, until: Time) {
        self.through_kicks(state, resting, until);
    }

    fn jitter(&self, at: Time) -> Jitter<T> {
        self.unstated(at)
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, AngleAccumulator, DriveCommand, DriveMode, MotorParams};

    use super::super::kick_record::KickRecord;
    use super::*;
    use crate::camera::angle_rate_covariance::AngleRateCovariance;
    use crate::camera::track_covariance::TrackCovariance as _;
    use crate::instruments::Instruments;
    use crate::vibrometer::impact_detector::ImpactDetector;
    use crate::vibrometer::next_impact::tests::flying;

    /// At 1 ms.
    fn exact_state<B>(covariance: B) -> State<f64, B> {
        let angle = AngleAccumulator::at(Angle::ZERO);
        State { at: Time::from_micros(1000), angle, rate_rad_s: 0.0, covariance }
    }

    /// What a process refers to. All impacts are known until 4 ms, and a flight is believed for 0.2 ms more.
    struct Known {
        tuning: TwinTuning<f64>,
        detector: ImpactDetector<f64>,
        kicks: KickRecords<f64>,
        checkpoints: Checkpoints<f64, RotorCovariance<f64>>,
        mean_rates: MeanRates<f64>,
        strength: WalkStrength<f64>,
    }

    impl Known {
        /// With a kick at each of these times in us.
        fn with_kicks(micros: impl IntoIterator<Item = u64>) -> Self {
            let tuning = TwinTuning::<f64>::new(&MotorParams::nominal(), &Instruments::default());
            let mut kicks = KickRecords::new();
            for at in micros {
                kicks.push_back(KickRecord::of_unknown_sign(Time::from_micros(at), 1.0)).unwrap();
            }
            Self {
                detector: flying(tuning.detector, Time::from_micros(4000), 0.03),
                tuning,
                kicks,
                checkpoints: Checkpoints::none(),
                mean_rates: MeanRates::new(),
                strength: WalkStrength::expected(),
            }
        }

        fn process(&self, motion: Motion, drive: DriveCommand, taken_since: Time) -> TwinProcess<'_, f64> {
            TwinProcess {
                tuning: &self.tuning,
                kicks: &self.kicks,
                checkpoints: &self.checkpoints,
                motions: Motions::always(motion),
                mean_rates: &self.mean_rates,
                strength: &self.strength,
                taken_since,
                unseen: self.tuning.without_stator.next_impact.unseen(&self.detector, drive, true),
                propagated: None,
            }
        }
    }

    /// Kicks are taken from 2 ms on. The rate wanders for 1 ms before, and for 1 ms after the flight is no longer
    /// believed. Between them only kicks change it, and those that may come: a rotor that falls fast onto the teeth is
    /// struck by 4000 of 3.5 rad/s in a second, one high above by a two-hundredth.
    #[test]
    fn exact_the_rate_wanders_where_kicks_are_not_known() {
        let mut known = Known::with_kicks([]);
        let walk = known.tuning.without_stator.constant_rate.random_walk;
        let high = known.detector.moved(1e-4, 0.1);
        for (detector, ahead) in [(high, 240.0), (high.moved(0.0, -0.1), 48_000.0)] {
            known.detector = detector;
            let (mode, since) = (DriveMode::B, Time::from_micros(2000));
            let process = known.process(Motion::Impacted(mode), DriveCommand::full(mode), since);
            let mut state = exact_state(AngleRateCovariance::diagonal(0.0, 0.0));
            process.wander(&mut state, false, Time::from_micros(5200));
            let expected = 2e-3 * walk.impacted_b_rad2_s3 + 0.2e-3 * ahead;
            let own = state.covariance.rate_rad2_s2();
            assert!((own / expected - 1.0).abs() < 1e-9, "{own} {expected}");
            let unstated = |micros| process.unstated(Time::from_micros(micros));
            assert_eq!((unstated(4000), unstated(4199)), (Jitter::none(), Jitter::none()));
            assert_eq!(unstated(4200), walk.jitter_b);
        }
    }

    /// A kick moves a rotor that slides on quiet teeth, and not one that lies still there.
    #[test]
    fn exact_a_rotor_that_lies_still_is_not_kicked() {
        let known = Known::with_kicks([1500]);
        let process = known.process(Motion::Quiet, DriveCommand::OFF, Time::ZERO);
        let walk = &known.tuning.without_stator.constant_rate.random_walk;
        for (resting, kick, per_s) in [(true, 0.0, walk.resting_rad2_s3), (false, 1.0, walk.sliding_rad2_s3)]
        {
            let mut state = exact_state(RotorCovariance::begin(0.0, 0.0, None));
            process.through_kicks(&mut state, resting, Time::from_micros(2000));
            let (own, expected) = (state.covariance.rate_rad2_s2(), kick + 1e-3 * per_s);
            assert!((own - expected).abs() < 1e-9 * (kick + expected), "{resting}: {own} {expected}");
        }
    }

    /// Of 40 kicks a sample passes 32; a rotor that lies still takes none, and is done at once.
    #[test]
    fn exact_a_rotor_that_lies_still_has_no_kicks_to_pass() {
        let known = Known::with_kicks(1500..1540);
        let process = known.process(Motion::Quiet, DriveCommand::OFF, Time::ZERO);
        for (resting, done, reached) in [(true, true, 1000), (false, false, 1531)] {
            let mut state = exact_state(RotorCovariance::begin(0.0, 0.0, None));
            assert_eq!(process.go_on(&mut state, resting), done);
            assert_eq!(state.at, Time::from_micros(reached));
        }
    }

    /// With a slow camera the rate that wanders without kicks returns to the mean of its drive, and with kicks to none.
    #[test]
    fn exact_without_kicks_the_rate_returns_to_the_mean_of_its_drive() {
        let mut known = Known::with_kicks([]);
        known.tuning.without_stator.constant_rate.random_walk.returns_to_mean = true;
        let (mode, since, until) = (DriveMode::B, Time::from_micros(3000), Time::from_micros(4000));
        let process = known.process(Motion::Impacted(mode), DriveCommand::full(mode), since);
        let mut state = exact_state(RotorCovariance::begin(0.0, 0.0, None));
        process.wander(&mut state, false, until);
        // Two of twelve milliseconds of the way to 16 rad/s.
        let x: f64 = 2.0 / 12.0;
        let expected = 16.0 * (1.0 - 1.0 / (1.0 + x + 0.5 * x * x));
        assert!((state.rate_rad_s - expected).abs() < 1e-9, "{} {expected}", state.rate_rad_s);
        let variance = state.covariance.rate_rad2_s2();
        process.wander(&mut state, false, until);
        assert_eq!(state.covariance.rate_rad2_s2().to_bits(), variance.to_bits());
    }
}
