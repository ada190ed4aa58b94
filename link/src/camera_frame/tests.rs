extern crate std;

use std::collections::HashSet;
use std::vec::Vec;

use proptest::prelude::*;
use rand_core::Rng;
use rand_pcg::Pcg64;

use super::*;
use crate::frame::decode_on_board;
use crate::{BoardMessage, decode};

const RECORD: CameraRecord =
    CameraRecord { exposed_nanos: 5_000_000, angle_units: -5, marks_used: 2, residual: 12 };
const HEADER: Header = Header { session: 0x0102_0304, sequence: 7, ticks: 520 };
const EXPECTED: Expected = Expected { session: 0x0102_0304, sequence: 7, now_nanos: 5_200_000 };

fn framed(header: Header, record: CameraRecord) -> Vec<u8> {
    let mut frame = [0; FRAME_BYTES_MAX];
    let length = encode_camera(header, record, &mut frame).unwrap();
    frame[..length].to_vec()
}

fn decoded(mut frame: Vec<u8>, expected: Expected) -> Result<(Header, HostMessage), FrameError> {
    decode_on_board(&mut frame, Some(expected))
}

/// The bytes, by hand: 20,000 units are 0x4E20; CRC-16/DNP by its check value.
#[test]
fn exact_bytes_of_a_short_frame() {
    assert_eq!(CRC.checksum(b"123456789"), 0xEA82, "the check value of CRC-16/DNP");
    let fields = [0x20, 0x4E, 0xFB, 0xFF, 0xFF, 0xFF, 12, 0x72];
    let crc = CRC.checksum(&[&[VERSION, 4, 3, 2, 1][..], &fields].concat()).to_le_bytes();
    assert!(!crc.contains(&0));
    let expected = [&[11][..], &fields, &crc, &[0]].concat();
    assert_eq!(framed(HEADER, RECORD), expected);
    assert_eq!(expected.len(), SHORT_FRAME_BYTES);
    let header = Header { ticks: 0, ..HEADER };
    assert_eq!(decoded(expected, EXPECTED), Ok((header, HostMessage::Camera(RECORD))));
}

/// A record that a short frame cannot hold goes as any message does.
#[test]
fn exact_other_records_go_in_long_frames() {
    let now_nanos = HEADER.ticks * PositionLoop::TICK_NANOS;
    let late = Header { ticks: 2_000, ..HEADER };
    for (header, record) in [
        (HEADER, CameraRecord { exposed_nanos: 5_000_100, ..RECORD }),
        (HEADER, CameraRecord { marks_used: 16, ..RECORD }),
        (HEADER, CameraRecord { exposed_nanos: now_nanos + EARLY_NANOS + 250, ..RECORD }),
        (late, CameraRecord { exposed_nanos: 9_663_750, ..RECORD }),
        (Header { ticks: u64::MAX, ..HEADER }, RECORD),
    ] {
        let frame = framed(header, record);
        assert!(frame.len() > SHORT_FRAME_BYTES, "{record:?}");
        assert_eq!(decode(&mut frame.clone()), Ok((header, HostMessage::Camera(record))));
        assert_eq!(decoded(frame, EXPECTED), Ok((header, HostMessage::Camera(record))));
    }
    // 20 ms less 14.336 ms and more 4 ms.
    assert_eq!(framed(late, CameraRecord { exposed_nanos: 9_664_000, ..RECORD }).len(), SHORT_FRAME_BYTES);
}

