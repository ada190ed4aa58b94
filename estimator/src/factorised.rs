//! Covariances kept as their factors `P = U D U'`: the numerical core, which knows neither motor nor instruments.
//!
//! | module | what it holds |
//! |---|---|
//! | [`ud_covariance`] | the factors of N states: measurement update, process noise, single states, sparse rows |
//! | [`transition`] | the shapes of F, and `P <- F P F'` for each |
//! | [`prediction`] | the time update, of both |
//! | [`angle_rate`] | the factors of two states, angle and rate, written out |
//!
//! Imports point from the last to the first: `ud_covariance` imports none of the others.

pub(crate) mod angle_rate;
mod prediction;
pub(crate) mod transition;
pub(crate) mod ud_covariance;
