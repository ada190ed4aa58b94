//! Many drawn motors, each commissioned and then moved by the map of its own and by the one that commissioning began
//! with: `host-sim commission --trials`.
//!
//! The targets are those of `host-sim positioning-trials`. Of `n` motors, motor `k` goes to the targets of the trials
//! `k`, `k + n`, `k + 2 n` and so on, each time from rest at zero, with the map as commissioning has made it and with
//! noise of its own. A motor that is refused makes no move by a map of its own, and counts in the table of what was
//! refused.

use serde::{Deserialize, Serialize};

use super::rows;
use super::{end_word, finding_word};
use crate::report::{OutputError, files};
use crate::studies::positioning_trials::{PositioningTrial, PositioningTrialsPlan, Strategy, TrialSummary};
use crate::studies::shard::{Shard, run_each};
use simulation::runs::{RunError, commission};
use simulation::scene::Scene;

/// What became of a motor, as it is written and read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommissioningTrial {
    /// Its place among all.
    pub number: u64,
    /// How many motors there are in all: its targets follow from that.
    pub motors: u64,
    /// Its seed.
    pub seed: u64,
    /// Motor time of commissioning in s.
    pub time_s: f64,
    /// How commissioning ended.
    pub end: String,
    /// Why the motor was refused; `None` of one that was not.
    pub refused: Option<String>,
    /// What was found: mode and word.
    pub findings: Vec<(String, String)>,
    /// Resonance found less the true one, and the standard deviation stated, in Hz, for modes B and C.
    pub resonances: [Option<(f64, f64)>; 2],
    /// The moves by the map that commissioning began with.
    pub by_prior: Vec<PositioningTrial>,
    /// The same moves by the map of its own; empty where it was refused one.
    pub by_own: Vec<PositioningTrial>,
}

/// The trials of a scene.
#[derive(Clone, Debug)]
pub struct CommissioningTrials {
    /// In the order of the seeds.
    pub trials: Vec<CommissioningTrial>,
}

/// How many motors are commissioned and moved.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommissioningTrialsPlan {
    /// Motors of all parts.
    pub motors: u64,
    /// Moves of each motor by either map.
    pub moves: u64,
    /// Which of the motors are taken.
    pub part: Shard,
}

/// A move in a row of trials.csv.
#[derive(Debug, Serialize)]
struct TrialRow {
    seed: u64,
    commissioning_s: f64,
    end: String,
    refused: Option<String>,
    findings: String,
    b_off_hz: Option<f64>,
    b_sd_hz: Option<f64>,
    c_off_hz: Option<f64>,
    c_sd_hz: Option<f64>,
    target_deg: f64,
    prior_error_mdeg: f64,
    prior_settle_s: Option<f64>,
    own_error_mdeg: Option<f64>,
    own_settle_s: Option<f64>,
}

impl CommissioningTrialsPlan {
    /// Motors that this part takes: progress counts them.
    pub fn work(&self) -> u64 {
        self.part.numbers(self.motors).len() as u64
    }
}

/// The moves of motor `number`. Each has noise of its own: the first that of the scene.
fn moves(
    scene: &Scene,
    number: u64,
    plan: &CommissioningTrialsPlan,
) -> Result<Vec<PositioningTrial>, RunError> {
    let first = scene.integer("plant.repetition");
    let one = |of: u64| {
        let mut scene = scene.clone();
        scene.set("plant.repetition", &first.saturating_add(of).to_string())?;
        let trials = PositioningTrialsPlan::new(&scene, Strategy::Planned, 1)?;
        trials.trial_of_motor(number, number + of * plan.motors)
    };
    (0..plan.moves).map(one).collect()
}

impl CommissioningTrial {
    /// Motor `number` of `scene`.
    fn of(scene: &Scene, number: u64, plan: &CommissioningTrialsPlan) -> Result<Self, RunError> {
        let motors = plan.motors;
        let own = scene.of_run(number)?;
        let motor = commission::run(&own, |_| ())?;
        let by_prior = moves(scene, number, plan)?;
        let (by_own, refused) = match motor.commissioned.map {
            Ok(map) => match moves(&scene.clone().with_response_map(map), number, plan) {
                Ok(trials) => (trials, None),
                // A move that the map does not allow is refused before it begins.
                Err(error) => (Vec::new(), Some(error.to_string())),
            },
            Err(unfit) => (Vec::new(), Some(unfit.to_string())),
        };
        let mut resonances = rows::resonances(&motor)
            .into_iter()
            .map(|row| row.found_hz.zip(row.true_hz).map(|(found, truth)| found - truth).zip(row.sd_hz));
        let findings = motor.commissioned.findings;
        Ok(Self {
            number,
            motors,
            seed: own.seed(),
            time_s: motor.commissioned.time_s.into(),
            end: end_word(motor.commissioned.end).to_owned(),
            refused,
            findings: findings
                .iter()
                .map(|finding| (format!("{:?}", finding.mode), finding_word(finding.kind).to_owned()))
                .collect(),
            resonances: [resonances.next().flatten(), resonances.next().flatten()],
            by_prior,
            by_own,
        })
    }

