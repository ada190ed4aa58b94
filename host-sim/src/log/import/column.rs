//! A column by its name, and the unit of its cells.
//!
//! The unit is the end of the name after an underscore (`t_ms`, `angle_deg`, `v_mm_s`), or stands behind a colon
//! (`phi:rad`).

use std::f64::consts::PI;
use std::str::FromStr;

use super::ImportError;

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A time, in s.
    Time,
    /// An angle, in degrees.
    Angle,
    /// A velocity, in m/s.
    Velocity,
    /// A frequency, in Hz.
    Frequency,
}

impl Quantity {
    /// The flags of `import` that name the columns of a measured quantity and of its times.
    pub(super) const fn flags(self) -> (&'static str, &'static str) {
        match self {
            Self::Velocity => ("--vibrometer-velocity", "--vibrometer-time"),
            Self::Time | Self::Angle | Self::Frequency => ("--camera-angle", "--camera-time"),
        }
    }

    /// Its units, and each in s, degrees, m/s or Hz. A unit stands before those that its end is.
    const fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Time => &[("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("s", 1.0)],
            Self::Angle => &[
                ("mdeg", 1e-3),
                ("deg", 1.0),
                ("mrad", 0.18 / PI),
                ("urad", 1.8e-4 / PI),
                ("rad", 180.0 / PI),
                ("turn", 360.0),
            ],
            Self::Velocity => &[("mm_s", 1e-3), ("um_s", 1e-6), ("m_s", 1.0)],
            Self::Frequency => &[("khz", 1e3), ("kHz", 1e3), ("hz", 1.0), ("Hz", 1.0)],
        }
    }
}

/// A column, as it is asked for: a name, with a unit if one was given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnName {
    /// The name.
    pub name: String,
    unit: Option<String>,
}

impl FromStr for ColumnName {
    type Err = std::convert::Infallible;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (name, unit) = match text.rsplit_once(':') {
            Some((name, unit)) => (name, Some(unit.to_owned())),
            None => (text, None),
        };
        Ok(Self { name: name.to_owned(), unit })
    }
}

impl ColumnName {
    /// A cell of 1 in s, degrees, m/s or Hz.
    ///
    /// # Errors
    /// When neither the name nor a colon says which unit the cells have.
    pub(super) fn factor(&self, quantity: Quantity) -> Result<f64, ImportError> {
        let units = quantity.units();
        let named = |(unit, _): &&(&str, f64)| match &self.unit {
            Some(given) => given == unit,
            None => {
                self.name == *unit || self.name.strip_suffix(unit).is_some_and(|rest| rest.ends_with('_'))
            }
        };
        units.iter().find(named).map(|(_, factor)| *factor).ok_or_else(|| ImportError::Unit {
            column: self.name.clone(),
            unit: self.unit.clone(),
            possible: units.iter().map(|(unit, _)| *unit).collect::<Vec<_>>().join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_units_by_suffix_and_by_colon() {
        use Quantity::{Angle, Frequency, Time, Velocity};
        for (text, quantity, expected) in [
            ("t_ms", Time, Some(1e-3)),
            ("time_s", Time, Some(1.0)),
            ("s", Time, Some(1.0)),
            ("stamp_ns", Time, Some(1e-9)),
            ("class", Time, None),
            ("phi:rad", Angle, Some(57.295_779_513_082_32)),
            ("angle_mdeg", Angle, Some(1e-3)),
            ("x_turn", Angle, Some(360.0)),
            ("v_mm_s", Velocity, Some(1e-3)),
            ("v_um_s", Velocity, Some(1e-6)),
            ("v_m_s", Velocity, Some(1.0)),
            ("v_m_s:um_s", Velocity, Some(1e-6)),
            ("v", Velocity, None),
            ("f_khz", Frequency, Some(1e3)),
            ("f_Hz", Frequency, Some(1.0)),
            ("v:deg", Velocity, None),
        ] {
            let column: ColumnName = text.parse().unwrap();
            let factor = column.factor(quantity).ok();
            let close = |(a, b): (f64, f64)| (a / b - 1.0).abs() < 1e-15;
            assert!(factor.zip(expected).map_or(factor == expected, close), "{text} {factor:?}");
        }
    }
}
