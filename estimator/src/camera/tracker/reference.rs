//! What the angle counts from, and whether a restart keeps it.
//!
//! A rotor turns without jumps. A jump of the frames that lasts shows a camera that was pushed, or tracking that
//! follows another feature or takes marks for each other. So a restart that nothing explains loses the reference: the
//! angle is relative to an unknown one, and not to be used.
//!
//! | restart | the reference |
//! |---|---|
//! | the turn is lost: a driven rotor was not seen for long | the angle is right but for whole turns, for good |
//! | a quiet rotor was not seen for long, and is beyond where it slides to | is doubtful: the turn is not known |
//! | the frames since the last one used do not agree among themselves: they scatter | is kept |
//! | they show its rotor elsewhere, and moving as before | is lost; the track before goes on, as the trusted one |
//! | they go on from its angle: the rotor was jolted, once and by any rate, or kicked before every frame | is kept |
//! | they agree, and nothing explains them | is lost, as above |
//! | the reference is lost, and the frames are where the trusted track is | is found again |
//! | the frames since the jump turn out to be one code of a stuck camera | is found again, with the trusted track |
//!
//! The trusted track finds a lost reference as long as it is certain to three degrees: of all places one in ten is then
//! within its gate.
//!
//! # A gap while the rotor is quiet
//!
//! Friction stops a quiet rotor, but the variance of its angle grows on: after a gap of 0.1 s any frame is within the
//! gate. So such a frame has to be where a rotor slides to that stops within 25 ms. If it is not, the camera shows
//! another feature, or the rotor was jolted and may have turned round. A rotor that is where it was keeps its turn.
//!
//! # Doubt
//!
//! Where most frames are wrong, the gate grows until some of them pass, and restarts happen at others: the track may
//! then come out of it by whole turns off, with frames that agree. So where the third frame that is refused in a row,
//! or a later one, is off by half a radian, the track before is trusted beside the one that goes on, until the frames
//! fit again. Then the turn is the one nearest to where the trusted track leads. If that is uncertain by half a
//! radian, half a turn is within six standard deviations, and the turn is not known. Four frames that fit one kick of
//! the trusted track end the doubt at once.
//!
//! Limits: a jump within the gate of a frame, six standard deviations, or within what kicks turn between two frames is
//! taken for a motion, and so is a jump within what a quiet rotor may slide by while it is not seen. Kicks turn the
//! rotor by some hundredths of a degree between two of 10,000 frames a second, and by two degrees or three between two
//! of 500. So do jolts that friction ends between two of these.

use motor_model::{Angle, AngleAccumulator, Real, Time};

use super::hypotheses::Fit;
use super::{TrackedFrame, Tracker, record};
use crate::camera::process::Process;
use crate::camera::track::{State, Track};
use crate::camera::track_covariance::TrackCovariance;
use crate::innovation::{Innovation, Verdict};
use crate::measurement::CameraFrame;
use crate::vibrometer::motion::STOPPING_NANOS;

/// What the angle counts from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference<T, B> {
    /// Whether a frame has been used since the first one: until then that frame is the reference.
    pub(super) begun: bool,
    pub(super) turn_known: bool,
    pub(super) lost: bool,
    /// The track before they jumped, or before they were doubted, while it is of use.
    pub(super) trusted: Option<TrackedFrame<T, B>>,
    /// Frames far from the track since the frames are doubted; 0 while they are not.
    pub(super) doubted: u16,
}

impl<T: Real, B: TrackCovariance<T>> Reference<T, B> {
    /// Variance of the trusted track's angle beyond which it is of no use, in rad^2: three degrees.
    const TRUSTED_RAD2: f64 = 2.7e-3;

    pub(super) const fn new() -> Self {
        Self { begun: false, turn_known: true, lost: false, trusted: None, doubted: 0 }
    }

    /// Predicted angle variance in rad^2 beyond which the turn is lost: the gate of six standard deviations then spans
    /// a turn.
    pub(super) const LOST_RAD2: f64 = 0.25;

    /// Carries the trusted track to `until`, as long as it is of use.
    #[inline(never)]
    pub(super) fn carry(&mut self, until: Time, process: &impl Process<T, B>) {
        let Some(TrackedFrame { track, .. }) = &mut self.trusted else { return };
        process.carry(&mut track.state, track.resting, until);
        let limit_rad2 = if self.lost { Self::TRUSTED_RAD2 } else { Self::LOST_RAD2 };
        // Written so that a variance that has overflowed is not certain.
        let certain = track.state.covariance.angle_rad2() <= T::from_f64(limit_rad2);
        if !certain {
            self.trusted = None;
        }
    }

    /// Whether the frames are doubted.
    pub(super) fn is_doubted(&self) -> bool {
        self.doubted > 0 && !self.lost
    }
}

