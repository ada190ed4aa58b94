use link::{
    BoardIdentity, Counters, KeptDescription, LINE_BAUD, REPORT_TICKS_MAX, ResetCause, SHORT_FRAME_BYTES,
    decode,
};
use simulation::runs::record::RunRecord;

use super::*;
use crate::board::serial::fake_board::FakeBoard;
use crate::board::serial::progress::Progress;
use crate::board::serial::stamp_watch::ClockDoubt;

/// Sees how often the clock is doubted.
#[derive(Default)]
struct Doubts(usize);

impl Watcher for Doubts {
    fn board(&mut self, _: &IdentityFigures) {}

    fn kept(&mut self, _: KeptDescription) {}

    fn record(&mut self, _: &RunRecord) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    fn clock(&mut self, _: &ClockDoubt) {
        self.0 += 1;
    }

    fn progress(&mut self, _: &Progress) {}
}

/// The run of a board that has answered once, a millisecond later.
fn armed(stamps: StampWatch) -> (ArmedRun, FakeBoard) {
    let (mut session, mut board) = FakeBoard::with_session();
    session.ask_time().unwrap();
    assert_eq!(board.hears(), HostMessage::Arm);
    std::thread::sleep(Duration::from_millis(1));
    board.says(100_000, &BoardMessage::Armed);
    assert!(session.next_event_until(host_nanos() + 5_000_000_000).is_some());
    let identity = BoardIdentity { loop_digest: 0, reset_cause: ResetCause::Power.into() };
    let description = DescriptionFigures {
        digest: String::new(),
        sent: true,
        kept: false,
        filter: "none",
        clock_error_us: 500,
    };
    let task = BoardTask::Move.watched(&Scene::of_sets(&[]).unwrap()).unwrap();
    let frames = FreshFrames::new(SHORT_AGE_NANOS);
    let figures = (identity.into(), description);
    (ArmedRun::new(session, task, figures, (None, frames, stamps), (0, Angle::ZERO)), board)
}

/// A clock that is known to half a millisecond, with time stamps of ten microseconds: it is told once, after as many
/// answers beyond the first ones as begin a run, and not where instants are by the board's clock. The watch allows what
/// was described.
#[test]
fn exact_a_doubtful_clock_is_told_once() {
    let scene = Scene::of_sets(&["camera.stamp_jitter_s=1e-5".to_owned()]).unwrap();
    let described = Preparation::of(BoardTask::Move, &scene).unwrap();
    let watch = StampWatch::new(&described.camera());
    let told = StampWatch::new(&described.with_clock_error(10_000).camera());
    for (stamps, more, doubted) in [
        (watch, FIRST_QUESTIONS + 3, 1),
        (watch, FIRST_QUESTIONS - 1, 0),
        (told, FIRST_QUESTIONS + 3, 0),
        (StampWatch::none(), FIRST_QUESTIONS + 3, 0),
    ] {
        let (mut run, mut board) = armed(stamps);
        let mut doubts = Doubts::default();
        // Nothing is asked any more, and the clock stays as it is. The answers that begin the run do not count.
        run.time_asked = i64::MAX;
        for answer in 1..FIRST_QUESTIONS + more {
            board.says(100_000 + u64::from(answer), &BoardMessage::Counters(Counters::default()));
            while run.time_answers <= answer {
                assert!(run.next(&AtomicBool::new(false), &mut doubts).is_ok_and(|is_over| !is_over));
            }
        }
        assert_eq!(doubts.0, doubted, "{more}");
    }
}

/// In the middle of a run and at its end: what the filter is told of the clock, where it is told anything.
#[test]
fn exact_what_the_filter_is_told_of_the_clock_is_shown() {
    for (told_us, live, ended) in
        [(500, " us (filter: 500 us rms)", " us; the filter is told of 500 us rms\n"), (0, " us", " us\n")]
    {
        let (mut run, mut board) = armed(StampWatch::none());
        run.description.clock_error_us = told_us;
        let progress = run.progress(1.0).to_string();
        assert!(progress.contains(", clock +- ") && progress.ends_with(live), "{progress}");
        board.says(100_001, &BoardMessage::Counters(Counters::default()));
        let outcome = run.outcome(1.0, true, None);
        assert_eq!(serde_json::to_value(&outcome).unwrap()["description"]["clock_error_us"], told_us);
        let text = outcome.to_string();
        let clock = text.split_inclusive('\n').find(|line| line.starts_with("clock ")).unwrap();
        assert!(clock.contains("round trip") && clock.ends_with(ended), "{clock}");
    }
}

