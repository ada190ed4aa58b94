//! The lag: frames that are older than the last one, and frames of a wrong time.
//!
//! The track lives at the last exposure and is carried forward when an estimate is asked for, so a latency costs
//! nothing. A frame older than the last is fused in its place: the track goes back to the frame before it, and the
//! newer frames are taken in again. So the order of arrival makes no difference. For this the last [`FRAMES_KEPT`]
//! frames are kept, each with the track after it. They limit the *difference* of latencies that can be corrected, not
//! the latency.
//!
//! - A frame from before the oldest one kept is [`Rejection::OutOfHorizon`].
//! - A frame of an exposure that is kept already is [`Rejection::Duplicate`].
//! - A frame from more than a millisecond after the filter's clock, the latest time of drive and vibrometer, is
//!   [`Rejection::Future`]. Where neither has reported a time since the last frame there is no clock to judge by.
//!
//! None of these moves the estimate. All but duplicates count as refusals, so that a track which itself stands at a
//! wrong time is given up after [`TrackTuning::refusals_max`](crate::TrackTuning::refusals_max) of them.

use heapless::Deque;
use motor_model::Real;

use super::{FRAMES_KEPT, TrackedFrame, Tracker, refused};
use crate::camera::process::Process;
use crate::camera::track_covariance::TrackCovariance;
use crate::innovation::{Innovation, Rejection};
use crate::measurement::CameraFrame;

impl<T: Real, B: TrackCovariance<T>> Tracker<T, B> {
    /// A frame that arrives after newer ones: goes back, fuses it, and then the newer ones again.
    #[cold]
    pub(super) fn process_late(
        &mut self,
        frame: &CameraFrame,
        quiet: bool,
        process: &impl Process<T, B>,
    ) -> Innovation<T> {
        let is_same = |tracked: &TrackedFrame<T, B>| tracked.frame.exposed_at == frame.exposed_at;
        if is_same(&self.newest) || self.older.iter().any(is_same) {
            return refused(frame, (T::zero(), T::zero()), Rejection::Duplicate);
        }
        let oldest = self.older.front().unwrap_or(&self.newest);
        if frame.exposed_at < oldest.frame.exposed_at.max(oldest.track.state.at) {
            return self.refuse_for_time(frame, Rejection::OutOfHorizon);
        }
        // A frame that is processed again tells nothing new of the process.
        let correlation = self.correlation;
        let mut newer = Deque::<CameraFrame, FRAMES_KEPT>::new();
        while self.newest.frame.exposed_at > frame.exposed_at {
            let Some(before) = self.older.pop_back() else { break };
            // Cannot overflow: it has the capacity of the lag.
            let _ = newer.push_front(self.newest.frame);
            self.newest = before;
        }
        let innovation = core::iter::once(frame).chain(&newer).fold(None, |first, frame| {
            let judged = self.process_newest(frame, quiet, process);
            first.or(Some(judged))
        });
        self.correlation = correlation;
        innovation.unwrap_or(refused(frame, (T::zero(), T::zero()), Rejection::OutOfHorizon))
    }

    /// Refuses a frame for its time. After too many refusals restarts at it.
    #[cold]
    pub(super) fn refuse_for_time(&mut self, frame: &CameraFrame, why: Rejection) -> Innovation<T> {
        let track = &mut self.newest.track;
        track.refusals = track.refusals.saturating_add(1);
        if track.refusals >= self.tuning.refusals_max {
            return self.begin(frame, self.newest.track.state.angle.angle());
        }
        refused(frame, (T::zero(), T::zero()), why)
    }
}
