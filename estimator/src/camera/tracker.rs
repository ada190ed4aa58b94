//! Which frames are used, in which order, and what explains a refusal. Every filter of angle and rate shares this code.
//!
//! ```text
//! update
//!   exposed after the filter's clock .................. refuse_for_time: Future
//!   camera stuck, same code ........................... refused: Stuck
//!   newer than all frames: process_newest
//!       the turn is lost .............................. restart, turn unknown
//!       a quiet rotor is beyond where it slides to .... restart, turn unknown
//!       within the gate: accept ....................... used; at rest refused: Repeated, or restart: moved
//!           equal codes of a driven rotor ............. refused: Stuck
//!       beyond the gate: explain_or_refuse
//!           an earlier outlier or a kick explains it .. accept
//!           refusals_max in a row that agree .......... restart; a jolt explains it, or the reference is lost
//!           otherwise ................................. refused: Gate
//!   older: process_late
//!       this exposure is kept already ................. refused: Duplicate
//!       before the oldest frame kept .................. refuse_for_time: OutOfHorizon
//!       otherwise ..................................... process_newest, of it and of all newer frames again
//! refuse_for_time ...................................... refused; after refusals_max in a row restart
//! ```
//!
//! A frame is fused at its exposure, however late it arrives: [`lag`]. A frame beyond the gate is refused and changes
//! neither the estimate nor its variance, unless the frames around it show that an outlier came before or that the
//! rotor was kicked: [`hypotheses`]. What the angle counts from after a restart: [`mod@reference`]. A camera that shows
//! one code for ever: [`stuck`].

#![expect(clippy::inline_always, reason = "a call copies the frame's record, at the cost of an update")]

mod estimate;
mod hypotheses;
mod lag;
mod reference;
mod silence;
mod stuck;

use heapless::Deque;
use motor_model::{Angle, Real, Time};

use crate::camera::angle_rate_covariance::AngleRateCovariance;
use crate::camera::innovation_correlation::InnovationCorrelation;
use crate::camera::noise::CameraNoise;
use crate::camera::persistent_error::PersistentError;
use crate::camera::process::{Jitter, Process};
use crate::camera::rest_test::RestTest;
use crate::camera::track::{Place, Track};
use crate::camera::track_covariance::TrackCovariance;
use crate::camera::track_tuning::TrackTuning;
use crate::innovation::{Innovation, Rejection, Source, Verdict};
use crate::measurement::{CLOCK_TOLERANCE_NANOS, CameraFrame};
use hypotheses::Fit;
use reference::Reference;
use silence::Intervals;
use stuck::Stuck;

/// Frames kept, so that a late one can be fused in its place: 3.1 ms at 10,000 frames a second.
pub const FRAMES_KEPT: usize = 32;

/// What the filter knows when a frame arrives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameContext {
    /// The filter's clock: the latest time that drive and vibrometer have reported.
    pub(crate) clock: Time,
    /// Whether the rotor lies on the teeth.
    pub(crate) quiet: bool,
    /// Whether the vibrometer shows that it moves all the same.
    pub(crate) disputed: bool,
}

/// A frame, and the track after it.
#[derive(Clone, Copy, Debug)]
struct TrackedFrame<T, B> {
    frame: CameraFrame,
    track: Track<T, B>,
}

impl<T: Real, B: TrackCovariance<T>> TrackedFrame<T, B> {
    /// A copy, field by field: on a microcontroller a copy as a whole is a call of `memcpy` that costs as much as an
    /// update.
    fn copied(&self) -> Self {
        Self { frame: CameraFrame { ..self.frame }, track: self.track.copied() }
    }
}

/// The track after the last frames.
#[derive(Clone, Debug)]
pub(crate) struct Tracker<T, B = AngleRateCovariance<T>> {
    tuning: TrackTuning<T>,
    /// Whether a frame has come.
    begun: bool,
    /// The newest frame.
    newest: TrackedFrame<T, B>,
    /// What no number of frames removes of the estimates that follow from it. Kept, since every tick asks for it.
    persistent: Jitter<T>,
    /// Those before it, by exposure.
    older: Deque<TrackedFrame<T, B>, { FRAMES_KEPT - 1 }>,
    reference: Reference<T, B>,
    stuck: Option<Stuck>,
    /// Whether the rotor has been driven since a frame last brought another code.
    driven: bool,
    rest_test: RestTest<T>,
    noise: CameraNoise<T>,
    persistent_error: PersistentError<T>,
    correlation: InnovationCorrelation<T>,
    intervals: Intervals,
}

