//! Camera frames in their short form: they do what long ones do, and the faults of a line are noticed in them too.

use link::{FRAME_BYTES_MAX, Header, SHORT_FRAME_BYTES, encode_camera};

use super::*;

impl Bench {
    /// A camera frame as it goes on the line when the host knows the board's time.
    fn camera_frame(&mut self, angle_units: i32) -> Vec<u8> {
        let ticks = self.board.elapsed_ticks;
        let header = Header { session: self.session, sequence: self.sequence, ticks };
        self.sequence = self.sequence.wrapping_add(1);
        let exposed_nanos = ticks * PositionLoop::TICK_NANOS;
        let record = CameraRecord { exposed_nanos, angle_units, marks_used: 0, residual: 0 };
        let mut frame = [0; FRAME_BYTES_MAX];
        let length = encode_camera(header, record, &mut frame).unwrap();
        assert_eq!(length, SHORT_FRAME_BYTES);
        frame[..length].to_vec()
    }

    /// Sends a frame of a camera that dithers, in its short or its long form; the report of the next tick.
    fn measured(&mut self, number: i32, short: bool) -> Option<TickRecord> {
        let angle_units = 350_546 * (number % 2);
        if short {
            let frame = self.camera_frame(angle_units);
            assert!(self.exchange_bytes(&frame).is_empty());
        } else {
            let exposed_nanos = self.board.elapsed_ticks * PositionLoop::TICK_NANOS;
            let record = CameraRecord { exposed_nanos, angle_units, marks_used: 0, residual: 0 };
            assert!(self.exchange(&HostMessage::Camera(record)).is_empty());
        }
        self.step()
    }
}

/// Every bit of every report is the same.
#[test]
fn dual_short_and_long_frames_do_the_same() {
    let [mut short, mut long] = [Bench::driving(), Bench::driving()];
    for number in 0..2000 {
        let reports = [short.measured(number, true), long.measured(number, false)];
        let [Some(report), Some(of_long)] = reports else { panic!("{number}: {reports:?}") };
        assert_eq!(report.difference(&of_long), None, "{number}");
        assert_eq!(report.camera.map(|camera| camera.taken_nanos), of_long.camera.map(|c| c.taken_nanos));
        assert!(report.camera.is_some(), "{number}");
    }
    assert_eq!(short.board.counters().taken, long.board.counters().taken);
}

/// L1: no flipped bit passes.
#[test]
fn law_no_flipped_bit_of_a_short_frame_is_taken() {
    let mut bench = Bench::driving();
    let frame = bench.camera_frame(5);
    let before = bench.board.counters();
    for bit in 0..8 * (frame.len() - 1) {
        let mut spoilt = frame.clone();
        spoilt[bit / 8] ^= 1 << (bit % 8);
        assert!(bench.exchange_bytes(&[&spoilt[..], &[0]].concat()).is_empty(), "bit {bit}");
    }
    let after = bench.board.counters();
    assert_eq!(after.taken, before.taken);
    assert!(after.damaged >= before.damaged + 80, "{after:?}");
    assert!(bench.exchange_bytes(&frame).is_empty());
    assert_eq!(bench.board.counters().taken, before.taken + 1);
}

/// L3: lost ones are counted, and one that comes twice or late is not taken.
#[test]
fn law_short_frames_lost_repeated_and_late_are_noticed() {
    let mut bench = Bench::driving();
    let before = bench.board.counters();
    let frames: Vec<_> = (0..5).map(|n| bench.camera_frame(n)).collect();
    for index in [0, 0, 4, 3] {
        assert!(bench.exchange_bytes(&frames[index]).is_empty());
    }
    let after = bench.board.counters();
    assert_eq!((after.taken - before.taken, after.lost - before.lost), (2, 3));
    assert_eq!((after.duplicates - before.duplicates, after.late - before.late), (1, 1));
}

/// L4: the host learns that the board has started anew.
#[test]
fn law_a_board_without_a_session_says_so() {
    let mut bench = Bench::driving();
    let frame = bench.camera_frame(0);
    bench.board = board();
    let fault = BoardMessage::Fault(BoardFault::UnknownSession { session: 0 });
    assert_eq!(bench.exchange_bytes(&frame), [fault]);
    assert_eq!(bench.board.counters().other_session, 1);
}

/// A damaged frame that passes its CRC-16 may have any number. It keeps no message out that follows.
#[test]
fn law_a_wrong_number_of_a_short_frame_keeps_no_message_out() {
    for ahead in 0..12 {
        let mut bench = Bench::driving();
        let sequence = bench.sequence;
        bench.sequence = sequence.wrapping_add(ahead);
        let wrong = bench.camera_frame(0);
        bench.sequence = sequence;
        let right = bench.camera_frame(0);
        assert!(bench.exchange_bytes(&[wrong, right].concat()).is_empty());
        assert_eq!(bench.exchange(&HostMessage::Stop), [BoardMessage::Stopped], "{ahead} ahead");
    }
}
