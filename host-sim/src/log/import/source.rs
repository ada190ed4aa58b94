//! A table of an instrument.

use std::path::PathBuf;

use super::rows::{Clock, TableRows};
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

impl MeasuredTable {
    /// Its rows from `start_s` on.
    pub(super) fn rows(&self, quantity: Quantity, start_s: f64) -> Result<TableRows<f64>, ImportError> {
        let mut rows = self.opened(quantity, start_s)?;
        rows.fill()?;
        Ok(rows)
    }

    /// The same before the first row is read.
    fn opened(&self, quantity: Quantity, start_s: f64) -> Result<TableRows<f64>, ImportError> {
        let table = Table::open(&self.path)?;
        let (place, factor) = (table.place(&self.value.name)?, self.value.factor(quantity)?);
        let (scale, offset) = (self.scale, self.offset);
        let decode = move |table: &Table| {
            table.number(place).map(|cell| cell.map(|cell| scale * (cell * factor) + offset))
        };
        TableRows::of(table, &self.time, self.clock, start_s, Box::new(decode))
    }
}

/// What the beginning of a table says of its instrument.
#[derive(Clone, Copy, Debug)]
pub(super) struct Preview {
    /// Time of the first row, on the common clock.
    pub first_s: f64,
    /// Rows a second, from the median of the periods.
    pub rate_hz: f64,
}

impl Preview {
    /// That of `table`.
    ///
    /// # Errors
    /// When it cannot be read or has fewer than two rows.
    pub(super) fn of(table: &MeasuredTable, quantity: Quantity) -> Result<Self, ImportError> {
        let mut rows = table.opened(quantity, f64::NEG_INFINITY)?;
        let mut times_s = Vec::new();
        while times_s.len() < PREVIEW_ROWS
            && let Some((at_s, _)) = rows.next_row()?
        {
            times_s.push(at_s);
        }
        let mut periods: Vec<f64> =
            times_s.windows(2).map(|pair| pair[1] - pair[0]).filter(|period| *period > 0.0).collect();
        let too_short = || ImportError::TooShort { path: table.path.clone(), rows: times_s.len() };
        let period_s = quantile(&mut periods, 500).ok_or_else(too_short)?;
        let first_s = times_s.iter().copied().fold(f64::INFINITY, f64::min);
        // Six digits: stamps are rounded, and clocks drift.
        let rate_hz = format!("{:.5e}", 1.0 / period_s).parse().unwrap_or(1.0 / period_s);
        Ok(Self { first_s, rate_hz })
    }
}
