//! The filter with impacts: angle and rate from the camera, instants and sizes of the kicks of the rate from the
//! vibrometer.
//!
//! | index | symbol | unit | meaning | prior |
//! |---|---|---|---|---|
//! | 0 | angle | rad | rotation of the rotor | first frame, its variance R |
//! | 1 | rate | rad/s | angular rate | 0, standard deviation 20 rad/s |
//!
//! ```text
//! angle' = rate,   rate' = 0
//! at an impact of jump dv:   rate+ = rate + kick,   |kick| <= c dv,   c = mu m_r R_t / J        (13c)
//! ```
//!
//! Between impacts the filter therefore knows the rate as well as the frames since the last impact determine it: drag
//! takes a millionth of it in a second. At each impact the rate changes by a mean kick and becomes less certain.
//!
//! # The kick
//!
//! Friction acts on the slip and at most stops it: `kick = clamp(S - rate, -c dv, c dv)`, with the tooth's tangential
//! rate `S = s' / R_t`. The jump gives the tooth's *vertical* velocity, since restitution is known (F8).
//!
//! - Mode B: S follows from the tooth's rise and from what the earlier impacts of the train have left in the other
//!   modes ([`ringing`]). It is taken as uniform within a width of that value, so the mean kick and its slope are known
//!   ([`crate::filters::kick`]). Where the teeth stick, the rate afterwards is that of the tooth. The friction is
//!   uniform in 0.2 to 0.6, and its error is the same at every impact of a motor: counted at 0.04 of its square.
//! - Mode C moves the teeth by 2 um, no more than what impacts leave in A and B. So neither the pair that impacts is
//!   known nor the sign of the slip, and 80 % of the kicks are at their bound. The mean is 0 and the variance 0.68 of
//!   `(c dv)^2` (0.95 in drawn motors, but neighbouring kicks undo a part of each other: the jitter).
//! - Drive off: S is 0 within what the rise of the tooth allows, so friction brakes the rotor and does not accelerate
//!   it.
//!
//! Jumps below the detector's threshold accompany those that it finds: `dv^2` in the variance is `dv^2 + threshold^2`,
//! and between impacts the rate wanders a little.
//!
//! # Late frames, lost samples
//!
//! The impacts since the oldest frame kept are kept, as many as the camera needs ([`super::kicks_kept`]). A frame is
//! fused at its exposure, through the impacts before it. One impact more drops the frames before the oldest impact. The
//! track after all kicks is kept beside, so that an estimate of the present passes none of them. Where a frame is
//! followed by many, the track passes a few of them with each sample ([`super::checkpoints`]).
//!
//! ```text
//!                    sample                            what it does to the rate
//!   impact           jump dv upwards                   kick of mean and variance above
//!   fall             jump downwards: a wrong sample    kick of unknown sign, as large as the fall
//!   none yet         an instant after the newest       random walk while an impact can come (F20)
//!   gap              first sample after a gap          random walk over the gap, as in ConstantRate
//!   fault ends       sign or scale right again         kick of unknown sign right after the last frame
//!   not taken        before the first frame, or where  random walk until kicks are taken, as in ConstantRate
//!                    the rotor tilts
//! ```
//!
//! # A rotor that tilts
//!
//! Its kicks are not those above, and its pin strikes it without a jump. Impacts at heights that no tooth reaches show
//! it ([`impact_heights`]), or frames that pull the estimate one way: then no kicks are taken for a while, and the rate
//! wanders as by the camera alone ([`crate::filters::kick_use`]).

mod impact_heights;
mod kick_use;
mod process;
pub(crate) mod ringing;
#[cfg(feature = "tell")]
mod told;
mod tuning;

use heapless::Deque;
use motor_model::{DriveCommand, DriveMode, Real, Time};

