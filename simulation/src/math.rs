//! Numbers only; nothing here knows a motor.
//!
//! | module | what it is |
//! |---|---|
//! | [`statistics`] | mean, spread, quantiles, a straight line, quantiles of distributions |
//! | [`spectrum`] | Fourier spectrum of a sampled motion |
//! | [`allan_deviation`] | Allan deviation of a record of angles |
//! | [`random_streams`] | one seeded stream of random numbers per source |
//! | [`plain_number`] | numbers as a person writes them |
//! | [`count`] | counts in arithmetic |
//! | [`clock_sync`] | one clock by another, from round trips, with its uncertainty |

pub mod allan_deviation;
pub mod clock_sync;
pub mod count;
pub mod plain_number;
pub mod random_streams;
pub mod spectrum;
pub mod statistics;
