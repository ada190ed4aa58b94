//! The time that bytes take on the line, and the share of it that is in use.

/// Bits of a byte on the line: start, eight of data, stop.
const BITS_PER_BYTE: u64 = 10;

/// Time in ns that `bytes` take at `baud`, rounded up.
pub(super) fn line_nanos(bytes: usize, baud: u32) -> u64 {
    (bytes as u64 * BITS_PER_BYTE * 1_000_000_000).div_ceil(u64::from(baud.max(1)))
}

/// Bytes in a second at `baud`.
pub(super) fn bytes_per_s(baud: u32) -> f64 {
    f64::from(baud) / 10.0
}

/// Spaces out what is written, so that never more bytes wait than one frame: a stop does not queue behind old frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinePace {
    baud: u32,
    free_at: i64,
}

impl LinePace {
    /// A line of this rate on which nothing waits.
    pub(super) fn new(baud: u32) -> Self {
        Self { baud, free_at: i64::MIN }
    }

    /// Takes `bytes` on the line at `now`, in ns; the time in ns to wait before they are written.
    pub(super) fn take(&mut self, now: i64, bytes: usize) -> u64 {
        let begin = self.free_at.max(now);
        self.free_at = begin.saturating_add_unsigned(line_nanos(bytes, self.baud));
        begin.abs_diff(now)
    }
}

/// Bytes of one direction, counted from the last reading.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LineLoad {
    bytes: u64,
    bytes_before: u64,
}

impl LineLoad {
    /// Adds bytes.
    pub(super) fn add(&mut self, bytes: usize) {
        self.bytes += bytes as u64;
    }

    /// Mean share of the line, 0 to 1, over `seconds` with all bytes so far.
    pub(super) fn mean(self, seconds: f64, baud: u32) -> f64 {
        share(self.bytes, seconds, baud)
    }

    /// Share of the line over the `seconds` since the last reading.
    pub(super) fn read(&mut self, seconds: f64, baud: u32) -> f64 {
        let bytes = self.bytes - self.bytes_before;
        self.bytes_before = self.bytes;
        share(bytes, seconds, baud)
    }
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
fn share(bytes: u64, seconds: f64, baud: u32) -> f64 {
    if seconds > 0.0 { bytes as f64 / (seconds * bytes_per_s(baud)) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A byte at 1,000,000 baud takes 10 us.
    #[test]
    fn exact_frames_begin_when_the_line_is_free() {
        let mut pace = LinePace::new(1_000_000);
        assert_eq!(pace.take(5_000, 30), 0);
        assert_eq!(pace.take(5_000, 10), 300_000);
        assert_eq!(pace.take(105_000, 1), 300_000);
        assert_eq!(pace.take(1_000_000, 1), 0);
        assert_eq!(line_nanos(1, 921_600), 10_851);
    }

    #[test]
    fn exact_share_of_the_line() {
        let mut load = LineLoad::default();
        load.add(500);
        assert!((load.read(0.01, 1_000_000) - 0.5).abs() < 1e-12);
        load.add(250);
        assert!((load.read(0.01, 1_000_000) - 0.25).abs() < 1e-12);
        assert!((load.mean(0.02, 1_000_000) - 0.375).abs() < 1e-12);
        assert!(load.mean(0.0, 1_000_000).abs() < 1e-12);
    }
}
