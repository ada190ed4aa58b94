//! Rows of a source with a time of the log and a value each, later and later.

use motor_model::Time;
use serde::Serialize;

use super::ImportError;

/// The clock of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Clock {
    /// What it shows at time 0 of the other tables, in s.
    pub offset_s: f64,
    /// How much faster it runs, in parts per million.
    pub drift_ppm: f64,
}

impl Clock {
    /// The time at which it shows `shown_s`.
    pub fn true_s(self, shown_s: f64) -> f64 {
        (shown_s - self.offset_s) / (1.0 + 1e-6 * self.drift_ppm)
    }
}

/// Rows that were left out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// Without a time or a value, or with one that is not finite.
    pub empty: u64,
    /// Not later than the row before.
    pub out_of_order: u64,
    /// Before the start of the log.
    pub early: u64,
}

/// Seconds in ns, to the nearest; 0 below 0.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and it saturates")]
pub(super) fn nanos(seconds: f64) -> u64 {
    (1e9 * seconds).round().max(0.0) as u64
}

/// The next row of a source: a time in s, as its clock shows it, and a value; `None` after the last. A row may lack
/// either.
pub(super) type NextRow<'a, T> =
    Box<dyn FnMut() -> Result<Option<(Option<f64>, Option<T>)>, ImportError> + 'a>;

/// The rows of a source, by times of the log.
pub(super) struct SourceRows<'a, T> {
    next: NextRow<'a, T>,
    clock: Clock,
    start_s: f64,
    /// Whether a row before the start is taken as of the start.
    keeps_early: bool,
    upcoming: Option<(Time, T)>,
    last: Option<Time>,
    left_out: LeftOut,
}

impl<'a, T> SourceRows<'a, T> {
    /// No rows.
    pub(super) fn none() -> Self {
        Self::of(Box::new(|| Ok(None)), Clock::default(), 0.0)
    }

    /// The rows that `next` gives, before the first is read.
    pub(super) fn of(next: NextRow<'a, T>, clock: Clock, start_s: f64) -> Self {
        Self {
            next,
            clock,
            start_s,
            keeps_early: false,
            upcoming: None,
            last: None,
            left_out: LeftOut::default(),
        }
    }

    /// The same with rows before the start taken as of the start.
    pub(super) fn keeping_early(self) -> Self {
        Self { keeps_early: true, ..self }
    }

    /// Time and value of the next row that has both, in s of the common clock.
    pub(super) fn next_row(&mut self) -> Result<Option<(f64, T)>, ImportError> {
        while let Some(row) = (self.next)()? {
            if let (Some(shown_s), Some(value)) = row {
                return Ok(Some((self.clock.true_s(shown_s), value)));
            }
            self.left_out.empty += 1;
        }
        Ok(None)
    }

    /// Reads up to the next row that is later than the last.
    pub(super) fn fill(&mut self) -> Result<(), ImportError> {
        self.upcoming = None;
        while let Some((true_s, value)) = self.next_row()? {
            if true_s < self.start_s && !self.keeps_early {
                self.left_out.early += 1;
                continue;
            }
            let at = Time::from_nanos(nanos(true_s - self.start_s));
            if self.last.is_some_and(|last| at < last || (at == last && !self.keeps_early)) {
                self.left_out.out_of_order += 1;
                continue;
            }
            self.last = Some(at);
            self.upcoming = Some((at, value));
            break;
        }
        Ok(())
    }

    /// Time of the next row.
    pub(super) fn upcoming(&self) -> Option<Time> {
        self.upcoming.as_ref().map(|(at, _)| *at)
    }

    /// The next row, if it arrives by `now`, `latency_nanos` after its time.
    pub(super) fn take_until(
        &mut self,
        now: Time,
        latency_nanos: u64,
    ) -> Result<Option<(Time, T)>, ImportError> {
        if self.upcoming().is_none_or(|at| at.plus_nanos(latency_nanos) > now) {
            return Ok(None);
        }
        let row = self.upcoming.take();
        self.fill()?;
        Ok(row)
    }

    /// The rows that were left out.
    pub(super) fn left_out(&self) -> LeftOut {
        self.left_out
    }
}
