use controller::map_correction::MapCorrection;
use link::{BoardIdentity, Counters, ResetCause};

use super::*;
use crate::board::serial::fake_board::FakeBoard;

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

/// What the line has lost is asked again: the time by another question, what was learnt by the same.
#[test]
fn exact_a_lost_question_is_asked_again() {
    let (mut session, mut board) = FakeBoard::with_session();
    let learnt = controller::map_correction::LearntFactors::from(&MapCorrection::of(
        controller::ResponseMap::table_1(),
    ));
    let board = std::thread::spawn(move || {
        let asked = [board.hears(), board.hears()];
        board.says(7, &BoardMessage::Identity(identity()));
        let asked_then = [board.hears(), board.hears()];
        board.says(8, &BoardMessage::Learnt(learnt.into()));
        // The line is open as long as the board is there.
        (board, asked, asked_then)
    });
    assert_eq!(session.ticks_unarmed().unwrap(), 7);
    assert!(session.clock().is_some());
    assert_eq!(session.learnt(), Some(learnt));
    let (_, asked, asked_then) = board.join().unwrap();
    assert_eq!(asked, [HostMessage::Count, HostMessage::Identify]);
    assert_eq!(asked_then, [HostMessage::Learnt, HostMessage::Learnt]);
}
