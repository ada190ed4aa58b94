#![doc = include_str!("../README.md")]
//!
//! # Tour
//!
//! | item | what it is |
//! |---|---|
//! | [`KalmanFilter`] | state and covariance: linear and extended predictions and measurements |
//! | [`UdCovariance`] | the factors of N states: measurement update, process noise, single states |
//! | [`Transition`] | shapes of F, with `P <- F P F'`: [`UpperTriangular`], [`Blocks2`], [`Blocks`], [`Dense`], yours |
//! | [`NoiseSource`] | a random input of known variance and its effect on each state |
//! | [`SparseRow`], [`WhitenedMeasurement`] | measurements of a few of many states |
//! | [`InnovationRecord`] | what became of a measurement: used, outside the gate, refused |
//! | [`VectorInnovationRecord`] | the same of several measurements at once |
//! | [`DiscreteModel`] | F and noise sources of a step, from a model in continuous time |
//! | [`smooth`] | the states of an interval from the measurements before and after each |
//! | [`Real`] | the scalar: `f32`, `f64` |

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
        clippy::cast_precision_loss,
        reason = "a test fails by panicking, and takes its expected values from another library"
    )
)]

#[cfg(test)]
mod bad_numbers;
mod discretisation;
mod kalman_filter;
mod prediction;
mod real;
#[cfg(feature = "serde")]
mod serialised_array;
mod smoother;
#[cfg(test)]
mod test_support;
mod transition;
mod ud_covariance;
#[cfg(test)]
mod unrolling;

pub use discretisation::DiscreteModel;
pub use kalman_filter::KalmanFilter;
pub use prediction::PredictionRefusal;
pub use real::{Real, is_finite, reciprocal};
pub use smoother::{SmootherRefusal, SmootherStep, smooth};
pub use transition::{BlockList, Blocks, Blocks2, Dense, Transition, UpperTriangular};
pub use ud_covariance::{
    Columns, Correction, InnovationRecord, NoiseSource, NotAVariance, NotFactors, NotPositiveSemidefinite,
    Outcome, Refusal, SparseRow, UdCovariance, VectorInnovationRecord, WhitenedMeasurement,
};
