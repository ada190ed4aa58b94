//! What a board does after it has held its target: [`NextStep`].
//!
//! The move under way gets another target or another zero. It is not configured anew, so that what the loop has learnt
//! of the motor and the whole turns of the rotor stay.

use std::str::FromStr;

use controller::Target;
use link::{HostMessage, TargetRecord};
use motor_model::OutOfBounds;

/// What a board does after it has held its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NextStep {
    /// It moves on to this angle in degrees, clockwise positive, within 360,000 degrees of the zero.
    To(f64),
    /// It holds the angle at which the rotor is then.
    Hold,
    /// It counts all angles from the one at which the rotor is then, and goes on to hold that place.
    Zero,
}

/// Why a text is no step.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NextStepError {
    /// It is neither a number nor one of the words.
    #[error("expected an angle in degrees, hold or zero")]
    Unknown,
    /// The angle is out of bounds.
    #[error(transparent)]
    OutOfBounds(#[from] OutOfBounds),
}

impl FromStr for NextStep {
    type Err = NextStepError;

    /// The step of an angle in degrees, `hold` or `zero`.
    fn from_str(text: &str) -> Result<Self, NextStepError> {
        match text {
            "hold" => Ok(Self::Hold),
            "zero" => Ok(Self::Zero),
            angle => {
                let angle_deg = angle.parse().map_err(|_| NextStepError::Unknown)?;
                Target::try_new(angle_deg, Target::TOLERANCE_MIN_DEG)?;
                Ok(Self::To(angle_deg))
            }
        }
    }
}

impl NextStep {
    /// What the board is told.
    pub(super) fn message(self, tolerance_deg: f64) -> HostMessage {
        match self {
            Self::To(target_deg) => HostMessage::Retarget(TargetRecord { target_deg, tolerance_deg }),
            Self::Hold => HostMessage::Hold,
            Self::Zero => HostMessage::Zero { angle_units: None },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_steps_of_words() {
        assert_eq!("-12.5".parse(), Ok(NextStep::To(-12.5)));
        assert_eq!(("hold".parse(), "zero".parse()), (Ok(NextStep::Hold), Ok(NextStep::Zero)));
        for unknown in ["", "Hold", "5deg"] {
            assert_eq!(unknown.parse::<NextStep>(), Err(NextStepError::Unknown), "{unknown}");
        }
        for beyond in ["360001", "-1e9", "nan", "inf"] {
            let error = beyond.parse::<NextStep>().unwrap_err().to_string();
            assert!(error.contains("position.to_deg") && error.contains("360000"), "{error}");
        }
    }

    #[test]
    fn exact_what_the_board_is_told() {
        let record = TargetRecord { target_deg: 60.0, tolerance_deg: 0.1 };
        assert_eq!(NextStep::To(60.0).message(0.1), HostMessage::Retarget(record));
        assert_eq!(NextStep::Hold.message(0.1), HostMessage::Hold);
        assert_eq!(NextStep::Zero.message(0.1), HostMessage::Zero { angle_units: None });
    }
}
