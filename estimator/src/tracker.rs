//! Which frames are let in, in which order, and what may be believed afterwards: one code for every filter of angle and rate.
//!
//! # The lag
//!
//! A frame is fused at its exposure, however late it arrives. Frames in order cost nothing for that, whatever their latency: the track lives at the
//! last exposure and is carried forward when asked. One older than the last is fused in its place: the track goes back to the frame before it,
//! and the newer ones are taken in again, so that the order of arrival makes no difference. For this the last [`FRAMES_KEPT`] frames are kept, each with the track after
//! it: 32 of them reach 3.1 ms back at 10,000 frames a second - the largest *difference* of latencies that can be made good, not the largest
//! latency - and take 2.6 kB in `f32`. Going back costs what the newer frames cost anew, at most 31 times the price of one.
//!
//! A frame from before that is [`Rejection::OutOfHorizon`]. One of an exposure already seen is [`Rejection::Duplicate`]. One from more than
//! a millisecond after the filter's clock is [`Rejection::Future`]: its own clock is wrong. The filter's clock is what drive and vibrometer tell
//! ([`crate::MotionWatch`]); where they have told nothing since the last frame there is no clock to judge by. None of these moves the estimate;
//! all but duplicates count as refusals, so that a track which stands at a wrong time itself is given up after
//! [`TrackTuning::refusals_max`] of them.
//!
//! # The gate
//!
//! A frame beyond the gate is refused and moves nothing, neither the estimate nor its variance. If the next one is within it, the first was an outlier and
//! that is all. If not, either the last frame used was an outlier, though within the gate: it is taken back if the two since fit the track before it. Or the rotor
//! has been kicked out of the gate, as in a landing: with a kick of [`TrackTuning::kick_rad2_s2`] right after the last frame used the newest four have to fit.
//! (Two, as it once was, are no proof: of a fifth of outliers of 0.7 degrees two that fit come fifty times a second, and each led the estimate astray by half a
//! degree or more.) After [`TrackTuning::refusals_max`] refusals the track begins anew as soon as the newest frames agree among themselves.
//!
//! # A stuck camera
//!
//! A camera that delivers its last picture for ever shows a rotor that is being struck the same code frame after frame. Tracking noise and motion change the code of a
//! live camera with probability 0.46 or more, so [`STUCK_FRAMES`] equal codes in a row are one chance in 10^5 even of a struck rotor that does not
//! turn. Then the camera counts as stuck: the frames with that code are taken back, and refused ([`Rejection::Stuck`]) until another code comes. At rest
//! the same code is no proof of anything, see [`crate::track`]; so a camera that stuck before the rotor was known to turn is believed again once the
//! rotor lies quiet, for it may be one without dither. What this leaves open: one that really is stuck, and did so as the rotor turned round.

use heapless::Deque;
use motor_model::{Angle, Real, Time};

use crate::belief::Belief;
use crate::covariance::AngleRateCovariance;
use crate::filter::{Estimate, Health, Reason};
use crate::innovation::{Innovation, Rejection, Source, Verdict};
use crate::measurement::CameraFrame;
use crate::smoother::{Reversible, Smoothed};
use crate::track::{AtRest, Process, State, Track, TrackTuning};

/// Frames kept, so that one that was overtaken can be fused in its place: 3.1 ms at 10,000 frames a second.
pub const FRAMES_KEPT: usize = 32;

/// Equal codes in a row of a struck rotor that make a camera count as stuck: 2 ms at 10,000 frames a second.
pub const STUCK_FRAMES: u8 = 20;

/// How far the filter's clock and that of a measurement may be apart, in ns.
pub(crate) const CLOCK_TOLERANCE_NANOS: u32 = 1_000_000;

/// What the filter knows when a frame comes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moment {
    /// The filter's clock.
    pub(crate) clock: Time,
    /// Whether the rotor lies on the teeth.
    pub(crate) quiet: bool,
}

/// A frame that was looked at, and the track after it.
#[derive(Clone, Copy, Debug)]
struct Looked<T, B> {
    frame: CameraFrame,
    track: Track<T, B>,
}

