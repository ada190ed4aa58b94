//! Fixed runs in `f32`, and a digest of every bit of each: the proof that host and microcontroller compute the same.
//!
//! - [`TwinRun`]: the twin alone, 10,000 steps, with impacts at the end of the step and located inside it.
//! - [`LoopRun`]: the loop that flies, [`controller::tick`], positioning the twin by each of the filters.
//!
//! Construction, in `f64`, is part of both. The programs print both runs, one `key value` a line.

mod digest;
mod position;
mod twin;

pub(crate) use position::{Instruments, follow_loop, put};
pub use position::{LoopPlace, LoopRun};
pub use twin::TwinRun;
