//! What a tick of any loop did, that of a move, of a rate or of experiments.

use controller::commissioning::{ExperimentPhase, ExperimentReport};
use controller::{PositioningPhase, RateReport, TickReport};
use estimator::{Estimate, Health, Innovation};
use link::{PhaseRecord, RatePhase, TickRecord};
use motor_model::{Angle, DriveCommand};

/// What a tick of any loop did, in the place where the loop keeps it.
#[derive(Debug, PartialEq)]
pub enum LoopReport<'a> {
    /// Of a move.
    Move(&'a mut TickReport),
    /// Of a rate.
    Rate {
        /// The report of the loop.
        report: &'a mut RateReport,
        /// What becomes of the rate: its loop does not know when it is over.
        phase: RatePhase,
    },
    /// Of experiments.
    Experiment(&'a mut ExperimentReport),
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

/// The same field of the report of any loop.
macro_rules! field {
    ($self:ident.$field:ident) => {
        match $self {
            LoopReport::Move(report) => &report.$field,
            LoopReport::Rate { report, .. } => &report.$field,
            LoopReport::Experiment(report) => &report.$field,
        }
    };
}

impl LoopReport<'_> {
    /// Counts its angles from `zero`, if it is of a tick with a decision: otherwise they are counted so already.
    #[inline]
    pub fn count_from(&mut self, zero: Angle) {
        let (estimate, reference) = match self {
            Self::Move(report) => (&mut report.estimate, None),
            Self::Experiment(report) => (&mut report.estimate, None),
            Self::Rate { report, .. } => (&mut report.estimate, report.reference.as_mut()),
        };
        // A reference needs an estimate.
        if let Some(estimate) = estimate {
            estimate.angle = estimate.angle.minus(zero);
            if let Some(reference) = reference {
                *reference = reference.minus(zero);
            }
        }
    }

    /// The estimate that the decision was based on.
    pub fn estimate(&self) -> Option<&Estimate<f32>> {
        field!(self.estimate).as_ref()
    }

    /// Whether it may be used.
    pub fn health(&self) -> Health {
        *field!(self.health)
    }

    /// What became of the camera frame that arrived, if one did.
    pub fn camera(&self) -> Option<&Innovation<f32>> {
        field!(self.camera).as_ref()
    }

    /// The command of the controller.
    pub fn command(&self) -> DriveCommand {
        *field!(self.command)
    }

    /// The command that the amplifier applies.
    pub fn applied(&self) -> DriveCommand {
        *field!(self.applied)
    }

    /// What the controller does.
    pub fn phase(&self) -> LoopPhase {
        match self {
            Self::Move(report) => LoopPhase::Move(report.phase),
            Self::Rate { phase, .. } => LoopPhase::Rate(*phase),
            Self::Experiment(report) => LoopPhase::Experiment(report.phase),
        }
    }

    /// The same, without since when and what for.
    pub fn kind_of_phase(&self) -> PhaseRecord {
        match self {
            Self::Move(report) => PhaseRecord::from(report.phase),
            Self::Rate { phase, .. } => PhaseRecord::Rate(*phase),
            Self::Experiment(report) => PhaseRecord::Experiment(report.phase),
        }
    }
}

impl From<&LoopReport<'_>> for TickRecord {
    fn from(report: &LoopReport<'_>) -> Self {
        match report {
            LoopReport::Move(report) => Self::from(&**report),
            LoopReport::Experiment(report) => Self::from(&**report),
            LoopReport::Rate { report, phase } => {
                Self { phase: PhaseRecord::Rate(*phase).into(), ..Self::from(&**report) }
            }
        }
    }
}
