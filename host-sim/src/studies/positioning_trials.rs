//! `host-sim positioning-trials`: many moves of many drawn motors, judged by where the rotor truly is.
//!
//! Every trial has a motor and a target of its own, both named by its seed. Four of ten targets are uniform in +-360 degrees, four are moves of 1 milli-degree to
//! 1 degree (log-uniform, either way), two a quarter turn either way. A trial ends [`HOLD_S`] after the controller says that the target is reached,
//! or when it gives up; its error is then the true angle less the target.
//!
//! # The bound on settling
//!
//! No controller can be done before the rotor has come there and been measured:
//!
//! ```text
//! bound = distance / mean rate of the strongest cruise over motors  +  R (1.96 / 0.5 mdeg)^2 / frame rate
//! ```
//!
//! with `R` the variance of a frame, its quantisation included: so many frames at rest make 0.5 milli-degrees 1.96 standard deviations, 95 %. With the default camera the second term
//! is 0.45 s.
//!
//! # The strategies
//!
//! [`Strategy`] lists what the controller is compared with, on the same motors and targets: itself without learning, and simpler programs.

mod naive;
mod picture;
mod simple;
mod tables;

use controller::response_map::{direction, strongest_cruise};
use controller::{Limits, PositioningTuning};
use motor_model::DriveMode;
use rand_distr::{Distribution, Uniform};
use rayon::prelude::*;
use serde::Serialize;
use std::convert::Infallible;
use std::ops::ControlFlow;

use crate::math::random_streams::{Source, stream};
use crate::math::statistics;
use crate::runs::filter::FILTERS;
use crate::runs::position::{self, MoveOutcome};
use crate::scene::Scene;
use crate::studies::StudyError;
use crate::world::instruments::Camera;
pub use naive::Table as NaiveTable;
pub use simple::Rule;

/// Time for which a reached target is held before the error counts.
pub const HOLD_S: f64 = 0.1;
/// Tolerance asked for.
pub const TOLERANCE_DEG: f64 = 0.0005;
/// Beyond this a trial that claims success has failed.
const FAILED_MDEG: f64 = 3.0;
/// Time after which the controller gives up: a slow motor takes 20 s for a turn counter-clockwise.
const DEADLINE_S: f64 = 60.0;
/// A way to position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// The controller.
    Planned,
    /// The controller with the map as it stands, never corrected.
    Unlearned,
    /// A table of bursts at nominal parameters, the camera averaged between them.
    Naive,
    /// One approach, cut where the mean coast remains, and nothing after.
    CutOff,
    /// Full drive towards the target while the estimate is off by more than a dead band.
    BangBang,
}

impl Strategy {
    /// Every strategy.
    pub const ALL: [Self; 5] = [Self::Planned, Self::Unlearned, Self::Naive, Self::CutOff, Self::BangBang];

    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Planned => "controller",
            Self::Unlearned => "no map correction",
            Self::Naive => "naive table of bursts",
            Self::CutOff => "cut-off without bursts",
            Self::BangBang => "bang-bang on the estimate",
        }
    }
}

/// The kind of a trial's target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Move {
    /// Uniform in +-360 degrees.
    Long,
    /// Log-uniform from 1 milli-degree to 1 degree.
    Short,
    /// 90 degrees either way.
    QuarterTurn,
}

/// A trial and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Trial {
    /// The kind of move.
    pub kind: Move,
    /// What became of it.
    pub outcome: MoveOutcome,
    /// No controller could have been done before this.
    pub bound_s: f64,
}

impl Trial {
    /// Whether it did not reach the target, or claims so although the rotor is far off.
    pub fn failed(&self) -> bool {
        self.outcome.settle_time_s.is_none() || self.outcome.final_error_mdeg.abs() > FAILED_MDEG
    }
}

/// Trials to be run by one strategy on one filter.
#[derive(Clone, Debug)]
pub struct Plan {
    scene: Scene,
    strategy: Strategy,
    trials: u64,
    naive: NaiveTable,
}

/// What came out, in the order of the seeds.
#[derive(Clone, Debug)]
pub struct Trials {
    /// The strategy.
    pub strategy: Strategy,
    /// The filter.
    pub filter: &'static str,
    /// The trials.
    pub trials: Vec<Trial>,
}