impl<T: Real, B: Belief<T>> Looked<T, B> {
    /// The same, part by part: on a microcontroller a copy as a whole is a call that costs as much as an update.
    #[inline]
    fn copied(&self) -> Self {
        let Self { frame: CameraFrame { exposed_at, angle }, track } = self;
        Self { frame: CameraFrame { exposed_at: *exposed_at, angle: *angle }, track: track.copied() }
    }
}

/// What the track would be at the newest frame were the frames before it explained otherwise, and the newest frame's innovation, which is not yet taken in.
struct Fit<T, B> {
    state: State<T, B>,
    /// The innovation and its variance.
    seen: (T, T),
    normalised: T,
    /// Whether by a kick.
    kicked: bool,
}

/// A camera that is stuck.
#[derive(Clone, Copy, Debug)]
struct Stuck {
    /// What it shows.
    code: Angle,
    /// Whether the rotor was known to turn when it began.
    turning: bool,
}

/// The track after the last frames.
#[derive(Clone, Debug)]
pub(crate) struct Tracker<T, B = AngleRateCovariance<T>> {
    tuning: TrackTuning<T>,
    /// The newest frame; `None` before the first one.
    newest: Option<Looked<T, B>>,
    /// Those before it, by exposure.
    older: Deque<Looked<T, B>, { FRAMES_KEPT - 1 }>,
    stuck: Option<Stuck>,
    /// Age of the last frame by the filter's clock when it came, in ns.
    latency_nanos: u64,
}

impl<T: Real, B: Belief<T>> Tracker<T, B> {
    /// Predicted angle variance in rad^2 beyond which the turn is lost: six standard deviations, the gate, then span it.
    const LOST_RAD2: f64 = 0.25;

    /// Angle variance in rad^2 beyond which an estimate is of no use: half a degree.
    const UNCERTAIN_RAD2: f64 = 7.6e-5;

    /// From so many refusals in a row on the estimate is of no use: a single outlier or a landing takes one or two.
    const REFUSALS_SUSTAINED: u8 = 3;

    /// Mean normalised innovation squared beyond which the camera is worse than is believed: a right one has 1 +- 0.13 over 64 frames, and the
    /// filters' own models are within 1.5 of it.
    const NIS_MAX: f64 = 4.0;

    /// Frames in a row that have to fit a kick, or a new beginning, before it is believed: of a fifth of outliers four do so once in ten seconds, three every second.
    const WITNESSES: usize = 4;

    /// Frames in a row that prove the last one used to be an outlier.
    const WITNESSES_OF_AN_OUTLIER: usize = 2;

    /// A tracker that has seen nothing.
    pub(crate) fn new(tuning: TrackTuning<T>) -> Self {
        Self { tuning: tuning.sound(), newest: None, older: Deque::new(), stuck: None, latency_nanos: 0 }
    }

    /// The track at the last frame used.
    #[inline]
    pub(crate) fn track(&self) -> Option<&Track<T, B>> {
        self.newest.as_ref().map(|looked| &looked.track)
    }

    /// Where the track stands: a frame that leaves it has left all of the track's state.
    #[inline]
    pub(crate) fn place(&self) -> Option<(Time, Angle, T, bool)> {
        let Track { state: State { at, angle, rate_rad_s, .. }, resting, .. } = self.track()?;
        Some((*at, angle.angle(), *rate_rad_s, *resting))
    }

    /// The earliest time from which the track may have to be carried forward again.
    pub(crate) fn horizon(&self) -> Option<Time> {
        self.older.front().or(self.newest.as_ref()).map(|looked| looked.track.state.at)
    }

    /// Gives up going back to before `limit`: what has happened until then is no longer known, so the track itself is carried there, if it is older.
    pub(crate) fn shorten(&mut self, limit: Time, process: &impl Process<T, B>) {
        while self.older.pop_front_if(|looked| looked.track.state.at < limit).is_some() {}
        if let Some(Looked { track, .. }) = &mut self.newest {
            process.carry(&mut track.state, track.resting, limit);
        }
    }

