//! Experiment, height-only rotor and tilting rotors side by side: what explains the rate of mode B.
//!
//! The motor of the experiment turned at about 1 rad/s in mode B. A rotor that can only rise and fall turns at 15. A
//! rotor that tilts, and whose hole rubs on the pin, turns as slowly with some values of what was not measured.
//!
//! | module | what it is |
//! |---|---|
//! | [`variants`] | the rotors that are compared, as scenes |
//! | [`measured`] | the six figures of the experiment, and the same figures of a run |
//! | [`draws`] | rotors drawn over what was not measured, and which part of them explains the experiment |
//! | [`changes`] | what one change at a time does |
//! | [`predictions`] | how the rate of mode B depends on what a builder can change |
//! | [`tables`], [`pictures`] | what is shown of them |

pub mod changes;
pub mod draws;
pub mod measured;
pub mod pictures;
pub mod predictions;
pub mod tables;
pub mod variants;

use motor_model::DriveMode;
use rayon::prelude::*;
use serde::Serialize;

use crate::studies::paper::runs::RunTime;
use changes::{ChangedRotor, Changes, OF_NOMINAL, OF_SETS};
use draws::{DrawnRotor, draw_scenes};
use measured::{MeasuredRun, measured_run};
use predictions::{PREDICTIONS, Prediction};
use simulation::runs::RunError;
use simulation::scene::Scene;
use variants::{VARIANTS, Variant};

/// Both driven modes, in the order of the tables.
pub const MODES: [DriveMode; 2] = [DriveMode::B, DriveMode::C];

/// One of the rotors that are compared, and its runs.
#[derive(Clone, Debug, Serialize)]
pub struct VariantRuns {
    /// Its name in tables and pictures.
    pub name: &'static str,
    /// The runs in mode B and in mode C, one for each seed.
    pub runs: [Vec<MeasuredRun>; 2],
}

/// What is to be simulated.
#[derive(Clone, Debug)]
pub struct RotorModelsPlan {
    seeds: u64,
    drawn: u64,
    changes: bool,
    time: RunTime,
}

/// What was simulated.
#[derive(Clone, Debug, Serialize)]
pub struct RotorModels {
    /// Runs of each rotor and mode.
    pub seeds: u64,
    /// The time of each run, unless it is the full one.
    #[serde(skip_serializing_if = "RunTime::is_full")]
    pub time: RunTime,
    /// Runs of each rotor with a change.
    pub change_seeds: u64,
    /// The rotors that are compared.
    pub variants: Vec<VariantRuns>,
    /// The rate of mode B against what a builder can change.
    pub predictions: Vec<Prediction>,
    /// Rotors with one change at a time, if that was asked for: the sets that meet the experiment, and the paper's
    /// nominal values.
    pub changed: Vec<Vec<ChangedRotor>>,
    /// The rotors drawn over what was not measured.
    pub drawn: Vec<DrawnRotor>,
}

/// A run by its place among the others.
#[derive(Clone, Copy, Debug)]
struct Job<'a> {
    scene: &'a Scene,
    mode: DriveMode,
    seed: u64,
}

impl RotorModelsPlan {
    /// `seeds` runs of each rotor and mode, and `drawn` drawn rotors.
    pub fn new(seeds: u64, drawn: u64) -> Self {
        Self { seeds, drawn, changes: false, time: RunTime::FULL }
    }

    /// The same, with runs of every rotor of [`changes`] as well.
    pub fn with_changes(self, changes: bool) -> Self {
        Self { changes, ..self }
    }

    /// The same runs in so much time.
    #[must_use]
    pub fn within(self, time: RunTime) -> Self {
        Self { time, ..self }
    }

    /// Runs of each rotor with a change, in each mode.
    fn change_seeds(&self) -> u64 {
        self.seeds.div_ceil(2).max(2)
    }

    /// The changes that are made, none if they were not asked for.
    fn changes(&self) -> &'static [Changes] {
        if self.changes { &[OF_SETS, OF_NOMINAL] } else { &[] }
    }

    /// Number of runs.
    pub fn work(&self) -> u64 {
        let variants = 2 * VARIANTS.len() as u64;
        let predictions: usize = PREDICTIONS.iter().map(|varied| varied.values.len()).sum();
        let changed: usize = self.changes().iter().map(|of| of.rotors.len() * of.changes.len()).sum();
        (variants + 2 * predictions as u64) * self.seeds
            + 2 * changed as u64 * self.change_seeds()
            + 2 * self.drawn
    }

    /// Makes every run, and calls `progress` after each. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// When a scene is refused or a run fails.
    pub fn run(&self, progress: &(impl Fn() + Sync)) -> Result<RotorModels, RunError> {
        let variants: Vec<Scene> = VARIANTS.iter().map(Variant::scene).collect::<Result<_, _>>()?;
        let swept = predictions::scenes()?;
        let changed: Vec<Vec<Scene>> =
            self.changes().iter().map(Changes::scenes).collect::<Result<_, _>>()?;
        let drawn = draw_scenes(self.drawn)?;
        let each_seed = |scene, mode, seeds| (1..=seeds).map(move |seed| Job { scene, mode, seed });
        let mut jobs: Vec<Job> = Vec::new();
        for (scene, seeds) in (variants.iter().map(|scene| (scene, self.seeds)))
            .chain(changed.iter().flatten().map(|scene| (scene, self.change_seeds())))
        {
            jobs.extend(MODES.into_iter().flat_map(|mode| each_seed(scene, mode, seeds)));
        }
        for scene in &swept {
            jobs.extend(each_seed(scene, DriveMode::B, self.seeds));
        }
        for (scene, seed) in drawn.iter().map(|drawn| &drawn.scene).zip(1..) {
            jobs.extend(MODES.map(|mode| Job { scene, mode, seed }));
        }
        let measured: Result<Vec<MeasuredRun>, RunError> = (jobs.par_iter().with_max_len(1))
            .map(|job| {
                let run = measured_run(job.scene, job.mode, job.seed, self.time)?;
                progress();
                Ok(run)
            })
            .collect();
        let mut measured = measured?.into_iter();
        let mut next = |count: u64| -> Vec<MeasuredRun> {
            measured.by_ref().take(usize::try_from(count).unwrap_or(usize::MAX)).collect()
        };
        let variants: Vec<VariantRuns> = (VARIANTS.iter())
            .map(|variant| VariantRuns { name: variant.name, runs: MODES.map(|_| next(self.seeds)) })
            .collect();
        let changed: Vec<Vec<ChangedRotor>> = (self.changes().iter())
            .map(|changes| changes.collect(|| MODES.map(|_| next(self.change_seeds()))))
            .collect();
        Ok(RotorModels {
            seeds: self.seeds,
            time: self.time,
            change_seeds: self.change_seeds(),
            variants,
            changed,
            predictions: predictions::collect(|| next(self.seeds)),
            drawn: drawn
                .into_iter()
                .map(|rotor| DrawnRotor {
                    stator: rotor.stator,
                    values: rotor.values,
                    runs: MODES.map(|_| next(1).remove(0)),
                })
                .collect(),
        })
    }
}
