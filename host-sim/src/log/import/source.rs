//! Tables as rows: a time of the log and a value each, later and later.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use csv::{Reader, ReaderBuilder, StringRecord, Trim};
use motor_model::{DriveCommand, DriveMode, Time};
use serde::Serialize;

use super::{ColumnName, ImportError, Quantity};
use crate::math::statistics::quantile;

/// Rows from which the period of an instrument is taken.
const PREVIEW_ROWS: usize = 10_000;

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

/// A table of drives.
#[derive(Clone, Debug)]
pub struct DriveTable {
    /// The file.
    pub path: PathBuf,
    /// Column of the times.
    pub time: ColumnName,
    /// Column of the modes: `b`, `c`; `off`, `none`, 0 or nothing for no drive.
    pub mode: String,
    /// Column of the amplitudes, of full drive.
    pub amplitude: String,
    /// Its clock.
    pub clock: Clock,
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

/// An open table.
struct Table {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
    columns: Vec<String>,
    record: StringRecord,
    decimal_comma: bool,
}

impl Table {
    fn open(path: &Path) -> Result<Self, ImportError> {
        let unreadable = |why: String| ImportError::Unreadable { path: path.to_owned(), why };
        let open = || File::open(path).map(BufReader::new).map_err(|error| unreadable(error.to_string()));
        let mut first = String::new();
        for line in open()?.lines() {
            first = line.map_err(|error| unreadable(error.to_string()))?;
            if !first.trim().is_empty() && !first.starts_with('#') {
                break;
            }
        }
        let delimiter = [b';', b'\t', b','].into_iter().find(|mark| first.as_bytes().contains(mark));
        let delimiter = delimiter.unwrap_or(b',');
        let mut reader = ReaderBuilder::new()
            .delimiter(delimiter)
            .flexible(true)
            .comment(Some(b'#'))
            .trim(Trim::All)
            .from_reader(open()?);
        let header = reader.headers().map_err(|error| unreadable(error.to_string()))?;
        let columns = header.iter().map(|name| name.trim_start_matches('\u{feff}').to_owned()).collect();
        let decimal_comma = delimiter == b';';
        Ok(Self { path: path.to_owned(), reader, columns, record: StringRecord::new(), decimal_comma })
    }

    fn place(&self, column: &str) -> Result<usize, ImportError> {
        self.columns.iter().position(|name| name == column).ok_or_else(|| ImportError::NoColumn {
            path: self.path.clone(),
            column: column.to_owned(),
            columns: self.columns.clone(),
        })
    }

    /// Reads the next row; whether there is one.
    fn advance(&mut self) -> Result<bool, ImportError> {
        let path = &self.path;
        self.reader
            .read_record(&mut self.record)
            .map_err(|error| ImportError::Unreadable { path: path.clone(), why: error.to_string() })
    }

    fn cell(&self, place: usize) -> &str {
        self.record.get(place).unwrap_or("")
    }

    fn refused(&self, place: usize, expected: &'static str) -> ImportError {
        ImportError::Cell {
            path: self.path.clone(),
            line: self.record.position().map_or(0, csv::Position::line),
            column: self.columns.get(place).cloned().unwrap_or_default(),
            text: self.cell(place).to_owned(),
            expected,
        }
    }

    /// The number of a cell; `None` where there is none, or none that is finite.
    fn number(&self, place: usize) -> Result<Option<f64>, ImportError> {
        let cell = self.cell(place);
        if cell.is_empty() {
            return Ok(None);
        }
        let parsed: Result<f64, _> =
            if self.decimal_comma { cell.replace(',', ".").parse() } else { cell.parse() };
        let number = parsed.map_err(|_| self.refused(place, "a number"))?;
        Ok(number.is_finite().then_some(number))
    }
}

/// Makes the value of a row: `None` where it has none.
type Decode<T> = Box<dyn Fn(&Table) -> Result<Option<T>, ImportError>>;

/// The rows of a table, by times of the log.
pub(super) struct TableRows<T> {
    table: Option<Table>,
    time_place: usize,
    time_factor: f64,
    clock: Clock,
    start_s: f64,
    decode: Decode<T>,
    /// Whether a row before the start is taken as of the start.
    keeps_early: bool,
    upcoming: Option<(Time, T)>,
    last: Option<Time>,
    left_out: LeftOut,
}

impl<T> TableRows<T> {
    /// No rows.
    pub(super) fn none() -> Self {
        Self {
            table: None,
            time_place: 0,
            time_factor: 1.0,
            clock: Clock::default(),
            start_s: 0.0,
            decode: Box::new(|_| Ok(None)),
            keeps_early: false,
            upcoming: None,
            last: None,
            left_out: LeftOut::default(),
        }
    }

    /// Time and value of the next row that has both, in s of the common clock.
    fn next_row(&mut self) -> Result<Option<(f64, T)>, ImportError> {
        let Some(table) = &mut self.table else { return Ok(None) };
        while table.advance()? {
            match (table.number(self.time_place)?, (self.decode)(table)?) {
                (Some(time), Some(value)) => {
                    return Ok(Some((self.clock.true_s(self.time_factor * time), value)));
                }
                _ => self.left_out.empty += 1,
            }
        }
        Ok(None)
    }

    /// Reads up to the next row that is later than the last.
    fn fill(&mut self) -> Result<(), ImportError> {
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
        Ok(TableRows {
            time_place: table.place(&self.time.name)?,
            time_factor: self.time.factor(Quantity::Time)?,
            table: Some(table),
            clock: self.clock,
            start_s,
            decode: Box::new(decode),
            ..TableRows::none()
        })
    }
}

impl DriveTable {
    /// Its rows from `start_s` on; what was set before holds from the start on.
    pub(super) fn rows(&self, start_s: f64) -> Result<TableRows<DriveCommand>, ImportError> {
        let table = Table::open(&self.path)?;
        let [mode, amplitude] = [table.place(&self.mode)?, table.place(&self.amplitude)?];
        let decode = move |table: &Table| drive(table, mode, amplitude);
        let mut rows = TableRows {
            time_place: table.place(&self.time.name)?,
            time_factor: self.time.factor(Quantity::Time)?,
            table: Some(table),
            clock: self.clock,
            start_s,
            decode: Box::new(decode),
            keeps_early: true,
            ..TableRows::none()
        };
        rows.fill()?;
        Ok(rows)
    }
}

/// The drive of a row; `None` of one without an amplitude.
fn drive(table: &Table, mode: usize, amplitude: usize) -> Result<Option<DriveCommand>, ImportError> {
    let mode_of = match table.cell(mode).to_lowercase().as_str() {
        "b" => DriveMode::B,
        "c" => DriveMode::C,
        "" | "off" | "none" | "0" => return Ok(Some(DriveCommand::OFF)),
        _ => return Err(table.refused(mode, "a mode: b, c or off")),
    };
    let Some(of_full) = table.number(amplitude)? else { return Ok(None) };
    #[expect(clippy::cast_possible_truncation, reason = "a command is f32")]
    let command = DriveCommand::try_new(mode_of, of_full as f32);
    command.map(Some).map_err(|_| table.refused(amplitude, "an amplitude from 0 to 1"))
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
