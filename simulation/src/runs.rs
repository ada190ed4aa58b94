//! One motor, one run: in open loop, in closed loop, a move, a rate.

pub mod clock_note;
pub mod closed_loop;
pub mod commission;
mod error;
pub mod filter;
pub mod health_words;
pub mod late_interrupts;
pub mod limits;
pub mod not_modelled;
pub mod position;
pub mod rate;
pub mod record;
pub mod recording;
pub mod rotor_tilt;
pub mod simulate;
pub mod stated_errors;
pub mod tick_driver;

pub use error::RunError;