    /// A row for each of its moves.
    fn rows(&self) -> impl Iterator<Item = TrialRow> {
        let [b, c] = self.resonances;
        let words: Vec<String> = self.findings.iter().map(|(mode, word)| format!("{mode}:{word}")).collect();
        let findings = words.join(" ");
        self.by_prior.iter().enumerate().map(move |(place, prior)| {
            let own = self.by_own.get(place);
            TrialRow {
                seed: self.seed,
                commissioning_s: self.time_s,
                end: self.end.clone(),
                refused: self.refused.clone(),
                findings: findings.clone(),
                b_off_hz: b.map(|found| found.0),
                b_sd_hz: b.map(|found| found.1),
                c_off_hz: c.map(|found| found.0),
                c_sd_hz: c.map(|found| found.1),
                target_deg: prior.target_deg,
                prior_error_mdeg: prior.final_error_mdeg,
                prior_settle_s: prior.settle_s,
                own_error_mdeg: own.map(|own| own.final_error_mdeg),
                own_settle_s: own.and_then(|own| own.settle_s),
            }
        })
    }
}

impl CommissioningTrials {
    /// Commissions the motors of `plan`, the first that of the seed of `scene`, and lets each move by either map. Calls
    /// `progress` after each motor. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// When the scene is refused, or the part has no motor.
    pub fn run(
        scene: &Scene,
        plan: CommissioningTrialsPlan,
        progress: &(impl Fn() + Sync),
    ) -> Result<Self, RunError> {
        let numbers = plan.part.numbers_of_some(plan.motors, "motors")?;
        let one = |number| CommissioningTrial::of(scene, number, &plan);
        Ok(Self { trials: run_each(numbers, one, progress)? })
    }

    /// Those of all parts, in the order of their numbers.
    ///
    /// # Errors
    /// When the parts differ in how many motors there are or in the moves of each, or motors at the end are missing.
    pub fn merged(trials: Vec<CommissioningTrial>) -> Result<Self, OutputError> {
        let plan_of = |trial: &CommissioningTrial| (trial.motors, trial.by_prior.len());
        if let Some(first) = trials.first() {
            let (motors, moves) = plan_of(first);
            if let Some(other) = trials.iter().find(|trial| plan_of(trial) != (motors, moves)) {
                let of_other = plan_of(other);
                let why = format!(
                    "run 0 is of {motors} motors with {moves} moves, run {} of {} with {}",
                    other.number, of_other.0, of_other.1
                );
                return Err(OutputError::NotWhole(why));
            }
            let made = trials.len() as u64;
            if made < motors {
                return Err(OutputError::NotWhole(format!("run {made} is missing")));
            }
        }
        Ok(Self { trials })
    }

    /// The figures of the moves by either map, of motors that made both; the first by the map that commissioning began
    /// with.
    pub fn both(&self) -> [TrialSummary; 2] {
        let (prior, own): (Vec<_>, Vec<_>) = self.pairs().unzip();
        [TrialSummary::of(&prior), TrialSummary::of(&own)]
    }

    /// Each move that was made by both maps: by the one that commissioning began with, and by that of the motor.
    pub(super) fn pairs(&self) -> impl Iterator<Item = (&PositioningTrial, &PositioningTrial)> {
        self.trials.iter().flat_map(|trial| trial.by_prior.iter().zip(&trial.by_own))
    }

    /// The figures of all motors by the map that commissioning began with.
    pub fn all_by_prior(&self) -> TrialSummary {
        TrialSummary::of(&self.trials.iter().flat_map(|trial| &trial.by_prior).collect::<Vec<_>>())
    }

    /// A row a move.
    ///
    /// # Errors
    /// When it cannot be laid out: never.
    pub(crate) fn csv(&self) -> Result<String, OutputError> {
        let rows: Vec<TrialRow> = self.trials.iter().flat_map(CommissioningTrial::rows).collect();
        files::csv(None, rows.into_iter())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::positioning_trials;

    fn trial(number: u64, motors: u64) -> CommissioningTrial {
        CommissioningTrial {
            number,
            motors,
            seed: number,
            time_s: 20.0,
            end: String::new(),
            refused: None,
            findings: Vec::new(),
            resonances: [None; 2],
            by_prior: Vec::new(),
            by_own: Vec::new(),
        }
    }

    /// Two moves of one motor to the same target are two trials: each has noise of its own.
    #[test]
    fn exact_moves_to_the_same_target_do_not_repeat_their_noise() {
        let same = |seed: &u64| {
            let [first, second] = [*seed, *seed + 1].map(positioning_trials::target);
            first == second && first.1 > 0.0
        };
        let seed = (0..1000).find(same).unwrap();
        let scene = Scene::of_sets(&[format!("seed={seed}")]).unwrap();
        let plan = CommissioningTrialsPlan { motors: 1, moves: 2, part: Shard::ALL };
        let made = moves(&scene, 0, &plan).unwrap();
        let [first, second] = made.as_slice() else { panic!("{made:?}") };
        assert!((first.target_deg - second.target_deg).abs() <= 0.0);
        assert!((first.final_error_mdeg - second.final_error_mdeg).abs() > 1e-3, "{first:?} {second:?}");
    }

    /// Parts without the last motors are no whole, nor are parts of plans with other motors: their targets are others.
    #[test]
    fn exact_parts_of_other_plans_and_without_the_last_motors_are_refused() {
        let merged = |of: &[(u64, u64)]| {
            let trials = of.iter().map(|(number, motors)| trial(*number, *motors)).collect();
            CommissioningTrials::merged(trials)
                .map(|whole| whole.trials.len())
                .map_err(|error| error.to_string())
        };
        assert_eq!(merged(&[(0, 3), (1, 3), (2, 3)]), Ok(3));
        let refused = |why: &str| Err(format!("the parts are not one whole: {why}"));
        assert_eq!(merged(&[(0, 3), (1, 3)]), refused("run 2 is missing"));
        let other = "run 0 is of 3 motors with 0 moves, run 1 of 2 with 0";
        assert_eq!(merged(&[(0, 3), (1, 2), (2, 3)]), refused(other));
    }
}