    /// Takes a frame in.
    #[inline]
    pub(crate) fn update(
        &mut self,
        frame: &CameraFrame,
        moment: Moment,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        let Some(Looked { frame: last, track: Track { state, .. } }) = &self.newest else {
            return self.begin(frame, Angle::ZERO);
        };
        let in_order = frame.exposed_at > last.exposed_at && frame.exposed_at > state.at;
        if frame.exposed_at <= moment.clock {
            self.latency_nanos = moment.clock.nanos_since(frame.exposed_at);
        } else if moment.clock > state.at
            && !frame.exposed_at.is_within(CLOCK_TOLERANCE_NANOS.into(), moment.clock)
        {
            return self.mistimed(frame, Rejection::Future);
        } else {
            self.latency_nanos = 0;
        }
        if self.stuck.is_some() && self.shows_still(frame, moment.quiet) {
            return refused(frame, (T::zero(), T::zero()), Rejection::Stuck);
        }
        if in_order {
            self.look(frame, moment.quiet, process)
        } else {
            self.overtaken(frame, moment.quiet, process)
        }
    }

    /// Whether a camera that is stuck shows the same as before; if not, it is stuck no more.
    #[cold]
    fn shows_still(&mut self, frame: &CameraFrame, quiet: bool) -> bool {
        let still = self.stuck.is_some_and(|stuck| stuck.code == frame.angle && (stuck.turning || !quiet));
        if !still {
            self.stuck = None;
        }
        still
    }