use crate::camera::angle_rate_covariance::AngleRateCovariance;
use crate::camera::process::Process;
use crate::camera::track::{Place, State};
use crate::camera::tracker::{FrameContext, Tracker};
use crate::filters::checkpoints::{Checkpoints, KICKS_PER_SAMPLE};
use crate::filters::kick_use::KickUse;
use crate::filters::kicks_kept::kicks_kept;
use crate::filters::mean_rate::MeanRates;
use crate::vibrometer::impact_detector::{ImpactDetector, VibrometerEvent};
use crate::vibrometer::motion::MotionWatch;
use crate::{
    AngleFilter, CameraFrame, Estimate, Health, ImpactInnovation, Innovation, LdvSample, Motion, Reason,
};
use impact_heights::ImpactHeights;
use process::{ImpactKick, ImpactKicks, KickedRate};
use ringing::Ringing;
#[cfg(feature = "tell")]
pub use told::SignedKick;
#[cfg(feature = "tell")]
use told::ToldSigns;
pub use tuning::ImpactAidedTuning;

/// Time after which the ringing of an impact has decayed: two time constants of mode C.
const RINGING_NANOS: u64 = 6_000_000;

/// Time after which the rate has forgotten what it was, in s: a longer gap makes it no less certain.
pub(crate) const RATE_MEMORY_S: f64 = 12e-3;

/// Longest spacing of two samples in s at which the phase of the ringing is known: a third of a radian of mode C.
const SAMPLE_SPACING_MAX_S: f64 = 7e-6;

/// Jump per threshold of the detector from which an impact is no false alarm, though the vibrometer were half as noisy
/// again as described.
const SURE_THRESHOLDS: f64 = 1.5;

/// Half the width of the distribution of the tooth's rate under mode B, in rad/s, without the change by ringing between
/// two samples.
const TOOTH_WIDTH_RAD_S: f64 = 1.0;

/// The filter with impacts from the vibrometer.
#[derive(Clone, Debug)]
pub struct ImpactAided<T> {
    tuning: ImpactAidedTuning<T>,
    watch: MotionWatch<T>,
    detector: ImpactDetector<T>,
    tracker: Tracker<T>,
    kicks: ImpactKicks<T>,
    kick_use: KickUse,
    mean_rates: MeanRates<T>,
    heights: ImpactHeights<T>,
    /// The track after all kicks; `None` if there are none after the last frame.
    propagated: Option<State<T>>,
    /// The track after the last frame, on its way through the kicks since; `propagated` is then that before the frame.
    renewed: Option<State<T>>,
    checkpoints: Checkpoints<T, AngleRateCovariance<T>>,
    ringing: Ringing<T>,
    /// From when on all impacts that still ring have been detected.
    ringing_known_from: Time,
    #[cfg(feature = "tell")]
    told: ToldSigns<T>,
}

/// How angle and rate change up to `$now`. It is no method: the tracker changes while the process is in use.
macro_rules! process {
    ($filter:ident, $now:expr) => {
        KickedRate {
            tuning: &$filter.tuning,
            kicks: &$filter.kicks,
            checkpoints: &$filter.checkpoints,
            motions: $filter.watch.motions($now),
            mean_rates: &$filter.mean_rates,
            taken_since: $filter.kick_use.since,
            unseen: {
                let (detector, drive) = (&$filter.detector, $filter.watch.applied);
                $filter.tuning.next_impact.unseen(detector, drive, $filter.kick_use.taken)
            },
        }
    };
}

impl<T: Real> ImpactAided<T> {
    /// A filter without measurements.
    pub fn new(tuning: &ImpactAidedTuning<T>) -> Self {
        Self {
            tuning: *tuning,
            watch: MotionWatch::new(&tuning.constant_rate.rest),
            detector: ImpactDetector::new(tuning.detector),
            tracker: Tracker::new(tuning.constant_rate.track),
            kicks: Deque::new(),
            kick_use: KickUse::new(),
            mean_rates: MeanRates::new(),
            heights: ImpactHeights::new(),
            propagated: None,
            renewed: None,
            checkpoints: Checkpoints::none(),
            ringing: Ringing::default(),
            ringing_known_from: Time::ZERO,
            #[cfg(feature = "tell")]
            told: ToldSigns::default(),
        }
    }

    /// Uses the noise of the vibrometer that was learnt at rest.
    #[cold]
    fn use_learnt_noise(&mut self) {
        self.tuning = self.tuning.with_noise(self.watch.noise_m_s());
        self.detector.set_noise(self.tuning.detector.noise_m_s);
    }