impl<T: Real, B: TrackCovariance<T>> Tracker<T, B> {
    /// Mean normalised innovation squared above which the gate is narrower after a refusal: two refusals above the
    /// usual.
    const NIS_DOUBTED: f64 = 2.0;

    /// Variance of an innovation, per that of the camera, beyond which a gap between frames has made the prediction a
    /// guess. The next frames' is far smaller, so that a mean of both would be of the first alone.
    const GUESS_VARIANCE: f64 = 100.0;

    /// The narrower gate of a moving rotor right after a refusal: outliers come in bursts, and one of them may lie
    /// within the wide gate by chance.
    const GATE_AFTER_REFUSAL: f64 = 16.0;

    // Built in its place: by a call a copy of it would be made, of 3.5 kB of a microcontroller's stack.
    #[inline(always)]
    pub(crate) fn new(tuning: TrackTuning<T>) -> Self {
        let tuning = tuning.validated();
        let frame = CameraFrame::new(Time::ZERO, Angle::ZERO);
        Self {
            tuning,
            begun: false,
            newest: TrackedFrame { frame, track: Track::started(&frame, Angle::ZERO, None, &tuning) },
            persistent: Jitter::none(),
            older: Deque::new(),
            reference: Reference::new(),
            stuck: None,
            driven: false,
            rest_test: RestTest::default(),
            noise: CameraNoise::new(&tuning.camera),
            persistent_error: PersistentError::default(),
            correlation: InnovationCorrelation::white(),
            intervals: Intervals::default(),
        }
    }

    pub(crate) fn is_resting(&self) -> bool {
        self.newest.track.resting
    }

    /// Time of the last frame used; zero before the first.
    pub(crate) fn newest_at(&self) -> Time {
        self.newest.track.state.at
    }

    /// The rotor is driven: it may move, however short the drive and however long the time to the next frame.
    pub(crate) fn end_rest(&mut self) {
        self.driven = true;
        if self.newest.track.still {
            self.newest.track.end_rest();
            self.rest_test = RestTest::default();
            self.persistent = self.persistent_of(&self.newest.track);
        }
        if let Some(TrackedFrame { track, .. }) = &mut self.reference.trusted {
            track.end_rest();
        }
    }

    /// Whether the frames have contradicted the process since this was last asked.
    pub(crate) fn take_contradiction(&mut self) -> bool {
        let coloured = self.correlation.is_coloured();
        if coloured {
            self.correlation = InnovationCorrelation::white();
        }
        coloured
    }

    /// The innovations so far tell nothing of the process from now on.
    pub(crate) fn forget_neighbours(&mut self) {
        self.correlation = InnovationCorrelation::white();
    }

    /// Square of the mean of neighbouring innovations per its variance, and the share of the last frame in that mean.
    /// `None` unless that frame was used and showed a motion.
    pub(crate) fn take_neighbours(&mut self) -> Option<(T, T)> {
        self.correlation.last_square.take().map(|square| (square, self.tuning.per_neighbours))
    }

    /// The track at the last frame used; `None` before the first.
    pub(crate) fn track(&self) -> Option<&Track<T, B>> {
        self.begun.then_some(&self.newest.track)
    }

    /// Where the track is: a frame that leaves it there leaves all of the track's state.
    pub(crate) fn place(&self) -> Place<T> {
        Place::new(&self.newest.track.state, self.newest.track.resting)
    }

    /// The earliest time from which the track may have to be carried again, after a late frame.
    pub(crate) fn horizon(&self) -> Option<Time> {
        let oldest = self.reference.trusted.as_ref().or(self.older.front()).unwrap_or(&self.newest);
        self.begun.then_some(oldest.track.state.at)
    }

