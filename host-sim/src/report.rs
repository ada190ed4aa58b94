//! Rows in; text, pictures and files out. Nothing here knows a motor.
//!
//! | module | what it is |
//! |---|---|
//! | [`document`] | headings, paragraphs, tables and pictures, as text and as Markdown |
//! | `table` | the layout of every table |
//! | [`page`] | pages of results: a template, its values, and the comparison of two pages |
//! | [`chart`] | pictures: panels of series over axes, as SVG |
//! | [`compare`] | two results side by side, with what changed beyond noise |
//! | [`key_figure`] | the numbers by which a result is judged, with their intervals |
//! | `html` | the report on a run as one HTML file |
//! | `parquet_table` | tables as Parquet files, in row groups |
//! | [`files`] | files that appear whole or not at all; CSV and JSON |

pub mod chart;
pub(crate) mod compare;
pub(crate) mod document;
mod error;
pub(crate) mod files;
pub(crate) mod html;
pub(crate) mod key_figure;
pub(crate) mod page;
pub(crate) mod parquet_table;
pub(crate) mod table;

pub use error::OutputError;
