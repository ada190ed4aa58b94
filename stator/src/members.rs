//! The ensembles that are kept: stators that meet the paper's frequencies, one a row, with what is not published drawn.
//!
//! The columns are those of [`Member`]. A row whose `met` is false meets the frequencies not, and says why.

use crate::ensemble::Member;

/// Flat: without the stress of bonding. Made by `host-sim stator --ensemble 26`.
const FLAT: &str = include_str!("../members.csv");

/// With the stress of bonding: the first of the same draws. Made by `host-sim stator --ensemble 8 --set
/// stator.stressed=yes`.
const STRESSED: &str = include_str!("../members-stressed.csv");

/// The members of a kept ensemble: of flat stators, or of those with the stress of bonding.
///
/// # Errors
/// When the table is damaged, which a test excludes.
pub fn kept(stressed: bool) -> Result<Vec<Member>, csv::Error> {
    let table = if stressed { STRESSED } else { FLAT };
    csv::Reader::from_reader(table.as_bytes()).deserialize().collect()
}
