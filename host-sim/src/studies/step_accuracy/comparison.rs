//! The result of the study: a row for each method, the averaged motor, and other integrators.

use serde::Serialize;

use super::tilting_forms::TiltingFormRow;
use analysis::step_accuracy::averaged_moves::AveragedRow;
use analysis::step_accuracy::method_row::MethodRow;
use analysis::step_accuracy::peers::PeerRow;

/// The result of the study.
#[derive(Clone, Debug, Serialize)]
pub struct StepAccuracy {
    /// One row for each method.
    pub rows: Vec<MethodRow>,
    /// The averaged motor under each of [`analysis::step_accuracy::steady_motion::CONDITIONS`].
    pub averaged: Vec<AveragedRow>,
    /// The fixed-step model and other integrators on the ball on the vibrating plate.
    pub peers: Vec<PeerRow>,
    /// The forms of the rotor at set F.
    pub tilting: Vec<TiltingFormRow>,
}
