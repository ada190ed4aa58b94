//! A motor's parameters from recordings of it, by statistics that repeat where the motion does not.
//!
//! ```text
//! recordings ---> statistics s                                     statistics.rs
//! prior ---> drawn motors, same drives, same instruments ---> statistics of each               training.rs
//!            regressions: what tells a parameter, how it follows from the parameters           emulator.rs
//! s, prior ---> posterior of the parameters that are told          posterior.rs
//! ```

pub mod candidates;
pub mod emulator;
pub mod measured;
pub mod parameters;
pub mod parts;
pub mod posterior;
pub mod ridge;
pub mod statistics;
pub mod training;

#[cfg(test)]
mod tests;