impl Plan {
    /// `trials` trials of `strategy`, named by the scene's seed and those that follow it, with the scene's filter and instruments.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn new(scene: &Scene, strategy: Strategy, trials: u64) -> Result<Self, StudyError> {
        let naive = if strategy == Strategy::Naive { NaiveTable::nominal()? } else { NaiveTable::default() };
        Ok(Self { scene: scene.clone(), strategy, trials, naive })
    }

    /// Every other strategy on the scene's filter, and the controller on every other filter.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn others(scene: &Scene, trials: u64) -> Result<Vec<Self>, StudyError> {
        let strategies = Strategy::ALL.into_iter().skip(1).map(|strategy| Self::new(scene, strategy, trials));
        let chosen = scene.choice("estimator.filter");
        let filters = FILTERS.iter().filter(|filter| **filter != chosen).map(|filter| {
            let mut other = scene.clone();
            other.set("estimator.filter", filter)?;
            Self::new(&other, Strategy::Planned, trials)
        });
        filters.chain(strategies).collect()
    }

    /// How many trials.
    pub fn trials(&self) -> u64 {
        self.trials
    }

    /// Runs them all, telling `progress` of each; the order of the threads does not show.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<Trials, StudyError> {
        let trial = |number| {
            let trial = self.trial(number);
            progress(1);
            trial
        };
        let numbers: Vec<u64> = (0..self.trials).collect();
        let trials: Result<Vec<Trial>, StudyError> =
            numbers.into_par_iter().with_max_len(1).map(trial).collect();
        let filter = self.scene.choice("estimator.filter");
        Ok(Trials { strategy: self.strategy, filter, trials: trials? })
    }

    fn trial(&self, number: u64) -> Result<Trial, StudyError> {
        let seed = self.scene.seed().wrapping_add(number);
        let (kind, target_deg) = target(seed);
        let mut scene = self.scene.clone();
        for (key, value) in [
            ("seed", seed.to_string()),
            ("position.to_deg", target_deg.to_string()),
            ("position.tolerance_deg", TOLERANCE_DEG.to_string()),
            ("position.hold_s", HOLD_S.to_string()),
            ("position.deadline_s", DEADLINE_S.to_string()),
        ] {
            scene.set(key, &value)?;
        }
        let outcome = match self.strategy {
            Strategy::Planned => position::run(&scene, |_| ())?,
            Strategy::Unlearned => {
                let tuning = PositioningTuning { learning: false, ..tuning(&scene) };
                let watch = |_: &mut _, _: &_| ControlFlow::<Infallible>::Continue(());
                let ControlFlow::Continue(outcome) = position::run_tuned(&scene, tuning, watch)?;
                outcome
            }
            Strategy::Naive => simple::run(&scene, Rule::Naive(self.naive.clone()))?,
            Strategy::CutOff => simple::run(&scene, Rule::CutOff)?,
            Strategy::BangBang => simple::run(&scene, Rule::BangBang)?,
        };
        Ok(Trial { kind, outcome, bound_s: bound_s(&scene, target_deg) })
    }
}

fn tuning(scene: &Scene) -> PositioningTuning {
    let limits = Limits { deadline_nanos: scene.nanos("position.deadline_s"), ..Limits::default() };
    PositioningTuning { limits, ..PositioningTuning::default() }
}

/// The move that a seed names: its kind and its target in degrees, rounded to a micro-degree so that it can be typed.
pub fn target(seed: u64) -> (Move, f64) {
    let mut rng = stream(seed, Source::Target);
    let mut unit = || Uniform::new(0.0, 1.0).map_or(0.5, |unit| unit.sample(&mut rng));
    let (kind, size, sign) = (unit(), unit(), if unit() < 0.5 { 1.0 } else { -1.0 });
    let (kind, degrees) = if kind < 0.4 {
        (Move::Long, 360.0 * size)
    } else if kind < 0.8 {
        // Natural exponent of three decades.
        (Move::Short, 1e-3 * motor_model::math::exp(size * core::f64::consts::LN_10 * 3.0))
    } else {
        (Move::QuarterTurn, 90.0)
    };
    (kind, sign * (degrees * 1e6).round() / 1e6)
}

/// Time before which no controller can be done.
fn bound_s(scene: &Scene, target_deg: f64) -> f64 {
    let mode = if target_deg > 0.0 { DriveMode::B } else { DriveMode::C };
    let rate = strongest_cruise(mode, 1.0)
        .map_or(f64::INFINITY, |cruise| f64::from(direction(mode) * cruise.rate_rad_s));
    target_deg.abs().to_radians() / rate + measuring_s(scene)
}

/// Time at rest after which [`TOLERANCE_DEG`] is 1.96 standard deviations of the mean of the frames.
pub fn measuring_s(scene: &Scene) -> f64 {
    let wanted_rad = TOLERANCE_DEG.to_radians() / 1.96;
    Camera::variance_rad2(scene) / (wanted_rad * wanted_rad) / scene.number("camera.frame_rate_hz")
}

