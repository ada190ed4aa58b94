//! The microcontroller's program, as far as it does not depend on a board: the same code runs on the host, where tests call it.
//!
//! - [`application`]: bytes from the host in, ticks of the loop, frames to the host out; over any transport and any amplifier. [`filter`]: the one
//!   that a configuration picks.
//! - [`waveform`], [`amplifier`]: the drive's sine, phase-continuous, out of a pulse width and an enabling pin (`embedded-hal`).
//! - [`tasks`]: the fast interrupt and the slow loop, their deadlines, the queues between them.
//! - [`telemetry`]: what it tells of itself in a log.
//! - `board`: the emulated board: registers, fault handlers, stack. What another board needs is in `firmware/BRINGUP.md`.
//!
//! The programs are in `src/bin`: `board` is the whole program, `pil` the loop in lock step with a simulated motor.

#![no_std]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        reason = "a test fails by panicking"
    )
)]

pub mod amplifier;
pub mod application;
#[cfg(target_os = "none")]
pub mod board;
pub mod filter;
#[cfg(target_os = "none")]
pub mod semihosting;
pub mod tasks;
pub mod telemetry;
pub mod waveform;
