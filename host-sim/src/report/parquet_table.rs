//! A table as a Parquet file, written in row groups: no more than one of them is in memory.

use std::borrow::Cow;
use std::io::Write;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};

/// Rows of a row group.
pub(crate) const GROUP_ROWS: usize = 1 << 16;

/// The kind of a column's cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellKind {
    /// A number.
    Number,
    /// A whole number.
    Whole,
    /// A word.
    Word,
}

/// A cell that is not empty.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cell {
    Number(f64),
    Whole(u64),
    Word(Cow<'static, str>),
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<f32> for Cell {
    fn from(number: f32) -> Self {
        Self::Number(number.into())
    }
}

impl From<u64> for Cell {
    fn from(number: u64) -> Self {
        Self::Whole(number)
    }
}

impl From<&'static str> for Cell {
    fn from(word: &'static str) -> Self {
        Self::Word(Cow::Borrowed(word))
    }
}

impl From<String> for Cell {
    fn from(word: String) -> Self {
        Self::Word(Cow::Owned(word))
    }
}

impl From<Cow<'static, str>> for Cell {
    fn from(word: Cow<'static, str>) -> Self {
        Self::Word(word)
    }
}

/// The cells of a column that are not empty, and which rows have one.
#[derive(Clone, Debug, Default)]
struct ColumnCells {
    numbers: Vec<f64>,
    wholes: Vec<i64>,
    words: Vec<ByteArray>,
    filled: Vec<i16>,
}

impl ColumnCells {
    /// Adds the cell of row `row`; the rows since the last cell are empty.
    fn push(&mut self, row: usize, cell: &Cell) {
        self.filled.resize(row, 0);
        self.filled.push(1);
        match cell {
            Cell::Number(number) => self.numbers.push(*number),
            // The same bits: the column says that it has no sign.
            Cell::Whole(number) => self.wholes.push(number.cast_signed()),
            Cell::Word(word) => self.words.push(ByteArray::from(word.as_bytes().to_vec())),
        }
    }

    fn clear(&mut self) {
        self.numbers.clear();
        self.wholes.clear();
        self.words.clear();
        self.filled.clear();
    }

    /// Bytes that `rows` rows of the column take in the file, at most.
    fn bytes_max(&self, rows: usize) -> u64 {
        let words: usize = self.words.iter().map(|word| 8 + word.len()).sum();
        let numbers = 8 * (self.numbers.len() + self.wholes.len());
        // Snappy may add a sixth; a page for each megabyte, and the levels.
        ((numbers + words) as u64) * 7 / 6 + rows as u64 / 4 + 4096
    }
}

/// A table that is being written.
pub(crate) struct ParquetTable<W: Write + Send> {
    writer: SerializedFileWriter<W>,
    kinds: Vec<CellKind>,
    columns: Vec<ColumnCells>,
    rows: usize,
}

fn schema(columns: &[(&str, CellKind)]) -> Result<Type, ParquetError> {
    let column = |&(name, kind): &(&str, CellKind)| {
        let field = match kind {
            CellKind::Number => Type::primitive_type_builder(name, PhysicalType::DOUBLE),
            CellKind::Whole => Type::primitive_type_builder(name, PhysicalType::INT64)
                .with_logical_type(Some(LogicalType::integer(64, false)))
                .with_converted_type(ConvertedType::UINT_64),
            CellKind::Word => Type::primitive_type_builder(name, PhysicalType::BYTE_ARRAY)
                .with_logical_type(Some(LogicalType::String))
                .with_converted_type(ConvertedType::UTF8),
        };
        field.with_repetition(Repetition::OPTIONAL).build().map(Arc::new)
    };
    let columns = columns.iter().map(column).collect::<Result<_, _>>()?;
    Type::group_type_builder("rows").with_fields(columns).build()
}

impl<W: Write + Send> ParquetTable<W> {
    /// Begins a table of `columns` with `facts` about it in its metadata.
    ///
    /// # Errors
    /// When the file refuses its first bytes.
    pub(crate) fn create(
        file: W,
        columns: &[(&str, CellKind)],
        facts: Vec<(String, String)>,
    ) -> Result<Self, ParquetError> {
        let facts: Vec<KeyValue> = facts.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_key_value_metadata(Some(facts));
        for (name, kind) in columns {
            let path = ColumnPath::new(vec![(*name).to_owned()]);
            properties = properties.set_column_dictionary_enabled(path, *kind == CellKind::Word);
        }
        let writer =
            SerializedFileWriter::new(file, Arc::new(schema(columns)?), Arc::new(properties.build()))?;
        Ok(Self {
            writer,
            kinds: columns.iter().map(|(_, kind)| *kind).collect(),
            columns: vec![ColumnCells::default(); columns.len()],
            rows: 0,
        })
    }

    /// Adds a row of as many cells as there are columns to the group in memory.
    pub(crate) fn push<'a>(&mut self, row: impl IntoIterator<Item = &'a Option<Cell>>) {
        self.push_cells(
            row.into_iter().enumerate().filter_map(|(column, cell)| Some((column, cell.as_ref()?))),
        );
    }

    /// Adds a row that has these cells, each with its column; the others are empty.
    pub(crate) fn push_cells<'a>(&mut self, cells: impl IntoIterator<Item = (usize, &'a Cell)>) {
        for (column, cell) in cells {
            if let Some(column) = self.columns.get_mut(column) {
                column.push(self.rows, cell);
            }
        }
        self.rows += 1;
    }

    /// Rows of the group in memory.
    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// Bytes that the group in memory takes in the file, at most.
    pub(crate) fn bytes_max(&self) -> u64 {
        self.columns.iter().map(|column| column.bytes_max(self.rows)).sum()
    }

    /// Writes the group in memory, and begins another.
    ///
    /// # Errors
    /// When the file refuses it.
    pub(crate) fn write_group(&mut self) -> Result<(), ParquetError> {
        let mut group = self.writer.next_row_group()?;
        for (column, kind) in self.columns.iter_mut().zip(&self.kinds) {
            column.filled.resize(self.rows, 0);
            let Some(mut writer) = group.next_column()? else { break };
            let filled = Some(&column.filled[..]);
            match kind {
                CellKind::Number => {
                    writer.typed::<DoubleType>().write_batch(&column.numbers, filled, None)?
                }
                CellKind::Whole => writer.typed::<Int64Type>().write_batch(&column.wholes, filled, None)?,
                CellKind::Word => writer.typed::<ByteArrayType>().write_batch(&column.words, filled, None)?,
            };
            writer.close()?;
        }
        group.close()?;
        self.columns.iter_mut().for_each(ColumnCells::clear);
        self.rows = 0;
        Ok(())
    }

    /// Adds a fact about the table.
    pub(crate) fn append_fact(&mut self, key: &str, value: &str) {
        self.writer.append_key_value_metadata(KeyValue::new(key.to_owned(), value.to_owned()));
    }

    /// Ends the file. What is in memory is left out: [`Self::write_group`] writes it.
    ///
    /// # Errors
    /// When the file refuses its end.
    pub(crate) fn finish(self) -> Result<W, ParquetError> {
        self.writer.into_inner()
    }
}
