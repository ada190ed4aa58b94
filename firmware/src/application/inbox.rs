//! Measurements that have arrived and wait for a tick.

use controller::LDV_SAMPLES_PER_TICK_MAX;
use estimator::{CameraFrame, LdvSample};
use heapless::Deque;

/// A tick takes one frame; a burst of so many late ones is kept.
const CAMERA_FRAMES_MAX: usize = 8;

/// Four ticks' worth.
const LDV_SAMPLES_MAX: usize = 4 * LDV_SAMPLES_PER_TICK_MAX;

/// Two queues that drop their oldest entry for a new one.
#[derive(Debug, Default)]
pub(super) struct Inbox {
    camera_frames: Deque<CameraFrame, CAMERA_FRAMES_MAX>,
    ldv_samples: Deque<LdvSample, LDV_SAMPLES_MAX>,
    /// Measurements dropped.
    pub(super) dropped: u32,
}

/// Puts `item` at the end; whether an old one had to go for it.
fn put<T, const N: usize>(queue: &mut Deque<T, N>, item: T) -> bool {
    let dropped = queue.is_full() && queue.pop_front().is_some();
    // There is room now.
    let _ = queue.push_back(item);
    dropped
}

impl Inbox {
    pub(super) fn put_camera_frame(&mut self, frame: CameraFrame) {
        self.dropped += u32::from(put(&mut self.camera_frames, frame));
    }

    pub(super) fn put_ldv_sample(&mut self, sample: LdvSample) {
        self.dropped += u32::from(put(&mut self.ldv_samples, sample));
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
