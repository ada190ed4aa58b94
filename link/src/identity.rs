//! What the board is: which loop it was built of, and why it started.

use serde::{Deserialize, Serialize};

use crate::numbering::Coded;

/// Digest of the sources of the loop: motor model, filter core, estimator, controller and this protocol.
///
/// Where host and board have the same, the board runs the loop that the host simulates. Another digest may be another
/// comment. It is a CRC-64: it tells sources apart, and protects from nothing.
pub const LOOP_DIGEST: u64 = match u64::from_str_radix(env!("LOOP_DIGEST"), 16) {
    Ok(digest) => digest,
    Err(_) => 0,
};

/// Why the board started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ResetCause {
    /// The board does not know.
    #[default]
    Unknown,
    /// Its supply came, or sank and came back.
    Power,
    /// The pin for it was low, by a button or a debugger.
    Pin,
    /// The watchdog was not fed: the main loop had stopped.
    Watchdog,
    /// The program asked for it.
    Software,
    /// Something else: an option byte was loaded, or a low-power mode entered that is not allowed.
    Other,
    /// The program had found an error of its own, and ended.
    Panic,
    /// The processor had found one: a fault.
    Fault,
}

/// What the board is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BoardIdentity {
    /// The [`LOOP_DIGEST`] that it was built with.
    pub loop_digest: u64,
    /// Why it started.
    pub reset_cause: Coded<ResetCause>,
}
