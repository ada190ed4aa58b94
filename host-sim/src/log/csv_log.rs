//! Rows into a CSV file, in blocks.

use std::io::Write as _;

use estimator::LdvSample;
use motor_model::Time;

use super::RecordWriter;
use super::error::LogError;
use super::held_file::{HeldFile, refusal};
use super::table::{COLUMNS, Cell, Row, RowMaker};
use simulation::runs::record::{Impact, RunRecord};

/// Bytes of a block, about.
const BLOCK_BYTES: usize = 1 << 18;

/// The writer.
pub(super) struct CsvLog {
    file: HeldFile,
    rows: RowMaker,
    block: csv::Writer<Vec<u8>>,
    /// A cell as text.
    field: Vec<u8>,
    block_rows: usize,
    last: Time,
    until: Time,
}

/// A row has 40 characters, about.
const BLOCK_ROWS: usize = BLOCK_BYTES / 40;

fn new_block() -> csv::Writer<Vec<u8>> {
    csv::WriterBuilder::new().from_writer(Vec::with_capacity(2 * BLOCK_BYTES))
}

impl CsvLog {
    /// Begins the log of a run with the names of the columns.
    ///
    /// # Errors
    /// When a name is refused.
    pub(super) fn create(file: HeldFile) -> Result<Self, LogError> {
        let mut block = new_block();
        block
            .write_record(COLUMNS.iter().map(|(name, _)| name))
            .map_err(|error| LogError::Format(error.to_string()))?;
        let (rows, field) = (RowMaker::new(), Vec::with_capacity(32));
        Ok(Self { file, rows, block, field, block_rows: 0, last: Time::ZERO, until: Time::ZERO })
    }
}

/// A cell as it stands in the file: the shortest number that is read back to the same bits.
fn text(cell: Option<&Cell>, into: &mut Vec<u8>) {
    into.clear();
    match cell {
        None => {}
        // A vector takes everything.
        Some(Cell::Number(number)) => drop(write!(into, "{number:?}")),
        Some(Cell::Whole(number)) => drop(write!(into, "{number}")),
        Some(Cell::Word(word)) => into.extend(word.as_bytes()),
    }
}

fn write_row(block: &mut csv::Writer<Vec<u8>>, field: &mut Vec<u8>, row: &Row) -> Result<(), LogError> {
    let refused = |error: csv::Error| LogError::Format(error.to_string());
    for cell in row.cells() {
        text(cell.as_ref(), field);
        block.write_field(&*field).map_err(refused)?;
    }
    block.write_record(None::<&[u8]>).map_err(refused)
}

impl RecordWriter for CsvLog {
    fn write_samples(&mut self, at: Time, impacts: &[Impact], samples: &[LdvSample]) -> Result<(), LogError> {
        if self.block_rows >= BLOCK_ROWS {
            self.last_block()?;
        }
        self.last = at;
        let Self { rows, block, block_rows, field, .. } = self;
        rows.of_samples(impacts, samples, |row| {
            *block_rows += 1;
            write_row(block, field, row)
        })
    }

    fn write_tick(&mut self, record: &RunRecord, logged: bool) -> Result<(), LogError> {
        let Self { rows, block, block_rows, field, .. } = self;
        rows.of_tick(record, logged, |row| {
            *block_rows += 1;
            write_row(block, field, row)
        })
    }

    fn last_block(&mut self) -> Result<(), LogError> {
        let block = std::mem::replace(&mut self.block, new_block());
        self.block_rows = 0;
        let bytes = block.into_inner().map_err(|error| LogError::Format(error.to_string()))?;
        let written = self.file.hold(bytes.len() as u64).and_then(|()| self.file.write_all(&bytes));
        written.map_err(|source| refusal(self.file.destination(), source))?;
        self.until = self.last;
        Ok(())
    }

    fn until(&self) -> Time {
        self.until
    }

    fn close(self: Box<Self>, _: &str, _: Option<&str>) -> Result<HeldFile, LogError> {
        Ok(self.file)
    }
}
