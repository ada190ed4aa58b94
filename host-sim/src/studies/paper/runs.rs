//! The paper's motors and their runs. The results are the same bytes on any number of threads.

use std::fmt;

use motor_model::{DriveCommand, DriveMode, FrictionLaw, ImpactRule, MotorParams, Parameter, TiltingParams};
use rayon::prelude::*;
use serde::Serialize;

use super::published::Quantity;
use simulation::math::statistics::Spread;
use simulation::runs::RunError;
use simulation::runs::simulate::{OpenLoopRun, OpenLoopSummary, Precision, simulate};
use simulation::scene::RotorModel;

/// Step of every run except where the step is varied.
pub const STEP_S: f64 = 1e-6;
/// Step with which the model gives the paper's rates in mode B.
pub const COARSE_STEP_S: f64 = 10e-6;
/// Step at which the rate in mode B has converged.
pub const CONVERGED_STEP_S: f64 = 0.1e-6;

/// Time of a run, and the part of it in which the rotor settles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RunTime {
    /// The whole in s.
    pub duration_s: f64,
    /// The part in s.
    pub settle_s: f64,
}

impl RunTime {
    /// That of the pages of results.
    pub const FULL: Self = Self { duration_s: 2.0, settle_s: 0.5 };
    /// Long enough for every figure, and for none to be sharp.
    pub const QUICK: Self = Self { duration_s: 0.3, settle_s: 0.1 };

    /// Whether it is [`Self::FULL`].
    pub fn is_full(&self) -> bool {
        *self == Self::FULL
    }
}

impl Default for RunTime {
    fn default() -> Self {
        Self::FULL
    }
}

impl fmt::Display for RunTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} s of which {} s to settle", self.duration_s, self.settle_s)
    }
}

/// A run of the paper: its law of friction, impacts at the end of the step, full drive, 2 s of which 0.5 s to settle.
///
/// # Errors
/// When a change is out of bounds.
pub fn paper_run(
    mode: DriveMode,
    changes: &[(Parameter, f64)],
    step_s: f64,
    seed: u64,
) -> Result<OpenLoopRun, RunError> {
    let changed = changes
        .iter()
        .try_fold(MotorParams::nominal(), |params, &(parameter, value)| params.with(parameter, value));
    Ok(OpenLoopRun {
        params: changed?,
        rotor: RotorModel::HeightOnly,
        tilting: TiltingParams::nominal(),
        drive: DriveCommand::full(mode),
        duration_s: RunTime::FULL.duration_s,
        settle_s: RunTime::FULL.settle_s,
        step_s,
        impact_rule: ImpactRule::EndOfStep,
        friction_law: FrictionLaw::Paper,
        precision: Precision::F64,
        seed,
    })
}

/// The runs of one motor, one for each seed.
#[derive(Clone, Debug)]
pub struct Ensemble {
    /// Mode driven.
    pub mode: DriveMode,
    /// One summary for each seed.
    pub summaries: Vec<OpenLoopSummary>,
}

impl Ensemble {
    /// Mean and spread of a quantity over the seeds, in its unit.
    pub fn spread(&self, quantity: Quantity) -> Spread {
        self.values(quantity).collect()
    }

    /// A quantity of each seed, in its unit.
    pub fn values(&self, quantity: Quantity) -> impl Iterator<Item = f64> {
        self.summaries.iter().map(move |summary| match quantity {
            Quantity::CollisionFrequency => summary.collision.map_or(0.0, |line| line.frequency_hz),
            Quantity::CollisionAmplitude => summary.collision.map_or(0.0, |line| 1e3 * line.amplitude),
            Quantity::Rate => summary.rate_rad_s.mean.abs(),
        })
    }

    /// Whether every run turns in the sense of its mode: B clockwise, C counter-clockwise.
    pub fn turns_in_the_sense_of_its_mode(&self) -> bool {
        self.summaries.iter().all(|summary| match self.mode {
            DriveMode::B => summary.rate_rad_s.mean > 0.0,
            DriveMode::C => summary.rate_rad_s.mean < 0.0,
        })
    }
}

