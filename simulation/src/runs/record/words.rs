//! Parts of a record as words.

use std::borrow::Cow;

use controller::{PositioningPhase, Wait};
use estimator::{Health, Innovation, Verdict};
use motor_model::{DriveCommand, DriveMode};

use super::Task;

impl Task {
    /// What the controller does, in a word: the phase of a move, `Rate`, `Stopped` with the reason, or `None`.
    pub fn word(&self) -> Cow<'static, str> {
        Cow::Borrowed(match self {
            Self::None => "None",
            Self::Rate { stopped: Some(why), .. } => return format!("Stopped({why:?})").into(),
            Self::Rate { .. } => "Rate",
            Self::Told(phase) => phase,
            Self::Position(PositioningPhase::Waiting(_)) => "Waiting",
            Self::Position(PositioningPhase::Cruise { .. }) => "Cruise",
            Self::Position(PositioningPhase::Burst { .. }) => "Burst",
            Self::Position(PositioningPhase::Settling(Wait::Rest)) => "Settling(Rest)",
            Self::Position(PositioningPhase::Settling(Wait::Turning)) => "Settling(Turning)",
            Self::Position(PositioningPhase::Settling(Wait::Measuring { .. })) => "Settling(Measuring)",
            Self::Position(PositioningPhase::Settling(Wait::MeasuringUnrested { .. })) => {
                "Settling(MeasuringUnrested)"
            }
            Self::Position(PositioningPhase::Brake { .. }) => "Brake",
            Self::Position(PositioningPhase::Holding) => "Holding",
            Self::Position(PositioningPhase::Stopped(why)) => return format!("Stopped({why:?})").into(),
        })
    }
}

/// The mode of a drive: off, B or C.
pub fn mode_word(command: DriveCommand) -> &'static str {
    match command.mode() {
        None => "off",
        Some(DriveMode::B) => "B",
        Some(DriveMode::C) => "C",
    }
}

/// Used, Restarted, or Rejected with the reason.
pub fn verdict_word(innovation: &Innovation<f32>) -> Cow<'static, str> {
    match innovation.verdict {
        Verdict::Used => "Used".into(),
        Verdict::Restarted => "Restarted".into(),
        Verdict::Rejected(why) => format!("Rejected({why:?})").into(),
    }
}

/// 0 good, 1 degraded, 2 unusable, 3 waiting.
pub fn health_level(health: Health) -> u8 {
    match health {
        Health::Good => 0,
        Health::Degraded(_) => 1,
        Health::Unusable(_) => 2,
        Health::Waiting => 3,
    }
}
