//! The microcontroller's program, as far as it does not depend on a board: the same code runs on the host, where tests call it.
//!
//! - [`application`]: bytes from the host in, ticks of the loop, frames to the host out; over any transport and any amplifier. [`filter`]: the one
//!   that a configuration picks.
//! - [`waveform`], [`amplifier`]: the drive's sine, phase-continuous, out of a pulse width and an enabling pin (`embedded-hal`).
//! - [`tasks`]: the fast interrupt and the slow loop, their deadlines, the queues between them.
//! - [`telemetry`]: what it tells of itself in a log.
//! - `board`: the emulated board: registers, fault handlers, stack. What another board needs is in `firmware/BRINGUP.md`.
//! - [`parity`]: fixed runs of the `f32` twin and of the whole loop, and the digests of their bits, equal on every machine.
//! - [`instructions`]: what each operation of the twin, the filter and the loop takes, in instructions.
//!
//! The programs are in `src/bin`. `parity` prints the same lines on the host, so `cargo run -p firmware` shows what
//! `cargo run -p firmware --release --target thumbv7em-none-eabihf` must print from QEMU; `instructions` counts on the microcontroller only.

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
pub mod instructions;
pub mod parity;
#[cfg(target_os = "none")]
pub mod semihosting;
pub mod tasks;
pub mod telemetry;
pub mod waveform;
