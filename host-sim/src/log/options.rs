//! What is written to a log.

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LogOptions {
    /// Ticks from one logged truth and estimate to the next.
    pub every: u64,
}
