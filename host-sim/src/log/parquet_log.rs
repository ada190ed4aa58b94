//! Rows into a Parquet file, in row groups. The file's own key-value metadata has what an MCAP log says of its run.

use std::path::{Path, PathBuf};

use estimator::LdvSample;
use motor_model::Time;
use parquet::errors::ParquetError;

use super::error::LogError;
use super::held_file::{HeldFile, SharedFile, refusal};
use super::options::LogOptions;
use super::table::{COLUMNS, RowMaker};
use super::{RecordWriter, Stated};
use crate::report::parquet_table::{GROUP_ROWS, ParquetTable};
use simulation::runs::record::{Impact, RunRecord};

/// What the end of the file says of a row group: its columns, each with place, sizes and statistics.
const GROUP_PLACE_BYTES: u64 = 300 * COLUMNS.len() as u64;
/// What it says of the file.
const END_BYTES: u64 = 1 << 14;

/// The writer.
pub(super) struct ParquetLog {
    table: ParquetTable<SharedFile>,
    file: SharedFile,
    path: PathBuf,
    rows: RowMaker,
    groups: u64,
    end_bytes: u64,
    last: Time,
    until: Time,
}

impl ParquetLog {
    /// Begins the log of a run.
    ///
    /// # Errors
    /// When there is no room, or the system refuses it.
    pub(super) fn create(mut file: HeldFile, stated: &Stated, options: LogOptions) -> Result<Self, LogError> {
        let path = file.destination().to_owned();
        let mut facts: Vec<(String, String)> = stated.facts(options).into_iter().collect();
        facts.push(("scene.toml".to_owned(), stated.scene.clone()));
        let end_bytes = END_BYTES + stated.scene.len() as u64;
        file.hold(end_bytes).map_err(|source| refusal(&path, source))?;
        let file = SharedFile::new(file);
        let table = ParquetTable::create(file.clone(), COLUMNS, facts);
        Ok(Self {
            table: table.map_err(|error| of_parquet(&path, error))?,
            file,
            path,
            rows: RowMaker::new(),
            groups: 0,
            end_bytes,
            last: Time::ZERO,
            until: Time::ZERO,
        })
    }
}

impl RecordWriter for ParquetLog {
    fn write_samples(&mut self, at: Time, impacts: &[Impact], samples: &[LdvSample]) -> Result<(), LogError> {
        if self.table.rows() >= GROUP_ROWS {
            self.last_block()?;
        }
        self.last = at;
        let Self { rows, table, .. } = self;
        rows.of_samples(impacts, samples, |row| {
            table.push_cells(row.filled());
            Ok(())
        })
    }

    fn write_tick(&mut self, record: &RunRecord, logged: bool) -> Result<(), LogError> {
        let Self { rows, table, .. } = self;
        rows.of_tick(record, logged, |row| {
            table.push_cells(row.filled());
            Ok(())
        })
    }

    fn last_block(&mut self) -> Result<(), LogError> {
        let bytes = self.table.bytes_max() + self.end_bytes + (self.groups + 1) * GROUP_PLACE_BYTES;
        self.file.lock().hold(bytes).map_err(|source| refusal(&self.path, source))?;
        self.table.write_group().map_err(|error| of_parquet(&self.path, error))?;
        self.groups += 1;
        self.until = self.last;
        Ok(())
    }

    fn until(&self) -> Time {
        self.until
    }

    fn close(self: Box<Self>, ended: &str, _: Option<&str>) -> Result<HeldFile, LogError> {
        let Self { mut table, file, path, .. } = *self;
        table.append_fact("ended", ended);
        drop(table.finish().map_err(|error| of_parquet(&path, error))?);
        file.into_inner()
    }
}

fn of_parquet(path: &Path, error: ParquetError) -> LogError {
    match error {
        ParquetError::External(source) => match source.downcast::<std::io::Error>() {
            Ok(source) => refusal(path, *source),
            Err(other) => LogError::Format(other.to_string()),
        },
        other => LogError::Format(other.to_string()),
    }
}