/// Figures of a set of trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Trials.
    pub trials: usize,
    /// Trials that failed.
    pub failures: usize,
    /// Median magnitude of the true final error.
    pub p50_mdeg: f64,
    /// What 95 % of the errors do not exceed.
    pub p95_mdeg: f64,
    /// What 99.9 % do not exceed.
    pub p999_mdeg: f64,
    /// The largest.
    pub max_mdeg: f64,
    /// Median time to settle, of those that did.
    pub median_settle_s: f64,
    /// What 95 % of them take at most.
    pub p95_settle_s: f64,
    /// Median, over quarter turns that settled, of the time per its bound; over all moves if there was no quarter turn.
    pub settle_over_bound: f64,
    /// Median overshoot.
    pub median_overshoot_mdeg: f64,
    /// Median number of changes of the drive.
    pub median_switches: f64,
    /// Median time with the drive on.
    pub median_on_s: f64,
}

impl Summary {
    /// Of `trials`.
    pub fn of(trials: &[&Trial]) -> Self {
        let quantile = |mut values: Vec<f64>, per_mille| {
            statistics::quantile(&mut values, per_mille).unwrap_or(f64::NAN)
        };
        let all = |of: fn(&Trial) -> f64| trials.iter().map(|trial| of(trial)).collect::<Vec<f64>>();
        let error = |per_mille| quantile(all(|trial| trial.outcome.final_error_mdeg.abs()), per_mille);
        let settle: Vec<f64> = trials.iter().filter_map(|trial| trial.outcome.settle_time_s).collect();
        let ratio = |trial: &&&Trial| Some(trial.outcome.settle_time_s? / trial.bound_s);
        let quarters: Vec<f64> =
            trials.iter().filter(|trial| trial.kind == Move::QuarterTurn).filter_map(|t| ratio(&t)).collect();
        let ratios =
            if quarters.is_empty() { trials.iter().filter_map(|t| ratio(&t)).collect() } else { quarters };
        Self {
            trials: trials.len(),
            failures: trials.iter().filter(|trial| trial.failed()).count(),
            p50_mdeg: error(500),
            p95_mdeg: error(950),
            p999_mdeg: error(999),
            max_mdeg: error(1000),
            median_settle_s: quantile(settle.clone(), 500),
            p95_settle_s: quantile(settle, 950),
            settle_over_bound: quantile(ratios, 500),
            median_overshoot_mdeg: quantile(all(|trial| 1e3 * trial.outcome.overshoot_deg), 500),
            median_switches: quantile(all(|trial| f64::from(trial.outcome.drive_switches)), 500),
            median_on_s: quantile(all(|trial| trial.outcome.drive_on_s), 500),
        }
    }
}

impl Trials {
    /// Figures of all trials.
    pub fn summary(&self) -> Summary {
        Summary::of(&self.trials.iter().collect::<Vec<_>>())
    }

    /// Figures of the trials of one kind of move.
    pub fn summary_of(&self, kind: Move) -> Summary {
        Summary::of(&self.trials.iter().filter(|trial| trial.kind == kind).collect::<Vec<_>>())
    }

    /// The trials that failed.
    pub fn failures(&self) -> impl Iterator<Item = &Trial> {
        self.trials.iter().filter(|trial| trial.failed())
    }
}

/// The controller's trials, and those of what it is compared with.
#[derive(Clone, Debug)]
pub struct Report {
    /// The controller's.
    pub trials: Trials,
    /// The others'.
    pub others: Vec<Trials>,
    /// Measuring time in the bound.
    pub measuring_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.255 milli-degrees from frames of 17: (2e-6 / 3.9e-3)^2 (1/4 + 1/12) rad^2 at 10 kHz.
    #[test]
    fn exact_measuring_time_of_the_default_camera() {
        let frame_mdeg = 1e3 * (2e-6_f64 / 3.9e-3).to_degrees() / motor_model::math::sqrt(3.0);
        let ratio = frame_mdeg / (0.5 / 1.96);
        let expected = ratio * ratio / 1e4;
        assert!((measuring_s(&Scene::default()) / expected - 1.0).abs() < 1e-9, "{expected}");
    }

    /// Shares, ranges and signs of 4,000 targets, within four standard deviations.
    #[test]
    fn law_targets_are_drawn_as_stated() {
        let targets: Vec<(Move, f64)> = (0..4000).map(target).collect();
        let share = |kind| targets.iter().filter(|(k, _)| *k == kind).count();
        assert!(share(Move::Long).abs_diff(1600) < 124 && share(Move::QuarterTurn).abs_diff(800) < 102);
        assert!(targets.iter().filter(|(_, deg)| *deg > 0.0).count().abs_diff(2000) < 127);
        for (kind, deg) in targets {
            let (low, high) = match kind {
                Move::Long => (0.0, 360.0),
                Move::Short => (0.001, 1.0),
                Move::QuarterTurn => (90.0, 90.0),
            };
            assert!((low..=high).contains(&deg.abs()), "{kind:?} {deg}");
        }
    }
}
