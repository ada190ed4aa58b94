//! Rows of a sweep as cells, and as Parquet files.
//!
//! | column | content |
//! |---|---|
//! | `row`, `point`, `repeat`, `seed` | which row it is |
//! | one for each key | its value at the point |
//! | `failure`, `reason` | why there are no figures; empty where there are |
//! | one for each figure, by its path | its value; empty where the result has `null` |
//!
//! The time of each row on its machine is in a file of its own, since it is never the same twice.

use std::fs::File;
use std::path::{Path, PathBuf};

use parquet::basic::Type as PhysicalType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::record::Field;
use serde_json::Value;
use tempfile::NamedTempFile;

use super::summary::SummarySums;
use super::{Row, RowOutcome, SweepError, SweepPlan, SweepSummary};
use crate::report::OutputError;
use crate::report::files;
use crate::report::parquet_table::{Cell, CellKind, GROUP_ROWS, ParquetTable};

/// A column's name, and what its cells are.
pub(super) type Column = (String, CellKind);

/// A row as cells.
pub(super) type Cells = Vec<Option<Cell>>;

/// Columns before those of the keys.
const OF_EACH_ROW: [&str; 4] = ["row", "point", "repeat", "seed"];
/// Columns of a row that has failed.
pub(super) const FAILURE: &str = "failure";
pub(super) const REASON: &str = "reason";

/// Column of the table of times.
pub(super) const TIME: &str = "time_s";

/// File of the rows.
pub(super) const ROWS_FILE: &str = "rows.parquet";
/// File of their times.
pub(super) const TIMES_FILE: &str = "times.parquet";

impl SweepPlan {
    /// The columns of its rows. The seed has one of its own, also where it is swept.
    pub(super) fn columns(&self) -> Vec<Column> {
        let whole = |name: &str| (name.to_owned(), CellKind::Whole);
        let word = |name: &str| (name.to_owned(), CellKind::Word);
        let axes = self.swept_beside_the_seed().map(|(_, axis)| (axis.key.to_owned(), axis.cells));
        let figures = self.figures.iter().map(|path| (path.clone(), CellKind::Number));
        let first = OF_EACH_ROW.map(whole).into_iter();
        first.chain(axes).chain([FAILURE, REASON].map(word)).chain(figures).collect()
    }

    /// Places and axes, without that of the seed.
    fn swept_beside_the_seed(&self) -> impl Iterator<Item = (usize, &super::Axis)> {
        self.axes.iter().enumerate().filter(|(_, axis)| axis.key != "seed")
    }

    /// A row as cells of these columns.
    pub(super) fn cells(&self, row: &Row) -> Cells {
        let (point, repeat) = self.place_of(row.number);
        let mut cells: Cells = [row.number, point, repeat, row.seed].map(|whole| Some(whole.into())).into();
        let axes = self.swept_beside_the_seed();
        cells.extend(axes.map(|(place, axis)| cell(axis.cells, &row.values[place])));
        match &row.outcome {
            RowOutcome::Figures(figures) => {
                cells.extend([None, None]);
                cells.extend(figures.iter().map(|figure| figure.map(Cell::from)));
            }
            RowOutcome::Failed { failure, reason } => {
                cells.extend([Some(failure.word().into()), Some(reason.clone().into())]);
                cells.extend(self.figures.iter().map(|_| None));
            }
        }
        cells
    }
}

/// The cell of a text; empty for an empty text, and for what is not of its kind.
pub(super) fn cell(kind: CellKind, text: &str) -> Option<Cell> {
    match kind {
        _ if text.is_empty() => None,
        CellKind::Number => text.parse::<f64>().ok().map(Cell::from),
        CellKind::Whole => text.parse::<u64>().ok().map(Cell::from),
        CellKind::Word => Some(text.to_owned().into()),
    }
}

/// Both tables of a sweep while they are written, and what is said of them.
pub(super) struct TablesWriter {
    folder: PathBuf,
    rows: ParquetTable<NamedTempFile>,
    times: ParquetTable<NamedTempFile>,
    sums: SummarySums,
}

