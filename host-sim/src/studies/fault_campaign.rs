//! Moves during which things go wrong, drawn at random: `host-sim faults`.
//!
//! Each run has a motor, a target, a filter and one or two faults of its own, all drawn by its seed. What is counted
//! are estimates that were called good and were not, moves that ended as reached and were not, and rotors that ran
//! away. Every run can be repeated by the command that the tables print.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the plan: scenes, runs, and which of them a part makes |
//! | `draw` | the faults of a run |
//! | `run` | one run, watched |
//! | `summary` | the counts of some runs |
//! | `tables`, `picture`, `report` | what is shown of them |

mod draw;
mod picture;
mod report;
mod run;
mod summary;
mod tables;

use std::path::PathBuf;

use crate::report::OutputError;
use crate::studies::beside::BesideScene;
use crate::studies::shard::{self, Part, Shard, run_each};
pub use run::FaultRun;
use simulation::runs::RunError;
pub use summary::FaultSummary;

/// Runs to be made.
#[derive(Clone, Debug)]
pub struct FaultCampaignPlan {
    /// Run `number` is of the scene in the place `number` modulo their count.
    scenes: Vec<BesideScene>,
    runs: u64,
    shard: Shard,
}

/// Runs that were made, in the order of their numbers.
#[derive(Clone, Debug)]
pub struct FaultCampaign {
    /// The runs.
    pub runs: Vec<FaultRun>,
}

impl FaultCampaign {
    /// That of tables of its parts.
    ///
    /// # Errors
    /// When a file cannot be read, has other rows, or is of another scene than the first.
    pub fn merged(tables: &[PathBuf]) -> Result<Self, OutputError> {
        let parts: Result<Vec<Part<FaultRun>>, _> = tables.iter().map(|path| shard::read(path)).collect();
        let parts = parts?;
        if let Some(digest) = parts.first().and_then(|part| part.digest.clone()) {
            shard::refuse_other_scenes(&parts, &digest)?;
        }
        Ok(Self { runs: shard::merged(parts, |run| run.number)? })
    }
}

impl FaultCampaignPlan {
    /// The part `shard` of `runs` runs, shared out among `scenes`: one at least.
    pub fn new(scenes: Vec<BesideScene>, runs: u64, shard: Shard) -> Self {
        Self { scenes, runs, shard }
    }

    /// How many runs this part makes.
    pub fn work(&self) -> u64 {
        self.shard.numbers(self.runs).len() as u64
    }

    /// Makes the runs, and calls `progress` after each. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn run(&self, progress: &(impl Fn() + Sync)) -> Result<FaultCampaign, RunError> {
        let one = |number: u64| {
            let place = usize::try_from(number % self.scenes.len() as u64).unwrap_or(0);
            run::made(number, &self.scenes[place])
        };
        Ok(FaultCampaign { runs: run_each(self.shard.numbers(self.runs), one, progress)? })
    }
}
