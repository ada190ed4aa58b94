//! Many moves of many drawn motors, measured by the true angle at the end: `host-sim positioning-trials`.
//!
//! Every trial has a motor and a target of its own, both named by its seed. Four of ten targets are uniform in +-360
//! degrees, four are moves of 1 milli-degree to 1 degree (log-uniform, either way), two a quarter turn either way. A
//! trial ends [`HOLD_S`] after the controller says that the target is reached, or when it gives up. Its error is then
//! the true angle less the target.
//!
//! # The bound on settling
//!
//! No controller can settle before the rotor has moved to the target and its angle has been measured:
//!
//! ```text
//! bound = distance / mean rate of the strongest cruise over motors  +  R (1.96 / tolerance)^2 / frame rate
//! ```
//!
//! `R` is the variance of a frame, its quantisation included. After the second term the tolerance, 0.35 milli-degrees
//! unless the scene sets another, is 1.96 standard deviations (95 %) of the mean of the frames at rest. With the
//! default camera and that tolerance it is 0.45 s.
//!
//! # The time that was promised
//!
//! Before each move the controller says what it will take ([`controller::MoveForecast`]). The table of promises sets
//! that beside what the moves took. A move is late if it takes longer than was promised to 95 % of the moves.
//!
//! # The strategies
//!
//! [`Strategy`] lists what the controller is compared with, on the same motors and targets: itself without learning,
//! and baselines, which are simpler programs.
//!
//! | module | what it is |
//! |---|---|
//! | this one | the plan: which strategies, how many trials |
//! | `trial` | one trial: its target, its outcome, the bound on settling |
//! | `baselines`, `burst_table` | the simpler programs |
//! | `summary` | the figures of a set of trials |
//! | `beside_table` | the controller on several scenes side by side |
//! | `promise_table` | the time that was promised beside the time taken |
//! | [`tolerances`] | the same moves at several tolerances |
//! | `tables`, `picture`, `report` | what is shown of them |

mod baselines;
mod beside_table;
mod burst_table;
mod picture;
mod promise_table;
mod report;
mod summary;
mod tables;
pub mod tolerances;
mod trial;

use std::convert::Infallible;
use std::ops::ControlFlow;
use std::time::Instant;

use controller::PositioningTuning;

use crate::studies::beside::Beside;
use crate::studies::shard::{Shard, run_each};
use baselines::BaselineRule;
use burst_table::BurstTable;
use simulation::runs::RunError;
use simulation::runs::closed_loop;
use simulation::runs::filter::{self, FILTERS};
use simulation::runs::position;
use simulation::scene::Scene;
pub use summary::TrialSummary;
pub(crate) use tables::millidegrees;
pub use trial::{MoveKind, PositioningTrial, measuring_s, target, tolerance_deg};

/// Time for which a reached target is held before the error counts.
pub const HOLD_S: f64 = 0.1;
/// Tolerance asked for, where the scene sets none: 95 % of the moves end within it, and nearly all within half a
/// milli-degree, which the motor is to be known to.
pub const TOLERANCE_DEG: f64 = 0.000_35;
/// Time after which the controller gives up: a slow motor takes 20 s for a turn counter-clockwise.
const DEADLINE_S: f64 = 60.0;

/// A way to position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// The controller.
    Planned,
    /// The controller with a response map that is never corrected.
    Unlearned,
    /// A table of bursts of the nominal motor, the camera averaged between them.
    BurstTable,
    /// One approach, cut off where the mean coast remains, and no burst.
    CutOff,
    /// Full drive towards the target while the estimate is off by more than a dead band.
    BangBang,
}

impl Strategy {
    /// Every strategy.
    pub const ALL: [Self; 5] =
        [Self::Planned, Self::Unlearned, Self::BurstTable, Self::CutOff, Self::BangBang];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Planned => "controller",
            Self::Unlearned => "no map correction",
            Self::BurstTable => "naive table of bursts",
            Self::CutOff => "cut-off without bursts",
            Self::BangBang => "bang-bang on the estimate",
        }
    }
}

/// Trials to be run by one strategy on one filter.
#[derive(Clone, Debug)]
pub struct PositioningTrialsPlan {
    scene: Scene,
    strategy: Strategy,
    trials: u64,
    part: Shard,
    burst_table: BurstTable,
}

/// The trials of one strategy on one filter.
#[derive(Clone, Debug)]
pub struct StrategyTrials {
    /// The strategy.
    pub strategy: Strategy,
    /// The filter.
    pub filter: &'static str,
    /// In the order of the seeds.
    pub trials: Vec<PositioningTrial>,
    /// Time that this machine took for a second of motor time, the filter included.
    pub s_per_s: f64,
}

