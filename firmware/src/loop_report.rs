//! What a tick of any loop did, that of a move, of a rate or of experiments.

use controller::commissioning::{ExperimentPhase, ExperimentReport};
use controller::{PositioningPhase, RateReport, TickReport};
use estimator::{Estimate, Health, Innovation};
use link::{PhaseRecord, RatePhase, TickRecord};
use motor_model::{Angle, DriveCommand};

/// What a tick of any loop did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoopReport {
    /// Of a move.
    Move(TickReport),
    /// Of a rate.
    Rate {
        /// The report of the loop.
        report: RateReport,
        /// What becomes of the rate: its loop does not know when it is over.
        phase: RatePhase,
    },
    /// Of experiments.
    Experiment(ExperimentReport),
}

/// What the controller does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoopPhase {
    /// It moves the rotor to an angle.
    Move(PositioningPhase),
    /// It holds a rate.
    Rate(RatePhase),
    /// It makes experiments.
    Experiment(ExperimentPhase),
}

impl LoopReport {
    /// Counts its angles from `zero`.
    #[inline]
    pub fn count_from(&mut self, zero: Angle) {
        let (estimate, reference) = match self {
            Self::Move(report) => (&mut report.estimate, None),
            Self::Experiment(report) => (&mut report.estimate, None),
            Self::Rate { report, .. } => (&mut report.estimate, report.reference.as_mut()),
        };
        if let Some(estimate) = estimate {
            estimate.angle = estimate.angle.minus(zero);
        }
        if let Some(reference) = reference {
            *reference = reference.minus(zero);
        }
    }

    /// The estimate that the decision was based on.
    pub fn estimate(&self) -> Option<Estimate<f32>> {
        match self {
            Self::Move(report) => report.estimate,
            Self::Rate { report, .. } => report.estimate,
            Self::Experiment(report) => report.estimate,
        }
    }

    /// Whether it may be used.
    pub fn health(&self) -> Health {
        match self {
            Self::Move(report) => report.health,
            Self::Rate { report, .. } => report.health,
            Self::Experiment(report) => report.health,
        }
    }

    /// What became of the camera frame that arrived, if one did.
    pub fn camera(&self) -> Option<Innovation<f32>> {
        match self {
            Self::Move(report) => report.camera,
            Self::Rate { report, .. } => report.camera,
            Self::Experiment(report) => report.camera,
        }
    }

    /// The command of the controller, and that which the amplifier applies.
    pub fn drive(&self) -> (DriveCommand, DriveCommand) {
        match self {
            Self::Move(report) => (report.command, report.applied),
            Self::Rate { report, .. } => (report.command, report.applied),
            Self::Experiment(report) => (report.command, report.applied),
        }
    }

    /// What the controller does.
    pub fn phase(&self) -> LoopPhase {
        match self {
            Self::Move(report) => LoopPhase::Move(report.phase),
            Self::Rate { phase, .. } => LoopPhase::Rate(*phase),
            Self::Experiment(report) => LoopPhase::Experiment(report.phase),
        }
    }
}

impl From<&LoopReport> for TickRecord {
    fn from(report: &LoopReport) -> Self {
        match report {
            LoopReport::Move(report) => report.into(),
            LoopReport::Experiment(report) => report.into(),
            LoopReport::Rate { report, phase } => {
                Self { phase: PhaseRecord::Rate(*phase).into(), ..report.into() }
            }
        }
    }
}
