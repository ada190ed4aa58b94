//! How well the board's clock is known, in the board's time.
//!
//! The half of a round trip is a time of the host. An emulated board counts less in it:
//!
//! ```text
//! bound = pace * bound by the host's clock        pace = 1 + drift + bound of the drift, at most 1
//! ```

use simulation::math::clock_sync::BoardClock;

/// Root mean square of an error that is as likely to be any within a bound, per the bound: `1 / sqrt 3`.
pub(super) const WITHIN_BOUND: f64 = 0.577_350_269_189_625_8;

/// Bound of the error of `now` of the host's clock as a time of the board, in ns of the board.
pub(super) fn bound_nanos(clock: &BoardClock, now: i64) -> f64 {
    pace_max(clock) * clock.uncertainty_nanos(now)
}

/// The most that the board counts in a second of the host, in s. A real board is not taken to be faster than the host:
/// its crystal is off by some ppm. Of a single exchange no pace is known.
pub(super) fn pace_max(clock: &BoardClock) -> f64 {
    let drift = clock.drift().zip(clock.drift_uncertainty());
    drift.map_or(1.0, |(drift, bound)| (1.0 + drift + bound).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use simulation::math::clock_sync::{ClockSync, Exchange};

    use super::*;

    const MS: i64 = 1_000_000;

    /// A clock that was set by sixteen round trips of 1 ms every 10 ms, of a board that counts `ticks` meanwhile.
    fn clock(ticks: u64) -> BoardClock {
        let mut sync = ClockSync::default();
        for number in 0..16_u32 {
            let sent_nanos = 10 * MS * i64::from(number);
            let exchange =
                Exchange { sent_nanos, received_nanos: sent_nanos + MS, ticks: u64::from(number) * ticks };
            sync.add(exchange);
        }
        sync.at(151 * MS).unwrap()
    }

    /// Exchanges that are 80 ms apart, each to 0.505 ms, give the drift to 1.2625 %. A board of the host's pace may be
    /// as fast as the host; of one that counts a tenth the pace is 0.1 and that bound.
    #[test]
    fn exact_bounds_are_in_the_board_s_time() {
        for (ticks, pace) in [(1000, 1.0), (1100, 1.0), (100, 0.112_625)] {
            let clock = clock(ticks);
            assert!((pace_max(&clock) - pace).abs() < 1e-9, "{ticks}: {}", pace_max(&clock));
            let by_host = clock.uncertainty_nanos(200 * MS);
            assert!((bound_nanos(&clock, 200 * MS) / by_host - pace).abs() < 1e-9, "{ticks}");
        }
    }

    #[test]
    fn exact_of_one_exchange_no_pace_is_known() {
        let mut sync = ClockSync::default();
        sync.add(Exchange { sent_nanos: 0, received_nanos: MS, ticks: 3 });
        assert!((bound_nanos(&sync.at(0).unwrap(), 0) - 505_000.0).abs() < 1e-6);
    }
}
