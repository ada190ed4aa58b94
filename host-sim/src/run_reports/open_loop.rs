//! The samples, the picture and the report of a run in open loop.

mod html_report;
mod report_trace;
pub mod samples_csv;

pub(crate) use html_report::html_report;
pub use report_trace::{OpenLoopTrace, close_up};
