//! Instructions that each operation takes on the microcontroller, as an emulator counts them.
//!
//! In the order of the data:
//!
//! - [`program`]: builds the ELF of `firmware-checks/src/bin/instructions.rs`, or takes one that is there.
//! - [`emulator`]: runs it on a [`Board`], in bounded time.
//! - [`Listing`]: what it printed, read with suspicion, and proved by loops of known length.
//! - [`targets`]: what the project wants the operations to take.
//! - [`Report`]: all of it as a table or as JSON.
//! - [`cycles`]: what the hot operations would take in cycles, an estimate.
//! - [`readme`]: the README's table of all that.
//!
//! The call of an operation and the passing of its arguments are counted with it. An emulator has neither wait states nor a pipeline: counts are
//! of instructions, not of cycles.

pub mod cycles;
pub mod emulator;
mod listing;
pub mod page;
pub mod program;
mod report;
pub mod targets;

pub use emulator::Board;
pub use listing::{Count, Listing, ListingError};
pub use report::{Record, Report};