/// A list of motors, each with several seeds.
#[derive(Clone, Debug, Default)]
pub struct PaperRuns {
    time: RunTime,
    motors: Vec<Vec<OpenLoopRun>>,
}

impl PaperRuns {
    /// The same runs in so much time.
    #[must_use]
    pub fn within(mut self, time: RunTime) -> Self {
        self.time = time;
        for run in self.motors.iter_mut().flatten() {
            (run.duration_s, run.settle_s) = (time.duration_s, time.settle_s);
        }
        self
    }

    /// The time of each run.
    pub fn time(&self) -> RunTime {
        self.time
    }

    /// Adds a motor that runs with the seeds 1 to `seeds`.
    ///
    /// # Errors
    /// When a change is out of bounds.
    pub fn add(
        &mut self,
        mode: DriveMode,
        changes: &[(Parameter, f64)],
        step_s: f64,
        seeds: u64,
    ) -> Result<(), RunError> {
        let runs: Result<Vec<OpenLoopRun>, _> =
            (1..=seeds).map(|seed| paper_run(mode, changes, step_s, seed)).collect();
        self.motors.push(runs?);
        Ok(())
    }

    /// Number of steps of all runs: the unit of progress.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "for display")]
    pub fn steps(&self) -> u64 {
        self.motors.iter().flatten().map(|run| (run.duration_s / run.step_s) as u64).sum()
    }

    /// Makes every run. `progress` gets the number of steps of each run that has ended.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<Vec<Ensemble>, RunError> {
        let runs: Vec<&OpenLoopRun> = self.motors.iter().flatten().collect();
        // A thread takes one run at a time. The results come back in the order of the list.
        let summaries: Result<Vec<OpenLoopSummary>, RunError> = (runs.par_iter().with_max_len(1))
            .map(|run| {
                let summary = simulate(run, &mut ())?;
                progress(summary.steps);
                Ok(summary)
            })
            .collect();
        let mut summaries = summaries?.into_iter();
        let ensembles = self.motors.iter().map(|runs| Ensemble {
            mode: runs.first().and_then(|run| run.drive.mode()).unwrap_or(DriveMode::C),
            summaries: summaries.by_ref().take(runs.len()).collect(),
        });
        Ok(ensembles.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0.3 s instead of 2 s.
    #[test]
    fn exact_quick_runs_are_shorter() {
        let mut runs = PaperRuns::default();
        runs.add(DriveMode::C, &[], 1e-5, 2).unwrap();
        assert_eq!(runs.time().to_string(), "2 s of which 0.5 s to settle");
        let full = runs.steps();
        let quick = runs.within(RunTime::QUICK);
        assert_eq!(quick.time().to_string(), "0.3 s of which 0.1 s to settle");
        assert!(full.abs_diff(400_000) < 10 && quick.steps().abs_diff(60_000) < 10);
        let ensembles = quick.run(&|_| ()).unwrap();
        assert!(ensembles[0].turns_in_the_sense_of_its_mode());
        assert!(ensembles[0].values(Quantity::CollisionFrequency).all(|frequency_hz| frequency_hz > 0.0));
    }

    #[test]
    fn law_threads_change_nothing() {
        let mut runs = PaperRuns::default();
        for mode in [DriveMode::B, DriveMode::C] {
            runs.add(mode, &[], 1e-5, 3).unwrap();
        }
        let run_on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| runs.run(&|_| ())).unwrap()
        };
        let (one, many) = (run_on(1), run_on(4));
        assert_eq!(one.len(), 2);
        for (a, b) in one.iter().zip(&many) {
            assert_eq!((a.mode, &a.summaries), (b.mode, &b.summaries));
            assert_eq!(a.summaries.len(), 3);
            assert!(a.turns_in_the_sense_of_its_mode());
        }
        let mean = |ensemble: &Ensemble| ensemble.spread(Quantity::Rate).mean;
        assert!(mean(&one[0]) > 3.0 * mean(&one[1]), "mode B is several times faster");
    }
}
