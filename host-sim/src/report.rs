//! Rows in; text, pictures and files out. Nothing here knows a motor.

pub mod chart;
pub mod document;
mod error;
pub mod files;
pub mod page;
pub(crate) mod table;

pub use error::OutputError;