impl<T: Real, B: TrackCovariance<T>> Tracker<T, B> {
    /// Whether a quiet rotor that `frame` shows, with an innovation of `variance_rad2`, is further from where the track
    /// was before it than friction lets it slide: beyond six standard deviations of where it may have stopped. Never
    /// where the prediction is certain to three degrees.
    pub(super) fn has_strayed(&self, frame: &CameraFrame, variance_rad2: T) -> bool {
        variance_rad2 > T::from_f64(Reference::<T, B>::TRUSTED_RAD2) && self.is_beyond_sliding(frame)
    }

    #[cold]
    #[inline(never)]
    fn is_beyond_sliding(&self, frame: &CameraFrame) -> bool {
        let Some(State { angle, rate_rad_s, covariance, .. }) =
            self.older.back().map(|before| &before.track.state)
        else {
            return false;
        };
        let stopping_s = Time::from_nanos(STOPPING_NANOS).seconds_since(Time::ZERO);
        let turned_rad: T = frame.angle.minus(angle.angle()).wrapped().radians_since(Angle::ZERO);
        let beyond_rad = turned_rad.abs() - rate_rad_s.abs() * stopping_s;
        let [angle_rad2, ..] = covariance.moments_after(stopping_s);
        let variance_rad2 = angle_rad2 + self.tuning.frame_rad2(frame, *rate_rad_s, true);
        beyond_rad > T::zero() && beyond_rad * beyond_rad > self.tuning.gate * variance_rad2
    }

    /// Time in which kicks turn a driven rotor by less than the gate of a frame, in ns: two impacts, and a tenth of a
    /// degree.
    const UNKICKED_NANOS: u64 = 300_000;

    /// Standard deviation of the rate after a jolt, in rad/s: 16 turns a second.
    const JOLT_RAD_S: f64 = 100.0;

    /// Whether the frames since the last one used show the rotor elsewhere, and moving as before, or `least` of them or
    /// more agree among themselves, and no rotor has gone there: a track that has become uncertain meanwhile would take
    /// them in. A track that outliers may have led astray proves nothing.
    #[cold]
    pub(super) fn has_jumped(&self, least: usize, process: &impl Process<T, B>) -> bool {
        let Some(track) = self.older.back().map(|before| before.track) else { return false };
        let used = self.older.iter().rev().find(|tracked| tracked.frame.exposed_at == track.state.at);
        let calm =
            used.is_some_and(|used| used.track.far == 0 && used.track.nis <= T::from_f64(Self::NIS_DOUBTED));
        let count = self.frames_since(&track);
        let nothing_explains = || {
            count >= least && self.frames_agree(count, process) && self.followed(&track, process).is_none()
        };
        calm && (self.goes_on_elsewhere(&track, process) || nothing_explains())
    }

    /// Whether the frames since the last one of `track` show its rotor at another angle, and moving as before: a rotor
    /// that is jolted or kicked moves otherwise for a while. It has to have gone there between two frames, and in so
    /// short a time, or at rest, that kicks do not take it there.
    #[inline(never)]
    fn goes_on_elsewhere(&self, track: &Track<T, B>, process: &impl Process<T, B>) -> bool {
        let count = self.frames_since(track);
        let first = (self.older.len() + 1).checked_sub(count).and_then(|index| self.older.get(index));
        let Some(first) = first.filter(|_| count >= Self::CONFIRMING_FRAMES) else { return false };
        let frame = &first.frame;
        let mut state = track.state;
        process.carry(&mut state, track.resting, frame.exposed_at);
        let frame_rad2 = self.tuning.frame_rad2(frame, state.rate_rad_s, false);
        let turned = state.angle.angle().minus(track.state.angle.angle());
        let step_rad: T = frame.angle.minus(track.code.plus(turned)).wrapped().radians_since(Angle::ZERO);
        let at_once = step_rad * step_rad > (frame_rad2 + frame_rad2) * self.tuning.gate;
        let unkicked = track.resting || frame.exposed_at <= track.state.at.plus_nanos(Self::UNKICKED_NANOS);
        if !(at_once && unkicked) {
            return false;
        }
        let (rate_rad2_s2, before) = (state.covariance.rate_rad2_s2(), Some(&state.covariance));
        let covariance = B::begin(frame_rad2, rate_rad2_s2, before);
        let elsewhere = State { angle: AngleAccumulator::at(frame.angle), covariance, ..state };
        let fit = self.fit(elsewhere, (T::zero(), track.resting), count - 1, process);
        fit.is_some_and(|fit| fit.is_good())
    }

    /// Innovation of a frame in rad from which on it can lead the track astray by a turn: a noisy camera's cannot.
    const FAR_RAD: f64 = 0.5;

