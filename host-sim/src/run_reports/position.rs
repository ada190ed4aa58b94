//! The picture and the report of a move.
//!
//! | module | what it is |
//! |---|---|
//! | `picture_trace` | the course of a move, thinned for its picture |
//! | `picture` | the picture |
//! | `report_trace` | what the report on a move shows beside: innovations, health, phases, the impacts of a burst |
//! | `report` | the report on a move |

mod picture;
mod picture_trace;
mod report;
mod report_trace;

pub use picture::svg;
pub use picture_trace::PictureTrace;
pub(crate) use report::{MoveCost, report};
pub(crate) use report_trace::ReportTrace;