    /// Looks at a frame newer than all others.
    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "a call copies the record of the frame, which costs as much as an update"
    )]
    fn look(&mut self, frame: &CameraFrame, quiet: bool, process: &impl Process<T, B>) -> Innovation<T> {
        let Some(newest) = &mut self.newest else { return self.begin(frame, Angle::ZERO) };
        if self.older.is_full() {
            self.older.pop_front();
        }
        // Cannot be full any more.
        let _ = self.older.push_back(newest.copied());
        newest.frame = *frame;
        let track = &mut newest.track;
        track.kicked = false;
        process.carry(&mut track.state, track.resting, frame.exposed_at);
        let innovation_rad: T =
            frame.angle.minus(track.state.angle.angle()).wrapped().radians_since(Angle::ZERO);
        let variance_rad2 = track.state.covariance.innovation_rad2(self.tuning.camera_rad2);
        let normalised = innovation_rad * innovation_rad * (T::one() / variance_rad2);
        // Both asked this way round, so that NaN, and a variance that has overflowed, are refused.
        let turn_known = variance_rad2 <= T::from_f64(Self::LOST_RAD2);
        let believable = normalised <= self.tuning.gate;
        let seen = (innovation_rad, variance_rad2);
        if !turn_known {
            self.begin_here()
        } else if believable {
            self.accept(seen, normalised, quiet)
        } else {
            self.doubt(seen, quiet, process)
        }
    }

    /// Takes in the newest frame, to whose exposure the track has been carried: `innovation_rad` off, with that variance.
    #[inline(always)]
    #[expect(
        clippy::inline_always,
        reason = "a call copies the record of the frame, which costs as much as an update"
    )]
    fn accept(
        &mut self,
        (innovation_rad, variance_rad2): (T, T),
        normalised: T,
        quiet: bool,
    ) -> Innovation<T> {
        let Some(Looked { frame, track }) = &mut self.newest else { return self.begin_here() };
        let same = track.same_code(frame);
        if track.same_codes >= STUCK_FRAMES && !quiet {
            return self.take_back((innovation_rad, variance_rad2));
        }
        track.watch_noise(normalised);
        track.refusals = 0;
        // What concerns rest costs a rotor nothing that is being struck.
        let lying = quiet || track.may_rest();
        let at_rest = if lying {
            track.judge_at_rest(frame, innovation_rad, same && quiet, &self.tuning)
        } else {
            AtRest::Told
        };
        track.note_code(frame);
        let verdict = match at_rest {
            AtRest::Told => {
                track.correct(innovation_rad, &self.tuning);
                Verdict::Used
            }
            AtRest::Repeated => Verdict::Rejected(Rejection::Repeated),
            AtRest::Moved => return self.begin_here(),
        };
        if lying {
            track.conclude_rest(quiet, at_rest, &self.tuning);
        }
        Innovation {
            source: Source::Camera,
            taken_at: frame.exposed_at,
            innovation_rad,
            variance_rad2,
            verdict,
        }
    }

    /// The newest frame is beyond the gate: takes it in all the same if it is not the first and a kick explains it, or refuses it and leaves the track as it
    /// was but for the counts; after too many refusals begins anew at it.
    #[cold]
    fn doubt(&mut self, seen: (T, T), quiet: bool, process: &impl Process<T, B>) -> Innovation<T> {
        let (Some(Looked { frame, track }), Some(before)) = (&mut self.newest, self.older.back()) else {
            return self.begin_here();
        };
        let (frame, predicted) = (*frame, track.state.angle.angle());
        *track = before.track;
        if !quiet && let Some(Fit { state, seen, normalised, kicked }) = self.explained(process) {
            let Some(Looked { track, .. }) = &mut self.newest else { return self.begin_here() };
            track.state = state;
            track.kicked = kicked;
            return self.accept(seen, normalised, quiet);
        }
        let Some(Looked { track, .. }) = &mut self.newest else { return self.begin_here() };
        track.same_code(&frame);
        if !quiet && track.same_codes >= STUCK_FRAMES {
            return self.take_back(seen);
        }
        track.watch_noise(self.tuning.gate);
        track.refusals = track.refusals.saturating_add(1);
        if track.refusals >= self.tuning.refusals_max && self.agree(process) {
            return self.begin(&frame, predicted);
        }
        refused(&frame, seen, Rejection::Gate)
    }

    /// What explains that the newest frames are refused: the last one used was an outlier, and is taken back, or the rotor was kicked right after it.
    #[cold]
    fn explained(&mut self, process: &impl Process<T, B>) -> Option<Fit<T, B>> {
        let state = self.track()?.state;
        let used = self.older.iter().rposition(|looked| looked.frame.exposed_at == state.at);
        if let Some(before) = used.and_then(|used| self.older.get(used.checked_sub(1)?))
            && let Some(fit) = self.fit(before.track.state, Self::WITNESSES_OF_AN_OUTLIER, process)
        {
            let state = before.track.state;
            self.older.iter_mut().skip(used?).for_each(|looked| looked.track.state = state);
            return Some(fit);
        }
        let mut kicked = state;
        kicked.covariance.widen_rate(self.tuning.kick_rad2_s2);
        Some(Fit { kicked: true, ..self.fit(kicked, Self::WITNESSES, process)? })
    }

    /// Whether the newest frames agree on an angle and a rate, whatever was known before.
    #[cold]
    fn agree(&self, process: &impl Process<T, B>) -> bool {
        let first = self.older.len().checked_sub(Self::WITNESSES).and_then(|index| self.older.get(index));
        let Some((first, track)) = first.zip(self.track()) else { return true };
        let State { angle, covariance, .. } = &track.state;
        let begun = Track::begun(&first.frame, angle.angle(), Some(covariance), &self.tuning);
        self.fit(begun.state, Self::WITNESSES, process).is_some()
    }

    /// `state` carried through the newest `count` frames, if all of them are within its gate.
    fn fit(&self, mut state: State<T, B>, count: usize, process: &impl Process<T, B>) -> Option<Fit<T, B>> {
        let newest = self.newest.as_ref()?;
        let first = (self.older.len() + 1).checked_sub(count)?;
        for looked in self.older.iter().skip(first).chain(core::iter::once(newest)) {
            let frame = &looked.frame;
            if frame.exposed_at <= state.at {
                return None;
            }
            process.carry(&mut state, newest.track.resting, frame.exposed_at);
            let innovation_rad: T =
                frame.angle.minus(state.angle.angle()).wrapped().radians_since(Angle::ZERO);
            let variance_rad2 = state.covariance.innovation_rad2(self.tuning.camera_rad2);
            let normalised = innovation_rad * innovation_rad / variance_rad2;
            // Asked this way round, so that NaN is refused.
            let believable = normalised <= self.tuning.gate;
            if !believable {
                return None;
            }
            if frame.exposed_at == newest.frame.exposed_at {
                let seen = (innovation_rad, variance_rad2);
                return Some(Fit { state, seen, normalised, kicked: false });
            }
            state.correct(innovation_rad, self.tuning.camera_rad2);
        }
        None
    }

    /// A frame that newer ones have overtaken: goes back, looks at it, and then at those again.
    #[cold]
    fn overtaken(&mut self, frame: &CameraFrame, quiet: bool, process: &impl Process<T, B>) -> Innovation<T> {
        let mut kept = self.older.iter().chain(&self.newest);
        if kept.any(|looked| looked.frame.exposed_at == frame.exposed_at) {
            return refused(frame, (T::zero(), T::zero()), Rejection::Duplicate);
        }
        let oldest = self.older.front().or(self.newest.as_ref());
        if oldest.is_some_and(|oldest| frame.exposed_at < oldest.frame.exposed_at.max(oldest.track.state.at))
        {
            return self.mistimed(frame, Rejection::OutOfHorizon);
        }
        let mut newer = Deque::<CameraFrame, FRAMES_KEPT>::new();
        while let Some(looked) = self.newest.take_if(|looked| looked.frame.exposed_at > frame.exposed_at) {
            // As large as the lag itself.
            let _ = newer.push_front(looked.frame);
            self.newest = self.older.pop_back();
        }
        let mut innovation = None;
        for frame in core::iter::once(frame).chain(&newer) {
            let looked = self.look(frame, quiet, process);
            innovation = innovation.or(Some(looked));
        }
        innovation.unwrap_or(refused(frame, (T::zero(), T::zero()), Rejection::OutOfHorizon))
    }

    /// Refuses a frame for its time; after too many refusals begins anew at it.
    #[cold]
    fn mistimed(&mut self, frame: &CameraFrame, why: Rejection) -> Innovation<T> {
        if let Some(Looked { track, .. }) = &mut self.newest {
            track.refusals = track.refusals.saturating_add(1);
            if track.refusals >= self.tuning.refusals_max {
                let near = track.state.angle.angle();
                return self.begin(frame, near);
            }
        }
        refused(frame, (T::zero(), T::zero()), why)
    }

    /// Takes the frames back that brought the code of a camera that is stuck, the newest one's, as far as they are kept.
    #[cold]
    fn take_back(&mut self, innovation: (T, T)) -> Innovation<T> {
        let Some(Looked { frame, .. }) = self.newest else { return self.begin_here() };
        while self.newest.is_some_and(|looked| looked.track.same_codes > 0) && !self.older.is_empty() {
            self.newest = self.older.pop_back();
        }
        let turning = self.track().is_some_and(|Track { state, .. }| {
            state.rate_rad_s * state.rate_rad_s > T::from_f64(9.0) * state.covariance.rate_rad2_s2()
        });
        self.stuck = Some(Stuck { code: frame.angle, turning });
        refused(&frame, innovation, Rejection::Stuck)
    }

    /// Begins anew at the newest frame, whose turn is that nearest to its prediction.
    #[cold]
    fn begin_here(&mut self) -> Innovation<T> {
        let place = self.newest.map(|looked| (looked.frame, looked.track.state.angle.angle()));
        let (frame, near) =
            place.unwrap_or((CameraFrame { exposed_at: Time::ZERO, angle: Angle::ZERO }, Angle::ZERO));
        self.begin(&frame, near)
    }

    /// Begins at `frame`, in the turn that brings it nearest to `near`.
    #[cold]
    fn begin(&mut self, frame: &CameraFrame, near: Angle) -> Innovation<T> {
        self.older.clear();
        let before = self.track().map(|track| track.state.covariance);
        let track = Track::begun(frame, near, before.as_ref(), &self.tuning);
        self.newest = Some(Looked { frame: *frame, track });
        Innovation {
            source: Source::Camera,
            taken_at: frame.exposed_at,
            innovation_rad: T::zero(),
            variance_rad2: T::zero(),
            verdict: Verdict::Restarted,
        }
    }

    /// Angle and rate carried forward to `now`; `None` before the first frame.
    #[inline]
    pub(crate) fn estimate(&self, now: Time, process: &impl Process<T, B>) -> Option<Estimate<T>> {
        let track = self.track()?;
        self.estimate_from(process.on_the_way(&track.state, track.resting, now).copied(), now, process)
    }

    /// The same from `ahead`, to which the track has been carried already.
    #[inline]
    pub(crate) fn estimate_from(
        &self,
        mut ahead: State<T, B>,
        now: Time,
        process: &impl Process<T, B>,
    ) -> Option<Estimate<T>> {
        let track = self.track()?;
        process.carry(&mut ahead, track.resting, now);
        let jitter = process.jitter(now);
        Some(Estimate {
            at: now,
            angle: ahead.angle.angle(),
            rate_rad_s: ahead.rate_rad_s,
            angle_rad2: ahead.covariance.angle_rad2() + jitter.angle_rad2,
            angle_rate_rad2_s: ahead.covariance.angle_rate_rad2_s(),
            rate_rad2_s2: ahead.covariance.rate_rad2_s2() + jitter.rate_rad2_s2,
            resting: track.resting,
        })
    }

    /// Whether `estimate`, this tracker's at `now`, may be used; `vibrometer` is what is wrong with that, if anything is.
    #[inline]
    pub(crate) fn judge(
        &self,
        estimate: Option<&Estimate<T>>,
        now: Time,
        vibrometer: Option<Reason>,
    ) -> Health {
        let (Some(track), Some(&Estimate { angle_rad2: variance_rad2, .. })) = (self.track(), estimate)
        else {
            return Health::Waiting;
        };
        // Asked this way round, so that a variance that has overflowed is refused too.
        let certain = variance_rad2 <= T::from_f64(Self::UNCERTAIN_RAD2);
        if self.stuck.is_some() {
            Health::Unusable(Reason::CameraStuck)
        } else if track.refusals >= Self::REFUSALS_SUSTAINED {
            Health::Unusable(Reason::FramesRefused)
        } else if !certain {
            Health::Unusable(Reason::Uncertain)
        } else if self.silent(now) {
            Health::Degraded(Reason::CameraSilent)
        } else if track.nis > T::from_f64(Self::NIS_MAX) {
            Health::Degraded(Reason::NoiseMismatch)
        } else {
            vibrometer.map_or(Health::Good, Health::Degraded)
        }
    }

    /// Whether no frame has come for two and a half of the mean time between them, with the latency of the last one.
    fn silent(&self, now: Time) -> bool {
        let (Some(newest), Some(oldest)) = (&self.newest, self.older.front()) else { return false };
        let span_nanos = newest.frame.exposed_at.nanos_since(oldest.frame.exposed_at);
        let overdue_nanos = now.nanos_since(newest.frame.exposed_at.plus_nanos(self.latency_nanos));
        // Without a division, which costs a microcontroller more than all of this.
        let twice_frames = 2 * u64::try_from(self.older.len()).unwrap_or(0);
        overdue_nanos.saturating_mul(twice_frames) > span_nanos.saturating_mul(5)
    }
}

