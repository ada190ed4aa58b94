//! The port: opened, or why it is not.

use std::path::Path;
use std::time::Duration;

use serialport::{ErrorKind, SerialPort};

use super::SerialError;

/// Longest wait for bytes, and for room for them. A read that is waiting ends with the process, or with the line.
pub(super) const WAIT_MAX: Duration = Duration::from_millis(200);

/// Opens `port` at `baud`, for this program alone: eight bits, no parity, one stop bit.
///
/// # Errors
/// When there is no such port, another program has it, or the system refuses it.
pub(super) fn open(port: &str, baud: u32) -> Result<Box<dyn SerialPort>, SerialError> {
    let name = || port.to_owned();
    serialport::new(port, baud).timeout(WAIT_MAX).open().map_err(|error| match error.kind() {
        ErrorKind::Io(std::io::ErrorKind::NotFound) => SerialError::NoPort { port: name() },
        // This is what the crate says of a port that another program has, and Windows of one that is not there.
        ErrorKind::NoDevice if cfg!(windows) || !Path::new(port).exists() => {
            SerialError::NoPort { port: name() }
        }
        ErrorKind::NoDevice => SerialError::Busy { port: name() },
        _ => SerialError::Unopened { port: name(), reason: error.description },
    })
}
