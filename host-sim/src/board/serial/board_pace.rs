//! How slow the board is by the host's clock.
//!
//! A real board's second is the host's, to some ppm. An emulated board may need a minute for it. What the host sends by
//! the board's clock, so that the line stays alive, would flood the line of such a board if it were sent by the host's.

use std::time::Duration;

use controller::TICK_NANOS;
use simulation::math::count::real;

use super::host_clock::{nanos, seconds};

/// Time by the host's clock after which reports tell how slow the board is: far longer than a line keeps a report.
const KNOWN_AFTER: Duration = Duration::from_millis(50);

/// The board's pace since it was armed.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoardPace {
    armed_at: i64,
    armed_ticks: u64,
    /// How much longer the board's time takes by the host's clock, at least 1.
    slowness: f64,
}

impl BoardPace {
    /// Of a board that was armed at `armed_at` of the host's clock, in ns, when it had counted `armed_ticks`.
    pub(super) fn new(armed_at: i64, armed_ticks: u64) -> Self {
        Self { armed_at, armed_ticks, slowness: 1.0 }
    }

    /// Takes a report of tick `ticks`, which arrived at `at_nanos` of the host's clock.
    pub(super) fn take(&mut self, ticks: u64, at_nanos: i64) {
        let by_host = at_nanos - self.armed_at;
        let by_board = ticks.saturating_sub(self.armed_ticks) * TICK_NANOS;
        if by_host >= nanos(KNOWN_AFTER) && by_board > 0 {
            self.slowness = (seconds(by_host) / (1e-9 * real(by_board))).max(1.0);
        }
    }

    /// A duration of the board's clock by the host's, in ns. A board is not taken to be faster than the host.
    #[expect(clippy::cast_possible_truncation, reason = "far below 2^53")]
    pub(super) fn host_nanos(&self, duration: Duration) -> i64 {
        (1e9 * duration.as_secs_f64() * self.slowness) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: i64 = 1_000_000;
    const ARMED_AT: i64 = 7 * MS;
    const FOUR_MS: Duration = Duration::from_millis(4);

    /// 4 ms of a board that takes 40 times as long are 160 ms; before reports tell, and of a board that is too fast, 4.
    #[test]
    fn exact_time_of_a_slow_board() {
        let mut pace = BoardPace::new(ARMED_AT, 500);
        assert_eq!(pace.host_nanos(FOUR_MS), 4 * MS);
        pace.take(600, ARMED_AT + 40 * MS);
        assert_eq!(pace.host_nanos(FOUR_MS), 4 * MS, "too early to tell");
        pace.take(700, ARMED_AT + 80 * MS);
        assert!((pace.host_nanos(FOUR_MS) - 160 * MS).abs() <= 1, "{pace:?}");
        pace.take(8500, ARMED_AT + 60 * MS);
        assert_eq!(pace.host_nanos(FOUR_MS), 4 * MS);
        // Of a number of before it was armed there is nothing to learn.
        pace.take(400, ARMED_AT + 100 * MS);
        assert_eq!(pace.host_nanos(FOUR_MS), 4 * MS);
    }

    /// A line that keeps reports of a real board for 16 ms, as some adapters do: the board, which waits for 10 ms,
    /// never waits for longer than 6.
    #[test]
    fn law_a_late_line_does_not_make_a_real_board_slow() {
        let mut pace = BoardPace::new(ARMED_AT, 0);
        for report in 1..1000_u32 {
            let at = i64::from(report) * MS;
            pace.take(u64::from(report) * 100, ARMED_AT + (at / (16 * MS) + 1) * 16 * MS);
            let host = pace.host_nanos(FOUR_MS);
            assert!((4 * MS..=6 * MS).contains(&host), "{host} ns at report {report}");
        }
    }
}
