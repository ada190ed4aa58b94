//! A motor is commissioned: its map is measured through the instruments, and drawn beside the map that it began with.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the words of what was found |
//! | `rows` | the rows of both maps side by side |
//! | `tables` | text and JSON |
//! | `picture` | the map with intervals, and the sweeps |
//! | `report` | the report on one motor |
//! | `trials`, `trial_tables` | many motors, each commissioned and moved by both maps |

mod picture;
mod report;
mod rows;
mod tables;
mod trial_tables;
mod trials;

pub(crate) use report::report;
pub(crate) use tables::json;
pub(crate) use trial_tables::page_value;
pub use trials::{CommissioningTrial, CommissioningTrials, CommissioningTrialsPlan};

use controller::commissioning::CommissioningEnd;
use controller::commissioning::findings::{Finding, FindingKind};
use simulation::runs::commission::CommissionedMotor;

/// How commissioning ended, in a word.
pub(crate) fn end_word(end: CommissioningEnd) -> &'static str {
    match end {
        CommissioningEnd::Enough => "enough",
        CommissioningEnd::TimeOver => "time_over",
        CommissioningEnd::NoEstimate => "no_estimate",
        CommissioningEnd::NeverRests => "never_rests",
        CommissioningEnd::EndOfTravel => "end_of_travel",
    }
}

/// The motor in words.
fn name(motor: &CommissionedMotor) -> String {
    motor.seed.map_or_else(|| "Motor at the board".to_owned(), |seed| format!("Motor of seed {seed}"))
}

/// A finding in a word.
pub(crate) fn finding_word(kind: FindingKind) -> &'static str {
    match kind {
        FindingKind::Dead => "dead",
        FindingKind::Slow { .. } => "slow",
        FindingKind::OtherWay => "other_way",
        FindingKind::FastestBelowFull { .. } => "fastest_below_full",
        FindingKind::TurnsBack { .. } => "turns_back",
        FindingKind::Sticks { .. } => "sticks",
        FindingKind::Lost { .. } => "lost",
    }
}

/// A finding in a sentence.
fn sentence(finding: &Finding) -> String {
    let mode = finding.mode;
    match finding.kind {
        FindingKind::Dead => format!("Mode {mode:?} is dead."),
        FindingKind::Slow { part } => {
            format!("Mode {mode:?} turns the rotor at {:.1} % of the map's rate.", 100.0 * part)
        }
        FindingKind::OtherWay => format!("Mode {mode:?} turns the rotor the other way."),
        FindingKind::FastestBelowFull { amplitude } => {
            format!("Mode {mode:?} is fastest at amplitude {amplitude:.2}, not at full drive.")
        }
        FindingKind::TurnsBack { amplitude, part } => {
            format!(
                "Mode {mode:?} at amplitude {amplitude:.2} turns back in {:.0} % of its windows.",
                100.0 * part
            )
        }
        FindingKind::Sticks { amplitude, part } => {
            format!(
                "Mode {mode:?} at amplitude {amplitude:.2} sticks in {:.0} % of its windows.",
                100.0 * part
            )
        }
        FindingKind::Lost { part } => {
            format!("The estimate is lost in {:.0} % of the cruises of mode {mode:?}.", 100.0 * part)
        }
    }
}
