//! A setting in words: its default, what it takes, and what is known of its value.

use motor_model::params::{Origin, ParameterSpec, Tolerance};
use motor_model::{Parameter, TiltingParameter};

use super::setting::of_design;
use super::{Kind, Setting};
use crate::math::plain_number::plain;

impl Kind {
    /// The value when nothing sets it.
    #[must_use]
    pub fn default_text(self) -> String {
        match self {
            Self::Number { default, .. } => plain(default),
            Self::Integer { default, .. } => default.to_string(),
            Self::Choice { default, .. } | Self::Schedule { default } => default.to_owned(),
            Self::Faults => "[]".to_owned(),
            Self::As { key } => format!("as {key}"),
        }
    }

    /// The values that it takes, without their unit.
    #[must_use]
    pub fn bounds_text(self) -> String {
        match self.resolved() {
            Self::Number { min, max, .. } => format!("{} to {}", plain(min), plain(max)),
            Self::Integer { min, max, .. } => format!("{min} to {max}"),
            Self::Choice { of, .. } => of.join("|"),
            Self::Faults => "words".to_owned(),
            Self::Schedule { .. } => "drives".to_owned(),
            Self::As { .. } => String::new(),
        }
    }
}

impl Setting {
    /// The parameter that the key sets, of the design or of the true motor.
    fn parameter(&self) -> Option<ParameterSpec> {
        let key = of_design(self.key).unwrap_or(self.key);
        let of_motor = Parameter::from_key(key).map(Parameter::spec);
        of_motor.or_else(|| TiltingParameter::from_key(key).map(TiltingParameter::spec))
    }

    /// How far a drawn motor may be off the design in this parameter; empty for other keys.
    #[must_use]
    pub fn tolerance_text(&self) -> String {
        match self.parameter().map(|spec| spec.tolerance) {
            Some(Tolerance::Normal(within)) => format!("+-{}", plain(within)),
            Some(Tolerance::Uniform(low, high)) => format!("{} to {}", plain(low), plain(high)),
            Some(Tolerance::Exact) => "exact".to_owned(),
            None => String::new(),
        }
    }

    /// Where the nominal value of this parameter comes from; empty for other keys.
    #[must_use]
    pub fn origin_text(&self) -> &'static str {
        match self.parameter().map(|spec| spec.origin) {
            Some(Origin::Measured) => "measured",
            Some(Origin::FiniteElement) => "finite elements",
            Some(Origin::Calculated) => "calculated",
            Some(Origin::Literature) => "literature",
            Some(Origin::Tuned) => "tuned",
            Some(Origin::Assumed) => "assumed",
            None => "",
        }
    }
}
