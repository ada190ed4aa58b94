use super::*;
use crate::board::serial::fake_board::FakeBoard;

fn next(session: &mut BoardSession) -> Option<BoardMessage> {
    match session.next_event_until(host_nanos() + 5_000_000_000)? {
        Event::Board { message, .. } => Some(message),
        event => panic!("{event:?}"),
    }
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

/// A frame of 3 ms ago was 3 ms ago by the host's clock too, whatever the time of day was set to before.
#[test]
fn exact_times_of_day_by_the_host_s_clock() {
    for day_nanos in [0, 1_795_000_000_000_000_000] {
        assert_eq!(by_host_clock(day_nanos - 3_000_000, 7_000_000, day_nanos), 4_000_000);
    }
    assert_eq!(by_host_clock(9_000_000_000_000_000_000, i64::MAX, 0), i64::MAX);
    let before = host_nanos();
    assert!((0..1_000_000_000).contains(&(host_nanos() - before)));
}
