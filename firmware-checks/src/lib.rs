//! Programs that measure the firmware and are not part of it: counts of instructions, digests of bits, faults.
//!
//! - [`parity`]: fixed runs of the `f32` twin and of the whole loop, and the digests of their bits, equal on every
//!   machine.
//! - [`instructions`]: the instructions that each operation of the twin, the filters and the loop takes.
//!
//! The programs are in `src/bin`:
//!
//! | program | what it does |
//! |---|---|
//! | `parity` | prints the digests, on the microcontroller and on the host |
//! | `instructions` | prints the counts; `host-sim instructions` reads them |
//! | `peers` | the same for other crates' Kalman filters |
//! | `hot_operations` | runs the most frequent operations; `host-sim instructions --cycles` follows every instruction |
//! | `faults` | fails as its input says; the drive must go off |
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

/// Ends a program on the microcontroller; after an error it has failed.
#[cfg(target_os = "none")]
pub fn end_with(outcome: Result<(), motor_model::OutOfBounds>) -> ! {
    use cortex_m_semihosting::{debug, heprintln};

    if let Err(error) = outcome {
        // The key alone: printing its numbers would link decimal conversion of f64.
        heprintln!("{} is out of bounds", error.key);
        firmware::board::end(debug::EXIT_FAILURE)
    }
    firmware::board::end(debug::EXIT_SUCCESS)
}
