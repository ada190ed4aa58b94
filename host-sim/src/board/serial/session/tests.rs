use controller::map_correction::{LearntFactors, MapCorrection};
use link::{BoardIdentity, Counters, LdvRecords, ResetCause};

use super::*;
use crate::board::serial::fake_board::FakeBoard;
use crate::board::serial::serial_run::KEEP_ALIVE;

fn next(session: &mut BoardSession) -> Option<BoardMessage> {
    match session.next_event_until(host_nanos() + 5_000_000_000)? {
        Event::Board { message, .. } => Some(message),
        event => panic!("{event:?}"),
    }
}

fn identity() -> BoardIdentity {
    BoardIdentity { loop_digest: 0, reset_cause: ResetCause::Power.into() }
}

/// The board answers 20 ms late, when it is asked again. The round trip is that of 20 ms, or there is none.
#[test]
fn exact_a_late_answer_makes_no_short_round_trip() {
    let (mut session, mut board) = FakeBoard::with_session();
    session.ask_time().unwrap();
    std::thread::sleep(Duration::from_millis(20));
    session.ask_time().unwrap();
    board.says(5, &BoardMessage::Armed);
    assert_eq!(next(&mut session), Some(BoardMessage::Armed));
    assert!(
        session.shortest_nanos().is_none_or(|nanos| nanos >= 20_000_000),
        "{:?}",
        session.shortest_nanos()
    );
    // The answer to the second question sets the clocks, whichever that was.
    let (asked, _) = (board.hears(), board.hears());
    assert_eq!(asked, HostMessage::Arm);
    board.says(2_000, &BoardMessage::Counters(Counters::default()));
    assert!(next(&mut session).is_some());
    assert!(session.clock().is_some());
}

/// An answer of another session is none.
#[test]
fn exact_an_answer_of_another_session_sets_no_clock() {
    let (mut session, mut board) = FakeBoard::with_session();
    session.ask_time_unarmed().unwrap();
    board.session = board.session.wrapping_add(1);
    board.says(5, &BoardMessage::Counters(Counters::default()));
    assert!(next(&mut session).is_some() && session.clock().is_none());
}

/// Frames that the line loses are counted, and a board that begins anew has lost none.
#[test]
fn exact_lost_frames_of_the_board_are_counted() {
    let (mut session, mut board) = FakeBoard::with_session();
    for lost in [0, 2, 0, 1] {
        board.lose(lost);
        board.says(5, &BoardMessage::Stopped);
        assert!(next(&mut session).is_some());
    }
    assert_eq!(session.lost, 3);
    board.begin_anew();
    board.says(5, &BoardMessage::Welcome { tick_nanos: PositionLoop::TICK_NANOS });
    board.says(5, &BoardMessage::Stopped);
    assert!(next(&mut session).is_some() && next(&mut session).is_some());
    assert_eq!(session.lost, 3);
    board.lose(1);
    board.says(5, &BoardMessage::Stopped);
    assert!(next(&mut session).is_some());
    assert_eq!(session.lost, 4);
}

/// What was learnt by a move that has learnt nothing.
fn nothing_learnt() -> LearntFactors {
    LearntFactors::from(&MapCorrection::of(controller::ResponseMap::table_1()))
}

/// What the line has lost is asked again: the time by another question, all else by the same. A board that is armed
/// hears from its host in the meantime, and else it would have switched off and answered so; one that is not is not
/// told.
#[test]
fn exact_a_lost_question_is_asked_again() {
    let (mut session, mut board) = FakeBoard::with_session();
    let board = std::thread::spawn(move || {
        let asked = [board.hears_question(), board.hears_question()];
        board.says(7, &BoardMessage::Identity(identity()));
        let mut asked_then = Vec::new();
        for answer in [BoardMessage::Armed, BoardMessage::Learnt(nothing_learnt().into())] {
            let ((question, _), (again, alive)) = (board.hears_question(), board.hears_question());
            let silent = BoardMessage::Fault(BoardFault::HostSilent);
            board.says(8, if alive > 0 { &answer } else { &silent });
            asked_then.extend([question, again]);
        }
        // The line is open as long as the board is there.
        (board, asked, asked_then)
    });
    assert_eq!(session.ticks_unarmed().unwrap(), 7);
    assert!(session.clock().is_some());
    assert_eq!(session.arm().unwrap(), 8);
    assert_eq!(session.learnt(nanos(KEEP_ALIVE)), Some(nothing_learnt()));
    let (_, asked, asked_then) = board.join().unwrap();
    assert_eq!(asked, [(HostMessage::Count, 0), (HostMessage::Identify, 0)]);
    assert_eq!(asked_then, [HostMessage::Arm, HostMessage::Arm, HostMessage::Learnt, HostMessage::Learnt]);
}

/// A board answers late, over a line that keeps what both sides say: by then it has heard several times that its host
/// is there.
#[test]
fn law_a_board_that_is_armed_hears_from_its_host_until_it_answers() {
    let (mut session, mut board) = FakeBoard::with_session();
    let board = std::thread::spawn(move || {
        for answer in [BoardMessage::Armed, BoardMessage::Learnt(nothing_learnt().into())] {
            let mut alive = 0;
            while alive < 4 {
                alive += u32::from(board.hears() == HostMessage::Ldv(LdvRecords::new()));
            }
            board.says(8, &answer);
        }
        board
    });
    assert_eq!(session.arm().unwrap(), 8);
    assert_eq!(session.learnt(nanos(KEEP_ALIVE)), Some(nothing_learnt()));
    board.join().unwrap();
}
