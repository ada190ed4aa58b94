//! A motor is commissioned: its map is measured through the instruments, and drawn beside the map that it began with.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the words of what was found |
//! | `rows` | the rows of both maps side by side |
//! | `tables` | text and JSON |
//! | `picture` | the map with intervals, and the sweeps |
//! | `report` | the report on one motor |

mod picture;
mod report;
mod rows;
mod tables;

pub(crate) use report::report;
pub(crate) use tables::json;

use controller::commissioning::CommissioningEnd;
use controller::commissioning::findings::{Finding, FindingKind};

/// How commissioning ended, in a word.
pub(crate) fn end_word(end: CommissioningEnd) -> &'static str {
    match end {
        CommissioningEnd::Enough => "enough",
        CommissioningEnd::TimeOver => "time_over",
        CommissioningEnd::NoEstimate => "no_estimate",
        CommissioningEnd::NeverRests => "never_rests",
    }
}

/// A finding in a word.
pub(crate) fn finding_word(kind: FindingKind) -> &'static str {
    match kind {
        FindingKind::Dead => "dead",
        FindingKind::OtherWay => "other_way",
        FindingKind::FastestBelowFull { .. } => "fastest_below_full",
        FindingKind::TurnsBack { .. } => "turns_back",
        FindingKind::Sticks { .. } => "sticks",
    }
}

/// A finding in a sentence.
fn sentence(finding: &Finding) -> String {
    let mode = finding.mode;
    match finding.kind {
        FindingKind::Dead => format!("Mode {mode:?} is dead."),
        FindingKind::OtherWay => format!("Mode {mode:?} turns the rotor the other way."),
        FindingKind::FastestBelowFull { amplitude } => {
            format!("Mode {mode:?} is fastest at amplitude {amplitude:.2}, not at full drive.")
        }
        FindingKind::TurnsBack { part } => {
            format!("Mode {mode:?} turns back in up to {:.0} % of the windows of a drive.", 100.0 * part)
        }
        FindingKind::Sticks { part } => {
            format!("Mode {mode:?} sticks in up to {:.0} % of the windows of a drive.", 100.0 * part)
        }
    }
}
