//! Moves under many cameras and vibrometers, each beside what was promised before it began: `host-sim instruments`.
//!
//! Every bench of [`benches()`] differs from the scene in one or two keys. On each, motors drawn within their
//! tolerances make four kinds of moves, with every filter and with the one that is chosen when none is named. The
//! tolerance of a move is the finest of [`TOLERANCES_DEG`] that the bench promises to meet before the deadline
//! ([`simulation::runs::position::plan`]).
//!
//! Each move of a bench and a filter has a motor and a noise of its own: moves with the noise of one seed end with
//! nearly the same error, because most of their frames are those at rest after the move, and would count once.
//!
//! | outcome | meaning |
//! |---|---|
//! | refused | no tolerance can be promised: nothing moves |
//! | reached | held as on target, and the true angle is within three tolerances |
//! | wrong | held as on target, and it is not |
//! | gave up | ended with a reason before the deadline |
//! | sat still | ended by the deadline alone |
//!
//! | module | what it is |
//! |---|---|
//! | this one | the plan: which benches, filters, motors and moves; one move |
//! | `benches` | the instruments that are tried |
//! | `summary` | the counts of a bench |
//! | `tables`, `picture`, `report` | what is shown of them |

mod benches;
mod picture;
mod report;
mod summary;
mod tables;

use serde::{Deserialize, Serialize};

use crate::studies::shard::{Shard, run_each};
pub use benches::{Bench, benches};
use simulation::runs::RunError;
use simulation::runs::filter::FILTERS;
use simulation::runs::position::{self, MoveEnding};
use simulation::scene::{Scene, SceneError};
pub use summary::BenchSummary;

/// Targets of the moves, in degrees.
const TARGETS_DEG: [f64; 4] = [90.0, -90.0, 1.0, -0.05];
/// Tolerances that are asked for, the finest that is promised first.
const TOLERANCES_DEG: [f64; 7] = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0];
/// Time after which a move is given up, in s.
const DEADLINE_S: &str = "30";
/// Time for which a target is held before the error counts, in s.
const HOLD_S: &str = "0.1";
/// The choice of the filter that the instruments allow best.
const CHOSEN: &str = "best";

/// What became of a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GridOutcome {
    /// No tolerance can be promised.
    Refused,
    /// On target, rightly.
    Reached,
    /// On target, wrongly.
    Wrong,
    /// Ended with a reason.
    GaveUp,
    /// Ended by the deadline.
    SatStill,
}

/// A move, as it is written and read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GridMove {
    /// Its place among all moves.
    pub number: u64,
    /// The bench.
    pub bench: String,
    /// The filter asked for.
    pub filter: String,
    /// Seed of motor and noise.
    pub seed: u64,
    /// Target.
    pub target_deg: f64,
    /// Tolerance asked for; 0 where it was refused.
    pub tolerance_deg: f64,
    /// Time promised in s.
    pub promised_s: f64,
    /// What became of it.
    pub outcome: GridOutcome,
    /// Why it ended, where it gave up.
    pub reason: String,
    /// True angle at the end less the target.
    pub error_mdeg: f64,
    /// Time until the target was held, or until the end, in s.
    pub time_s: f64,
}

/// Moves to be made.
#[derive(Clone, Debug)]
pub struct InstrumentGridPlan {
    scene: Scene,
    benches: Vec<Bench>,
    motors: u64,
    shard: Shard,
}

/// Moves that were made, in the order of their numbers.
#[derive(Clone, Debug)]
pub struct InstrumentGrid {
    /// The moves.
    pub moves: Vec<GridMove>,
}

impl InstrumentGridPlan {
    /// The moves of `motors` motors to each target on every bench whose name contains `only`.
    pub fn new(scene: &Scene, motors: u64, only: &str, shard: Shard) -> Self {
        let benches = benches().into_iter().filter(|bench| bench.name.contains(only)).collect();
        Self { scene: scene.clone(), benches, motors, shard }
    }

    /// The numbers of the moves of this shard.
    fn numbers(&self) -> Vec<u64> {
        let filters = FILTERS.len() as u64 + 1;
        self.shard.numbers(self.benches.len() as u64 * filters * self.motors * TARGETS_DEG.len() as u64)
    }

    /// How many moves this shard makes.
    pub fn work(&self) -> u64 {
        self.numbers().len() as u64
    }

