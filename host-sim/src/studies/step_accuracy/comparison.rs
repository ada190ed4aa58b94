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
use super::tilting_forms::TiltingFormRow;

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
    /// Errors of steady motion under each of [`super::steady_motion::CONDITIONS`].
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

/// The result of the study.
#[derive(Clone, Debug, Serialize)]
pub struct StepAccuracy {
    /// One row for each method.
    pub rows: Vec<MethodRow>,
    /// The averaged motor under each of [`super::steady_motion::CONDITIONS`].
    pub averaged: Vec<AveragedRow>,
    /// The fixed-step model and other integrators on the ball on the vibrating plate.
    pub peers: Vec<PeerRow>,
    /// The forms of the rotor at set F.
    pub tilting: Vec<TiltingFormRow>,
}
