//! The firmware on an emulated microcontroller: built, counted, measured, in the loop, its log decoded.

mod error;
pub mod instructions;
pub mod pil;
pub mod size;
pub mod telemetry;

pub use error::BoardError;