    /// Makes the moves of this shard, and calls `progress` after each. The result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn run(&self, progress: &(impl Fn() + Sync)) -> Result<InstrumentGrid, RunError> {
        Ok(InstrumentGrid { moves: run_each(self.numbers(), |number| self.make(number), progress)? })
    }

    /// Bench, filter, motor and target of a number: the last two vary fastest.
    fn case(&self, number: u64) -> Option<(&Bench, &'static str, u64, f64)> {
        let targets = TARGETS_DEG.len() as u64;
        let filters = FILTERS.len() as u64 + 1;
        let at = |index: u64| usize::try_from(index).ok();
        let moves = self.motors * targets;
        let (motor, rest) = (number % moves, number / moves);
        let target_deg = TARGETS_DEG.get(at(motor % targets)?)?;
        let filter =
            at(rest % filters)?.checked_sub(1).map_or(Some(CHOSEN), |index| FILTERS.get(index).copied())?;
        Some((self.benches.get(at(rest / filters)?)?, filter, motor, *target_deg))
    }

    fn make(&self, number: u64) -> Result<GridMove, RunError> {
        let (bench, filter, motor, target_deg) = self.case(number).expect("a number below the count");
        let mut scene = self.scene.of_run(motor)?;
        let to = target_deg.to_string();
        let own = [
            ("estimator.filter", filter),
            ("position.to_deg", &to),
            ("position.deadline_s", DEADLINE_S),
            ("position.hold_s", HOLD_S),
        ];
        for (key, value) in bench.sets.iter().copied().chain(own) {
            scene.set(key, value)?;
        }
        let made = GridMove {
            number,
            bench: bench.name.clone(),
            filter: filter.to_owned(),
            seed: scene.seed(),
            target_deg,
            tolerance_deg: 0.0,
            promised_s: 0.0,
            outcome: GridOutcome::Refused,
            reason: String::new(),
            error_mdeg: 0.0,
            time_s: 0.0,
        };
        let Some((tolerance_deg, promised_s)) = finest(&mut scene)? else { return Ok(made) };
        let outcome = position::run(&scene, |_| ())?;
        Ok(GridMove {
            tolerance_deg,
            promised_s,
            outcome: outcome.ending().into(),
            reason: outcome.stopped.clone().unwrap_or_default(),
            error_mdeg: outcome.final_error_mdeg,
            time_s: outcome.settle_time_s.unwrap_or(outcome.duration_s),
            ..made
        })
    }
}

/// The finest tolerance that is promised, set in `scene`, and the time promised.
fn finest(scene: &mut Scene) -> Result<Option<(f64, f64)>, RunError> {
    for tolerance_deg in TOLERANCES_DEG {
        scene.set("position.tolerance_deg", &tolerance_deg.to_string())?;
        match position::plan(scene) {
            Ok(plan) => return Ok(Some((tolerance_deg, plan.expected_s))),
            Err(RunError::Scene(SceneError::Conflict { .. })) => {}
            Err(error) => return Err(error),
        }
    }
    Ok(None)
}

impl From<MoveEnding> for GridOutcome {
    fn from(ending: MoveEnding) -> Self {
        match ending {
            MoveEnding::Reached => Self::Reached,
            MoveEnding::Wrong => Self::Wrong,
            MoveEnding::GaveUp => Self::GaveUp,
            MoveEnding::TimedOut => Self::SatStill,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every bench, filter, motor and target comes once, and the shards share them out.
    #[test]
    fn law_shards_share_the_moves_out() {
        let plan = |shard| InstrumentGridPlan::new(&Scene::default(), 3, "", shard);
        let all = plan(Shard::ALL);
        let mut seeds: Vec<u64> = all.numbers().iter().map(|&number| all.case(number).unwrap().2).collect();
        seeds[..12].sort_unstable();
        assert!(
            seeds[..12].iter().copied().eq(0..12),
            "a motor of its own for each move of a bench and a filter"
        );
        assert_eq!(seeds[12], seeds[0], "and the same motors for the next filter");
        let mut cases: Vec<_> = all
            .numbers()
            .into_iter()
            .map(|number| {
                let (bench, filter, motor, target_deg) = all.case(number).unwrap();
                (bench.name.clone(), filter, motor, target_deg.to_bits())
            })
            .collect();
        assert_eq!(cases.len(), benches().len() * 4 * 3 * 4);
        cases.sort_unstable();
        cases.dedup();
        assert_eq!(cases.len() as u64, all.work());
        let mut shared: Vec<u64> =
            (0..5).flat_map(|index| plan(Shard { index, count: 5 }).numbers()).collect();
        shared.sort_unstable();
        assert_eq!(shared, all.numbers());
    }

    /// Every bench is a scene that is taken.
    #[test]
    fn exact_every_bench_is_a_scene() {
        for bench in benches() {
            let mut scene = Scene::default();
            for (key, value) in &bench.sets {
                scene.set(key, value).unwrap_or_else(|error| panic!("{}: {error}", bench.name));
            }
        }
    }
}
