//! The drives of a recording: a table in a file, or a series in memory.

use std::path::PathBuf;

use motor_model::{DriveCommand, DriveMode, MotorParams};

use super::rows::{Clock, NextRow, SourceRows};
use super::table::Table;
use super::{ColumnName, ImportError, Quantity};
use simulation::runs::recording::design_frequency_hz;

/// What a cell of the column of modes is not.
pub(super) const NO_MODE: &str = "a mode: b, c or off";

/// A table of drives.
#[derive(Clone, Debug)]
pub struct DriveTable {
    /// The file.
    pub path: PathBuf,
    /// Column of the times.
    pub time: ColumnName,
    /// Column of the modes: `b`, `c`; `off`, `none` or 0 for no drive. A row without a mode is no row of the drive.
    pub mode: String,
    /// Column of the amplitudes, of full drive.
    pub amplitude: String,
    /// Column of the frequencies; without it, and where a cell is empty, the drive has that of the design.
    pub frequency: Option<ColumnName>,
    /// Its clock.
    pub clock: Clock,
}

/// The drives of a recording.
#[derive(Clone, Debug)]
pub enum Drives<'a> {
    /// In a file.
    Table(DriveTable),
    /// In memory: times in s, each with the drive from then on.
    Series(&'a [(f64, DriveCommand)]),
}

impl Drives<'_> {
    /// Its rows from `start_s` on, of a motor of this design; what was set before holds from the start on.
    pub(super) fn rows(
        &self,
        start_s: f64,
        design: MotorParams,
    ) -> Result<SourceRows<'_, DriveCommand>, ImportError> {
        let rows = match self {
            Self::Table(table) => SourceRows::of(table.next_row(design)?, table.clock, start_s),
            Self::Series(series) => {
                let mut rows = series.iter();
                let next = move || Ok(rows.next().map(|(at_s, drive)| (Some(*at_s), Some(*drive))));
                SourceRows::of(Box::new(next), Clock::default(), start_s)
            }
        };
        let mut rows = rows.keeping_early();
        rows.fill()?;
        match self {
            Self::Table(table) if rows.upcoming().is_none() => Err(table.without_rows()),
            _ => Ok(rows),
        }
    }
}

impl DriveTable {
    fn next_row(&self, design: MotorParams) -> Result<NextRow<'_, DriveCommand>, ImportError> {
        let mut table = Table::open(&self.path)?;
        let mode = table.place(&self.mode, "--drive-mode")?;
        let amplitude = table.place(&self.amplitude, "--drive-amplitude")?;
        let frequency = match &self.frequency {
            Some(column) => {
                Some((table.place(&column.name, "--drive-frequency")?, column.factor(Quantity::Frequency)?))
            }
            None => None,
        };
        let time = table.place(&self.time.name, "--drive-time")?;
        let time_factor = self.time.factor(Quantity::Time)?;
        let columns = DriveColumns { mode, amplitude, frequency };
        Ok(Box::new(move || {
            if !table.advance()? {
                return Ok(None);
            }
            let shown_s = table.number(time)?.map(|cell| time_factor * cell);
            Ok(Some((shown_s, columns.drive(&table, &design)?)))
        }))
    }

    /// The refusal of a table whose rows say nothing of a drive.
    fn without_rows(&self) -> ImportError {
        let Self { path, mode, amplitude, .. } = self;
        ImportError::NoDrive { path: path.clone(), mode: mode.clone(), amplitude: amplitude.clone() }
    }
}

/// Places of the columns of a drive; of the frequency also its unit in Hz.
#[derive(Clone, Copy)]
struct DriveColumns {
    mode: usize,
    amplitude: usize,
    frequency: Option<(usize, f64)>,
}

impl DriveColumns {
    /// The drive of a row; `None` of one without a mode or an amplitude.
    fn drive(self, table: &Table, design: &MotorParams) -> Result<Option<DriveCommand>, ImportError> {
        let mode = match table.cell(self.mode).to_lowercase().as_str() {
            "b" => DriveMode::B,
            "c" => DriveMode::C,
            "" => return Ok(None),
            "off" | "none" | "0" => return Ok(Some(DriveCommand::OFF)),
            _ => return Err(table.refused(self.mode, NO_MODE)),
        };
        let Some(amplitude) = table.number(self.amplitude)? else { return Ok(None) };
        #[expect(clippy::cast_possible_truncation, reason = "a command is f32")]
        let command = DriveCommand::try_new(mode, amplitude as f32);
        let command = command.map_err(|_| table.refused(self.amplitude, "an amplitude from 0 to 1"))?;
        let Some((place, factor)) = self.frequency else { return Ok(Some(command)) };
        let Some(cell) = table.number(place)? else { return Ok(Some(command)) };
        let offset_hz = cell * factor - design_frequency_hz(design, mode);
        #[expect(clippy::cast_possible_truncation, reason = "a command is f32")]
        let command = command.with_frequency_offset(offset_hz as f32);
        command.map(Some).map_err(|_| table.refused(place, "a frequency within 2000 Hz of the design's"))
    }
}
