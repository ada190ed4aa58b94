//! The open loop by the model that a scene names: what `host-sim simulate` prints.

use std::fmt;
use std::time::Instant;

use serde::Serialize;

use analysis::averaged_motor::{AveragedReport, long_moves};
use simulation::runs::RunError;
use simulation::runs::simulate::{
    Observer, OpenLoopModel, OpenLoopReport, OpenLoopRun, StatorReport, simulate, simulate_stator,
};
use simulation::scene::Scene;

/// The result of the model that ran; JSON by the fields of that model.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum OpenLoopResult {
    /// Of the motor.
    Motor(Box<OpenLoopReport>),
    /// Of its stator without a rotor.
    Stator(StatorReport),
    /// Of its mean rate and random deviations.
    Averaged(Box<AveragedReport>),
}

/// Runs the model of `scene`; `observer` sees the motor, and nothing of the other models.
///
/// # Errors
/// When the scene is refused, or the run diverges.
pub fn run(scene: &Scene, observer: &mut impl Observer) -> Result<OpenLoopResult, RunError> {
    let run = OpenLoopRun::from_scene(scene)?;
    Ok(match OpenLoopModel::from_scene(scene)? {
        OpenLoopModel::Motor => {
            let begun = Instant::now();
            let summary = simulate(&run, observer)?;
            let report = OpenLoopReport::new(&run, &summary, begun.elapsed().as_secs_f64());
            OpenLoopResult::Motor(Box::new(report))
        }
        OpenLoopModel::Stator => {
            let begun = Instant::now();
            let report = simulate_stator(&run)?;
            OpenLoopResult::Stator(report.timed(begun.elapsed().as_secs_f64()))
        }
        OpenLoopModel::Averaged => OpenLoopResult::Averaged(Box::new(long_moves(&run)?)),
    })
}

impl OpenLoopResult {
    /// The result as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}

impl fmt::Display for OpenLoopResult {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Motor(report) => report.fmt(f),
            Self::Stator(report) => report.fmt(f),
            Self::Averaged(report) => report.fmt(f),
        }
    }
}
