//! How far the filters are off the truth: one motor under a [`timeline`] of drives, and the error sums of every filter
//! by phase.
//!
//! | module | what it is |
//! |---|---|
//! | [`comparison`] | one motor on the rig, and all filters and genies on the same frames and samples |
//! | [`timeline`] | which drive when, and the phases that are judged |
//! | [`error_sums`], [`phase_sums`] | sums of errors, innovations and health, of one phase and of all |
//! | `genie`, `kicks` | a lower bound: a filter that is told the kicks |
//! | [`told`] | twins that are told parts of the truth |
//! | [`rate_walk`] | the walk of the rate that a camera sees |

pub mod comparison;
pub mod error_sums;
mod genie;
mod kicks;
pub mod phase_sums;
pub mod rate_walk;
pub mod timeline;
pub mod told;
