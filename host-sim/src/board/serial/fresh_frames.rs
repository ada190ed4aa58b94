//! Which camera frames are sent: not an old one, where a newer one waits.
//!
//! A camera program or a host that stood still has a heap of frames at once. The old ones of them would load the line,
//! and the newer ones would be as old before their turn comes. A frame that is too old for a short one takes three
//! times the line: with a fast camera the heap would never end. The newest frame is sent however old it is, so that a
//! camera whose latency is not described is not lost.

use estimator::CameraFrame;

/// The frames of a run on their way to the board.
#[derive(Clone, Copy, Debug)]
pub(super) struct FreshFrames {
    /// Age in ns above which a frame is old.
    old_after_nanos: u64,
    /// An old frame, as long as it is not known that there is no newer one.
    waiting: Option<CameraFrame>,
    /// Frames that were left out.
    pub(super) left_out: u64,
}

impl FreshFrames {
    /// Frames are old after this time in ns.
    pub(super) fn new(old_after_nanos: u64) -> Self {
        Self { old_after_nanos, waiting: None, left_out: 0 }
    }

    /// Takes the next frame, at `now_nanos` of the board's time; the frame that is to be sent.
    pub(super) fn take(&mut self, frame: CameraFrame, now_nanos: u64) -> Option<CameraFrame> {
        self.left_out += u64::from(self.waiting.take().is_some());
        let is_old = now_nanos.saturating_sub(frame.exposed_at.nanos()) > self.old_after_nanos;
        self.waiting = Some(frame).filter(|_| is_old);
        Some(frame).filter(|_| !is_old)
    }

    /// Whether an old frame waits for a newer one.
    pub(super) fn is_waiting(&self) -> bool {
        self.waiting.is_some()
    }

    /// The old frame that waits: no newer one has come.
    pub(super) fn take_waiting(&mut self) -> Option<CameraFrame> {
        self.waiting.take()
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, Time};

    use super::*;

    const MS: u64 = 1_000_000;

    fn frame(at_ms: u64) -> CameraFrame {
        CameraFrame::new(Time::from_nanos(at_ms * MS), Angle::ZERO)
    }

    /// Of fifty frames at once, one in each of the last fifty milliseconds, those of the last ten are sent.
    #[test]
    fn exact_of_a_heap_the_new_frames_are_sent() {
        let mut frames = FreshFrames::new(10 * MS);
        let sent: Vec<_> = (51..=100).filter_map(|ms| frames.take(frame(ms), 100 * MS)).collect();
        assert_eq!(sent, (90..=100).map(frame).collect::<Vec<_>>());
        assert_eq!((frames.left_out, frames.take_waiting()), (39, None));
    }

    /// Where all are old, the newest is sent when nothing comes after it.
    #[test]
    fn exact_the_newest_is_sent_however_old_it_is() {
        let mut frames = FreshFrames::new(10 * MS);
        for ms in 51..=100 {
            assert_eq!(frames.take(frame(ms), 200 * MS), None);
        }
        assert!(frames.is_waiting());
        assert_eq!((frames.take_waiting(), frames.left_out), (Some(frame(100)), 49));
        assert!(!frames.is_waiting());
    }

    /// A frame of the future, by a clock that is not exact, is not old.
    #[test]
    fn exact_a_frame_of_the_future_is_sent() {
        let mut frames = FreshFrames::new(10 * MS);
        assert_eq!(frames.take(frame(5), 4 * MS), Some(frame(5)));
    }
}
