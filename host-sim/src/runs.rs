//! One motor, one run: in open loop, in closed loop, a move, a rate.

pub(crate) mod closed_loop;
mod error;
pub mod filter;
pub(crate) mod health_words;
pub(crate) mod not_modelled;
pub mod position;
pub mod rate;
pub mod record;
pub mod recording;
pub(crate) mod report_parts;
pub mod rotor_tilt;
pub(crate) mod simulate;
pub mod stated_errors;
pub mod tick_driver;

pub use error::RunError;
