//! Faults of a serial line: a byte that is stuck, and a receiver whose rate is not the sender's.

use super::sample_messages::host_messages;
use super::tests::{HEADER, framed};
use super::*;
use crate::Deframer;

extern crate std;

use std::vec::Vec;

/// Units of time in a bit of the sender, and in a look for the beginning of a byte: an STM32's receiver looks sixteen
/// times in a bit.
const UNITS_PER_BIT: usize = 16_000;
const UNITS_PER_LOOK: usize = UNITS_PER_BIT / 16;

/// The bytes that a receiver reads from a sender of `bytes`, one right after the other. The receiver's bits are so many
/// thousandths of the sender's long.
///
/// A byte begins where the line falls, which the receiver sees up to a look later. It reads each bit in its middle, as
/// long after that as its own bits last. Where it reads no stop bit, it has the byte all the same, and looks for the
/// next beginning.
fn received(bytes: &[u8], thousandths: usize) -> Vec<u8> {
    let bits = 10 * bytes.len();
    // Idle after the last byte.
    let is_high = |at: usize| match (at / UNITS_PER_BIT, at / UNITS_PER_BIT % 10) {
        (bit, _) if bit >= bits => true,
        (_, 0) => false,
        (_, 9) => true,
        (bit, place) => bytes[bit / 10] >> (place - 1) & 1 == 1,
    };
    let half_bit = UNITS_PER_BIT / 2 * thousandths / 1000;
    let (mut read, mut at) = (Vec::new(), 0);
    while at < bits * UNITS_PER_BIT {
        let was_high = at.checked_sub(UNITS_PER_LOOK).is_none_or(is_high);
        if is_high(at) || !was_high {
            at += UNITS_PER_LOOK;
            continue;
        }
        let bit = |place: usize| u8::from(is_high(at + (2 * place + 3) * half_bit));
        read.push((0..8).fold(0, |byte, place| byte | bit(place) << place));
        at += 19 * half_bit;
    }
    read
}

/// The frames that are decoded of `bytes`, and how many are refused.
fn decoded(bytes: &[u8]) -> (Vec<(Header, HostMessage)>, usize) {
    let mut deframer = Deframer::default();
    let (mut whole, mut refused) = (Vec::new(), 0);
    for &byte in bytes {
        match deframer.push(byte).map(decode::<HostMessage>) {
            Some(Ok(frame)) => whole.push(frame),
            Some(Err(_)) => refused += 1,
            None => {}
        }
    }
    (whole, refused)
}

/// Every message, numbered, and its frames on the line one after the other.
fn sent() -> (Vec<(Header, HostMessage)>, Vec<u8>) {
    let numbered = (0_u32..).zip(host_messages());
    let sent: Vec<_> = numbered.map(|(sequence, message)| (Header { sequence, ..HEADER }, message)).collect();
    let bytes = sent.iter().flat_map(|(header, message)| framed(*header, message)).collect();
    (sent, bytes)
}

/// At the end of a byte, 9.5 bits after its beginning, an error of 2 % has shifted the reading by 0.19 bits, and the
/// look for the beginning by at most 0.0625: it stays within the bit, half a bit from its edge.
#[test]
fn law_a_baud_error_of_2_percent_spoils_no_byte() {
    let (sent, bytes) = sent();
    for thousandths in [980, 1000, 1020] {
        assert_eq!(received(&bytes, thousandths), bytes, "{thousandths}");
    }
    assert_eq!(decoded(&bytes), (sent, 0));
}

/// Beyond half a bit in 9.5 bytes are read wrong, and begin in the middle of others. No frame comes of them that was
/// not sent. The frames after are whole when the rates are the same again.
#[test]
fn law_no_wrong_frame_at_a_wrong_baud_rate() {
    let (sent, bytes) = sent();
    for thousandths in (900..=1100).chain([500, 2000]) {
        let mut read = received(&bytes, thousandths);
        let (whole, _) = decoded(&read);
        assert!(whole.iter().all(|frame| sent.contains(frame)), "{thousandths}");
        // Half a bit and a look in 9.5 bits.
        if thousandths.abs_diff(1000) > 60 {
            assert!(whole.len() < sent.len(), "{thousandths}");
        }
        // A zero ends what is under way, as at the begin of a session.
        read.push(0);
        read.extend(&bytes);
        assert!(decoded(&read).0.ends_with(&sent), "{thousandths}");
    }
}

/// A byte of a frame is read again and again, as from a receiver that does not give the next one: twice, as often as a
/// frame is long, and more often. The frame goes on after that, or it does not. Neither becomes another frame, and the
/// second frame after it is whole: the first may have lost its beginning.
#[test]
fn law_no_wrong_frame_with_a_byte_stuck() {
    let (sent, bytes) = sent();
    for (header, message) in &sent {
        let frame = framed(*header, message);
        for place in 0..frame.len() {
            for times in [2, frame.len(), 2 * FRAME_BYTES_MAX] {
                for is_going_on in [true, false] {
                    let stuck = core::iter::repeat_n(&frame[place], times);
                    let rest = if is_going_on { &frame[place + 1..] } else { &[] };
                    let line: Vec<u8> = frame[..place].iter().chain(stuck).chain(rest).copied().collect();
                    let (whole, _) = decoded(&line);
                    let is_ended = frame[place] == 0;
                    assert_eq!(whole.len(), usize::from(is_ended), "{place} {times} of {message:?}");
                    assert!(whole.iter().all(|frame| *frame == (*header, message.clone())));
                    let after: Vec<u8> = line.iter().chain(&bytes).copied().collect();
                    let (whole, _) = decoded(&after);
                    assert!(whole.ends_with(&sent[1..]), "{place} {times} of {message:?}");
                }
            }
        }
    }
}

/// A line that is held low is a stream of zeros, and one that is held high brings nothing: neither is a frame, or a
/// damaged one.
#[test]
fn exact_a_line_that_is_held_is_silent() {
    assert_eq!(decoded(&[0; 10_000]), (Vec::new(), 0));
    assert_eq!(received(&[], 1000), []);
}
