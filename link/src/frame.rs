//! Frames: one message on the wire each.
//!
//! ```text
//! COBS( version u8 | session u32 | sequence u32 | ticks u64 | message, postcard | CRC-32 ) 0        little endian
//! ```
//!
//! The CRC (that of Ethernet and zip) is over everything before it. Version and CRC keep their places in every version
//! to come, so that a frame of another version is told from a damaged one. A camera frame may be shorter
//! ([`crate::camera_frame`]).

use crc::{CRC_32_ISO_HDLC, Crc};
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::camera_frame::{self, Expected};
use crate::message::{BoardMessage, HostMessage};

/// Version of header and messages: it goes up whenever either changes.
pub const VERSION: u8 = 17;

/// Rate of a serial line in baud: one that an STM32's clock of 170 MHz divides to, and that debuggers carry. Camera
/// frames of 10 kHz take 60 % of it, and a thousand reports a second at most 62 % of the other direction, fifty 3 %.
pub const LINE_BAUD: u32 = 2_000_000;

/// Longest frame, its final zero included.
pub const FRAME_BYTES_MAX: usize = 384;

/// Before the message.
const HEADER_BYTES: usize = 17;
/// After it.
const CRC_BYTES: usize = 4;
/// Header, message and CRC: COBS adds a byte for every 254, at least one, and the zero ends the frame.
const CONTENT_BYTES_MAX: usize = FRAME_BYTES_MAX - 3;

const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// The fields that go with every message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// The session that it belongs to.
    pub session: u32,
    /// Its number in this session and direction.
    pub sequence: u32,
    /// Ticks of the loop that the sender has counted.
    pub ticks: u64,
}

/// Why bytes are refused as a frame, or a message as too long.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// No valid COBS.
    #[error("not COBS")]
    Coding,
    /// As long as a short frame of the camera, which is read only in a session.
    #[error("no session")]
    NoSession,
    /// Too short for a header and a CRC.
    #[error("too short")]
    TooShort,
    /// Damaged: the CRC does not match.
    #[error("wrong CRC")]
    Checksum,
    /// Whole, but of another version of the protocol.
    #[error("protocol version {theirs}, expected {VERSION}")]
    Version {
        /// The sender's version.
        theirs: u8,
    },
    /// Whole, but no message that is expected here.
    #[error("no such message")]
    Message,
    /// The message does not fit a frame.
    #[error("too long")]
    TooLong,
}

/// Writes a frame into `frame` and returns its length.
///
/// # Errors
/// When the message does not fit. Every message of this crate fits.
pub fn encode<M: Serialize>(
    header: Header,
    message: &M,
    frame: &mut [u8; FRAME_BYTES_MAX],
) -> Result<usize, FrameError> {
    let mut content = [0; CONTENT_BYTES_MAX];
    let length = fill(header, message, &mut content).ok_or(FrameError::TooLong)?;
    frame_of(content.get(..length).ok_or(FrameError::TooLong)?, frame)
}

/// Writes the frame of `content`, and returns its length.
pub(crate) fn frame_of(content: &[u8], frame: &mut [u8; FRAME_BYTES_MAX]) -> Result<usize, FrameError> {
    let (last, body) = frame.split_last_mut().ok_or(FrameError::TooLong)?;
    let coded = cobs::try_encode(content, body).map_err(|_| FrameError::TooLong)?;
    *body.get_mut(coded).unwrap_or(last) = 0;
    Ok(coded + 1)
}

/// Writes header, message and CRC, and returns how many bytes they are.
fn fill<M: Serialize>(header: Header, message: &M, content: &mut [u8]) -> Option<usize> {
    let Header { session, sequence, ticks } = header;
    let (head, rest) = content.split_first_chunk_mut::<HEADER_BYTES>()?;
    let fields = [VERSION].into_iter().chain(session.to_le_bytes()).chain(sequence.to_le_bytes());
    for (byte, field) in head.iter_mut().zip(fields.chain(ticks.to_le_bytes())) {
        *byte = field;
    }
    let end = HEADER_BYTES + postcard::to_slice(message, rest).ok()?.len();
    let crc = CRC.checksum(content.get(..end)?);
    *content.get_mut(end..)?.first_chunk_mut::<CRC_BYTES>()? = crc.to_le_bytes();
    Some(end + CRC_BYTES)
}

/// Reads a frame, with or without its final zero. It is decoded in place, which destroys the bytes of `frame`.
///
/// # Errors
/// When `frame` is not a whole frame of this version that holds an `M` and nothing else.
pub fn decode<M: DeserializeOwned>(frame: &mut [u8]) -> Result<(Header, M), FrameError> {
    decode_content(content_of(frame)?)
}

/// The content of a frame, in its place.
fn content_of(frame: &mut [u8]) -> Result<&[u8], FrameError> {
    let length = cobs::decode_in_place(frame).map_err(|_| FrameError::Coding)?;
    frame.get(..length).ok_or(FrameError::Coding)
}

fn decode_content<M: DeserializeOwned>(content: &[u8]) -> Result<(Header, M), FrameError> {
    let (checked, crc) = content.split_last_chunk::<CRC_BYTES>().ok_or(FrameError::TooShort)?;
    if CRC.checksum(checked) != u32::from_le_bytes(*crc) {
        return Err(FrameError::Checksum);
    }
    let (&[theirs], rest) = checked.split_first_chunk::<1>().ok_or(FrameError::TooShort)?;
    if theirs != VERSION {
        return Err(FrameError::Version { theirs });
    }
    let (session, rest) = rest.split_first_chunk::<4>().ok_or(FrameError::TooShort)?;
    let (sequence, rest) = rest.split_first_chunk::<4>().ok_or(FrameError::TooShort)?;
    let (ticks, rest) = rest.split_first_chunk::<8>().ok_or(FrameError::TooShort)?;
    let header = Header {
        session: u32::from_le_bytes(*session),
        sequence: u32::from_le_bytes(*sequence),
        ticks: u64::from_le_bytes(*ticks),
    };
    match postcard::take_from_bytes::<M>(rest) {
        Ok((message, [])) => Ok((header, message)),
        Ok(_) | Err(_) => Err(FrameError::Message),
    }
}

/// [`decode`] on a board, which reads the camera's short frames too; `expected` is of its session, if it has one. One
/// copy, of the size for which this package is compiled there.
///
/// # Errors
/// As [`decode`]; and when a frame is as long as a short one, but there is no session.
#[inline(never)]
pub fn decode_on_board(
    frame: &mut [u8],
    expected: Option<Expected>,
) -> Result<(Header, HostMessage), FrameError> {
    let content = content_of(frame)?;
    match <[u8; camera_frame::CONTENT_BYTES]>::try_from(content) {
        Ok(short) => camera_frame::decode_content(short, expected.ok_or(FrameError::NoSession)?),
        Err(_) => decode_content(content),
    }
}

/// [`encode`] on a board, likewise.
///
/// # Errors
/// As [`encode`].
#[inline(never)]
pub fn encode_on_board(
    header: Header,
    message: &BoardMessage,
    frame: &mut [u8; FRAME_BYTES_MAX],
) -> Result<usize, FrameError> {
    encode(header, message, frame)
}

#[cfg(test)]
mod line_tests;
#[cfg(test)]
mod sample_messages;
#[cfg(test)]
mod tests;