    /// The kick of an impact detected at `at`, `within_s` after the sample before it.
    fn impact_kick(&mut self, at: Time, within_s: T, before_m_s: T, jump_m_s: T) -> ImpactKick<T> {
        let tuning = &self.tuning;
        let rise_m_s = before_m_s + jump_m_s * tuning.approach_per_jump;
        let tooth = self.ringing.impact(&tuning.ringing, at, rise_m_s, jump_m_s);
        let kick_max_rad_s = tuning.kick_per_jump_rad_m * jump_m_s;
        let missed_rad_s = tuning.kick_per_jump_rad_m * self.detector.threshold_m_s();
        let missed_rad2_s2 = missed_rad_s * missed_rad_s;
        let bound_rad2_s2 = kick_max_rad_s * kick_max_rad_s + missed_rad2_s2;
        // Until it has decayed, the ringing of an impact at an uncertain instant is uncertain.
        if within_s > T::from_f64(SAMPLE_SPACING_MAX_S) {
            self.ringing_known_from = at.plus_nanos(RINGING_NANOS);
        }
        let (tooth_rate_rad_s, half_width_rad_s, variance_rad2_s2) = match self.watch.applied.mode() {
            Some(DriveMode::B) => {
                let turned_rad_s = T::from_f64(0.5) * within_s * tooth.slope_rad_s2;
                let known = at >= self.ringing_known_from;
                let variance_rad2_s2 = if known { T::zero() } else { tuning.unexplained_b * bound_rad2_s2 };
                (tooth.rate_rad_s, T::from_f64(TOOTH_WIDTH_RAD_S) + turned_rad_s, variance_rad2_s2)
            }
            Some(DriveMode::C) => return ImpactKick::unknown(at, tuning.unexplained * bound_rad2_s2),
            None => {
                let swing_m_s = before_m_s.abs() + jump_m_s * tuning.approach_per_jump;
                (T::zero(), T::from_f64(1.2) * tuning.turn_per_rise_rad_m * swing_m_s, missed_rad2_s2)
            }
        };
        ImpactKick { at, tooth_rate_rad_s, half_width_rad_s, kick_max_rad_s, variance_rad2_s2 }
    }

    /// Takes in a detection other than continued flight. `before` is when the last sample was taken.
    #[inline(never)]
    fn take_detection(&mut self, sample: &LdvSample, detection: VibrometerEvent<T>, before: Option<Time>) {
        match detection {
            VibrometerEvent::Flight => (),
            VibrometerEvent::Rejected => {
                // The watch has started again: the samples before had wrong times.
                self.detector.start_again();
                self.kick_use.rewind(sample.taken_at);
                self.heights = ImpactHeights::new();
                while self.kicks.pop_back_if(|kick| kick.at >= sample.taken_at).is_some() {}
                (self.propagated, self.renewed) = (None, None);
                self.checkpoints.begin(self.tracker.place());
                let VibrometerEvent::Gap(seconds) = self.detector.observe(sample) else { return };
                self.random_walk_over_gap(sample.taken_at, seconds);
            }
            // The weight of a rotor that lies on the teeth makes it.
            VibrometerEvent::Impact { .. } if self.watch.settled(sample.taken_at) => (),
            VibrometerEvent::Impact { before_m_s, jump_m_s, height_m } => {
                let within_s = before.map_or(T::zero(), |before| sample.taken_at.seconds_since(before));
                let reach_m = self.tuning.reach_m + T::from_f64(2.0) * within_s * jump_m_s;
                let sure = jump_m_s > T::from_f64(SURE_THRESHOLDS) * self.detector.threshold_m_s();
                if !self.detector.has_fault() && self.heights.show_tilt(height_m, reach_m, sure) {
                    self.review_kick_use(sample.taken_at, true);
                }
                if !self.detector.has_fault() && self.kick_use.taken {
                    let kick = self.impact_kick(sample.taken_at, within_s, before_m_s, jump_m_s);
                    #[cfg(feature = "tell")]
                    let kick = self.of_told_sign(kick, jump_m_s);
                    self.record_kick(kick);
                }
            }
            VibrometerEvent::Fall { drop_m_s } => {
                // The wrong sample before may have been taken for an impact as large as the fall.
                let kick_rad_s = self.tuning.kick_per_jump_rad_m * drop_m_s;
                self.forget_ringing(sample.taken_at);
                self.record_kick(ImpactKick::unknown(sample.taken_at, kick_rad_s * kick_rad_s));
            }
            VibrometerEvent::Gap(seconds) => self.random_walk_over_gap(sample.taken_at, seconds),
        }
    }

