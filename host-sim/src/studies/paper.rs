//! The printed tables and figures of the paper, simulated again and compared.
//!
//! | module | what it is |
//! |---|---|
//! | [`published`] | what the paper prints |
//! | [`runs`] | the same motors, with the paper's law of friction and five seeds |
//! | [`comparison`] | the rule for a printed figure |
//! | [`trend`] | the rule for a printed trend |
//! | [`reproduction`] | the result |
//! | [`tables`] | the result as text and Markdown |
//! | [`pictures`] | the result as pictures |

pub mod comparison;
pub mod pictures;
pub mod published;
pub mod reproduction;
pub mod runs;
pub mod tables;
pub mod trend;

use motor_model::DriveMode;

use crate::runs::RunError;
use published::{CASES, Quantity, TRENDS};
use reproduction::{FigureRow, PaperReproduction, SimulatedTrend, StepRow};
use runs::{COARSE_STEP_S, CONVERGED_STEP_S, Ensemble, PaperRuns, STEP_S};
use trend::TrendLine;

/// Steps at which mode B of Table 3 is simulated, from the coarse to the converged one.
const MODE_B_STEPS_S: [f64; 7] = [10e-6, 5e-6, 2e-6, 1e-6, 0.5e-6, 0.2e-6, 0.1e-6];

/// Every motor to be simulated, and the place of each one's runs in the results.
#[derive(Clone, Debug)]
pub struct PaperPlan {
    seeds: u64,
    runs: PaperRuns,
    /// Place of each of [`CASES`].
    cases: Vec<usize>,
    /// Places of each case of mode B at the coarse and at the converged step.
    other_steps: Vec<Option<[usize; 2]>>,
    /// Places of mode B of Table 3, from the converged step to the coarse one.
    mode_b_steps: Vec<usize>,
    /// Places of each of [`TRENDS`].
    trends: Vec<Vec<usize>>,
}

impl PaperPlan {
    /// Every case, each motor with the seeds 1 to `seeds`.
    ///
    /// # Errors
    /// When a published motor is out of the model's bounds.
    pub fn new(seeds: u64) -> Result<Self, RunError> {
        let mut runs = PaperRuns::default();
        // The longest runs come first. So no thread still works on one of them when the others have ended.
        let mode_b_steps: Result<_, _> =
            MODE_B_STEPS_S.iter().rev().map(|step_s| runs.add(DriveMode::B, &[], *step_s, seeds)).collect();
        let cases: Result<_, _> =
            CASES.iter().map(|case| runs.add(case.mode, case.changes, STEP_S, seeds)).collect();
        let other_steps: Result<_, _> = CASES
            .iter()
            .map(|case| {
                let mut at = |step_s| runs.add(case.mode, case.changes, step_s, seeds);
                let is_mode_b = case.mode == DriveMode::B;
                Ok::<_, RunError>(if is_mode_b {
                    Some([at(COARSE_STEP_S)?, at(CONVERGED_STEP_S)?])
                } else {
                    None
                })
            })
            .collect();
        let trends: Result<_, _> =
            TRENDS.iter().map(|trend| trend::add_runs(trend, &mut runs, STEP_S, seeds)).collect();
        Ok(Self {
            seeds,
            cases: cases?,
            other_steps: other_steps?,
            mode_b_steps: mode_b_steps?,
            trends: trends?,
            runs,
        })
    }

    /// Number of steps of all runs: the unit of progress.
    pub fn steps(&self) -> u64 {
        self.runs.steps()
    }

    /// Simulates everything. `progress` gets the number of steps of each run that has ended.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<PaperReproduction, RunError> {
        let ensembles = self.runs.run(progress)?;
        let places = self.cases.iter().zip(&self.other_steps);
        let rows = CASES.iter().zip(places).flat_map(|(case, (&index, others))| {
            let others = others.map(|both| both.map(|other| &ensembles[other]));
            let row = |figure| FigureRow::new(case, figure, &ensembles[index], others);
            case.figures.iter().map(row).collect::<Vec<_>>()
        });
        let steps =
            MODE_B_STEPS_S.iter().zip(self.mode_b_steps.iter().rev()).map(|(&step_s, &index)| StepRow {
                step_s,
                collision_frequency_hz: ensembles[index].spread(Quantity::CollisionFrequency),
                collision_amplitude_mm_s: ensembles[index].spread(Quantity::CollisionAmplitude),
                rate_rad_s: ensembles[index].spread(Quantity::Rate),
            });
        let trends = TRENDS.iter().zip(&self.trends).map(|(trend, indices)| {
            let of_trend: Vec<&Ensemble> = indices.iter().map(|&index| &ensembles[index]).collect();
            let courses =
                trend.rises.iter().filter_map(|&rises| TrendLine::of(trend, rises, &of_trend)).collect();
            SimulatedTrend { picture: trend.picture, varied: trend.label, courses, trend: *trend }
        });
        Ok(PaperReproduction {
            seeds: self.seeds,
            rows: rows.collect(),
            mode_b_steps: steps.collect(),
            trends: trends.collect(),
        })
    }
}
