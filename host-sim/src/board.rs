//! The firmware on an emulated microcontroller: built, counted, measured, in the loop, its log decoded.
//!
//! | module | what it is |
//! |---|---|
//! | [`qemu`] | the emulator: boards, arguments, start, watch, end |
//! | [`instructions`] | instructions and estimated cycles of each operation |
//! | [`size`] | bytes of flash, RAM and stack, and calls that the loop must not make |
//! | [`parts`] | which filter fits which part |
//! | [`pil`] | processor in the loop: the firmware positions the simulated motor |
//! | [`serial`] | a real board at a serial line: a move on it, with its clock, its frames and the end of the drive |
//! | `telemetry` | the firmware's log beside the truth; only with the feature of that name |
//! | `elf_image` | an ELF of the microcontroller: its functions and sections |

mod elf_image;
mod error;
pub(crate) mod instructions;
pub(crate) mod parts;
pub mod pil;
pub mod qemu;
pub mod serial;
pub(crate) mod size;
#[cfg(feature = "telemetry")]
pub mod telemetry;

pub use error::BoardError;
pub use size::{MaskedSection, masked_sections};
