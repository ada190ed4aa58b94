//! Why a recording is refused.

use std::path::PathBuf;

use super::drive::NO_MODE;

/// Why a recording is refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// Neither a camera nor a vibrometer.
    #[error("nothing that was measured is given")]
    NothingMeasured,
    /// Frames of a stator without a rotor.
    #[error("--camera is given with record.model = stator, and a stator without a rotor has no marks")]
    CameraOfStator,
    /// A table cannot be read.
    #[error("cannot read {}: {why}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's or the reader's reason.
        why: String,
    },
    /// A column is not in a table.
    #[error("{} has no column {column:?}", path.display())]
    NoColumn {
        /// The file.
        path: PathBuf,
        /// The column asked for.
        column: String,
        /// The flag of `import` that names it.
        flag: &'static str,
        /// The columns of the table.
        columns: Vec<String>,
    },
    /// The unit of a column is not known.
    #[error("column {column:?} {}", unit.as_ref().map_or_else(
        || "does not end in a unit".to_owned(), |unit| format!("has no unit {unit:?}")))]
    Unit {
        /// The column.
        column: String,
        /// The unit given.
        unit: Option<String>,
        /// The units that there are.
        possible: String,
    },
    /// A cell is not what it should be.
    #[error("{}:{line}: column {column:?}: {text:?} is not {expected}", path.display())]
    Cell {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The column.
        column: String,
        /// The cell.
        text: String,
        /// What it should be.
        expected: &'static str,
    },
    /// A row has more cells than there are columns.
    #[error("{}:{line} has {cells} cells, and {columns} columns have a name", path.display())]
    Cells {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// Cells of the row.
        cells: usize,
        /// Columns of the table.
        columns: usize,
    },
    /// A table has fewer than two rows with a time and a value.
    #[error("{} has {rows} rows with time and value; 2 are the least", path.display())]
    TooShort {
        /// The file.
        path: PathBuf,
        /// Its usable rows.
        rows: usize,
    },
    /// No row of a table is later than another.
    #[error("{} has {rows} rows with time and value, all at the same time", path.display())]
    OneTime {
        /// The file.
        path: PathBuf,
        /// Its usable rows.
        rows: usize,
    },
    /// No row of a table of drives has all that a drive needs.
    #[error(
        "{} has no drive: no row has a time, a mode in {mode:?} and an amplitude in {amplitude:?}",
        path.display()
    )]
    NoDrive {
        /// The file.
        path: PathBuf,
        /// The column of the modes.
        mode: String,
        /// The column of the amplitudes.
        amplitude: String,
    },
    /// A gap that is too long for a log.
    #[error("no measurement for more than a minute after {from_s:.3} s of the log")]
    Gap {
        /// Where it begins.
        from_s: f64,
    },
}

impl ImportError {
    /// What to try instead.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::NothingMeasured => Some("--camera FILE.csv, --vibrometer FILE.csv, or both".to_owned()),
            Self::CameraOfStator => Some("--model motor, or leave --camera out".to_owned()),
            Self::NoColumn { columns, .. } if columns.is_empty() => {
                Some("a table begins with a line of names".to_owned())
            }
            Self::NoColumn { flag, columns, .. } => {
                Some(format!("{flag} names one of {}", columns.join(", ")))
            }
            Self::Unit { column, possible, .. } => Some(format!("{column}:UNIT, with one of {possible}")),
            Self::TooShort { .. } => Some("cells that are empty or no finite number are left out".to_owned()),
            Self::Cells { .. } => Some("a decimal comma needs semicolons between the cells".to_owned()),
            Self::OneTime { .. } => Some("a column of times rises from row to row".to_owned()),
            Self::NoDrive { .. } | Self::Cell { expected: NO_MODE, .. } => {
                Some("--drive-mode and --drive-amplitude name the columns".to_owned())
            }
            Self::Gap { .. } => Some("import the parts before and after it as logs of their own".to_owned()),
            Self::Unreadable { .. } | Self::Cell { .. } => None,
        }
    }
}
