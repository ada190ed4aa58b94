//! The result of the study: a row for each method, the averaged motor, and other integrators.

use motor_model::DriveMode;
use serde::Serialize;

use super::averaged_moves::AveragedRow;
use super::bursts::{BURSTS, BurstError};
use super::impact_map::ImpactMapErrors;
use super::method::StepMethod;
use super::peers::PeerRow;
use super::steady_motion::SteadyErrors;
use super::step_cost::StepCost;

/// One method, its costs and its errors.
#[derive(Clone, Debug, Serialize)]
pub struct MethodRow {
    /// Who.
    #[serde(flatten)]
    pub method: StepMethod,
    /// Cost at full drive of modes B and C.
    pub cost: [StepCost; 2],
    /// Errors of the map from impact to impact at full drive of modes B and C.
    pub flights: [ImpactMapErrors; 2],
    /// Errors of steady motion, one of each of [`CONDITIONS`].
    pub steady: [SteadyErrors; 4],
    /// Errors of net displacement, one of each of [`BURSTS`].
    pub bursts: [BurstError; 4],
}

impl MethodRow {
    /// Cost at full drive of `mode`.
    pub fn cost_of(&self, mode: DriveMode) -> StepCost {
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

/// The whole comparison.
#[derive(Clone, Debug, Serialize)]
pub struct StepAccuracy {
    /// One row a method.
    pub rows: Vec<MethodRow>,
    /// The averaged motor under each of [`CONDITIONS`].
    pub averaged: Vec<AveragedRow>,
    /// Ours and others' integrators on the ball on the plate.
    pub peers: Vec<PeerRow>,
}
