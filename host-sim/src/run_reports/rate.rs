//! The picture and the report of a held rate.

mod picture;
mod report;

pub use picture::svg;
pub(crate) use report::report;
