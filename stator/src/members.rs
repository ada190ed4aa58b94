//! The ensemble that is kept: stators that meet the paper's frequencies, one a row, with what is not published drawn.
//!
//! The columns are those of `ensemble::Member`. A row whose `met` is false meets the frequencies not.

/// Flat: without the stress of bonding. Made by `host-sim stator --ensemble 26`.
pub const FLAT: &str = include_str!("../members.csv");
