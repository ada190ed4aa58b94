//! Messages to the board as frames, and the error of an unexpected answer.

use estimator::CameraFrame;
use link::{BoardMessage, FRAME_BYTES_MAX, Header, HostMessage, encode, encode_camera};

use crate::board::BoardError;

/// The bytes of `message`.
///
/// # Errors
/// When the message does not fit a frame; every message of the host does.
pub(super) fn frame(header: Header, message: &HostMessage) -> Result<Vec<u8>, BoardError> {
    let mut frame = [0; FRAME_BYTES_MAX];
    let length = encode(header, message, &mut frame).map_err(|error| BoardError::Board(error.to_string()))?;
    Ok(frame[..length].to_vec())
}

/// The bytes of a camera frame.
///
/// # Errors
/// As [`frame`].
pub(super) fn camera_frame(header: Header, frame: CameraFrame) -> Result<Vec<u8>, BoardError> {
    let mut bytes = [0; FRAME_BYTES_MAX];
    let length = encode_camera(header, frame.into(), &mut bytes)
        .map_err(|error| BoardError::Board(error.to_string()))?;
    Ok(bytes[..length].to_vec())
}

/// The error that says that `received` is not the answer to what was asked.
pub(super) fn unexpected(received: &BoardMessage) -> BoardError {
    BoardError::Board(match received {
        BoardMessage::Fault(fault) => format!("reports a fault: {fault}"),
        other => format!("answers something else than was asked: {other:?}"),
    })
}
