//! Cost and error of a step of the fixed-step model: the `accuracy` command.
//!
//! [`analysis::step_accuracy`] measures; here is what is measured, and how it is shown.
//!
//! | module | what it is |
//! |---|---|
//! | [`tilting_forms`], `tilting_table` | what the forms of the rotor cost, and what error leaving out makes |
//! | [`comparison`] | the result |
//! | [`targets`] | the targets for error and cost, and whether they are met |
//! | [`tables`], `page`, `picture` | the result as text, CSV and JSON, as values of a page, as a picture |

pub mod comparison;
mod page;
mod picture;
mod report;
pub mod tables;
pub mod targets;
pub mod tilting_forms;
mod tilting_table;

use analysis::averaged_motor::SpinUpCampaign;
use analysis::step_accuracy::method::{STEPS_S, step_methods};
use analysis::step_accuracy::steady_motion::SteadySchedule;
use analysis::step_accuracy::step_cost::{self, TimingEffort};
use analysis::step_accuracy::{averaged_moves, method_row, peers};
use comparison::StepAccuracy;
use simulation::runs::RunError;
use tilting_forms::TiltingFormsEffort;

/// The number and length of the runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepAccuracyPlan {
    /// Steps of every method, from fine to coarse.
    pub steps_s: &'static [f64],
    /// Samples of the map from impact to impact in each mode.
    pub map_samples: usize,
    /// Runs of each condition of steady motion.
    pub steady: SteadySchedule,
    /// Runs from which the averaged motor is identified.
    pub identification: SpinUpCampaign,
    /// What is timed.
    pub timing: TimingEffort,
    /// Runs of the forms of the rotor.
    pub tilting: TiltingFormsEffort,
}

impl StepAccuracyPlan {
    /// Takes some minutes on two cores.
    pub fn full() -> Self {
        Self {
            steps_s: &STEPS_S,
            map_samples: 400,
            steady: SteadySchedule {
                seeds: 160,
                seeds_min: 8,
                steps_max: 6e7,
                settle_s: 0.4,
                time_s: 1.6384,
            },
            identification: SpinUpCampaign::default(),
            timing: TimingEffort { rounds: 7, settle_s: 0.2, time_s: 0.4, plate_s: 0.1 },
            tilting: TiltingFormsEffort {
                steps_s: &[0.25e-6, 0.5e-6, 1e-6, 2e-6, 5e-6, 10e-6],
                seeds: 8,
                settle_s: 0.5,
                time_s: 1.5,
                rounds: 3,
                timed_s: 0.3,
            },
        }
    }

    /// Takes some seconds. Every figure is there, with a wide interval.
    pub fn quick() -> Self {
        Self {
            steps_s: &STEPS_S[2..],
            map_samples: 40,
            steady: SteadySchedule { seeds: 4, seeds_min: 2, steps_max: 1e6, settle_s: 0.1, time_s: 0.2 },
            identification: SpinUpCampaign { runs: 4, blocks: 4, ..SpinUpCampaign::default() },
            timing: TimingEffort { rounds: 2, settle_s: 0.02, time_s: 0.02, plate_s: 0.01 },
            tilting: TiltingFormsEffort {
                steps_s: &[0.5e-6, 1e-6, 10e-6],
                seeds: 2,
                settle_s: 0.1,
                time_s: 0.2,
                rounds: 2,
                timed_s: 0.05,
            },
        }
    }

    /// Measures the costs on one thread, then computes the errors on all.
    ///
    /// # Errors
    /// When the reference stalls.
    pub fn run(&self) -> Result<StepAccuracy, RunError> {
        let methods = step_methods(self.steps_s);
        let costs = step_cost::costs(&methods, self.timing)?;
        Ok(StepAccuracy {
            rows: method_row::rows(&methods, &costs, self.map_samples, self.steady)?,
            averaged: averaged_moves::rows(&self.identification, self.timing.rounds)?,
            peers: peers::peers(self.steps_s, self.timing)?,
            tilting: tilting_forms::rows(&self.tilting)?,
        })
    }
}
