//! Columns of numbers as numpy arrays, which take the memory over without a copy.

use numpy::{IntoPyArray as _, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde::Serialize;
use serde_json::Value;

use crate::errors::Error;

/// A column, one cell a row.
#[derive(Debug)]
pub enum Column {
    /// Numbers, NaN where there is none.
    Numbers(Vec<f64>),
    /// Whole numbers that stand for words.
    Codes(Vec<u8>),
    /// Yes or no.
    Flags(Vec<bool>),
    /// Words.
    Words(Vec<String>),
    /// Numbers in rows of this many.
    Vectors(Vec<f64>, usize),
    /// Square matrices of this many rows.
    Matrices(Vec<f64>, usize),
}

impl Column {
    fn into_array(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        Ok(match self {
            Self::Numbers(numbers) => numbers.into_pyarray(py).into_any(),
            Self::Codes(codes) => codes.into_pyarray(py).into_any(),
            Self::Flags(flags) => flags.into_pyarray(py).into_any(),
            Self::Words(words) => {
                let words = PyList::new(py, words)?;
                py.import("numpy")?.call_method1("array", (words, "str"))?
            }
            Self::Vectors(numbers, n) => {
                let rows = numbers.len() / n.max(1);
                numbers.into_pyarray(py).reshape([rows, n])?.into_any()
            }
            Self::Matrices(numbers, n) => {
                let rows = numbers.len() / (n * n).max(1);
                numbers.into_pyarray(py).reshape([rows, n, n])?.into_any()
            }
        })
    }
}

/// Columns with their names.
#[derive(Debug, Default)]
pub struct Table(Vec<(String, Column)>);

impl Table {
    /// The table with another column.
    #[must_use]
    pub fn with(mut self, name: &str, column: Column) -> Self {
        self.0.push((name.to_owned(), column));
        self
    }

    /// A column a field of rows that are written as JSON objects: numbers, NaN where there is none, or words.
    ///
    /// # Errors
    /// When a row is no object: a slip in the program.
    pub fn of_rows<R: Serialize>(rows: &[R]) -> Result<Self, Error> {
        let rows: Result<Vec<Value>, _> = rows.iter().map(serde_json::to_value).collect();
        let rows = rows.map_err(|error| pyo3::exceptions::PyRuntimeError::new_err(error.to_string()))?;
        let names: Vec<String> = rows
            .first()
            .and_then(Value::as_object)
            .map(|row| row.keys().cloned().collect())
            .unwrap_or_default();
        let column = |name: &String| {
            let cells = || rows.iter().map(|row| &row[name]);
            let column = if cells().any(Value::is_string) {
                Column::Words(cells().map(|cell| cell.as_str().unwrap_or_default().to_owned()).collect())
            } else {
                Column::Numbers(cells().map(|cell| cell.as_f64().unwrap_or(f64::NAN)).collect())
            };
            (name.clone(), column)
        };
        Ok(Self(names.iter().map(column).collect()))
    }

    /// As a dictionary of arrays.
    ///
    /// # Errors
    /// When Python has no memory left.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        for (name, column) in self.0 {
            dict.set_item(name, column.into_array(py)?)?;
        }
        Ok(dict)
    }
}

/// Columns of numbers that grow row by row.
#[derive(Debug)]
pub struct NumberColumns<const N: usize> {
    names: [&'static str; N],
    columns: [Vec<f64>; N],
}

impl<const N: usize> NumberColumns<N> {
    /// No rows.
    pub fn new(names: [&'static str; N]) -> Self {
        Self { names, columns: std::array::from_fn(|_| Vec::new()) }
    }

    /// Adds a row.
    #[inline]
    pub fn push(&mut self, row: [f64; N]) {
        for (column, cell) in self.columns.iter_mut().zip(row) {
            column.push(cell);
        }
    }

    /// Adds `by` to every cell of a column.
    pub fn shift(&mut self, column: usize, by: f64) {
        self.columns.get_mut(column).into_iter().flatten().for_each(|cell| *cell += by);
    }
}

impl<const N: usize> From<NumberColumns<N>> for Table {
    fn from(columns: NumberColumns<N>) -> Self {
        let NumberColumns { names, columns } = columns;
        names
            .into_iter()
            .zip(columns)
            .fold(Self::default(), |table, (name, column)| table.with(name, Column::Numbers(column)))
    }
}