impl PositioningTrialsPlan {
    /// `trials` trials of `strategy` with the scene's filter and instruments. The scene's seed names the first, the
    /// seeds that follow it the others.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn new(scene: &Scene, strategy: Strategy, trials: u64) -> Result<Self, RunError> {
        let needs_table = strategy == Strategy::BurstTable;
        let burst_table = if needs_table { BurstTable::of(scene)? } else { BurstTable::default() };
        Ok(Self { scene: scene.clone(), strategy, trials, part: Shard::ALL, burst_table })
    }

    /// Every other strategy on the scene's filter, and the controller on every other filter.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn others(scene: &Scene, trials: u64) -> Result<Vec<Self>, RunError> {
        let strategies = Strategy::ALL.into_iter().skip(1).map(|strategy| Self::new(scene, strategy, trials));
        let chosen = filter::chosen(scene);
        let filters = FILTERS.iter().filter(|filter| **filter != chosen).map(|filter| {
            let mut other = scene.clone();
            other.set("estimator.filter", filter)?;
            Self::new(&other, Strategy::Planned, trials)
        });
        filters.chain(strategies).collect()
    }

    /// The same of a part of the trials alone.
    ///
    /// # Errors
    /// When it has no trial.
    pub fn part(self, part: Shard) -> Result<Self, RunError> {
        part.numbers_of_some(self.trials, "trials")?;
        Ok(Self { part, ..self })
    }

    /// How many trials this part makes.
    pub fn trials(&self) -> u64 {
        self.part.numbers(self.trials).len() as u64
    }

    /// Runs all trials of this part, and calls `progress` after each. The result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<StrategyTrials, RunError> {
        let trial = |number| {
            let begun = Instant::now();
            Ok::<_, RunError>((self.trial(number)?, begun.elapsed().as_secs_f64()))
        };
        let trials = run_each(self.part.numbers(self.trials), trial, &|| progress(1))?;
        let taken_s: f64 = trials.iter().map(|(_, taken_s)| taken_s).sum();
        let trials: Vec<PositioningTrial> = trials.into_iter().map(|(trial, _)| trial).collect();
        let s_per_s = taken_s / trials.iter().map(|trial| trial.duration_s).sum::<f64>();
        Ok(StrategyTrials { strategy: self.strategy, filter: filter::chosen(&self.scene), trials, s_per_s })
    }

    /// Trial `number` of the plan.
    ///
    /// # Errors
    /// When the scene is refused.
    pub(crate) fn trial(&self, number: u64) -> Result<PositioningTrial, RunError> {
        self.trial_of_motor(number, number)
    }

    /// The motor of trial `motor`, moved to the target of trial `number`.
    ///
    /// # Errors
    /// When the scene is refused.
    pub(crate) fn trial_of_motor(&self, motor: u64, number: u64) -> Result<PositioningTrial, RunError> {
        let mut scene = self.scene.of_run(motor)?;
        let (kind, target_deg) = target(self.scene.of_run(number)?.seed());
        for (key, value) in [
            ("position.to_deg", target_deg.to_string()),
            ("position.tolerance_deg", tolerance_deg(&self.scene).to_string()),
            ("position.hold_s", HOLD_S.to_string()),
            ("position.deadline_s", DEADLINE_S.to_string()),
        ] {
            scene.set(key, &value)?;
        }
        let outcome = match self.strategy {
            Strategy::Planned => position::run(&scene, |_| ())?,
            Strategy::Unlearned => {
                let tuning = PositioningTuning { learning: false, ..closed_loop::tuning(&scene) };
                let watch = |_: &mut _, _: &_| ControlFlow::<Infallible>::Continue(());
                let ControlFlow::Continue(outcome) = position::run_tuned(&scene, tuning, watch)?;
                outcome
            }
            Strategy::BurstTable => {
                baselines::run(&scene, BaselineRule::BurstTable(self.burst_table.clone()))?
            }
            Strategy::CutOff => baselines::run(&scene, BaselineRule::CutOff)?,
            Strategy::BangBang => baselines::run(&scene, BaselineRule::BangBang)?,
        };
        let promised = position::forecast(&scene)?.ok();
        Ok(PositioningTrial::new(number, kind, &outcome, trial::bound_s(&scene, target_deg), promised))
    }
}

impl StrategyTrials {
    /// The controller's trials on `scene` that were made in parts.
    pub fn merged(scene: &Scene, trials: Vec<PositioningTrial>) -> Self {
        // The parts are of other machines, whose time says nothing of this one.
        Self { strategy: Strategy::Planned, filter: filter::chosen(scene), trials, s_per_s: f64::NAN }
    }
}

/// The controller's trials, and those of every strategy and filter that it is compared with.
#[derive(Clone, Debug)]
pub struct PositioningTrials {
    /// Of the controller on the scene's filter.
    pub trials: StrategyTrials,
    /// Of the others.
    pub others: Vec<StrategyTrials>,
    /// Tolerance asked for.
    pub tolerance_deg: f64,
    /// Time at rest for measuring, in the bound on settling.
    pub measuring_s: f64,
    /// The controller on other scenes.
    pub beside: Vec<Beside<StrategyTrials>>,
}

impl PositioningTrials {
    /// Trials of the controller on `scene`, beside nothing.
    pub fn alone(scene: &Scene, trials: StrategyTrials) -> Self {
        let (tolerance_deg, measuring_s) = (tolerance_deg(scene), measuring_s(scene));
        Self { trials, others: Vec::new(), tolerance_deg, measuring_s, beside: Vec::new() }
    }
}