    /// Drops the frames from before `limit`, because the kicks until then are dropped. Tracks that are older are
    /// carried to `limit`.
    pub(crate) fn advance_to(&mut self, limit: Time, process: &impl Process<T, B>) {
        while self.older.pop_front_if(|tracked| tracked.track.state.at < limit).is_some() {}
        let track = &mut self.newest.track;
        process.carry(&mut track.state, track.resting, limit);
        self.persistent = self.persistent_of(&self.newest.track);
        self.reference.carry(limit, process);
    }

    /// Takes in a frame; what became of it.
    pub(crate) fn update(
        &mut self,
        frame: &CameraFrame,
        context: FrameContext,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        let innovation = self.take(frame, context, process);
        self.persistent = self.persistent_of(&self.newest.track);
        innovation
    }

    #[inline(always)]
    fn take(
        &mut self,
        frame: &CameraFrame,
        FrameContext { clock, quiet, disputed }: FrameContext,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        if !self.begun {
            return self.begin(frame, Angle::ZERO);
        }
        let (at, last_at, track_at) = (frame.exposed_at, self.newest.frame.exposed_at, self.newest_at());
        let in_order = at > last_at && at > track_at;
        let timely = at <= clock || at.is_within(CLOCK_TOLERANCE_NANOS.into(), clock);
        if clock > track_at && !timely {
            return self.refuse_for_time(frame, Rejection::Future);
        }
        self.intervals.take(in_order.then_some(last_at), at, clock);
        if quiet && self.noise.take(frame, &mut self.tuning) {
            self.rest_test.begin();
        }
        self.rest_test.disputed = disputed;
        if self.stuck.is_some() && self.still_stuck(frame, quiet) {
            return refused(frame, (T::zero(), T::zero()), Rejection::Stuck);
        }
        if in_order {
            self.process_newest(frame, quiet, process)
        } else {
            self.process_late(frame, quiet, process)
        }
    }

    /// Predicts, gates and fuses a frame newer than all others.
    #[inline(always)]
    fn process_newest(
        &mut self,
        frame: &CameraFrame,
        quiet: bool,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        if self.older.is_full() {
            self.older.pop_front();
        }
        // Not full: one was removed above.
        let _ = self.older.push_back(self.newest.copied());
        self.newest.frame = *frame;
        let track = &mut self.newest.track;
        track.kicked = false;
        process.carry_track(&mut track.state, track.resting, frame.exposed_at);
        let predicted = track.state.angle.angle();
        let innovation_rad = track.state.innovation_rad(frame.angle);
        let variance_rad2 = track.state.covariance.innovation_rad2(self.tuning.frame_rad2(
            frame,
            track.state.rate_rad_s,
            quiet,
        ));
        let normalised = innovation_rad * innovation_rad * (T::one() / variance_rad2);
        // Written so that NaN and a variance that has overflowed fail both. A rotor that was quiet since the last frame
        // has not turned round, however little is known of its rate, unless it is beyond where it slides to.
        let turn_known = variance_rad2
            <= T::from_f64(if quiet { f64::from(f32::MAX) } else { Reference::<T, B>::LOST_RAD2 });
        let near = normalised <= T::from_f64(Self::GATE_AFTER_REFUSAL);
        let trusted = near || quiet || track.refusals == 0 || track.nis <= T::from_f64(Self::NIS_DOUBTED);
        let plausible = normalised <= self.tuning.gate && trusted;
        let innovation = (innovation_rad, variance_rad2);
        let known = turn_known && !(quiet && plausible && self.has_strayed(frame, variance_rad2));
        if !known {
            // The first frame's turn is zero by definition.
            self.reference.turn_known &= !self.reference.begun;
            self.begin(frame, predicted)
        } else if !plausible {
            self.explain_or_refuse(innovation, predicted, quiet, process)
        } else if self.newest.track.refusals >= Self::REFUSALS_SUSTAINED
            && self.has_jumped(Self::JUMP_FRAMES, process)
        {
            self.restart_unexplained(predicted, process)
        } else {
            let used = self.accept(innovation, normalised, quiet);
            let resolved = self.reference.is_doubted() && self.frames_fit();
            if resolved { self.resolve_doubt(used, process) } else { used }
        }
    }

