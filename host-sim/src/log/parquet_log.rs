//! Rows into a Parquet file, in row groups. The file's own key-value metadata has what an MCAP log says of its run.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use motor_model::Time;
use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};

use super::error::LogError;
use super::held_file::{HeldFile, SharedFile, refusal};
use super::recorder::LogOptions;
use super::table::{COLUMNS, Cell, CellKind, Row, RowMaker};
use super::{RecordWriter, Stated};
use crate::runs::record::RunRecord;

/// Rows of a row group.
const GROUP_ROWS: usize = 1 << 16;
/// What the end of the file says of a row group: its columns, each with place, sizes and statistics.
const GROUP_PLACE_BYTES: u64 = 300 * COLUMNS.len() as u64;
/// What it says of the file.
const END_BYTES: u64 = 1 << 14;

/// The cells of a column that are not empty, and which rows have one.
#[derive(Clone, Debug, Default)]
struct ColumnCells {
    numbers: Vec<f64>,
    words: Vec<ByteArray>,
    filled: Vec<i16>,
}

impl ColumnCells {
    fn push(&mut self, cell: Option<&Cell>) {
        self.filled.push(i16::from(cell.is_some()));
        match cell {
            None => {}
            Some(Cell::Number(number)) => self.numbers.push(*number),
            Some(Cell::Word(word)) => self.words.push(ByteArray::from(word.as_bytes().to_vec())),
        }
    }

    fn clear(&mut self) {
        self.numbers.clear();
        self.words.clear();
        self.filled.clear();
    }

    /// Bytes that the column takes in the file, at most.
    fn bytes_max(&self) -> u64 {
        let words: usize = self.words.iter().map(|word| 8 + word.len()).sum();
        // Snappy may add a sixth; a page for each megabyte, and the levels.
        ((8 * self.numbers.len() + words) as u64) * 7 / 6 + self.filled.len() as u64 / 4 + 4096
    }
}

/// The writer.
pub(super) struct ParquetLog {
    writer: SerializedFileWriter<SharedFile>,
    file: SharedFile,
    path: PathBuf,
    rows: RowMaker,
    columns: Vec<ColumnCells>,
    groups: u64,
    end_bytes: u64,
    last: Time,
    until: Time,
}

fn schema() -> Result<Type, ParquetError> {
    let column = |&(name, kind): &(&str, CellKind)| {
        let field = match kind {
            CellKind::Number => Type::primitive_type_builder(name, PhysicalType::DOUBLE),
            CellKind::Word => Type::primitive_type_builder(name, PhysicalType::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String))
                .with_converted_type(ConvertedType::UTF8),
        };
        field.with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
    };
    let columns = COLUMNS.iter().map(column).collect::<Result<_, _>>()?;
    Type::group_type_builder("log").with_fields(columns).build()
}

impl ParquetLog {
    /// Begins the log of a run.
    ///
    /// # Errors
    /// When there is no room, or the system refuses it.
    pub(super) fn create(mut file: HeldFile, stated: &Stated, options: LogOptions) -> Result<Self, LogError> {
        let path = file.destination().to_owned();
        let mut facts: Vec<KeyValue> =
            stated.facts(options).into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
        facts.push(KeyValue::new("scene.toml".to_owned(), stated.scene.clone()));
        let end_bytes = END_BYTES + stated.scene.len() as u64;
        file.hold(end_bytes).map_err(|source| refusal(&path, source))?;
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_key_value_metadata(Some(facts));
        for (name, kind) in COLUMNS {
            let of_words = *kind == CellKind::Word;
            properties = properties.set_column_dictionary_enabled(ColumnPath::from(*name), of_words);
        }
        let file = SharedFile::new(file);
        let refused = |error| of_parquet(&path, error);
        let schema = Arc::new(schema().map_err(refused)?);
        let writer = SerializedFileWriter::new(file.clone(), schema, Arc::new(properties.build()));
        Ok(Self {
            writer: writer.map_err(refused)?,
            file,
            path,
            rows: RowMaker::new(options.every),
            columns: vec![ColumnCells::default(); COLUMNS.len()],
            groups: 0,
            end_bytes,
            last: Time::ZERO,
            until: Time::ZERO,
        })
    }

    fn push(columns: &mut [ColumnCells], row: &Row) {
        for (column, cell) in columns.iter_mut().zip(row) {
            column.push(cell.as_ref());
        }
    }

    fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for (column, (_, kind)) in self.columns.iter().zip(COLUMNS) {
            let Some(mut writer) = group.next_column()? else { break };
            let filled = Some(&column.filled[..]);
            match kind {
                CellKind::Number => {
                    writer.typed::<DoubleType>().write_batch(&column.numbers, filled, None)?
                }
                CellKind::Word => writer.typed::<ByteArrayType>().write_batch(&column.words, filled, None)?,
            };
            writer.close()?;
        }
        group.close()?;
        Ok(())
    }
}

impl RecordWriter for ParquetLog {
    fn write(&mut self, record: &RunRecord) -> Result<(), LogError> {
        let Self { rows, columns, .. } = self;
        rows.rows(record, |row| {
            Self::push(columns, row);
            Ok::<(), LogError>(())
        })?;
        self.last = record.at;
        let full = self.columns.first().is_some_and(|column| column.filled.len() >= GROUP_ROWS);
        if full { self.last_block() } else { Ok(()) }
    }

    fn last_block(&mut self) -> Result<(), LogError> {
        let group_bytes: u64 = self.columns.iter().map(ColumnCells::bytes_max).sum();
        let bytes = group_bytes + self.end_bytes + (self.groups + 1) * GROUP_PLACE_BYTES;
        self.file.lock().hold(bytes).map_err(|source| refusal(&self.path, source))?;
        self.write_group().map_err(|error| of_parquet(&self.path, error))?;
        self.groups += 1;
        self.until = self.last;
        self.columns.iter_mut().for_each(ColumnCells::clear);
        Ok(())
    }

    fn until(&self) -> Time {
        self.until
    }

    fn close(self: Box<Self>, ended: &str, _: Option<&str>) -> Result<HeldFile, LogError> {
        let Self { mut writer, file, path, .. } = *self;
        writer.append_key_value_metadata(KeyValue::new("ended".to_owned(), ended.to_owned()));
        let refused = |error| of_parquet(&path, error);
        drop(writer.into_inner().map_err(refused)?);
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
