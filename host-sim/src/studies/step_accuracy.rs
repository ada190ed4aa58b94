//! Speed against error of the fixed-step twin: the `accuracy` command.
//!
//! What a step of [`motor_model::Motor`] costs, and how far it is from the event-driven [`crate::studies::step_accuracy::reference`], which shares no line of it.
//! Chaos limits what can be compared. Two trajectories agree for about four impacts in `f64` and two in `f32`; beyond that only single maps and
//! statistics mean anything:
//!
//! | module | what is compared |
//! |---|---|
//! | [`contestant`] | who is judged |
//! | [`flights`] | time of the first impact, and the map to the next, from the same states |
//! | [`steady`] | mean rate, impacts per second and collision frequency of steady motion |
//! | [`bursts`] | net displacement of a few cycles from rest |
//! | [`averaged`] | the averaged motor on long moves |
//! | [`timing`] | ns a step and a simulated millisecond |
//! | [`plate`], [`peers`] | a ball on a plate, for other crates' integrators and SciPy's beside ours |
//! | [`verdict`] | what the twin is held to |
//! | [`tables`], `picture`, `page` | all of it in words and in a picture |

pub mod averaged;
pub mod bursts;
pub mod contestant;
pub mod flights;
mod page;
pub mod peers;
mod picture;
pub mod plate;
pub mod reference;
pub mod steady;
pub mod tables;
pub mod timing;
pub mod verdict;

use motor_model::DriveMode;
use rayon::prelude::*;
use serde::Serialize;

use crate::studies::StudyError;
use crate::studies::averaged_motor::Campaign;
use averaged::AveragedRow;
use bursts::{BURSTS, BurstError};
use contestant::{Contestant, STEPS_S, contestants};
use flights::{FlightErrors, Flights, Fly};
use motor_model::AmplitudeVariation;
use peers::PeerRow;
use steady::{Batch, Batches, CONDITIONS, SteadyErrors};
use timing::{Cost, Effort};

/// How much is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Steps judged, from fine to coarse.
    pub steps_s: &'static [f64],
    /// Flights of each mode.
    pub flights: usize,
    /// Runs of each condition.
    pub batches: Batches,
    /// Runs from which the averaged motor is identified.
    pub identification: Campaign,
    /// Timed work.
    pub effort: Effort,
}

impl Plan {
    /// A few minutes of computing on two cores.
    pub fn full() -> Self {
        Self {
            steps_s: &STEPS_S,
            flights: 400,
            batches: Batches { seeds: 160, seeds_min: 8, steps_max: 6e7, settle_s: 0.4, time_s: 1.6384 },
            identification: Campaign::default(),
            effort: Effort { rounds: 7, settle_s: 0.2, time_s: 0.4, plate_s: 0.1 },
        }
    }

    /// A few seconds of computing: every figure, none of them sharp.
    pub fn quick() -> Self {
        Self {
            steps_s: &STEPS_S[2..],
            flights: 40,
            batches: Batches { seeds: 4, seeds_min: 2, steps_max: 1e6, settle_s: 0.1, time_s: 0.2 },
            identification: Campaign { runs: 4, blocks: 4, ..Campaign::default() },
            effort: Effort { rounds: 2, settle_s: 0.02, time_s: 0.02, plate_s: 0.01 },
        }
    }
}

/// One contestant, its costs and its errors.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Who.
    #[serde(flatten)]
    pub who: Contestant,
    /// Cost at full drive of modes B and C.
    pub cost: [Cost; 2],
    /// Errors of the map from impact to impact at full drive of modes B and C.
    pub flights: [FlightErrors; 2],
    /// Errors of steady motion, one of each of [`CONDITIONS`].
    pub steady: [SteadyErrors; 4],
    /// Errors of net displacement, one of each of [`BURSTS`].
    pub bursts: [BurstError; 4],
}

impl Row {
    /// Cost at full drive of `mode`.
    pub fn cost_of(&self, mode: DriveMode) -> Cost {
        let [b, c] = self.cost;
        match mode {
            DriveMode::B => b,
            DriveMode::C => c,
        }
    }

    /// Largest relative error of the displacement of any burst.
    pub fn worst_burst(&self) -> f64 {
        self.bursts.iter().map(|burst| burst.relative.abs()).fold(0.0, f64::max)
    }

    /// Largest relative error of the displacement of a burst of `mode`.
    pub fn worst_burst_of(&self, mode: DriveMode) -> f64 {
        let bursts = BURSTS.iter().zip(&self.bursts).filter(|(burst, _)| burst.mode == mode);
        bursts.map(|(_, error)| error.relative.abs()).fold(0.0, f64::max)
    }
}

/// Everything that can be said without a clock.
struct Errors {
    flights: [FlightErrors; 2],
    steady: [SteadyErrors; 4],
    bursts: [BurstError; 4],
}

/// The whole comparison.
#[derive(Clone, Debug, Serialize)]
pub struct Accuracy {
    /// One row a contestant.
    pub rows: Vec<Row>,
    /// The averaged motor under each of [`CONDITIONS`].
    pub averaged: Vec<AveragedRow>,
    /// Ours and others' integrators on the ball on the plate.
    pub peers: Vec<PeerRow>,
}

impl Plan {
    /// Computes everything: errors on all threads, then costs on one.
    ///
    /// # Errors
    /// When the reference stalls.
    pub fn run(&self) -> Result<Accuracy, StudyError> {
        let contestants = contestants(self.steps_s);
        let errors = self.errors(&contestants)?;
        let costs = timing::costs(&contestants, self.effort)?;
        let rows = contestants.into_iter().zip(errors).zip(costs).map(|((who, errors), cost)| Row {
            who,
            cost,
            flights: errors.flights,
            steady: errors.steady,
            bursts: errors.bursts,
        });
        Ok(Accuracy {
            rows: rows.collect(),
            averaged: averaged::rows(&self.identification, self.effort.rounds)?,
            peers: peers::peers(self.steps_s, self.effort)?,
        })
    }

    fn errors(&self, contestants: &[Contestant]) -> Result<Vec<Errors>, StudyError> {
        let flights = [DriveMode::B, DriveMode::C].map(|mode| Flights::draw(mode, self.flights));
        let [b, c] = flights;
        let flights = [b?, c?];
        let converged = self.converged()?;
        // The fine steps first: they take longest, and no thread is left alone with them at the end.
        (contestants.par_iter().with_max_len(1))
            .map(|contestant| {
                let fly = |flights| {
                    let question = Fly { flights, step_s: contestant.step_s };
                    contestant.examine(AmplitudeVariation::default(), &question)
                };
                let steady = |index: usize| {
                    steady::errors(contestant, &CONDITIONS[index], self.batches, &converged[index])
                };
                let burst = |index: usize| BURSTS[index].error(contestant);
                Ok(Errors {
                    flights: [fly(&flights[0])?, fly(&flights[1])?],
                    steady: [steady(0)?, steady(1)?, steady(2)?, steady(3)?],
                    bursts: [burst(0)?, burst(1)?, burst(2)?, burst(3)?],
                })
            })
            .collect()
    }

    /// The reference's batches of each condition.
    fn converged(&self) -> Result<Vec<Vec<Batch>>, StudyError> {
        let of = |condition| {
            let seeds = self.batches.of(condition).seeds;
            (1..=seeds)
                .into_par_iter()
                .map(|seed| steady::reference_batch(condition, self.batches, seed))
                .collect()
        };
        CONDITIONS.iter().map(of).collect()
    }
}
