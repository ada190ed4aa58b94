//! The ensembles that are kept: stators that meet the paper's frequencies, one a row, with what is not published drawn.
//!
//! The columns are those of `ensemble::Member`. A row whose `met` is false meets the frequencies not, and says why.

/// Flat: without the stress of bonding. Made by `host-sim stator --ensemble 26`.
pub const FLAT: &str = include_str!("../members.csv");

/// With the stress of bonding: the first of the same draws. Made by `host-sim stator --ensemble 8 --set
/// stator.stressed=yes`.
pub const STRESSED: &str = include_str!("../members-stressed.csv");
