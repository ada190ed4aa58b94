use std::time::{SystemTime, UNIX_EPOCH};

use link::{BoardIdentity, KeptDescription, ResetCause, decode};
use simulation::runs::record::RunRecord;

use super::*;
use crate::board::serial::fake_board::FakeBoard;

struct Nobody;

impl Watcher for Nobody {
    fn board(&mut self, _: &IdentityFigures) {}

    fn kept(&mut self, _: KeptDescription) {}

    fn record(&mut self, _: &RunRecord) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn progress(&mut self, _: &Progress) {}
}

/// A camera program that stood still writes fifty frames at once, of the last `from_ms` milliseconds: how many of
/// them went to the board as short frames, how many as others, and how many were left out.
fn sent_of_a_heap(from_ms: i64) -> (usize, usize, u64) {
    let (mut session, mut board) = FakeBoard::with_session();
    session.ask_time().unwrap();
    assert_eq!(board.hears(), HostMessage::Arm);
    board.says(100_000, &BoardMessage::Armed);
    assert!(session.next_event_until(host_nanos() + 5_000_000_000).is_some());
    let events = session.sender();
    let identity = BoardIdentity { loop_digest: 0, reset_cause: ResetCause::Power.into() };
    let description = DescriptionFigures { digest: String::new(), sent: true, kept: false, filter: "none" };
    let task = BoardTask::Move.watched(&Scene::of_sets(&[]).unwrap()).unwrap();
    let frames = FreshFrames::new(SHORT_AGE_NANOS);
    let figures = (identity.into(), description);
    let mut run = ArmedRun::new(session, task, figures, (None, frames), (0, Angle::ZERO));
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap();
    for ms in 0..50 {
        let exposed_nanos = nanos(now) - (from_ms - ms) * 1_000_000;
        let frame = HostFrame { exposed_nanos, angle: Angle::ZERO, residual: 0 };
        events.send(Event::Frame(frame)).unwrap();
    }
    let interrupted = AtomicBool::new(false);
    for _ in 0..60 {
        assert!(run.next(&interrupted, &mut Nobody).is_ok_and(|is_over| !is_over));
    }
    let (mut short, mut long) = (0, 0);
    while let Some(mut frame) = board.frame() {
        if frame.len() < SHORT_FRAME_BYTES {
            short += 1;
        } else if let Ok((_, HostMessage::Camera(_))) = decode(&mut frame) {
            long += 1;
        }
    }
    (short, long, run.frames.left_out)
}

/// Of a heap up to now those of the last ten milliseconds are sent, as short frames. Of one that ended a tenth of a
/// second ago the last is, and no other.
#[test]
fn exact_of_a_heap_of_frames_the_board_gets_the_new_ones() {
    let (short, long, left_out) = sent_of_a_heap(50);
    // On a machine that is busy all of them may be old by then.
    assert!((1..=11).contains(&(short + long)) && long <= 1, "{short} {long}");
    assert_eq!(left_out, 50 - (short + long) as u64);
    assert_eq!(sent_of_a_heap(150), (0, 1, 49));
}