    /// After a gap of `seconds` up to `at` the rate is as uncertain as after a random walk.
    fn random_walk_over_gap(&mut self, at: Time, seconds: T) {
        let intensity = self.tuning.constant_rate.random_walk.intensity_rad2_s3(self.watch.motion(at), false);
        self.forget_ringing(at);
        self.tracker.forget_neighbours();
        let seconds = seconds.at_most(T::from_f64(RATE_MEMORY_S));
        self.record_kick(ImpactKick::unknown(at, intensity * seconds));
    }

    /// A fault of the vibrometer has ended at `at`: what contradicted the kicks before was the fault's.
    #[cold]
    fn end_fault(&mut self, at: Time) {
        self.heights = ImpactHeights::new();
        self.tracker.forget_neighbours();
        self.kick_use.forgive();
        self.kick_use.since = at;
        self.resume_detection(at);
    }

    /// The vibrometer is right again at `at`, or kicks are taken again: those since the last frame are not known.
    #[cold]
    fn resume_detection(&mut self, at: Time) {
        let Some(from) = self.tracker.track().map(|track| track.state.at) else { return };
        self.forget_ringing(at);
        // Right after that frame, so that the prediction of a frame exposed since is not too certain.
        let start = self.kicks.back().map_or(from, |kick| kick.at.max(from)).plus_nanos(1);
        self.record_kick(ImpactKick::unknown(start, self.tuning.constant_rate.track.kick_rad2_s2));
    }

    /// The ringing of the impacts before `at` is not known.
    fn forget_ringing(&mut self, at: Time) {
        self.ringing = Ringing::default();
        self.ringing_known_from = at.plus_nanos(RINGING_NANOS);
    }

    /// Keeps a kick. One that becomes known only after a later frame has been fused acts right after that frame.
    fn record_kick(&mut self, mut kick: ImpactKick<T>) {
        let Some(track) = self.tracker.track() else {
            self.kick_use.since = kick.at;
            return;
        };
        kick.at = kick.at.max(track.state.at.plus_nanos(1));
        if let Some(oldest) = self.kicks.front().map(|kick| kick.at)
            && self.kicks.len() >= kicks_kept(self.tuning.slow_camera)
        {
            self.tracker.advance_to(oldest, &process!(self, self.watch.clock()));
            self.checkpoints.follow(self.tracker.place());
            self.drop_old_kicks();
        }
        // Not full: the oldest kicks were dropped above.
        let _ = self.kicks.push_back(kick);
        self.propagate();
    }

    /// Carries the track, or what it was carried to before, through the kicks since.
    fn propagate(&mut self) {
        let newest = self.kicks.back().map(|kick| kick.at);
        let Some((track, newest)) = self.tracker.track().zip(newest) else { return };
        let (mut state, resting) = (self.propagated.unwrap_or(track.state), track.resting);
        if newest > state.at {
            process!(self, self.watch.clock()).carry(&mut state, resting, newest);
            self.propagated = Some(state);
            if self.tuning.slow_camera && self.renewed.is_none() {
                self.checkpoints.pass(&state);
            }
        }
    }

    /// Carries the track, which a frame has moved to `place`, through the kicks since. With a slow camera they may be
    /// many: then some now, the others with the next samples.
    fn renew(&mut self, place: Place<T>) {
        if self.tuning.slow_camera {
            self.checkpoints.begin(place);
            self.renewed =
                self.tracker.track().map(|track| track.state).filter(|_| self.propagated.is_some());
            if self.renewed.is_some() {
                return self.go_on();
            }
        }
        self.propagated = None;
        self.propagate();
    }