impl TablesWriter {
    /// Begins both tables of the sweep that `described` is.
    pub(super) fn create(folder: &Path, columns: &[Column], described: &Value) -> Result<Self, SweepError> {
        let about = described.to_string();
        let begun = |name: &str, columns: &[(&str, CellKind)]| {
            let path = folder.join(name);
            let facts = vec![("sweep".to_owned(), about.clone())];
            ParquetTable::create(files::temporary(&path)?, columns, facts)
                .map_err(|error| of_parquet(&path, error))
        };
        let named: Vec<(&str, CellKind)> =
            columns.iter().map(|(name, kind)| (name.as_str(), *kind)).collect();
        let of_times = [("row", CellKind::Whole), (TIME, CellKind::Number)];
        Ok(Self {
            folder: folder.to_owned(),
            rows: begun(ROWS_FILE, &named)?,
            times: begun(TIMES_FILE, &of_times)?,
            sums: SummarySums::new(columns, described),
        })
    }

    /// Adds a row and its time.
    pub(super) fn push(&mut self, cells: &Cells, time: Option<Cell>) -> Result<(), SweepError> {
        self.rows.push(cells);
        self.times.push(&[cells.first().cloned().flatten(), time]);
        self.sums.add(cells);
        if self.rows.rows() >= GROUP_ROWS { self.write_groups() } else { Ok(()) }
    }

    fn write_groups(&mut self) -> Result<(), SweepError> {
        let refused = |error| of_parquet(&self.folder.join(ROWS_FILE), error);
        self.rows.write_group().and_then(|()| self.times.write_group()).map_err(refused)
    }

    /// Ends both tables and gives them their names.
    pub(super) fn publish(mut self) -> Result<SweepSummary, SweepError> {
        if self.rows.rows() > 0 {
            self.write_groups()?;
        }
        let Self { folder, rows, times, sums } = self;
        for (table, name) in [(times, TIMES_FILE), (rows, ROWS_FILE)] {
            let path = folder.join(name);
            let file = table.finish().map_err(|error| of_parquet(&path, error))?;
            file.as_file().sync_all().map_err(|source| unwritable(&path, source))?;
            file.persist(&path).map_err(|error| unwritable(&path, error.error))?;
        }
        Ok(sums.summary(folder))
    }
}

/// A table that is read.
pub(super) struct TableReader {
    path: PathBuf,
    reader: SerializedFileReader<File>,
    columns: Vec<Column>,
}

impl TableReader {
    /// Opens the table at `path`.
    ///
    /// # Errors
    /// When it cannot be read.
    pub(super) fn open(path: &Path) -> Result<Self, SweepError> {
        let file =
            File::open(path).map_err(|source| OutputError::Unreadable { path: path.to_owned(), source })?;
        let reader = SerializedFileReader::new(file).map_err(|error| unreadable(path, &error))?;
        let kind_of = |column: PhysicalType| match column {
            PhysicalType::DOUBLE => CellKind::Number,
            PhysicalType::INT64 => CellKind::Whole,
            _ => CellKind::Word,
        };
        let columns = reader.metadata().file_metadata().schema_descr().columns().iter();
        let columns =
            columns.map(|column| (column.name().to_owned(), kind_of(column.physical_type()))).collect();
        Ok(Self { path: path.to_owned(), reader, columns })
    }

    /// Its columns.
    pub(super) fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// Its rows, in order.
    ///
    /// # Errors
    /// When the file cannot be read; an element is an error when its row cannot.
    pub(super) fn rows(&self) -> Result<impl Iterator<Item = Result<Cells, SweepError>>, SweepError> {
        let rows = self.reader.get_row_iter(None).map_err(|error| unreadable(&self.path, &error))?;
        Ok(rows.map(|row| {
            let row = row.map_err(|error| unreadable(&self.path, &error))?;
            Ok(row.get_column_iter().map(|(_, field)| of_field(field)).collect())
        }))
    }
}

fn unreadable(path: &Path, error: &ParquetError) -> SweepError {
    OutputError::unexpected(path, error).into()
}

fn of_field(field: &Field) -> Option<Cell> {
    match field {
        Field::Double(number) => Some((*number).into()),
        Field::ULong(number) => Some((*number).into()),
        Field::Str(word) => Some(word.clone().into()),
        _ => None,
    }
}

pub(super) fn unwritable(path: &Path, source: std::io::Error) -> SweepError {
    OutputError::Unwritable { path: path.to_owned(), source }.into()
}

fn of_parquet(path: &Path, error: ParquetError) -> SweepError {
    match error {
        ParquetError::External(source) => match source.downcast::<std::io::Error>() {
            Ok(source) => unwritable(path, *source),
            Err(other) => OutputError::Table(other.to_string()).into(),
        },
        other => OutputError::Table(other.to_string()).into(),
    }
}
