//! The firmware on an emulated microcontroller: built, counted, measured, in the loop, its log decoded.

mod error;
pub mod instructions;
pub mod pil;
pub mod size;
#[cfg(feature = "telemetry")]
pub mod telemetry;

pub use error::BoardError;