    /// Carries the track that a frame has moved through the next kicks.
    #[cold]
    #[inline(never)]
    fn go_on(&mut self) {
        let Some((mut state, track)) = self.renewed.take().zip(self.tracker.track()) else { return };
        let process = process!(self, self.watch.clock());
        let last = process.first_after(state.at) + KICKS_PER_SAMPLE - 1;
        let until = self.kicks.get(last).or(self.kicks.back()).map(|kick| kick.at);
        let done = last + 1 >= self.kicks.len();
        if let Some(until) = until.filter(|&until| until > state.at) {
            process.carry(&mut state, track.resting, until);
        }
        if done {
            self.propagated = (state.at > track.state.at).then_some(state);
        } else {
            self.checkpoints.keep(&state);
            self.renewed = Some(state);
        }
    }

    /// Drops the kicks that no frame can go back to.
    fn drop_old_kicks(&mut self) {
        let Some(at) = self.tracker.horizon() else { return };
        while self.kicks.pop_front_if(|kick| kick.at <= at).is_some() {}
    }
}

impl<T: Real> AngleFilter<T> for ImpactAided<T> {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        self.watch.drive(at, command);
        self.review_kick_use(at, false);
        if self.tuning.constant_rate.random_walk.returns_to_mean {
            self.mean_rates.note_drive(at, command);
        }
        if command.mode().is_some() {
            self.tracker.end_rest();
        }
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<ImpactInnovation<T>> {
        #[cfg(feature = "tell")]
        self.told.pass(sample.taken_at);
        if self.watch.observe(sample) {
            let (before, had_fault) = (self.detector.newest, self.detector.has_fault());
            let sample = &self.detector.scaled(&self.watch.corrected(sample));
            let detection = self.detector.observe(sample);
            if had_fault && !self.detector.has_fault() {
                self.end_fault(sample.taken_at);
            }
            if !matches!(detection, VibrometerEvent::Flight) {
                self.take_detection(sample, detection, before);
            }
            if self.renewed.is_some() {
                self.go_on();
            }
        }
        None
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T> {
        let clock = self.watch.clock();
        let process = process!(self, clock.max(frame.exposed_at));
        let from = self.tracker.newest_at().min(frame.exposed_at);
        let (motion, disputed) = (process.motions.throughout(from), self.watch.disputes_quiet(clock));
        let context = FrameContext { clock, quiet: motion == Motion::Quiet, disputed };
        let before = self.tracker.place();
        let innovation = self.tracker.update(frame, context, &process);
        let contradicted = self.tracker.take_contradiction();
        self.review_kick_use(clock, contradicted);
        self.watch.note_rest(self.tracker.is_resting(), self.tracker.newest_at(), clock);
        if self.tuning.constant_rate.random_walk.returns_to_mean {
            let begun = self.watch.motions(clock).piece(clock).begun;
            let mode = self.watch.applied.mode().filter(|_| !self.kick_use.taken);
            self.mean_rates.note_frame(&innovation, mode, begun);
        }
        if self.watch.noise_m_s() != self.tuning.detector.noise_m_s {
            self.use_learnt_noise();
        }
        self.drop_old_kicks();
        let place = self.tracker.place();
        if place != before {
            self.renew(place);
        }
        innovation
    }

    fn estimate(&self, now: Time) -> Option<Estimate<T>> {
        let process = process!(self, now);
        match self.propagated.as_ref().filter(|propagated| propagated.at <= now) {
            Some(propagated) => self.tracker.estimate_from(propagated, now, &process),
            None => self.tracker.estimate(now, &process),
        }
    }

    fn smoothed(&self, at: Time) -> Option<Estimate<T>> {
        self.tracker.smoothed(at, &process!(self, self.watch.clock().max(at)))
    }

    fn assess_for(&self, now: Time, instant: Time) -> (Option<Estimate<T>>, Health) {
        let silent = self.watch.silent(now).then_some(Reason::VibrometerSilent);
        let estimate = self.estimate(instant);
        let unexplained = (!self.kick_use.taken).then_some(Reason::ImpactsUnexplained);
        let health =
            self.tracker.judge(estimate.as_ref(), now, silent.or(self.detector.fault).or(unexplained));
        (estimate, health)
    }
}

#[cfg(test)]
mod late_frame_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod without_drive_tests;
