//! What is read from the track: the present, the past, and whether the estimate may be used.

use motor_model::{Real, Time};

use super::Tracker;
use super::reference::Reference;
use crate::camera::process::{Jitter, Process};
use crate::camera::smoother::Smoothed;
use crate::camera::track::{State, Track};
use crate::camera::track_covariance::{Carried, SmoothedCovariance, TrackCovariance};
use crate::filter::{Estimate, Health, Reason};

impl<T: Real, B: TrackCovariance<T>> Tracker<T, B> {
    /// Angle variance in rad^2 beyond which an estimate is of no use: half a degree.
    pub(super) const UNCERTAIN_RAD2: f64 = 7.6e-5;

    /// Angle variance in rad^2 beyond which an estimate is not good: three standard deviations are 0.1 degrees.
    const WIDE_RAD2: f64 = 3.385e-7;

    /// Variance of the rate before a second frame: half the prior.
    const RATE_UNKNOWN_RAD2_S2: f64 = 200.0;

    /// Refusals in a row from which on the estimate is of no use: a single outlier or a landing causes one or two.
    pub(super) const REFUSALS_SUSTAINED: u8 = 3;

    /// Mean normalised innovation squared beyond which the camera is worse than its variance says: a right one has 1 +-
    /// 0.13 over 64 frames, and the filters' own models are within 1.5 of it.
    const NIS_MAX: f64 = 4.0;

    /// So many of eight frames beyond four standard deviations show the same before the mean does. With a right camera
    /// a driven rotor has as many in a thousandth of the time, since single impacts kick it further than white noise
    /// would.
    const FAR_FRAMES: u32 = 3;

    /// Mean normalised innovation squared, as a part of the gate, beyond which the estimate is of no use. A refused
    /// frame counts as the gate: beyond a half the refused frames outnumber those used, and the wrong ones may be used.
    const NIS_LOST: f64 = 0.5;

    /// What no number of frames removes of the estimates that follow from `track`: [`crate::camera::persistent_error`].
    pub(super) fn persistent_of(&self, track: &Track<T, B>) -> Jitter<T> {
        let tuning = &self.tuning;
        let described_rad2 = tuning.shared_rad2(&self.newest.frame);
        let shared_rad2 = described_rad2 + self.persistent_error.rad2(track.resting, tuning);
        let mut rate_rad2_s2 = T::zero();
        if shared_rad2 > T::zero() {
            let covariance = &track.state.covariance;
            rate_rad2_s2 =
                T::from_f64(0.5) * shared_rad2 * (covariance.rate_rad2_s2() / covariance.angle_rad2());
        }
        let floor_rad2 = if track.undithered(tuning) { tuning.quantisation_rad2 } else { tuning.floor_rad2 };
        // What the rotor turns by in the error of the clock, which frames share (F21).
        let turned_rad = track.state.rate_rad_s * tuning.clock_sd_s();
        Jitter { angle_rad2: floor_rad2 + shared_rad2 + turned_rad * turned_rad, rate_rad2_s2 }
    }

    /// Angle and rate carried forward to `now`; `None` before the first frame.
    pub(crate) fn estimate(&self, now: Time, process: &impl Process<T, B>) -> Option<Estimate<T>> {
        let track = self.track()?;
        self.estimate_from(process.cached_state(&track.state, track.resting, now), now, process)
    }

    /// As [`Self::estimate`], from a state to which the track has been carried already.
    pub(crate) fn estimate_from(
        &self,
        from: &State<T, B>,
        now: Time,
        process: &impl Process<T, B>,
    ) -> Option<Estimate<T>> {
        let track = self.track()?;
        let mut estimate = process.predict(from, track.resting, now);
        let (persistent, jitter) = (self.persistent, process.jitter(now));
        estimate.angle_rad2 = estimate.angle_rad2 + persistent.angle_rad2 + jitter.angle_rad2;
        estimate.rate_rad2_s2 = estimate.rate_rad2_s2 + persistent.rate_rad2_s2 + jitter.rate_rad2_s2;
        Some(estimate)
    }

