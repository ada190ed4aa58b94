//! Instructions that each operation takes on the microcontroller, as an emulator counts them.
//!
//! In the order of the data:
//!
//! | module | what it is |
//! |---|---|
//! | [`program`] | builds the ELF of `firmware-checks/src/bin/instructions.rs` |
//! | [`qemu`](crate::board::qemu) | runs it on a [`Board`](crate::board::qemu::Board), in limited time |
//! | [`Listing`] | what it printed, checked, and proved by loops of known length |
//! | [`targets`] | the most instructions that the operations should take |
//! | [`CountReport`] | the counts beside their targets, as a table or as JSON |
//! | [`cycles`] | what the hot operations would take in cycles, an estimate |
//! | [`page_values`](page_values::page_values) | the values of the page on the microcontroller |
//!
//! The call of an operation and the passing of its arguments are counted with it. An emulator has neither wait states
//! nor a pipeline: counts are of instructions, not of cycles.

mod count_report;
pub mod cycles;
mod listing;
pub mod page_values;
pub mod program;
pub mod targets;

pub use count_report::CountReport;
pub use listing::{Listing, ListingError};
