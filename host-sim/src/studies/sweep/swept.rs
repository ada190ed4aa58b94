//! The commands that a sweep can run: each from a scene to the JSON value that it prints.

use serde::Serialize;
use serde_json::Value;

use crate::report::files;
use crate::studies::beside::{BesideScene, FIRST};
use crate::studies::fault_campaign::FaultCampaignPlan;
use crate::studies::filter_errors::FilterErrorsPlan;
use crate::studies::gyroscope_calibration::CalibrationPlan;
use crate::studies::held_rates::{self, HeldRates};
use crate::studies::open_loop;
use crate::studies::positioning_trials::{PositioningTrials, PositioningTrialsPlan, Strategy};
use crate::studies::shard::Shard;
use analysis::response_map;
use simulation::runs::{RunError, position};
use simulation::scene::Scene;

/// A command that a sweep can run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SweptCommand {
    /// One run in open loop.
    Simulate,
    /// One move.
    Position,
    /// One rate.
    Rate,
    /// The filters beside the truth.
    Estimate,
    /// Calibrations of gyroscopes.
    Calibrate,
    /// Moves of many motors.
    PositioningTrials,
    /// Moves during which things go wrong.
    Faults,
}

impl SweptCommand {
    /// Every one.
    pub const ALL: [Self; 7] = [
        Self::Simulate,
        Self::Position,
        Self::Rate,
        Self::Estimate,
        Self::Calibrate,
        Self::PositioningTrials,
        Self::Faults,
    ];

    /// Its name on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Simulate => "simulate",
            Self::Position => "position",
            Self::Rate => "rate",
            Self::Estimate => "estimate",
            Self::Calibrate => "calibrate",
            Self::PositioningTrials => "positioning-trials",
            Self::Faults => "faults",
        }
    }

    /// Whether it runs many motors or gyroscopes.
    pub const fn has_sample(self) -> bool {
        !matches!(self, Self::Simulate | Self::Position | Self::Rate)
    }

    /// Whether its controller plans by a response map.
    pub const fn plans(self) -> bool {
        !matches!(self, Self::Simulate | Self::Estimate)
    }

    /// The result of the command with `scene`, as `--format json` prints it; a study has `sample` motors, a calibration
    /// so many gyroscopes, a campaign so many moves.
    ///
    /// # Errors
    /// When the scene is refused, or the run diverges.
    pub(super) fn result(self, scene: &Scene, sample: u64) -> Result<Value, RunError> {
        let scene = &if self.plans() { with_map(scene)? } else { scene.clone() };
        let json = match self {
            Self::Simulate => open_loop::run(scene, &mut ())?.json(),
            Self::Position => {
                position::plan(scene)?;
                files::json_line(&position::run(scene, |_| ())?)
            }
            Self::Rate => HeldRates::of_one(held_rates::hold_one(scene)?, &[])?.json(),
            Self::Estimate => FilterErrorsPlan::new(scene, sample)?.run(&|_| ())?.json(),
            Self::Calibrate => CalibrationPlan::new(scene, sample, sample)?.run(&|| ())?.json(),
            Self::PositioningTrials => {
                let trials = PositioningTrialsPlan::new(scene, Strategy::Planned, sample)?.run(&|_| ())?;
                PositioningTrials::alone(scene, trials).json()
            }
            Self::Faults => {
                let one = BesideScene { name: FIRST.to_owned(), scene: scene.clone() };
                FaultCampaignPlan::new(vec![one], sample, Shard::ALL).run(&|| ())?.json()
            }
        };
        // Its own text, which is JSON.
        Ok(serde_json::from_str(&json).unwrap_or_default())
    }
}

/// `scene` with the response map of its design: one that is given, that of Table 1, or one that is made.
fn with_map(scene: &Scene) -> Result<Scene, RunError> {
    if scene.response_map().is_ok() {
        return Ok(scene.clone());
    }
    let map = response_map::of_design(scene, &|_| (), |_| ())?;
    Ok(scene.clone().with_response_map(map))
}
