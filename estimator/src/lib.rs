//! Angle and rate of a rotor from camera frames and the samples of a laser-Doppler vibrometer, with variances, gate and
//! health.
//!
//! # Tour in the order of the data
//!
//! ```text
//! drive command --------+-----------------------------+
//!                       v                             v
//! LdvSample ------> MotionWatch (RestDetector) ---> filter -----> Estimate, Health
//!      |                                              ^   +-----> Innovation of each frame
//!      +----------> ImpactDetector -------------------+
//!                                                     |
//! CameraFrame ----> lag, gate, rest, smoother --------+
//! ```
//!
//! 0. [`Instruments`]: what camera and vibrometer are, as data. Every filter is built from it.
//! 1. [`CameraFrame`], [`LdvSample`]: measurements, each with the time at which it was taken.
//! 2. `MotionWatch`, with `RestDetector`: whether the rotor is driven, and in which mode, or quiet: a [`Motion`].
//! 3. `ImpactDetector`: the jumps of the rotor's vertical velocity, their instants and sizes; faults of the
//!    vibrometer.
//! 4. The filters. All implement [`AngleFilter`], and share gate, lag of late frames, restart and rest.
//!
//!    | filter | measurements | the rate between frames |
//!    |---|---|---|
//!    | [`ConstantRate`] | camera | random walk |
//!    | [`ImpactAided`] | camera, vibrometer | a kick of uncertain size at each impact |
//!    | [`TwinFilter`] | camera, vibrometer | a kick at each impact, computed by the motor's twin |
//!
//! 5. [`Innovation`] and [`ImpactInnovation`]: what became of a frame or of an impact, used or not, and why.
//! 6. [`Estimate`]: angle and rate at an instant, with their variances. [`Health`]: whether the estimate may be used.
//! 7. [`AngleFilter::smoothed`]: angle and rate at an earlier instant, from the frames after it as well.
//!
//! The module of each filter has a table of its states: symbol, unit, meaning, prior.
//!
//! Covariances are kept as their factors `P = U D U'`, so that they stay positive semidefinite in `f32`: by the crate
//! [`ud_filter`] for any number of states, by [`AngleRateCovariance`] for two.
//!
//! # Guarantees
//!
//! `no_std`, no allocation, no unsafe code. No call panics, and no call of a filter fails: every frame passes a gate
//! and leaves an [`Innovation`]. Angles are integers ([`motor_model::Angle`]), so nothing is lost over a million turns
//! in `f32`.

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
        reason = "a test fails by panicking, and takes its expected values from another library"
    )
)]

mod camera;
mod filter;
mod filters;
mod innovation;
mod instruments;
mod measurement;
mod settling;
mod vibrometer;

pub use camera::angle_rate_covariance::AngleRateCovariance;
pub use camera::process::Jitter;
pub use camera::track_covariance::TrackCovariance;
pub use camera::track_tuning::{RESTING_GROWTH_RAD2_S, TrackTuning};
pub use camera::tracker::FRAMES_KEPT;
pub use filter::{AngleFilter, Estimate, Health, Reason, ResonanceOffset};
pub use filters::constant_rate::{ConstantRate, ConstantRateTuning, RandomWalkTuning};
#[cfg(feature = "tell")]
pub use filters::impact_aided::SignedKick;
pub use filters::impact_aided::ringing::RingingTuning;
pub use filters::impact_aided::{ImpactAided, ImpactAidedTuning};
pub use filters::kicks_kept::IMPACTS_KEPT_MAX;
pub use filters::twin::{CheckedMotor, TwinFilter, TwinTuning};
#[cfg(feature = "tell")]
pub use filters::twin::{
    LEARNT, LEARNT_NAMES, Learnt, LearntPhase, ToldParts, TrueContact, TrueTooth, true_parts,
};
pub use innovation::{ContactInnovation, ImpactInnovation, Innovation, Rejection, Source, Verdict};
pub use instruments::{CameraDescription, FilterKind, Instruments, VibrometerDescription};
pub use measurement::{CameraFrame, LdvSample};
pub use vibrometer::impact_detector::ImpactDetectorTuning;
pub use vibrometer::motion::Motion;
pub use vibrometer::rest::RestTuning;

/// The code of the README, compiled and run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;

#[cfg(test)]
mod tests;
