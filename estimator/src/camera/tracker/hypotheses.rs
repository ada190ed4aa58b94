//! What explains a frame beyond the gate.
//!
//! | hypothesis | test |
//! |---|---|
//! | the frame is an outlier | the next frame is within the gate |
//! | the last frame used was an outlier within its gate | the two newest frames fit the track before it |
//! | the rotor was kicked after the last frame used (landing) | the four newest frames fit that track with a kick |
//!
//! The variance of the kick is [`crate::TrackTuning::kick_rad2_s2`].
//!
//! Why four frames for a kick: if a fifth of the frames are outliers of 0.7 degrees, two that fit a kick by chance come
//! fifty times a second, three once a second, four once in ten seconds; each would lead the estimate astray by half a
//! degree or more.

use motor_model::{Angle, Real};

use super::Tracker;
use crate::camera::track::{Process, State, Track};
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
    /// Whether the hypothesis is a kick.
    pub(super) kicked: bool,
}

impl<T: Real, B: TrackCovariance<T>> Tracker<T, B> {
    /// Frames in a row that have to fit a kick, or a restart, before it is accepted.
    const CONFIRMING_FRAMES: usize = 4;

    /// Largest mean of their normalised innovations squared: 99.75 % of chi-square for two of them, 99.99 % for four.
    /// The gate of each alone would let a burst of outliers pass for a kick.
    const MEAN_MISFIT_MAX: f64 = 6.0;

    /// Frames in a row that prove that the last one used was an outlier.
    const CONFIRMING_FRAMES_OF_AN_OUTLIER: usize = 2;

    /// The hypothesis that explains the refusals, if one does: the last frame used was an outlier, and is taken back,
    /// or the rotor was kicked right after it.
    #[cold]
    pub(super) fn explain_refusals(&mut self, process: &impl Process<T, B>) -> Option<Fit<T, B>> {
        let state = self.track()?.state;
        let used = self.older.iter().rposition(|tracked| tracked.frame.exposed_at == state.at);
        if let Some(before) = used.and_then(|used| self.older.get(used.checked_sub(1)?))
            && let Some(fit) = self.fit(before.track.state, Self::CONFIRMING_FRAMES_OF_AN_OUTLIER, process)
            && fit.mean_misfit <= T::from_f64(Self::MEAN_MISFIT_MAX)
        {
            let state = before.track.state;
            self.older.iter_mut().skip(used?).for_each(|tracked| tracked.track.state = state);
            return Some(fit);
        }
        let mut kicked = state;
        kicked.covariance.widen_rate(self.tuning.kick_rad2_s2);
        let fit = self.fit(kicked, Self::CONFIRMING_FRAMES, process)?;
        (fit.mean_misfit <= T::from_f64(Self::MEAN_MISFIT_MAX)).then_some(Fit { kicked: true, ..fit })
    }

    /// Whether the newest frames agree on an angle and a rate, whatever was known before.
    #[cold]
    pub(super) fn newest_frames_agree(&self, process: &impl Process<T, B>) -> bool {
        let first =
            self.older.len().checked_sub(Self::CONFIRMING_FRAMES).and_then(|index| self.older.get(index));
        let Some((first, track)) = first.zip(self.track()) else { return true };
        let started = Track::started(&first.frame, track.state.angle.angle(), Some(track), &self.tuning);
        self.fit(started.state, Self::CONFIRMING_FRAMES, process).is_some()
    }

    /// `state` carried through the newest `count` frames, if all of them are within its gate.
    fn fit(&self, mut state: State<T, B>, count: usize, process: &impl Process<T, B>) -> Option<Fit<T, B>> {
        let newest = self.newest.as_ref()?;
        let mut mean_misfit = T::zero();
        let part = T::from_f64(1.0) / T::from_i32(i32::try_from(count).ok()?);
        let first = (self.older.len() + 1).checked_sub(count)?;
        for tracked in self.older.iter().skip(first).chain(core::iter::once(newest)) {
            let frame = &tracked.frame;
            if frame.exposed_at <= state.at {
                return None;
            }
            process.carry(&mut state, newest.track.resting, frame.exposed_at);
            let innovation_rad: T =
                frame.angle.minus(state.angle.angle()).wrapped().radians_since(Angle::ZERO);
            let noise_rad2 = self.tuning.frame_rad2(frame, false);
            let variance_rad2 = state.covariance.innovation_rad2(noise_rad2);
            let normalised = innovation_rad * innovation_rad / variance_rad2;
            mean_misfit += normalised * part;
            // Written so that NaN is refused.
            let plausible = normalised <= self.tuning.gate;
            if !plausible {
                return None;
            }
            if frame.exposed_at == newest.frame.exposed_at {
                let innovation = (innovation_rad, variance_rad2);
                return Some(Fit { state, innovation, normalised, mean_misfit, kicked: false });
            }
            state.correct(innovation_rad, noise_rad2);
        }
        None
    }
}
