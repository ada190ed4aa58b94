//! A table of a user, row by row: CSV with `,`, `;` or tabs, with or without a decimal comma.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use csv::{Reader, ReaderBuilder, StringRecord, Trim};

use super::ImportError;

/// An open table.
pub(super) struct Table {
    path: PathBuf,
    reader: Reader<BufReader<File>>,
    columns: Vec<String>,
    record: StringRecord,
    decimal_comma: bool,
}

impl Table {
    /// Opens the table at `path` and reads the names of its columns.
    pub fn open(path: &Path) -> Result<Self, ImportError> {
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

    /// The place of a column, which `flag` of `import` names.
    pub fn place(&self, column: &str, flag: &'static str) -> Result<usize, ImportError> {
        self.columns.iter().position(|name| name == column).ok_or_else(|| ImportError::NoColumn {
            path: self.path.clone(),
            column: column.to_owned(),
            flag,
            columns: self.columns.clone(),
        })
    }

    /// Reads the next row; whether there is one.
    ///
    /// # Errors
    /// When it cannot be read, or has a cell that is not empty behind the last column: the cells before it may then be
    /// parts of others, as those of a decimal comma in a table with commas are.
    pub fn advance(&mut self) -> Result<bool, ImportError> {
        let Self { path, columns, record, .. } = self;
        let read = self.reader.read_record(record);
        let is_read =
            read.map_err(|error| ImportError::Unreadable { path: path.clone(), why: error.to_string() })?;
        if record.iter().skip(columns.len()).any(|cell| !cell.is_empty()) {
            let (line, cells) = (line(record), record.len());
            return Err(ImportError::Cells { path: path.clone(), line, cells, columns: columns.len() });
        }
        Ok(is_read)
    }

    /// The text of a cell; empty where there is none.
    pub fn cell(&self, place: usize) -> &str {
        self.record.get(place).unwrap_or("")
    }

    /// The refusal of a cell.
    pub fn refused(&self, place: usize, expected: &'static str) -> ImportError {
        ImportError::Cell {
            path: self.path.clone(),
            line: line(&self.record),
            column: self.columns.get(place).cloned().unwrap_or_default(),
            text: self.cell(place).to_owned(),
            expected,
        }
    }

    /// The number of a cell; `None` where there is none, or none that is finite.
    pub fn number(&self, place: usize) -> Result<Option<f64>, ImportError> {
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

/// The line of a row, from 1.
fn line(record: &StringRecord) -> u64 {
    record.position().map_or(0, csv::Position::line)
}
