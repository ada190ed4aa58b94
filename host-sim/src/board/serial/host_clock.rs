//! The host's clock, which goes on where the time of day is set, and times of day by it.

use std::sync::OnceLock;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The host's clock: ns since it was first read. It goes on where the time of day is set.
pub(super) fn host_nanos() -> i64 {
    static BEGUN: OnceLock<Instant> = OnceLock::new();
    nanos(BEGUN.get_or_init(Instant::now).elapsed())
}

/// The time of day: ns since 1970-01-01 UTC.
pub(super) fn day_nanos() -> i64 {
    nanos(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default())
}

/// The time of day `time_nanos` by the host's clock.
pub(super) fn of_day(time_nanos: i64) -> i64 {
    by_host_clock(time_nanos, host_nanos(), day_nanos())
}

/// A time of day by the host's clock, where one is `host_nanos` and the other `day_nanos` now.
fn by_host_clock(time_nanos: i64, host_nanos: i64, day_nanos: i64) -> i64 {
    time_nanos.saturating_sub(day_nanos).saturating_add(host_nanos)
}

/// A duration in ns.
pub(super) fn nanos(duration: Duration) -> i64 {
    i64::try_from(duration.as_nanos()).unwrap_or(i64::MAX)
}

/// A time in ns as s.
#[expect(clippy::cast_precision_loss, reason = "a month of ns is below 2^53")]
pub(super) fn seconds(nanos: i64) -> f64 {
    nanos as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of 3 ms ago was 3 ms ago by the host's clock too, whatever the time of day was set to before.
    #[test]
    fn exact_times_of_day_by_the_host_s_clock() {
        for day_nanos in [0, 1_795_000_000_000_000_000] {
            assert_eq!(by_host_clock(day_nanos - 3_000_000, 7_000_000, day_nanos), 4_000_000);
        }
        assert_eq!(by_host_clock(9_000_000_000_000_000_000, i64::MAX, 0), i64::MAX);
        let before = host_nanos();
        assert!((0..1_000_000_000).contains(&(host_nanos() - before)));
    }
}