    /// The newest frame was refused, with this innovation. From the third in a row on, if it is far, the frames are
    /// doubted, and the track as it was before is trusted.
    #[cold]
    #[inline(never)]
    pub(super) fn note_refusal(&mut self, innovation_rad: T) {
        if innovation_rad.abs() < T::from_f64(Self::FAR_RAD) {
            return;
        }
        let Reference { begun, lost, trusted, doubted, .. } = &mut self.reference;
        if *doubted > 0 {
            *doubted = doubted.saturating_add(1);
        } else if *begun && !*lost && self.newest.track.refusals >= Self::REFUSALS_SUSTAINED {
            (*trusted, *doubted) = (Some(self.newest), self.newest.track.refusals.into());
        }
    }

    /// A hypothesis explains the refusals from a frame used at `at` on. The doubt ends, unless frames were used since
    /// it began.
    #[cold]
    pub(super) fn end_doubt_after(&mut self, at: Time) {
        let is_trusted = self.reference.trusted.as_ref().is_some_and(|trusted| trusted.track.state.at == at);
        if self.reference.is_doubted() && is_trusted {
            (self.reference.trusted, self.reference.doubted) = (None, 0);
        }
    }

    /// The newest frame was used, and the frames fit again. The turn is that of the trusted track. Where that is too
    /// uncertain, it is not known after so many far frames that the track may have been led astray.
    #[cold]
    #[inline(never)]
    pub(super) fn resolve_doubt(
        &mut self,
        used: Innovation<T>,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        let TrackedFrame { frame, track } = self.newest;
        self.reference.carry(frame.exposed_at, process);
        let far = core::mem::take(&mut self.reference.doubted);
        let Some(trusted) = self.reference.trusted.take() else {
            self.reference.turn_known &= far < self.tuning.refusals_max.into();
            return used;
        };
        let near = trusted.track.state.angle.angle();
        let off = track.state.angle.angle().minus(near);
        if off.wrapped() == off { used } else { self.begin(&frame, near) }
    }

    /// Frames that prove a jump: fewer that scatter may agree by chance.
    pub(super) const JUMP_FRAMES: usize = 11;

    /// Restarts at the newest frame, which no kick explains. `near` is the prediction.
    #[cold]
    #[inline(never)]
    pub(super) fn restart_unexplained(&mut self, near: Angle, process: &impl Process<T, B>) -> Innovation<T> {
        let frame = self.newest.frame;
        let Some(&before) = self.older.back() else { return self.begin(&frame, near) };
        let before = TrackedFrame { frame, ..before };
        let mut near = near;
        if self.reference.lost {
            if let Some(found) = self.found_again(&frame, process) {
                near = found;
                (self.reference.lost, self.reference.trusted, self.reference.doubted) = (false, None, 0);
            }
        } else {
            let elsewhere = self.goes_on_elsewhere(&before.track, process);
            if let Some(followed) = self.followed(&before.track, process).filter(|_| !elsewhere) {
                near = followed;
                self.end_doubt_after(before.track.state.at);
            } else if elsewhere || self.frames_agree(self.frames_since(&before.track), process) {
                self.reference.lost = true;
                self.reference.trusted.get_or_insert(before);
            }
        }
        self.begin(&frame, near)
    }

    /// Angle of the trusted track at `frame`, if the frame is where that track leads.
    fn found_again(&mut self, frame: &CameraFrame, process: &impl Process<T, B>) -> Option<Angle> {
        self.reference.carry(frame.exposed_at, process);
        let state = &self.reference.trusted.as_ref()?.track.state;
        let off_rad = state.innovation_rad(frame.angle);
        let frame_rad2 = self.tuning.frame_rad2(frame, state.rate_rad_s, false);
        let variance_rad2 = state.covariance.innovation_rad2(frame_rad2);
        (off_rad * off_rad <= self.tuning.gate * variance_rad2).then_some(state.angle.angle())
    }

    /// Angle of the rotor, if it may have come there since the last frame of `track`: jolted once, by any rate, or
    /// kicked before every frame.
    #[inline(never)]
    fn followed(&self, track: &Track<T, B>, process: &impl Process<T, B>) -> Option<Angle> {
        let jolt_rad2_s2 = T::from_f64(Self::JOLT_RAD_S * Self::JOLT_RAD_S);
        for [once, each] in [[jolt_rad2_s2, T::zero()], [T::zero(), self.tuning.kick_rad2_s2]] {
            let mut state = track.state;
            state.covariance.widen_rate(once);
            let fit = self.fit(state, (each, false), self.frames_since(track), process);
            if let Some(fit) = fit.filter(Fit::is_good) {
                return Some(fit.state.angle.angle());
            }
        }
        None
    }

    /// Starts at `frame`, in the turn that brings it nearest to `near`.
    #[cold]
    #[inline(never)]
    pub(super) fn begin(&mut self, frame: &CameraFrame, near: Angle) -> Innovation<T> {
        self.older.clear();
        let track = Track::started(frame, near, Some(&self.newest.track), &self.tuning);
        self.newest = TrackedFrame { frame: *frame, track };
        self.begun = true;
        record(frame, (T::zero(), T::zero()), Verdict::Restarted)
    }
}
