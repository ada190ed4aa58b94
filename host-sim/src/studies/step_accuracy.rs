//! Cost and error of a step of the fixed-step model: the `accuracy` command.
//!
//! The study times [`motor_model::Motor`] and compares it with an event-driven integrator, [`mod@reference`], which
//! shares no line of its step. The motion is chaotic: two trajectories agree for about four impacts in `f64` and two in
//! `f32`. So the study compares single impacts from equal states, and statistics.
//!
//! | module | what it is |
//! |---|---|
//! | [`method`] | what is compared: rule of impacts, precision, step |
//! | [`impact_map`] | time of the first impact, and the map from it to the next, from equal states |
//! | [`steady_motion`] | mean rate, impacts per second and collision frequency of steady motion |
//! | [`bursts`] | net displacement of a few cycles from rest |
//! | [`averaged_moves`] | the averaged motor on long moves |
//! | [`step_cost`] | time of a step, and of a simulated millisecond |
//! | [`tilting_forms`], `tilting_table` | what the forms of the rotor cost, and what error leaving out makes |
//! | [`vibrating_plate`] | a ball on a vibrating plate: a problem for any integrator with events |
//! | [`peers`] | integrators of other crates and of SciPy on that problem |
//! | [`comparison`] | the result |
//! | [`targets`] | the targets for error and cost, and whether they are met |
//! | [`tables`], `page`, `picture` | the result as text, CSV and JSON, as values of a page, as a picture |

pub mod averaged_moves;
pub mod bursts;
pub mod comparison;
pub mod impact_map;
pub mod method;
mod page;
pub mod peers;
mod picture;
pub mod reference;
mod report;
pub mod steady_motion;
pub mod step_cost;
pub mod tables;
pub mod targets;
pub mod tilting_forms;
mod tilting_table;
pub mod vibrating_plate;

use motor_model::{AmplitudeVariation, DriveMode};
use rayon::prelude::*;

use crate::studies::averaged_motor::SpinUpCampaign;
use bursts::BURSTS;
use comparison::{MethodRow, StepAccuracy};
use impact_map::{ImpactMapMeasurement, MapSamples};
use method::{STEPS_S, StepMethod, step_methods};
use simulation::runs::RunError;
use steady_motion::{CONDITIONS, SteadyMeans, SteadySchedule};
use step_cost::{StepCost, TimingEffort};
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
            rows: self.rows(&methods, &costs)?,
            averaged: averaged_moves::rows(&self.identification, self.timing.rounds)?,
            peers: peers::peers(self.steps_s, self.timing)?,
            tilting: tilting_forms::rows(&self.tilting)?,
        })
    }

    fn rows(&self, methods: &[StepMethod], costs: &[[StepCost; 2]]) -> Result<Vec<MethodRow>, RunError> {
        let [b, c] = [DriveMode::B, DriveMode::C].map(|mode| MapSamples::draw(mode, self.map_samples));
        let samples = [b?, c?];
        let reference = self.reference_means()?;
        // The fine steps come first, because they take longest: no thread is still at work when the others have ended.
        (methods.par_iter().zip(costs).with_max_len(1))
            .map(|(&method, &cost)| {
                let impact_map = |samples| {
                    let measurement = ImpactMapMeasurement { samples, step_s: method.step_s };
                    method.apply(AmplitudeVariation::default(), &measurement)
                };
                let steady = |index: usize| {
                    steady_motion::errors(&method, CONDITIONS[index], self.steady, &reference[index])
                };
                let burst = |index: usize| BURSTS[index].error(&method);
                Ok(MethodRow {
                    method,
                    cost,
                    impact_map: [impact_map(&samples[0])?, impact_map(&samples[1])?],
                    steady: [steady(0)?, steady(1)?, steady(2)?, steady(3)?],
                    bursts: [burst(0)?, burst(1)?, burst(2)?, burst(3)?],
                })
            })
            .collect()
    }

    /// The reference's means under each condition, one for each seed.
    fn reference_means(&self) -> Result<Vec<Vec<SteadyMeans>>, RunError> {
        let of = |condition| {
            let seeds = self.steady.of(condition).seeds;
            (1..=seeds)
                .into_par_iter()
                .map(|seed| steady_motion::reference_means(condition, self.steady, seed))
                .collect()
        };
        CONDITIONS.into_iter().map(of).collect()
    }
}