    /// Whether `estimate`, this tracker's at `now`, may be used. `vibrometer` is what is wrong with the vibrometer, if
    /// anything.
    pub(crate) fn judge(
        &self,
        estimate: Option<&Estimate<T>>,
        now: Time,
        vibrometer: Option<Reason>,
    ) -> Health {
        let (Some(track), Some(estimate)) = (self.track(), estimate) else { return Health::Waiting };
        let variance_rad2 = estimate.angle_rad2;
        // Written so that a variance that has overflowed fails too.
        let certain = variance_rad2 <= T::from_f64(Self::UNCERTAIN_RAD2);
        let wide = variance_rad2 > T::from_f64(Self::WIDE_RAD2);
        match track.nis {
            _ if self.stuck.is_some() => Health::Unusable(Reason::CameraStuck),
            _ if track.refusals >= Self::REFUSALS_SUSTAINED => Health::Unusable(Reason::FramesRefused),
            _ if self.reference.lost => Health::Unusable(Reason::ReferenceLost),
            // Between the frames of a slow camera the estimate is wide, but right.
            _ if !certain
                && variance_rad2 <= T::from_f64(Reference::<T, B>::LOST_RAD2)
                && self.on_time(now) =>
            {
                Health::Degraded(Reason::Uncertain)
            }
            _ if !certain => Health::Unusable(Reason::Uncertain),
            nis if nis > T::from_f64(Self::NIS_LOST) * self.tuning.gate => {
                Health::Unusable(Reason::NoiseMismatch)
            }
            _ if self.silent(now) => Health::Degraded(Reason::CameraSilent),
            _ if !self.frames_fit() => Health::Degraded(Reason::NoiseMismatch),
            _ if !self.reference.turn_known => Health::Degraded(Reason::TurnUnknown),
            _ => vibrometer.or(wide.then_some(Reason::Uncertain)).map_or(Health::Good, Health::Degraded),
        }
    }

    /// Whether the frames are as far from the track as their variance says.
    pub(super) fn frames_fit(&self) -> bool {
        let Track { nis, far, .. } = &self.newest.track;
        *nis <= T::from_f64(Self::NIS_MAX) && far.count_ones() < Self::FAR_FRAMES
    }

    /// Whether frames come as they should, and the rate has been measured since the start.
    #[cold]
    fn on_time(&self, now: Time) -> bool {
        let rate_rad2_s2 = self.newest.track.state.covariance.rate_rad2_s2();
        rate_rad2_s2 < T::from_f64(Self::RATE_UNKNOWN_RAD2_S2) && !self.older.is_empty() && !self.silent(now)
    }

    fn silent(&self, now: Time) -> bool {
        self.intervals.silent(self.newest.frame.exposed_at, now)
    }

    /// Angle and rate at `at`, from the frames before and after it; `None` before the oldest frame kept.
    pub(crate) fn smoothed<P, const N: usize>(&self, at: Time, process: &P) -> Option<Estimate<T>>
    where
        B: SmoothedCovariance<T, N>,
        P: Process<T, B> + Process<T, Carried<T, B, N>>,
    {
        let newest = self.track()?;
        if at >= newest.state.at {
            return self.estimate(at, process);
        }
        let (mut smoothed, mut later) = (Smoothed::newest(&newest.state), newest);
        for earlier in self.older.iter().rev().map(|tracked| &tracked.track) {
            // A refused frame has left the track where it was.
            if earlier.state.at >= later.state.at {
                continue;
            }
            let kick = if later.kicked { self.tuning.kick_rad2_s2 } else { T::zero() };
            let (mut state, reached) = (earlier.state, earlier.state.at <= at);
            if reached {
                process.carry(&mut state, earlier.resting, at);
            }
            smoothed = smoothed.step_back_to(&state, earlier.resting, kick, process)?;
            if reached {
                let added = Process::<T, B>::jitter(process, at).plus(self.persistent_of(earlier));
                return Some(smoothed.estimate(earlier.resting, added));
            }
            later = earlier;
        }
        None
    }
}
