//! Speed against error of the fixed-step twin: the `accuracy` command.
//!
//! What a step of [`motor_model::Motor`] costs, and how far it is from the event-driven [`crate::studies::step_accuracy::reference`], which shares no line of it.
//! Chaos limits what can be compared. Two trajectories agree for about four impacts in `f64` and two in `f32`; beyond that only single maps and
//! statistics mean anything:
//!
//! | module | what is compared |
//! |---|---|
//! | [`method`] | who is judged |
//! | [`impact_map`] | time of the first impact, and the map to the next, from the same states |
//! | [`steady_motion`] | mean rate, impacts per second and collision frequency of steady motion |
//! | [`bursts`] | net displacement of a few cycles from rest |
//! | [`averaged_moves`] | the averaged motor on long moves |
//! | [`step_cost`] | ns a step and a simulated millisecond |
//! | [`vibrating_plate`], [`peers`] | a ball on a plate, for other crates' integrators and SciPy's beside ours |
//! | [`targets`] | what the twin is held to |
//! | [`tables`], `picture`, `page` | all of it in words and in a picture |

pub mod averaged_moves;
pub mod bursts;
pub mod comparison;
pub mod impact_map;
pub mod method;
mod page;
pub mod peers;
mod picture;
pub mod reference;
pub mod steady_motion;
pub mod step_cost;
pub mod tables;
pub mod targets;
pub mod vibrating_plate;

use motor_model::DriveMode;
use rayon::prelude::*;

use crate::studies::StudyError;
use crate::studies::averaged_motor::SpinUpCampaign;
use bursts::{BURSTS, BurstError};
use comparison::{MethodRow, StepAccuracy};
use impact_map::{ImpactMapErrors, ImpactMapMeasurement, MapSamples};
use method::{STEPS_S, StepMethod, step_methods};
use motor_model::AmplitudeVariation;
use steady_motion::{CONDITIONS, SteadyErrors, SteadyMeans, SteadySchedule};
use step_cost::TimingEffort;

/// How much is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepAccuracyPlan {
    /// Steps judged, from fine to coarse.
    pub steps_s: &'static [f64],
    /// Samples of each mode.
    pub flights: usize,
    /// Runs of each condition.
    pub batches: SteadySchedule,
    /// Runs from which the averaged motor is identified.
    pub identification: SpinUpCampaign,
    /// Timed work.
    pub effort: TimingEffort,
}

impl StepAccuracyPlan {
    /// A few minutes of computing on two cores.
    pub fn full() -> Self {
        Self {
            steps_s: &STEPS_S,
            flights: 400,
            batches: SteadySchedule {
                seeds: 160,
                seeds_min: 8,
                steps_max: 6e7,
                settle_s: 0.4,
                time_s: 1.6384,
            },
            identification: SpinUpCampaign::default(),
            effort: TimingEffort { rounds: 7, settle_s: 0.2, time_s: 0.4, plate_s: 0.1 },
        }
    }

    /// A few seconds of computing: every figure, none of them sharp.
    pub fn quick() -> Self {
        Self {
            steps_s: &STEPS_S[2..],
            flights: 40,
            batches: SteadySchedule { seeds: 4, seeds_min: 2, steps_max: 1e6, settle_s: 0.1, time_s: 0.2 },
            identification: SpinUpCampaign { runs: 4, blocks: 4, ..SpinUpCampaign::default() },
            effort: TimingEffort { rounds: 2, settle_s: 0.02, time_s: 0.02, plate_s: 0.01 },
        }
    }
}

/// Everything that can be said without a clock.
struct MethodErrors {
    flights: [ImpactMapErrors; 2],
    steady: [SteadyErrors; 4],
    bursts: [BurstError; 4],
}

impl StepAccuracyPlan {
    /// Computes everything: errors on all threads, then costs on one.
    ///
    /// # Errors
    /// When the reference stalls.
    pub fn run(&self) -> Result<StepAccuracy, StudyError> {
        let methods = step_methods(self.steps_s);
        let errors = self.errors(&methods)?;
        let costs = step_cost::costs(&methods, self.effort)?;
        let rows = methods.into_iter().zip(errors).zip(costs).map(|((method, errors), cost)| MethodRow {
            method,
            cost,
            flights: errors.flights,
            steady: errors.steady,
            bursts: errors.bursts,
        });
        Ok(StepAccuracy {
            rows: rows.collect(),
            averaged: averaged_moves::rows(&self.identification, self.effort.rounds)?,
            peers: peers::peers(self.steps_s, self.effort)?,
        })
    }

    fn errors(&self, methods: &[StepMethod]) -> Result<Vec<MethodErrors>, StudyError> {
        let flights = [DriveMode::B, DriveMode::C].map(|mode| MapSamples::draw(mode, self.flights));
        let [b, c] = flights;
        let flights = [b?, c?];
        let converged = self.converged()?;
        // The fine steps first: they take longest, and no thread is left alone with them at the end.
        (methods.par_iter().with_max_len(1))
            .map(|method| {
                let fly = |flights| {
                    let measurement = ImpactMapMeasurement { flights, step_s: method.step_s };
                    method.apply(AmplitudeVariation::default(), &measurement)
                };
                let steady = |index: usize| {
                    steady_motion::errors(method, &CONDITIONS[index], self.batches, &converged[index])
                };
                let burst = |index: usize| BURSTS[index].error(method);
                Ok(MethodErrors {
                    flights: [fly(&flights[0])?, fly(&flights[1])?],
                    steady: [steady(0)?, steady(1)?, steady(2)?, steady(3)?],
                    bursts: [burst(0)?, burst(1)?, burst(2)?, burst(3)?],
                })
            })
            .collect()
    }

    /// The reference's batches of each condition.
    fn converged(&self) -> Result<Vec<Vec<SteadyMeans>>, StudyError> {
        let of = |condition| {
            let seeds = self.batches.of(condition).seeds;
            (1..=seeds)
                .into_par_iter()
                .map(|seed| steady_motion::reference_batch(condition, self.batches, seed))
                .collect()
        };
        CONDITIONS.iter().map(of).collect()
    }
}
