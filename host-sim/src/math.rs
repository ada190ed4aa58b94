//! Numbers only; nothing here knows a motor.
//!
//! | module | what it is |
//! |---|---|
//! | [`statistics`] | mean, spread, quantiles, a straight line, quantiles of distributions |
//! | [`difference`] | whether two independent results differ beyond chance |
//! | [`paired_difference`] | whether two results of the same runs do |
//! | [`least_squares`] | a curve through points, with the standard deviations of its parameters |
//! | [`spectrum`] | Fourier spectrum of a sampled motion |
//! | [`allan_deviation`] | Allan deviation of a record of angles |
//! | [`random_streams`] | one seeded stream of random numbers per source |
//! | [`plain_number`] | numbers as a person writes them |
//! | [`count`] | counts in arithmetic |

pub(crate) mod allan_deviation;
pub(crate) mod count;
pub(crate) mod difference;
pub(crate) mod least_squares;
pub(crate) mod paired_difference;
pub(crate) mod plain_number;
pub(crate) mod random_streams;
pub(crate) mod spectrum;
pub mod statistics;
