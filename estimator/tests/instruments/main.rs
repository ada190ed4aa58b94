//! The filters with any instruments, on rotors whose motion is known: without a vibrometer, with bad ones, with slow,
//! coarse and late cameras.
#![expect(
    clippy::unwrap_used,
    clippy::disallowed_methods,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "tests fail by panicking, and take their yardsticks from another library"
)]

mod any_instruments;
mod bench;
mod camera;
mod rest;
mod shared_errors;
mod stamps;
mod vibrometer;
