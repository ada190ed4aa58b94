//! Many drawn motors, each commissioned and then moved by the map of its own and by the one that commissioning began
//! with: `host-sim commission --trials`.
//!
//! The moves are those of `host-sim positioning-trials`. A motor that is refused makes none by a map of its own, and
//! counts in the table of what was refused.

use serde::Serialize;

use super::rows;
use super::{end_word, finding_word};
use crate::report::{OutputError, files};
use crate::studies::positioning_trials::{PositioningTrial, PositioningTrialsPlan, Strategy, TrialSummary};
use crate::studies::shard::{Shard, run_each};
use simulation::runs::{RunError, commission};
use simulation::scene::Scene;

/// What became of a motor.
#[derive(Clone, Debug)]
pub struct CommissioningTrial {
    /// Its place among all.
    pub number: u64,
    /// Its seed.
    pub seed: u64,
    /// Motor time of commissioning in s.
    pub time_s: f64,
    /// How commissioning ended.
    pub end: &'static str,
    /// Why the motor was refused; `None` of one that was not.
    pub refused: Option<String>,
    /// What was found: mode and word.
    pub findings: Vec<(String, &'static str)>,
    /// Resonance found less the true one, and the standard deviation stated, in Hz, for modes B and C.
    pub resonances: [Option<(f64, f64)>; 2],
    /// The move by the map that commissioning began with.
    pub by_prior: PositioningTrial,
    /// The move by the map of its own.
    pub by_own: Option<PositioningTrial>,
}

/// The trials of a scene.
#[derive(Clone, Debug)]
pub struct CommissioningTrials {
    /// In the order of the seeds.
    pub trials: Vec<CommissioningTrial>,
}

/// A motor in a row of trials.csv.
#[derive(Debug, Serialize)]
struct TrialRow {
    seed: u64,
    commissioning_s: f64,
    end: &'static str,
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

impl CommissioningTrial {
    fn of(scene: &Scene, number: u64) -> Result<Self, RunError> {
        let own = scene.of_run(number)?;
        let motor = commission::run(&own, |_| ())?;
        let moved = |scene: &Scene| PositioningTrialsPlan::new(scene, Strategy::Planned, 1)?.trial(number);
        let by_prior = moved(scene)?;
        let (by_own, refused) = match motor.commissioned.map {
            Ok(map) => match moved(&scene.clone().with_response_map(map)) {
                Ok(trial) => (Some(trial), None),
                // A move that the map does not allow is refused before it begins.
                Err(error) => (None, Some(error.to_string())),
            },
            Err(unfit) => (None, Some(unfit.to_string())),
        };
        let mut resonances = rows::resonances(&motor)
            .into_iter()
            .map(|row| row.found_hz.zip(row.true_hz).map(|(found, truth)| found - truth).zip(row.sd_hz));
        let findings = motor.commissioned.findings;
        Ok(Self {
            number,
            seed: own.seed(),
            time_s: motor.commissioned.time_s.into(),
            end: end_word(motor.commissioned.end),
            refused,
            findings: findings
                .iter()
                .map(|finding| (format!("{:?}", finding.mode), finding_word(finding.kind)))
                .collect(),
            resonances: [resonances.next().flatten(), resonances.next().flatten()],
            by_prior,
            by_own,
        })
    }
}

impl CommissioningTrials {
    /// Commissions and moves `count` motors of `scene`, the first that of its seed. Calls `progress` after each. The
    /// result does not depend on the number of threads.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn run(scene: &Scene, count: u64, progress: &(impl Fn() + Sync)) -> Result<Self, RunError> {
        let one = |number| CommissioningTrial::of(scene, number);
        Ok(Self { trials: run_each(Shard::ALL.numbers(count), one, progress)? })
    }

    /// The figures of the moves by either map, of motors that made both; the first by the map that commissioning began
    /// with.
    pub fn both(&self) -> [TrialSummary; 2] {
        let pairs = || self.trials.iter().filter_map(|trial| Some((&trial.by_prior, trial.by_own.as_ref()?)));
        let [prior, own]: [Vec<&PositioningTrial>; 2] =
            [pairs().map(|pair| pair.0).collect(), pairs().map(|pair| pair.1).collect()];
        [TrialSummary::of(&prior), TrialSummary::of(&own)]
    }

    /// The figures of all motors by the map that commissioning began with.
    pub fn all_by_prior(&self) -> TrialSummary {
        TrialSummary::of(&self.trials.iter().map(|trial| &trial.by_prior).collect::<Vec<_>>())
    }

    /// A row a motor.
    ///
    /// # Errors
    /// When it cannot be laid out: never.
    pub(crate) fn csv(&self) -> Result<String, OutputError> {
        let row = |trial: &CommissioningTrial| {
            let [b, c] = trial.resonances;
            let words: Vec<String> =
                trial.findings.iter().map(|(mode, word)| format!("{mode}:{word}")).collect();
            TrialRow {
                seed: trial.seed,
                commissioning_s: trial.time_s,
                end: trial.end,
                refused: trial.refused.clone(),
                findings: words.join(" "),
                b_off_hz: b.map(|found| found.0),
                b_sd_hz: b.map(|found| found.1),
                c_off_hz: c.map(|found| found.0),
                c_sd_hz: c.map(|found| found.1),
                target_deg: trial.by_prior.target_deg,
                prior_error_mdeg: trial.by_prior.final_error_mdeg,
                prior_settle_s: trial.by_prior.settle_s,
                own_error_mdeg: trial.by_own.as_ref().map(|own| own.final_error_mdeg),
                own_settle_s: trial.by_own.as_ref().and_then(|own| own.settle_s),
            }
        };
        let rows: Vec<TrialRow> = self.trials.iter().map(row).collect();
        files::csv(None, rows.into_iter())
    }
}
