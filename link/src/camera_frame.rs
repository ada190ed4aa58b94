//! Short frames of the camera: 12 bytes on the wire where a frame of any message takes 36 ([`LONG_FRAME_BYTES`]).
//!
//! ```text
//! COBS( time u16 | angle u32 | residual u8 | marks u4, sequence u4 | CRC-16 ) 0        little endian
//! ```
//!
//! Its length tells a short frame from the others, which are longer. Nothing is rounded: a record that does not fit
//! goes as a frame of any message does ([`encode_camera`]).
//!
//! | field | what it is | how the board completes it |
//! |---|---|---|
//! | time | exposure in units of 250 ns, lowest 16 bits | from [`LATE_NANOS`] before to [`EARLY_NANOS`] after now |
//! | angle | as in [`CameraRecord`] | |
//! | marks | those used, at most 15 | |
//! | sequence | lowest 4 bits | from 4 before to 11 after the number that is expected |
//! | CRC-16 | DNP's (polynomial 3D65), over version, session and the fields before it | by its session |
//!
//! So a frame of another session or version is a damaged one here. On 13 bytes this CRC finds every change of up to
//! five bits (Koopman and Chakravarty, Cyclic redundancy code polynomial selection for embedded networks, DSN 2004:
//! Hamming distance 6 up to 135 bits). One in 65,536 of the frames that are damaged more than that passes. It brings a
//! wrong angle or instant, which the gates of the filter are for, or a wrong sequence number, which the next message
//! with a CRC-32 sets right ([`crate::BoardSequence`]). Every message that changes a state has one.

use controller::PositionLoop;
use crc::{CRC_16_DNP, Crc};

use crate::frame::{FRAME_BYTES_MAX, FrameError, Header, VERSION, encode, frame_of};
use crate::message::{CameraRecord, HostMessage};

/// Bytes of a short frame on the wire, its final zero included.
pub const SHORT_FRAME_BYTES: usize = 12;

/// Most bytes of a camera frame that goes as one of any message does, in the first day of a board: its final zero, the
/// numbers of a session and of a tick, and those of the record in as many bytes as they need.
pub const LONG_FRAME_BYTES: usize = 40;

/// Fields and CRC.
pub(crate) const CONTENT_BYTES: usize = SHORT_FRAME_BYTES - 2;
/// The fields, which the CRC follows.
const FIELD_BYTES: usize = CONTENT_BYTES - 2;

/// Unit of the exposure: the instants of a camera of 10 kHz, and of any slower one by a whole number, are multiples.
pub const UNIT_NANOS: u64 = 250;
/// A frame may arrive this long after its exposure: 14.3 ms.
pub const LATE_NANOS: u64 = (0x1_0000 - EARLY_UNITS) * UNIT_NANOS;
/// The clock of the host may be this far ahead of the board's: 2 ms.
pub const EARLY_NANOS: u64 = EARLY_UNITS * UNIT_NANOS;
const EARLY_UNITS: u64 = 0x2000;
/// What is left of [`LATE_NANOS`] for the way to the board.
const TRANSPORT_NANOS: u64 = 4_000_000;
/// A frame older than this when it is sent goes as one of any message does: 10.3 ms.
pub const SHORT_AGE_NANOS: u64 = LATE_NANOS - TRANSPORT_NANOS;

/// Sequence numbers that are taken as new: the next one, and those after at most 11 lost ones.
const AHEAD: u8 = 12;

const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_DNP);

/// What a receiver knows, by which it completes a short frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expected {
    /// Its session.
    pub session: u32,
    /// The sequence number of the next frame.
    pub sequence: u32,
    /// Its time in ns.
    pub now_nanos: u64,
}

/// Writes a frame with a camera record into `frame`, short if it can be, and returns its length. `header.ticks` is the
/// board's time as the sender knows it.
///
/// # Errors
/// As [`encode`].
pub fn encode_camera(
    header: Header,
    record: CameraRecord,
    frame: &mut [u8; FRAME_BYTES_MAX],
) -> Result<usize, FrameError> {
    match fields(header, record) {
        Some(fields) => {
            let crc = checksum(header.session, fields).to_le_bytes();
            let mut content = [0; CONTENT_BYTES];
            content.iter_mut().zip(fields.into_iter().chain(crc)).for_each(|(place, byte)| *place = byte);
            frame_of(&content, frame)
        }
        None => encode(header, &HostMessage::Camera(record), frame),
    }
}

/// The fields of a short frame; `None` if the record does not fit one.
fn fields(header: Header, record: CameraRecord) -> Option<[u8; FIELD_BYTES]> {
    let CameraRecord { exposed_nanos, angle_units, marks_used, residual } = record;
    let now_nanos = header.ticks.checked_mul(PositionLoop::TICK_NANOS)?;
    let oldest = now_nanos.saturating_sub(SHORT_AGE_NANOS);
    let in_time = (oldest..=now_nanos.saturating_add(EARLY_NANOS)).contains(&exposed_nanos);
    if !in_time || !exposed_nanos.is_multiple_of(UNIT_NANOS) || marks_used > 0xF {
        return None;
    }
    let [low, high, ..] = (exposed_nanos / UNIT_NANOS).to_le_bytes();
    let [a, b, c, d] = angle_units.to_le_bytes();
    let [sequence, ..] = header.sequence.to_le_bytes();
    Some([low, high, a, b, c, d, residual, marks_used | sequence << 4])
}

/// Reads the content of a short frame.
///
/// # Errors
/// When it is damaged, of another session or version, or of an instant before the board's start.
pub(crate) fn decode_content(
    content: [u8; CONTENT_BYTES],
    expected: Expected,
) -> Result<(Header, HostMessage), FrameError> {
    let [low, high, a, b, c, d, residual, marks_and_sequence, crc @ ..] = content;
    let fields = [low, high, a, b, c, d, residual, marks_and_sequence];
    if checksum(expected.session, fields) != u16::from_le_bytes(crc) {
        return Err(FrameError::Checksum);
    }
    let latest = expected.now_nanos / UNIT_NANOS + EARLY_UNITS;
    let [latest_low, latest_high, ..] = latest.to_le_bytes();
    let before = u16::from_le_bytes([latest_low, latest_high]).wrapping_sub(u16::from_le_bytes([low, high]));
    let exposed_nanos = latest.checked_sub(before.into()).ok_or(FrameError::Message)? * UNIT_NANOS;
    let record = CameraRecord {
        exposed_nanos,
        angle_units: i32::from_le_bytes([a, b, c, d]),
        marks_used: marks_and_sequence & 0xF,
        residual,
    };
    let sequence = complete(marks_and_sequence >> 4, expected.sequence);
    let header = Header { session: expected.session, sequence, ticks: 0 };
    Ok((header, HostMessage::Camera(record)))
}

/// The sequence number that ends in the 4 bits of `low`, when `next` is expected.
fn complete(low: u8, next: u32) -> u32 {
    let [next_low, ..] = next.to_le_bytes();
    let ahead = low.wrapping_sub(next_low) & 0xF;
    let number = next.wrapping_add(ahead.into());
    if ahead < AHEAD { number } else { number.wrapping_sub(0x10) }
}

fn checksum(session: u32, fields: [u8; FIELD_BYTES]) -> u16 {
    let mut digest = CRC.digest();
    digest.update(&[VERSION]);
    digest.update(&session.to_le_bytes());
    digest.update(&fields);
    digest.finalize()
}

#[cfg(test)]
mod tests;
