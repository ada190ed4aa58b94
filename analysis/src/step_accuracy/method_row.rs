//! Costs and errors of each method.

use motor_model::{AmplitudeVariation, DriveMode};
use rayon::prelude::*;
use serde::Serialize;

use super::bursts::{BURSTS, BurstError};
use super::impact_map::{ImpactMapErrors, ImpactMapMeasurement, MapSamples};
use super::method::StepMethod;
use super::steady_motion::{self, CONDITIONS, SteadyErrors, SteadyMeans, SteadySchedule};
use super::step_cost::StepCost;
use simulation::runs::RunError;

/// One method, its costs and its errors.
#[derive(Clone, Debug, Serialize)]
pub struct MethodRow {
    /// The method.
    #[serde(flatten)]
    pub method: StepMethod,
    /// Cost of a step at full drive of modes B and C.
    pub cost: [StepCost; 2],
    /// Errors of the map from impact to impact at full drive of modes B and C.
    #[serde(rename = "flights")]
    pub impact_map: [ImpactMapErrors; 2],
    /// Errors of steady motion under each of [`CONDITIONS`].
    pub steady: [SteadyErrors; 4],
    /// Error of the net displacement of each of [`BURSTS`].
    pub bursts: [BurstError; 4],
}

impl MethodRow {
    /// Largest relative error of the displacement over all bursts.
    pub fn worst_burst(&self) -> f64 {
        self.bursts.iter().map(|burst| burst.relative.abs()).fold(0.0, f64::max)
    }

    /// Largest relative error of the displacement over the bursts of `mode`.
    pub fn worst_burst_of(&self, mode: DriveMode) -> f64 {
        let bursts = BURSTS.iter().zip(&self.bursts).filter(|(burst, _)| burst.mode == mode);
        bursts.map(|(_, error)| error.relative.abs()).fold(0.0, f64::max)
    }
}

/// A row for each of `methods`, whose steps become longer, with its `costs`: `map_samples` samples of the map from
/// impact to impact in each mode, and `schedule` of steady motion.
///
/// # Errors
/// When the reference stalls.
pub fn rows(
    methods: &[StepMethod],
    costs: &[[StepCost; 2]],
    map_samples: usize,
    schedule: SteadySchedule,
) -> Result<Vec<MethodRow>, RunError> {
    let [b, c] = [DriveMode::B, DriveMode::C].map(|mode| MapSamples::draw(mode, map_samples));
    let samples = [b?, c?];
    let reference = reference_means(schedule)?;
    // The fine steps come first, because they take longest: no thread is still at work when the others have ended.
    (methods.par_iter().zip(costs).with_max_len(1))
        .map(|(&method, &cost)| {
            let impact_map = |samples| {
                let measurement = ImpactMapMeasurement { samples, step_s: method.step_s };
                method.apply(AmplitudeVariation::default(), &measurement)
            };
            let steady =
                |index: usize| steady_motion::errors(&method, CONDITIONS[index], schedule, &reference[index]);
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
fn reference_means(schedule: SteadySchedule) -> Result<Vec<Vec<SteadyMeans>>, RunError> {
    let of = |condition| {
        let seeds = schedule.of(condition).seeds;
        (1..=seeds)
            .into_par_iter()
            .map(|seed| steady_motion::reference_means(condition, schedule, seed))
            .collect()
    };
    CONDITIONS.into_iter().map(of).collect()
}
