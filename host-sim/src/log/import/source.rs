//! What an instrument measured: a table in a file, or series in memory.

use std::path::PathBuf;

use super::rows::{Clock, NextRow, SourceRows};
use super::table::Table;
use super::{ColumnName, ImportError, Quantity};
use simulation::math::statistics::quantile;

/// Rows from which the period of an instrument is taken.
const PREVIEW_ROWS: usize = 10_000;

/// A table of an instrument.
#[derive(Clone, Debug)]
pub struct MeasuredTable {
    /// The file.
    pub path: PathBuf,
    /// Column of the times: of a frame the middle of its exposure.
    pub time: ColumnName,
    /// Column of the values.
    pub value: ColumnName,
    /// What the values are multiplied by, for example -1 for a wrong sign.
    pub scale: f64,
    /// What is added to them then, in degrees or m/s.
    pub offset: f64,
    /// Its clock.
    pub clock: Clock,
}

/// Measurements of an instrument in memory.
#[derive(Clone, Copy, Debug)]
pub struct MeasuredSeries<'a> {
    /// What messages call it.
    pub name: &'static str,
    /// Times in s: of a frame the middle of its exposure.
    pub time_s: &'a [f64],
    /// Values in degrees or m/s, as many as times. What is not finite is left out.
    pub values: &'a [f64],
}

/// What an instrument measured.
#[derive(Clone, Debug)]
pub enum Measurements<'a> {
    /// In a file.
    Table(MeasuredTable),
    /// In memory.
    Series(MeasuredSeries<'a>),
}

impl Measurements<'_> {
    /// Its rows from `start_s` on.
    pub(super) fn rows(&self, quantity: Quantity, start_s: f64) -> Result<SourceRows<'_, f64>, ImportError> {
        let mut rows = self.opened(quantity, start_s)?;
        rows.fill()?;
        Ok(rows)
    }

    /// The same before the first row is read.
    fn opened(&self, quantity: Quantity, start_s: f64) -> Result<SourceRows<'_, f64>, ImportError> {
        Ok(match self {
            Self::Table(table) => SourceRows::of(table.next_row(quantity)?, table.clock, start_s),
            Self::Series(series) => SourceRows::of(series.next_row(), Clock::default(), start_s),
        })
    }

    /// What its values are multiplied by.
    pub(super) fn scale(&self) -> f64 {
        match self {
            Self::Table(table) => table.scale,
            Self::Series(_) => 1.0,
        }
    }

    /// What messages call it.
    fn path(&self) -> PathBuf {
        match self {
            Self::Table(table) => table.path.clone(),
            Self::Series(series) => series.name.into(),
        }
    }
}

impl MeasuredTable {
    fn next_row(&self, quantity: Quantity) -> Result<NextRow<'_, f64>, ImportError> {
        let mut table = Table::open(&self.path)?;
        let (value_flag, time_flag) = quantity.flags();
        let (value, factor) = (table.place(&self.value.name, value_flag)?, self.value.factor(quantity)?);
        let (time, time_factor) =
            (table.place(&self.time.name, time_flag)?, self.time.factor(Quantity::Time)?);
        let (scale, offset) = (self.scale, self.offset);
        Ok(Box::new(move || {
            if !table.advance()? {
                return Ok(None);
            }
            let shown_s = table.number(time)?.map(|cell| time_factor * cell);
            Ok(Some((shown_s, table.number(value)?.map(|cell| scale * (cell * factor) + offset))))
        }))
    }
}

impl MeasuredSeries<'_> {
    fn next_row(&self) -> NextRow<'_, f64> {
        let finite = |number: &f64| number.is_finite().then_some(*number);
        let mut rows = self.time_s.iter().map(finite).zip(self.values.iter().map(finite));
        Box::new(move || Ok(rows.next()))
    }
}

/// What the beginning of the measurements says of their instrument.
#[derive(Clone, Copy, Debug)]
pub(super) struct Preview {
    /// Time of the first row, on the common clock.
    pub first_s: f64,
    /// Rows a second, from the median of the periods.
    pub rate_hz: f64,
}

impl Preview {
    /// That of `measurements`.
    ///
    /// # Errors
    /// When they cannot be read, have fewer than two rows, or no row later than another.
    pub(super) fn of(measurements: &Measurements, quantity: Quantity) -> Result<Self, ImportError> {
        let mut rows = measurements.opened(quantity, f64::NEG_INFINITY)?;
        let mut times_s = Vec::new();
        while times_s.len() < PREVIEW_ROWS
            && let Some((at_s, _)) = rows.next_row()?
        {
            times_s.push(at_s);
        }
        let mut periods: Vec<f64> =
            times_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|period| *period > 0.0).collect();
        let too_short = || match (measurements.path(), times_s.len()) {
            (path, rows @ 0..2) => ImportError::TooShort { path, rows },
            (path, rows) => ImportError::OneTime { path, rows },
        };
        let period_s = quantile(&mut periods, 500).ok_or_else(too_short)?;
        let first_s = times_s.iter().copied().fold(f64::INFINITY, f64::min);
        // Six digits: stamps are rounded, and clocks drift.
        let rate_hz = format!("{:.5e}", 1.0 / period_s).parse().unwrap_or(1.0 / period_s);
        Ok(Self { first_s, rate_hz })
    }
}
