//! The firmware of the microcontroller: everything that runs on a board.
//!
//! Modules in the order of the data:
//!
//! | module | in | out |
//! |---|---|---|
//! | [`application`] | bytes of the host, measurements | ticks of the loop, commands, frames to the host |
//! | [`loop_report`] | the report of either loop | what the log and the host take of it |
//! | [`filter`] | a configuration | the filter that it selects |
//! | [`part_filters`] | the part, and the features of the program | the filters that it holds |
//! | [`design`] | the design of the motor | the frequencies of its drive |
//! | [`waveform`] | commands | samples of a sine with continuous phase |
//! | [`amplifier`] | samples | a pulse width and an enabling pin (`embedded-hal`) |
//! | [`ring`] | what a device writes into memory | the places that are new |
//! | [`tasks`] | the timer | the two tasks that call all of the above, their deadlines and the queues between them |
//! | [`main_loop`] | bytes of the line, ticks | bytes to the line, between which it never waits |
//! | [`telemetry`] | reports of ticks | entries of a log |
//! | [`store`] | the description of the bench | the same, after a loss of power |
//! | [`crash_record`] | a panic or a fault | the same, after the restart |
//! | [`stack_gauge`] | words of the stack | the most bytes that it has taken |
//!
//! These compile for any machine, and unit tests run them on the host. Two modules are for the microcontroller only:
//! `board` has the registers, the handlers of faults and the stack, `semihosting` the files of the emulator's host.
//! What a board of yours needs is in `firmware/BRINGUP.md`.
//!
//! The programs are in `src/bin`: `board` is the whole program of a board; `pil` runs the application in lock step with
//! a simulated motor. Programs that count instructions and compare bits are in the package `firmware-checks`.

#![no_std]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::cast_possible_truncation,
        reason = "a test fails by panicking, and its numbers are small"
    )
)]

pub mod amplifier;
pub mod application;
#[cfg(target_os = "none")]
pub mod board;
pub mod crash_record;
pub mod design;
pub mod filter;
pub mod loop_report;
pub mod main_loop;
pub mod part_filters;
pub mod ring;
#[cfg(target_os = "none")]
pub mod semihosting;
pub mod stack_gauge;
pub mod store;
pub mod tasks;
pub mod telemetry;
#[cfg(test)]
mod test_support;
pub mod waveform;

/// The `main` of a microcontroller's program on every other machine: says what to do instead, and fails.
#[macro_export]
macro_rules! only_on_the_board {
    ($instead:literal) => {
        #[cfg(not(target_os = "none"))]
        fn main() -> std::process::ExitCode {
            eprintln!($instead);
            std::process::ExitCode::from(2)
        }
    };
}