/// Up to five changed bits: syndromes of at most two bits differ from each other, and from those of three.
#[test]
fn exact_five_changed_bits_are_found() {
    let content = |bit: Option<usize>| {
        let mut fields = [0; FIELD_BYTES];
        if let Some(bit) = bit.filter(|bit| *bit < 8 * FIELD_BYTES) {
            fields[bit / 8] |= 1 << (bit % 8);
        }
        checksum(3, fields)
    };
    let syndrome = |bit: usize| {
        let of_crc = bit.checked_sub(8 * FIELD_BYTES).map_or(0, |place| 1 << place);
        content(Some(bit)) ^ content(None) ^ of_crc
    };
    let one: Vec<u16> = (0..8 * CONTENT_BYTES).map(syndrome).collect();
    let mut up_to_two = HashSet::from([0]);
    for (i, a) in one.iter().enumerate() {
        assert!(up_to_two.insert(*a), "bit {i}");
    }
    for (i, a) in one.iter().enumerate() {
        assert!(one[..i].iter().all(|b| up_to_two.insert(a ^ b)), "bit {i} and another");
    }
    for (i, a) in one.iter().enumerate() {
        for (j, b) in one[..i].iter().enumerate() {
            assert!(one[..j].iter().all(|c| !up_to_two.contains(&(a ^ b ^ c))), "bits {i}, {j} and another");
        }
    }
}

#[test]
fn exact_another_session_or_version_or_none_is_refused() {
    let frame = framed(HEADER, RECORD);
    let other = Expected { session: 5, ..EXPECTED };
    assert_eq!(decoded(frame.clone(), other), Err(FrameError::Checksum));
    assert_eq!(decode_on_board(&mut frame.clone(), None), Err(FrameError::NoSession));
    assert_eq!(decode::<BoardMessage>(&mut frame.clone()), Err(FrameError::Checksum));
    // Before the board's start.
    assert_eq!(decoded(frame, Expected { now_nanos: 0, ..EXPECTED }), Err(FrameError::Message));
}

/// Of random contents one in 65,536 passes: 15.3 of a million, within 2 to 40 (Poisson, 1e-5 and 1e-7).
#[test]
fn law_one_random_content_in_65_536_passes() {
    let mut random = Pcg64::new(3, 4);
    let mut passed = 0;
    for _ in 0..1_000_000 {
        let mut content = [0; CONTENT_BYTES];
        for byte in &mut content {
            *byte = random.next_u64() as u8;
        }
        passed += u32::from(decode_content(content, EXPECTED).is_ok());
    }
    assert!((2..=40).contains(&passed), "{passed}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever was lost, and however long the way, within what is promised.
    #[test]
    fn law_records_and_numbers_come_back(
        ticks in 2_000_u64..1 << 40, age in 0..=49_536_u64, way_ticks in 0_u64..=400, angle_units: i32,
        marks_used in 0..16_u8, residual: u8, session: u32, next: u32, ahead in -4_i32..12
    ) {
        // From 2 ms ahead of the sender's time to 10.336 ms behind it.
        let exposed_nanos = (ticks * PositionLoop::TICK_NANOS + EARLY_NANOS) / 250 * 250 - 250 * age;
        let record = CameraRecord { exposed_nanos, angle_units, marks_used, residual };
        let header = Header { session, sequence: next.wrapping_add_signed(ahead), ticks };
        let frame = framed(header, record);
        prop_assert_eq!(frame.len(), SHORT_FRAME_BYTES);
        let now_nanos = (ticks + way_ticks) * PositionLoop::TICK_NANOS;
        let expected = Expected { session, sequence: next, now_nanos };
        let back = (Header { ticks: 0, ..header }, HostMessage::Camera(record));
        prop_assert_eq!(decoded(frame, expected), Ok(back));
    }
}

/// After a day of a board, with the largest numbers of everything else: a frame that is too old for a short one.
#[test]
fn law_no_camera_frame_is_longer_than_said() {
    let ticks = 86_400 * 100_000;
    let exposed_nanos = ticks * PositionLoop::TICK_NANOS - SHORT_AGE_NANOS - UNIT_NANOS;
    let header = Header { session: u32::MAX, sequence: u32::MAX, ticks };
    let record = CameraRecord { exposed_nanos, angle_units: i32::MIN, marks_used: 15, residual: 255 };
    let length = |record| encode_camera(header, record, &mut [0; FRAME_BYTES_MAX]).unwrap();
    assert!((SHORT_FRAME_BYTES + 1..=LONG_FRAME_BYTES).contains(&length(record)), "{}", length(record));
    let exposed_nanos = exposed_nanos + UNIT_NANOS;
    assert_eq!(length(CameraRecord { exposed_nanos, ..record }), SHORT_FRAME_BYTES);
}
