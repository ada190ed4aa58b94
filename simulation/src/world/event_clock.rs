//! Instants at which an instrument measures, in whole nanoseconds, for any rate and for any length of a run.
//!
//! Event `n` of an instrument with the rate `f` and the phase `p`, in periods:
//!
//! ```text
//! t_n = round((n + p) 1e9 / f) ns + jitter,     n = 0, 1, 2, ...;  an event at or before the start does not happen
//! ```
//!
//! The rate is a whole number of nanohertz. Each event adds a period to the last even instant as whole nanoseconds and
//! a rest in parts of a nanosecond, both integers: nothing is rounded twice, and an hour has no drift. No period needs
//! to divide another, nor a step of the plant.
//!
//! Jitter is a normal number for each event, which does not add up: it is cut off at half a period, and an event comes
//! after the one before it.

use motor_model::Time;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

/// Nanohertz in a hertz, and nanoseconds in a second.
const NANO: f64 = 1e9;
/// Product of a rate in nanohertz and its period in nanoseconds.
const PERIOD_TIMES_RATE: u64 = 1_000_000_000_000_000_000;

/// A rate of events in whole nanohertz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EventRate {
    nano_hz: u64,
}

impl EventRate {
    /// The rate next to `hz`, 1 to 1e6.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "1e9 to 1e15")]
    pub fn from_hz(hz: f64) -> Self {
        Self { nano_hz: (hz.clamp(1.0, 1e6) * NANO).round() as u64 }
    }

    /// Length of `periods`, rounded to the nanosecond; saturates.
    pub fn span_nanos(self, periods: u64) -> u64 {
        let exact = u128::from(periods) * u128::from(PERIOD_TIMES_RATE);
        u64::try_from((exact + u128::from(self.nano_hz / 2)) / u128::from(self.nano_hz)).unwrap_or(u64::MAX)
    }

    /// Length of a part of a period, 0 to 1, rounded to the nanosecond.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "at most 1e9 ns"
    )]
    pub fn part_nanos(self, part: f64) -> u64 {
        (self.span_nanos(1) as f64 * part).round() as u64
    }
}

/// The clock of an instrument.
#[derive(Clone, Debug)]
pub struct EventClock {
    rate: EventRate,
    /// A period: whole nanoseconds, and the rest in parts of `1 / nano_hz`.
    period_nanos: u64,
    period_rest: u64,
    /// The last even instant, with half a nanosecond more: whole nanoseconds, and the rest in parts of `1 / nano_hz`.
    even_nanos: u64,
    even_rest: u64,
    jitter: Option<Jitter>,
    due: Time,
}

/// Random displacement of each event.
#[derive(Clone, Debug)]
struct Jitter {
    deviation_nanos: f64,
    stream: Pcg64,
}

impl EventClock {
    /// A clock of this rate; its phase is in periods, 0 to 1, where 1 is as 0.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1e9")]
    pub fn new(rate: EventRate, phase: f64) -> Self {
        // At most 1e18 + 5e14, far below 2^64.
        let first = (phase.clamp(0.0, 1.0) * NANO).round() as u64 * 1_000_000_000 + rate.nano_hz / 2;
        let (even_nanos, even_rest) = (first / rate.nano_hz, first % rate.nano_hz);
        let mut clock = Self {
            rate,
            period_nanos: PERIOD_TIMES_RATE / rate.nano_hz,
            period_rest: PERIOD_TIMES_RATE % rate.nano_hz,
            even_nanos,
            even_rest,
            jitter: None,
            due: Time::from_nanos(even_nanos),
        };
        if clock.due == Time::ZERO {
            clock.advance();
        }
        clock
    }

    /// The same with a jitter of this standard deviation, drawn from `stream`; none for 0.
    #[must_use]
    pub fn with_jitter(mut self, deviation_nanos: f64, stream: Pcg64) -> Self {
        self.jitter = (deviation_nanos > 0.0).then_some(Jitter { deviation_nanos, stream });
        self.due = self.displaced(Time::ZERO);
        self
    }

    /// When the next event is due.
    #[inline]
    pub fn due(&self) -> Time {
        self.due
    }

    /// Goes on to the event after the one that is due.
    #[inline]
    pub fn advance(&mut self) {
        let nano_hz = self.rate.nano_hz;
        self.even_nanos = self.even_nanos.saturating_add(self.period_nanos);
        self.even_rest += self.period_rest;
        if self.even_rest >= nano_hz {
            self.even_rest -= nano_hz;
            self.even_nanos = self.even_nanos.saturating_add(1);
        }
        self.due = self.displaced(self.due);
    }

    /// The even instant with its jitter, after `last`.
    #[expect(clippy::cast_possible_truncation, reason = "at most half a period")]
    fn displaced(&mut self, last: Time) -> Time {
        let Some(Jitter { deviation_nanos, stream }) = &mut self.jitter else {
            return Time::from_nanos(self.even_nanos);
        };
        let normal: f64 = StandardNormal.sample(stream);
        let half_nanos = 0.5e18 / self.rate.nano_hz_f64();
        let by_nanos = (*deviation_nanos * normal).clamp(-half_nanos, half_nanos).round() as i64;
        Time::from_nanos(self.even_nanos.saturating_add_signed(by_nanos)).max(last.plus_nanos(1))
    }
}

impl EventRate {
    #[expect(clippy::cast_precision_loss, reason = "at most 1e15")]
    fn nano_hz_f64(self) -> f64 {
        self.nano_hz as f64
    }
}

#[cfg(test)]
mod tests;
