//! Fixed runs in `f32`, and a digest of every bit of each, to show that host and microcontroller compute the same bits.
//!
//! - [`TwinRun`]: the twin alone, 10,000 steps, with impacts at the end of the step and located inside it.
//! - [`LoopRun`]: the loop body, [`controller::tick`], positions the twin, with each of the filters.
//!
//! The construction of motors and filters, in `f64`, is part of both. The program `parity` prints both, one `key value`
//! a line.

mod digest;
mod loop_run;
mod twin_run;

pub use loop_run::{LoopMemory, LoopRun};
pub(crate) use loop_run::{
    LoopParts, SAMPLE_NANOS, TARGETS_DEG, TICKS_PER_TARGET, TOLERANCE_DEG, TwinInstruments, build_loop,
    run_loop, tick_parts,
};
#[cfg(test)]
pub(crate) use loop_run::{PIXEL_UNITS, TICKS_PER_FRAME};
pub use twin_run::TwinRun;
