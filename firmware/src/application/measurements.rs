//! Queues of measurements that wait for a tick.

use controller::LDV_SAMPLES_PER_TICK_MAX;
use estimator::{CameraFrame, LdvSample};
use heapless::Deque;

/// A tick takes one frame. So many late frames are kept.
const CAMERA_FRAMES_MAX: usize = 8;

/// As many samples as three ticks take.
const LDV_SAMPLES_MAX: usize = 3 * LDV_SAMPLES_PER_TICK_MAX;

/// Two queues. A full queue drops its oldest entry for a new one.
#[derive(Debug, Default)]
pub(super) struct MeasurementQueues {
    camera_frames: Deque<CameraFrame, CAMERA_FRAMES_MAX>,
    ldv_samples: Deque<LdvSample, LDV_SAMPLES_MAX>,
    /// Number of measurements that were dropped.
    pub(super) dropped: u32,
}

/// Puts `item` at the end; whether the oldest entry was dropped for it.
fn push<T, const N: usize>(queue: &mut Deque<T, N>, item: T) -> bool {
    let dropped = queue.is_full() && queue.pop_front().is_some();
    // Never full here.
    let _ = queue.push_back(item);
    dropped
}

impl MeasurementQueues {
    pub(super) fn push_camera_frame(&mut self, frame: CameraFrame) {
        self.dropped += u32::from(push(&mut self.camera_frames, frame));
    }

    pub(super) fn push_ldv_sample(&mut self, sample: LdvSample) {
        self.dropped += u32::from(push(&mut self.ldv_samples, sample));
    }

    pub(super) fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.camera_frames.pop_front()
    }

    pub(super) fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv_samples.pop_front()
    }

    pub(super) fn clear(&mut self) {
        self.camera_frames.clear();
        self.ldv_samples.clear();
    }
}
