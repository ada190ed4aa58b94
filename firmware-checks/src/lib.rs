//! What is measured of the firmware, and nothing that flies: counts of instructions, and digests of bits.
//!
//! - [`parity`]: fixed runs of the `f32` twin and of the whole loop, and the digests of their bits, equal on every machine.
//! - [`instructions`]: the instructions that each operation of the twin, the filters and the loop takes.
//!
//! The programs are in `src/bin`:
//!
//! | program | what it does |
//! |---|---|
//! | `parity` | prints the digests, on the microcontroller and on the host |
//! | `instructions` | prints the counts; `host-sim instructions` reads them |
//! | `peers` | the same for other people's Kalman filters |
//! | `rehearsal` | runs the hot operations; `host-sim instructions --cycles` follows them |
//! | `faults` | fails in the way that it is told; the drive must go off |
//!
//! `cargo run -p firmware-checks` shows on the host what
//! `cargo run -p firmware-checks --profile firmware --target thumbv7em-none-eabihf` must print from QEMU.

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

pub mod instructions;
pub mod parity;