/// The first questions follow one another; of the others each waits for a quarter of the time since arming, and for
/// 100 ms of the board's time at most. The clock is then known to at most twice the bound of its exchanges.
#[test]
fn exact_questions_are_as_far_apart_as_the_drift_is_known() {
    const MS: i64 = 1_000_000;
    let (mut run, _board) = armed(StampWatch::none());
    let pause = |run: &mut ArmedRun, since_armed: i64| {
        run.time_asked = run.armed_at + since_armed;
        run.time_pause()
    };
    assert_eq!(pause(&mut run, 8 * MS), 0);
    run.time_answers = FIRST_QUESTIONS;
    assert_eq!([8, 200, 400, 9_000].map(|ms| pause(&mut run, ms * MS) / MS), [2, 50, 100, 100]);
    run.time_answered = false;
    assert_eq!(pause(&mut run, 8 * MS), 1_000 * MS);
    run.time_answered = true;
    run.pace = BoardPace::new(0, 0);
    run.pace.take(50_000, 1_000_000_000);
    assert_eq!([8, 9_000].map(|ms| pause(&mut run, ms * MS) / MS), [2, 200]);
}

/// A board that reports changes alone says within the longest period that it is there: ten such periods are silence. A
/// board of half the pace has twice the time.
#[test]
fn exact_ten_of_the_longest_periods_of_reports_are_silence() {
    let longest = Duration::from_nanos(u64::from(REPORT_TICKS_MAX) * PositionLoop::TICK_NANOS);
    assert_eq!(SILENCE_MAX, 10 * longest);
    for (ticks_in_a_second, periods, is_silent) in
        [(100_000, 5, false), (100_000, 11, true), (50_000, 11, false), (50_000, 21, true)]
    {
        let (mut run, _board) = armed(StampWatch::none());
        run.pace = BoardPace::new(0, 0);
        run.pace.take(ticks_in_a_second, 1_000_000_000);
        run.session.last_heard = host_nanos() - periods * nanos(longest);
        let next = run.next(&AtomicBool::new(false), &mut Doubts::default());
        assert_eq!(matches!(next, Err(Early::Silent)), is_silent, "{ticks_in_a_second} {periods}");
    }
}

/// A camera program that stood still writes fifty frames at once, of the last `from_ms` milliseconds: how many of
/// them went to the board as short frames, how many as others, and how many were left out.
fn sent_of_a_heap(from_ms: i64) -> (usize, usize, u64) {
    let (mut run, mut board) = armed(StampWatch::none());
    let events = run.session.sender();
    let now = host_nanos();
    for ms in 0..50 {
        let exposed_nanos = now - (from_ms - ms) * 1_000_000;
        let frame = HostFrame { exposed_nanos, angle: Angle::ZERO, residual: 0 };
        events.send(Event::Frame(frame)).unwrap();
    }
    let interrupted = AtomicBool::new(false);
    for _ in 0..60 {
        assert!(run.next(&interrupted, &mut Doubts::default()).is_ok_and(|is_over| !is_over));
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

/// Ctrl-C while the board is told what the run needs: it is told all of it, and is not armed.
#[test]
fn law_a_run_that_is_interrupted_before_it_begins_does_not_arm() {
    let (port, board) = FakeBoard::obedient();
    let (scene, interrupted) =
        (Scene::of_sets(&["ldv.installed=no".to_owned()]).unwrap(), AtomicBool::new(true));
    let run = SerialRun {
        port: &port,
        baud: LINE_BAUD,
        scene: &scene,
        task: BoardTask::Move,
        then: &[],
        keeping: Keeping::Untouched,
        source: &FrameSource::Plant,
        reports: ReportPeriod::checked(None, &FrameSource::Plant, false).unwrap(),
        interrupted: &interrupted,
    };
    let ended = run.run(&mut Doubts::default()).err().unwrap();
    assert!(matches!(ended, SerialError::Interrupted { stopped: Stopped::Acknowledged }), "{ended}");
    let (_board, heard) = board.join().unwrap();
    assert!(heard.iter().any(|message| matches!(message, HostMessage::Configure(_))), "{heard:?}");
    assert!(!heard.contains(&HostMessage::Arm), "{heard:?}");
}
