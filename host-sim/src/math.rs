//! Numbers only: what is said of samples, and where random numbers come from.

pub mod allan_deviation;
pub mod plain_number;
pub mod random_streams;
pub mod spectrum;
pub mod statistics;