impl<T: Real> Tracker<T> {
    /// Angle and rate at `at`, from the frames before and after it; `None` before the oldest one kept.
    pub(crate) fn smoothed(&self, at: Time, process: &impl Reversible<T>) -> Option<Estimate<T>> {
        let newest = self.track()?;
        if at >= newest.state.at {
            return self.estimate(at, process);
        }
        let mut smoothed = Smoothed::newest(&newest.state);
        let (mut later, mut from) = (newest, self.older.iter().rev().map(|looked| &looked.track));
        loop {
            // Frames refused left the track where it was.
            let earlier = from.find(|track| track.state.at < later.state.at)?;
            let kick = if later.kicked { self.tuning.kick_rad2_s2 } else { T::zero() };
            if earlier.state.at <= at {
                let mut state = earlier.state;
                process.carry(&mut state, earlier.resting, at);
                let smoothed = smoothed.back_to(&state, earlier.resting, kick, process);
                return Some(smoothed.estimate(earlier.resting, Process::<T>::jitter(process, at)));
            }
            smoothed = smoothed.back_to(&earlier.state, earlier.resting, kick, process);
            later = earlier;
        }
    }
}

fn refused<T: Real>(
    frame: &CameraFrame,
    (innovation_rad, variance_rad2): (T, T),
    why: Rejection,
) -> Innovation<T> {
    Innovation {
        source: Source::Camera,
        taken_at: frame.exposed_at,
        innovation_rad,
        variance_rad2,
        verdict: Verdict::Rejected(why),
    }
}
