//! Rotor angle and rate from what a camera and a laser-Doppler vibrometer (LDV) see.
//!
//! # In the order of the data
//!
//! - [`CameraFrame`], [`LdvSample`]: measurements, each with the time at which it was taken.
//! - [`RestDetector`]: from the rotor's vertical velocity, whether it is still being struck.
//! - [`ConstantRate`]: a two-state Kalman filter, angle and rate; its covariance is kept factorised in [`AngleRateCovariance`].
//! - [`Innovation`]: what became of a measurement, used or not, and why.
//! - [`Estimate`]: angle and rate at an instant, with their variances.
//!
//! # Promises
//!
//! `no_std`, no allocation, no unsafe code. No call can fail or panic; every measurement passes a gate and leaves an
//! [`Innovation`]. Angles are integers ([`motor_model::Angle`]), so nothing is lost over a million turns in `f32`.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | innovation | measurement less its prediction |
//! | test ratio | innovation squared over the gate's limit of its variance: above 1 is refused |
//! | process noise | how much the rate may wander in a second, in rad^2/s^3 |
//! | zero-rate update | telling the filter that a rotor at rest does not turn |

#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::disallowed_methods,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "a test fails by panicking, and takes its yardsticks from another library"
    )
)]

pub mod comparison;
mod constant_rate;
mod covariance;
mod factors;
mod innovation;
mod measurement;
mod rest;
mod transition;

pub use constant_rate::{ConstantRate, ConstantRateTuning, Estimate, Motion};
pub use covariance::AngleRateCovariance;
pub use factors::{Correction, NoiseSource, NotPositiveDefinite, Refusal, UdCovariance};
pub use innovation::{Innovation, Rejection, Source, Verdict};
pub use measurement::{CameraFrame, LdvSample};
pub use rest::{RestDetector, RestTuning};
pub use transition::{Blocks2, Dense, Transition, UpperTriangular};
