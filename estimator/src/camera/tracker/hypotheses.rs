//! What explains a frame beyond the gate.
//!
//! | hypothesis | test |
//! |---|---|
//! | the frame is an outlier | the next frame is within the gate |
//! | the last frame used was an outlier within its gate | the two newest frames fit the track before it |
//! | the rotor was kicked after the last frame used (landing) | the four newest fit it with a kick, and no jump |
//!
//! The variance of the kick is [`crate::TrackTuning::kick_rad2_s2`].
//!
//! Why four frames for a kick: if a fifth of the frames are outliers of 0.7 degrees, two that fit a kick by chance come
//! fifty times a second, three once a second, four once in ten seconds; each would lead the estimate astray by half a
//! degree or more.

use motor_model::Real;

use super::Tracker;
use crate::camera::process::Process;
use crate::camera::track::{State, Track};
use crate::camera::track_covariance::TrackCovariance;

/// The track at the newest frame under a hypothesis about the frames before it, and the newest frame's innovation,
/// which is not yet fused.
pub(super) struct Fit<T, B> {
    pub(super) state: State<T, B>,
    /// The innovation and its variance.
    pub(super) innovation: (T, T),
    pub(super) normalised: T,
    /// Mean of the normalised innovations squared of all frames tested.
    mean_misfit: T,
    /// How many they are.
    frames: T,
    /// Whether the hypothesis is a kick.
    pub(super) kicked: bool,
}

impl<T: Real, B> Fit<T, B> {
    /// Whether the frames together fit the hypothesis: the mean of n normalised innovations squared is at most
    /// `1 + 10 / sqrt n`, beyond 99.99 % of chi-square for four frames and more, and 6 for fewer, 99.75 % of two. The
    /// gate of each alone would let a burst of outliers pass for a kick.
    pub(super) fn is_good(&self) -> bool {
        let excess = self.mean_misfit - T::one();
        excess <= T::from_f64(5.0)
            && (excess <= T::zero() || excess * excess * self.frames <= T::from_f64(100.0))
    }
}

impl<T: Real, B: TrackCovariance<T>> Tracker<T, B> {
    /// Frames in a row that have to fit a kick, or the first of a restart, before it is accepted.
    pub(super) const CONFIRMING_FRAMES: usize = 4;

    /// Beyond those, one in so many may be an outlier.
    const FRAMES_PER_OUTLIER: usize = 4;

    /// Frames in a row that prove that the last one used was an outlier.
    const CONFIRMING_FRAMES_OF_AN_OUTLIER: usize = 2;

    /// The hypothesis that explains the refusals, if one does: the last frame used was an outlier, and is taken back,
    /// or the rotor was kicked right after it.
    #[cold]
    pub(super) fn explain_refusals(&mut self, process: &impl Process<T, B>) -> Option<Fit<T, B>> {
        // In both the rotor is in motion, and is not kicked again.
        let (state, in_motion) = (self.newest.track.state, (T::zero(), false));
        let used = self.older.iter().rposition(|tracked| tracked.frame.exposed_at == state.at);
        if let Some(before) = used.and_then(|used| self.older.get(used.checked_sub(1)?))
            && let Some(fit) =
                self.fit(before.track.state, in_motion, Self::CONFIRMING_FRAMES_OF_AN_OUTLIER, process)
            && fit.is_good()
        {
            let state = before.track.state;
            self.older.iter_mut().skip(used?).for_each(|tracked| tracked.track.state = state);
            return Some(fit);
        }
        let mut kicked = state;
        kicked.covariance.widen_rate(self.tuning.kick_rad2_s2);
        let fit = self.fit(kicked, in_motion, Self::CONFIRMING_FRAMES, process)?;
        let explained = fit.is_good() && !self.has_jumped(Self::CONFIRMING_FRAMES, process);
        explained.then_some(Fit { kicked: true, ..fit })
    }

    /// Whether the newest `count` frames agree on an angle and a rate, whatever was known before.
    #[inline(never)]
    pub(super) fn frames_agree(&self, count: usize, process: &impl Process<T, B>) -> bool {
        let first = (self.older.len() + 1).checked_sub(count).and_then(|index| self.older.get(index));
        let (Some(first), track) = (first, &self.newest.track) else { return true };
        let started = Track::started(&first.frame, track.state.angle.angle(), Some(track), &self.tuning);
        self.fit(started.state, (T::zero(), false), count - 1, process).is_some()
    }

    /// Frames since the last one used in `track`, the newest included, as far as they are kept.
    #[inline(never)]
    pub(super) fn frames_since(&self, track: &Track<T, B>) -> usize {
        1 + self.older.iter().filter(|tracked| tracked.frame.exposed_at > track.state.at).count()
    }

    /// The `state` carried through the newest `count` frames, if the newest and all but a few of the others are within
    /// its gate. The hypothesis is the variance of a kick before each frame, in rad^2/s^2, and whether the rotor lies
    /// still.
    #[inline(never)]
    pub(super) fn fit(
        &self,
        mut state: State<T, B>,
        (kick_rad2_s2, resting): (T, bool),
        count: usize,
        process: &impl Process<T, B>,
    ) -> Option<Fit<T, B>> {
        let newest = &self.newest;
        let (mut misfit, mut frames, mut outliers) = (T::zero(), T::zero(), 0);
        let first = (self.older.len() + 1).checked_sub(count)?;
        for tracked in self.older.iter().skip(first).chain(core::iter::once(newest)) {
            let frame = &tracked.frame;
            if frame.exposed_at <= state.at {
                return None;
            }
            state.covariance.widen_rate(kick_rad2_s2);
            process.carry(&mut state, resting, frame.exposed_at);
            let innovation_rad = state.innovation_rad(frame.angle);
            let noise_rad2 = self.tuning.frame_rad2(frame, state.rate_rad_s, false);
            let variance_rad2 = state.covariance.innovation_rad2(noise_rad2);
            let normalised = innovation_rad * innovation_rad / variance_rad2;
            let is_newest = frame.exposed_at == newest.frame.exposed_at;
            // Written so that NaN is refused.
            let plausible = normalised <= self.tuning.gate;
            if !plausible {
                outliers += 1;
                if is_newest || Self::FRAMES_PER_OUTLIER * outliers + Self::CONFIRMING_FRAMES > count {
                    return None;
                }
                continue;
            }
            (misfit, frames) = (misfit + normalised, frames + T::one());
            if is_newest {
                let (innovation, mean_misfit) = ((innovation_rad, variance_rad2), misfit / frames);
                return Some(Fit { state, innovation, normalised, mean_misfit, frames, kicked: false });
            }
            state.correct(innovation_rad, noise_rad2);
        }
        None
    }
}