    /// Fuses the newest frame, to whose exposure the track has been carried: its innovation has passed the gate.
    #[inline(always)]
    fn accept(&mut self, innovation: (T, T), normalised: T, quiet: bool) -> Innovation<T> {
        let (innovation_rad, variance_rad2) = innovation;
        let TrackedFrame { frame, track } = &mut self.newest;
        self.driven &= track.same_code(frame);
        if !quiet && track.repeats(&self.tuning) {
            return self.declare_stuck(innovation);
        }
        track.note_innovation(normalised, &self.tuning);
        track.refusals = 0;
        self.reference.begun = true;
        if !quiet {
            self.persistent_error.take(frame, &self.tuning);
            // Frames that are noisier than the camera says tell of the camera where they are white (F18). One after a
            // long gap tells of the gap.
            let guessed = variance_rad2 > T::from_f64(Self::GUESS_VARIANCE) * self.tuning.camera_rad2;
            let gap = |before: &TrackedFrame<T, B>| {
                self.intervals.is_gap(before.frame.exposed_at, frame.exposed_at)
            };
            if guessed && self.older.back().is_some_and(gap) {
                self.correlation = InnovationCorrelation::white();
            } else {
                let noisier = (track.nis / T::from_f64(Self::NIS_DOUBTED)).at_least(T::one());
                self.correlation.take(innovation_rad, T::one() / (variance_rad2 * noisier), &self.tuning);
            }
        } else if track.resting {
            self.persistent_error.take_at_rest(frame, self.noise.white_rad2(&self.tuning), &self.tuning);
        }
        let frame_rad2 = self.tuning.frame_rad2(frame, track.state.rate_rad_s, quiet);
        let repeated = track.undithered(&self.tuning);
        if track.resting && !repeated && track.has_moved(innovation_rad, frame_rad2, &self.tuning) {
            let (frame, near) = (*frame, track.state.angle.angle());
            self.rest_test.withdraw();
            return self.begin(&frame, near);
        }
        track.code = frame.angle;
        if !repeated {
            track.state.correct(innovation_rad, frame_rad2);
            // A rotor that moves skips what concerns rest.
            if quiet || track.still {
                track.look_for_rest(quiet, &self.tuning, &mut self.rest_test);
            }
        }
        if track.resting {
            track.fuse_rest(&self.tuning, self.rest_test.disputed);
        }
        let verdict = if repeated { Verdict::Rejected(Rejection::Repeated) } else { Verdict::Used };
        record(frame, innovation, verdict)
    }

    /// The newest frame is beyond the gate. Fuses it if an outlier before it or a kick explains it; otherwise refuses
    /// it and leaves the track as it was but for the counts. After too many refusals restarts at it.
    #[cold]
    fn explain_or_refuse(
        &mut self,
        innovation: (T, T),
        predicted: Angle,
        quiet: bool,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        if let Some(before) = self.older.back() {
            self.newest.track = before.track;
        }
        let explained = if quiet { None } else { self.explain_refusals(process) };
        if let Some(Fit { state, innovation, normalised, kicked, .. }) = explained {
            let track = &mut self.newest.track;
            let used_at = track.state.at;
            (track.state, track.kicked) = (state, kicked);
            if kicked {
                self.end_doubt_after(used_at);
            }
            return self.accept(innovation, normalised, quiet);
        }
        let TrackedFrame { frame, track } = &mut self.newest;
        track.same_code(frame);
        if !quiet && track.repeats(&self.tuning) {
            return self.declare_stuck(innovation);
        }
        track.note_innovation(self.tuning.gate, &self.tuning);
        track.refusals = track.refusals.saturating_add(1);
        self.note_refusal(innovation.0);
        let too_many = self.newest.track.refusals >= self.tuning.refusals_max;
        if too_many && self.frames_agree(Self::CONFIRMING_FRAMES + 1, process) {
            return self.restart_unexplained(predicted, process);
        }
        refused(&self.newest.frame, innovation, Rejection::Gate)
    }
}

fn record<T>(frame: &CameraFrame, innovation: (T, T), verdict: Verdict) -> Innovation<T> {
    let (innovation_rad, variance_rad2) = innovation;
    Innovation { source: Source::Camera, taken_at: frame.exposed_at, innovation_rad, variance_rad2, verdict }
}

fn refused<T>(frame: &CameraFrame, innovation: (T, T), why: Rejection) -> Innovation<T> {
    record(frame, innovation, Verdict::Rejected(why))
}

#[cfg(test)]
mod tests;
