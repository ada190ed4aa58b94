//! The rows that are done, one a line, in the order of their numbers: what an interrupted sweep goes on from.
//!
//! A line is written in one piece when its row and all before it are done. A process that is killed, or a full disk,
//! can tear the last line alone. Such a line is cut off, and its row is made again.

use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Seek as _, SeekFrom, Write as _};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::SweepError;
use super::tables::{Cells, Column, TIME, cell, unwritable};
use crate::report::OutputError;
use crate::report::parquet_table::{Cell, CellKind};

/// The file, while rows are added.
pub(super) struct Journal {
    path: PathBuf,
    file: File,
    /// Rows in it.
    pub(super) done: u64,
    line: Vec<u8>,
}

impl Journal {
    /// Opens the journal of `rows` and cuts off a torn line; begins it where there is none.
    ///
    /// # Errors
    /// When it cannot be read or written, or a row before the last line is damaged.
    pub(super) fn open(path: &Path, columns: &[Column], rows: &Range<u64>) -> Result<Self, SweepError> {
        let refused = |source| unwritable(path, source);
        let open = File::options().read(true).write(true).create(true).truncate(false).open(path);
        let mut file = open.map_err(refused)?;
        let header = header(columns)?;
        let mut end = 0;
        let mut done = 0;
        let mut reader = BufReader::new(&file);
        let mut line = Vec::new();
        loop {
            line.clear();
            let bytes = reader.read_until(b'\n', &mut line).map_err(refused)?;
            let is_next = if end == 0 { line == header } else { is_row(&line, rows.start + done) };
            if !is_next {
                // What follows a damaged line was written after it: a torn line is the last one.
                if bytes > 0 && line.ends_with(b"\n") {
                    return Err(SweepError::Damaged { path: path.to_owned(), row: rows.start + done });
                }
                break;
            }
            done += u64::from(end > 0);
            end += bytes as u64;
        }
        drop(reader);
        file.set_len(end).and_then(|()| file.seek(SeekFrom::Start(end)).map(drop)).map_err(refused)?;
        if end == 0 {
            file.write_all(&header).map_err(refused)?;
        }
        Ok(Self { path: path.to_owned(), file, done, line })
    }

    /// Adds a row.
    ///
    /// # Errors
    /// When there is no room, or the system refuses it; the next [`Self::open`] finds the rows before it.
    pub(super) fn append(&mut self, cells: &Cells, time_s: f64) -> Result<(), SweepError> {
        self.line.clear();
        let mut writer = csv::Writer::from_writer(&mut self.line);
        let texts = cells.iter().map(|cell| cell.as_ref().map_or_else(String::new, text));
        let written = writer.write_record(texts.chain([format!("{time_s:.6}")]));
        let ended = written.map_err(io::Error::from).and_then(|()| writer.flush());
        drop(writer);
        ended
            .and_then(|()| self.file.write_all(&self.line))
            .map_err(|source| unwritable(&self.path, source))?;
        self.done += 1;
        Ok(())
    }

    /// Calls `take` with each row and its time.
    ///
    /// # Errors
    /// When the file cannot be read, or `take` refuses a row.
    pub(super) fn read(
        &self,
        columns: &[Column],
        mut take: impl FnMut(&Cells, Option<Cell>) -> Result<(), SweepError>,
    ) -> Result<(), SweepError> {
        let refused = |error: csv::Error| OutputError::unexpected(&self.path, error);
        let mut reader = csv::Reader::from_path(&self.path).map_err(refused)?;
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record).map_err(refused)? {
            let cells: Cells =
                columns.iter().zip(&record).map(|((_, kind), text)| cell(*kind, text)).collect();
            let time = record.get(columns.len()).and_then(|text| cell(CellKind::Number, text));
            take(&cells, time)?;
        }
        Ok(())
    }
}

/// The first line.
fn header(columns: &[Column]) -> Result<Vec<u8>, SweepError> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let names = columns.iter().map(|(name, _)| name.as_str()).chain([TIME]);
    let refused = |error: csv::Error| OutputError::Table(error.to_string());
    writer.write_record(names).map_err(refused)?;
    writer.into_inner().map_err(|error| OutputError::Table(error.to_string()).into())
}

/// Whether a line is whole, and that of row `number`.
fn is_row(line: &[u8], number: u64) -> bool {
    let begins = line.strip_prefix(number.to_string().as_bytes()).is_some_and(|rest| rest.starts_with(b","));
    begins && line.ends_with(b"\n")
}

/// A cell as text: the shortest number that is read back to the same bits.
fn text(cell: &Cell) -> String {
    match cell {
        Cell::Number(number) => format!("{number:?}"),
        Cell::Whole(number) => number.to_string(),
        Cell::Word(word) => word.clone().into_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn columns() -> Vec<Column> {
        [("row", CellKind::Whole), ("reason", CellKind::Word), ("x", CellKind::Number)]
            .map(|(name, kind)| (name.to_owned(), kind))
            .to_vec()
    }

    fn cells(number: u64) -> Cells {
        let reason = (!number.is_multiple_of(2)).then(|| Cell::from("a, \"b\"".to_owned()));
        let figure =
            number.is_multiple_of(2).then(|| Cell::from(0.1 * simulation::math::count::real(number)));
        vec![Some(number.into()), reason, figure]
    }

    fn open(path: &Path) -> Result<Journal, SweepError> {
        Journal::open(path, &columns(), &(5..100))
    }

    /// Torn at any byte, it has the rows before the tear, and goes on from there to the same bytes.
    #[test]
    fn law_a_journal_torn_at_any_byte_goes_on_to_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.partial.csv");
        let write = |from: &mut Journal| {
            for number in from.done + 5..12 {
                from.append(&cells(number), 0.25).unwrap();
            }
        };
        write(&mut open(&path).unwrap());
        let whole = std::fs::read(&path).unwrap();
        // What is torn may be longer than all that is written after it.
        let tears = [Vec::new(), vec![b'x'; whole.len()]];
        for (length, tear) in
            (0..=whole.len()).flat_map(|length| tears.iter().map(move |tear| (length, tear)))
        {
            std::fs::write(&path, [&whole[..length], tear].concat()).unwrap();
            let mut journal = open(&path).unwrap();
            let lines = std::str::from_utf8(&whole[..length]).unwrap().matches('\n').count() as u64;
            assert_eq!(journal.done, lines.saturating_sub(1), "{length}");
            write(&mut journal);
            assert_eq!(std::fs::read(&path).unwrap(), whole, "{length}");
        }
        let mut found = Vec::new();
        let mut journal_rows = |row: &Cells, time| {
            assert_eq!(time, Some(Cell::Number(0.25)));
            found.push(row.clone());
            Ok(())
        };
        open(&path).unwrap().read(&columns(), &mut journal_rows).unwrap();
        assert_eq!(found, (5..12).map(cells).collect::<Vec<_>>());
    }

    #[test]
    fn exact_damage_before_the_last_line_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("rows.partial.csv");
        std::fs::write(&path, "row,reason,x,time_s\n5,,1.0,0.1\n7,,1.0,0.1\n").unwrap();
        assert!(matches!(open(&path), Err(SweepError::Damaged { row: 6, .. })));
        std::fs::write(&path, "row,other,time_s\n").unwrap();
        assert!(matches!(open(&path), Err(SweepError::Damaged { row: 5, .. })));
    }
}
