//! The board's clock by the host's, from round trips: of a host at a serial line, and of a camera's computer.
//!
//! The host asks at `sent`, the answer is there at `received`, and it carries the board's count of ticks. The board
//! counted them somewhere in between, so its clock less the host's lies within half the round trip of
//!
//! ```text
//! offset = board - (sent + received) / 2        uncertainty = (received - sent) / 2 + half a tick
//! ```
//!
//! whatever the delays of the two ways are. Delays only add to a round trip: of every eight exchanges in a row the one
//! with the shortest is kept, and the others are passed over. A line through an early and a late exchange gives drift.
//! For two clocks that differ by offset and drift alone, the error is never greater than the uncertainty.

use controller::TICK_NANOS;

/// Exchanges in a row of which one is kept.
const EXCHANGES_PER_WINDOW: usize = 8;

/// Exchanges kept. When there are as many, every second one is dropped.
const KEPT_MAX: usize = 256;

/// A question and its answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exchange {
    /// When the question was sent, in ns of the host's clock.
    pub sent_nanos: i64,
    /// When the answer had arrived, in ns of the host's clock.
    pub received_nanos: i64,
    /// Whole ticks that the board had counted.
    pub ticks: u64,
}

impl Exchange {
    /// Time from question to answer in ns.
    pub fn round_trip_nanos(&self) -> i64 {
        self.received_nanos - self.sent_nanos
    }

    /// The middle of the exchange, in ns of the host's clock.
    #[expect(clippy::cast_precision_loss, reason = "times are taken from an origin nearby")]
    fn middle_from(&self, origin_nanos: i64) -> f64 {
        (self.sent_nanos - origin_nanos) as f64 + 0.5 * self.round_trip_nanos() as f64
    }

    /// The board's time in ns: the middle of the tick that it was in.
    #[expect(clippy::cast_precision_loss, reason = "a month of ns is below 2^53")]
    fn board_nanos(&self) -> f64 {
        (self.ticks * TICK_NANOS) as f64 + 0.5 * TICK_NANOS as f64
    }

    #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
    fn uncertainty_nanos(&self) -> f64 {
        0.5 * self.round_trip_nanos() as f64 + 0.5 * TICK_NANOS as f64
    }
}

/// The exchanges that are kept.
#[derive(Clone, Debug, Default)]
pub struct ClockSync {
    /// The best of each whole window, oldest first.
    kept: Vec<Exchange>,
    /// The best of the window under way, and how many that has.
    best: Option<Exchange>,
    in_window: usize,
    shortest: Option<i64>,
}

impl ClockSync {
    /// Adds an exchange. One whose answer came before its question is passed over: it is to another one.
    pub fn add(&mut self, exchange: Exchange) {
        if exchange.round_trip_nanos() < 0 {
            return;
        }
        let shorter = |other: &Exchange| exchange.round_trip_nanos() <= other.round_trip_nanos();
        if self.best.as_ref().is_none_or(shorter) {
            self.best = Some(exchange);
        }
        self.shortest = Some(
            self.shortest
                .map_or(exchange.round_trip_nanos(), |shortest| shortest.min(exchange.round_trip_nanos())),
        );
        self.in_window += 1;
        if self.in_window == EXCHANGES_PER_WINDOW {
            self.in_window = 0;
            self.kept.extend(self.best.take());
            if self.kept.len() == KEPT_MAX {
                let mut index = 0;
                self.kept.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
            }
        }
    }

    /// The shortest round trip in ns.
    pub fn shortest_nanos(&self) -> Option<i64> {
        self.shortest
    }

    /// The board's clock, as it is known at `now_nanos` of the host's clock; `None` before the first exchange.
    pub fn at(&self, now_nanos: i64) -> Option<BoardClock> {
        let late = [self.best, self.kept.last().copied()].into_iter().flatten();
        let pairs = late.clone().flat_map(|late| {
            let earlier = self.kept.iter().filter(move |early| early.sent_nanos < late.sent_nanos);
            earlier.map(move |early| BoardClock { early: Some(*early), late })
        });
        let bound = |clock: &BoardClock| clock.uncertainty_nanos(now_nanos);
        let best = pairs.min_by(|a, b| bound(a).total_cmp(&bound(b)));
        best.or_else(|| late.map(|late| BoardClock { early: None, late }).next())
    }
}

/// Two clocks that differ by offset and drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardClock {
    /// `None` of a single exchange: no drift is known.
    early: Option<Exchange>,
    late: Exchange,
}

impl BoardClock {
    /// The board's time in ns since its start at `host_nanos`; 0 for a time before the start.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded, and not below 0")]
    pub fn board_nanos(&self, host_nanos: i64) -> u64 {
        let origin = self.late.sent_nanos;
        let past = -self.late.middle_from(origin) + nanos_between(origin, host_nanos);
        (self.late.board_nanos() + past * (1.0 + self.drift().unwrap_or(0.0))).round().max(0.0) as u64
    }

    /// Bound of the error of [`Self::board_nanos`] in ns, for clocks without another difference than offset and drift.
    /// Of a single exchange it leaves the drift out.
    pub fn uncertainty_nanos(&self, host_nanos: i64) -> f64 {
        let late = self.late.uncertainty_nanos();
        let Some((early, apart)) = self.apart() else { return late };
        let origin = self.late.sent_nanos;
        // From the late exchange on, in units of the time between the two.
        let on = (nanos_between(origin, host_nanos) - self.late.middle_from(origin)) / apart;
        (1.0 + on).abs() * late + on.abs() * early.uncertainty_nanos()
    }

    /// Bound of the error at the exchanges that set the clock, in ns: that of the worse one.
    pub fn exchange_uncertainty_nanos(&self) -> f64 {
        let late = self.late.uncertainty_nanos();
        self.early.map_or(late, |early| late.max(early.uncertainty_nanos()))
    }

    /// By how much the board's clock runs faster than the host's, relative; `None` of a single exchange.
    pub fn drift(&self) -> Option<f64> {
        let (early, apart) = self.apart()?;
        Some((self.late.board_nanos() - early.board_nanos()) / apart - 1.0)
    }

    /// Bound of the error of the drift.
    pub fn drift_uncertainty(&self) -> Option<f64> {
        let (early, apart) = self.apart()?;
        Some((self.late.uncertainty_nanos() + early.uncertainty_nanos()) / apart)
    }

    /// The early exchange, and the time between the two in ns of the host's clock.
    fn apart(&self) -> Option<(Exchange, f64)> {
        let early = self.early?;
        let origin = early.sent_nanos;
        let apart = self.late.middle_from(origin) - early.middle_from(origin);
        (apart > 0.0).then_some((early, apart))
    }
}

#[expect(clippy::cast_precision_loss, reason = "a day of ns is below 2^53")]
fn nanos_between(from: i64, to: i64) -> f64 {
    (to - from) as f64
}

#[cfg(test)]
mod tests;
