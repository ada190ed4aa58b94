//! One key and the values that it takes in a sweep.

use serde::Serialize;

use super::SweepError;
use crate::report::parquet_table::CellKind;
use simulation::math::count::real;
use simulation::math::plain_number::plain;
use simulation::scene::{Admission, Kind, Origin, Scene, registry};

/// A key and its values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// The key.
    pub key: &'static str,
    /// Its values.
    #[serde(flatten)]
    pub values: AxisValues,
    /// What its cells in a table are.
    #[serde(skip)]
    pub(super) cells: CellKind,
}

/// The values of an axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum AxisValues {
    /// These, as text.
    Listed(Vec<String>),
    /// A range.
    Range {
        /// The least.
        min: f64,
        /// The largest.
        max: f64,
        /// Whether equal factors lie between the values, instead of equal differences.
        log: bool,
        /// Values of a grid; `None` if the range is drawn from.
        count: Option<u64>,
    },
}

/// What is wrong with a range.
const NOT_NUMBERS: &str = "MIN and MAX of a range are numbers, MIN below MAX";

impl Axis {
    /// The axis that `text` means: `KEY=A,B,C` or `KEY=MIN..MAX`, the latter with `:log`, a count of values, or both.
    ///
    /// # Errors
    /// When there is no such key, `admit` refuses it, or the key does not take the values.
    pub fn parse(text: &str, admit: Admission) -> Result<Self, SweepError> {
        let refused = |why: &str| SweepError::Axis { text: text.to_owned(), why: why.to_owned() };
        let (key, values) = text.split_once('=').ok_or_else(|| refused("it is not KEY=VALUES"))?;
        let (key, values) = (key.trim(), values.trim());
        let mut scene = Scene::default();
        let mut take = |value: &str| scene.assign(key, value, admit, Origin::Flag);
        if let Some((min, rest)) = values.split_once("..") {
            let mut words = rest.split(':');
            let max = words.next().unwrap_or_default();
            take(min)?;
            take(max)?;
            let (key, cells) = found(key);
            let [min, max] = [min, max].map(|text| text.trim().parse::<f64>().ok());
            let (Some(min), Some(max)) = (min, max) else { return Err(refused(NOT_NUMBERS)) };
            let (mut log, mut count) = (false, None);
            for word in words {
                match (word, word.parse::<u64>()) {
                    ("log", _) => log = true,
                    ("linear", _) => log = false,
                    (_, Ok(number)) if number >= 2 => count = Some(number),
                    (_, Ok(_)) => return Err(refused("a grid has two values of a range at least")),
                    _ => return Err(refused(&format!("{word} is neither log, linear nor a count"))),
                }
            }
            if cells == CellKind::Word {
                return Err(refused("only numbers have a range"));
            }
            if min >= max {
                return Err(refused(NOT_NUMBERS));
            }
            if log && min <= 0.0 {
                return Err(refused("a logarithmic range begins above 0"));
            }
            return Ok(Self { key, values: AxisValues::Range { min, max, log, count }, cells });
        }
        let listed: Vec<String> = values
            .split(',')
            .map(|value| value.trim().to_owned())
            .filter(|value| !value.is_empty())
            .collect();
        if listed.is_empty() {
            return Err(refused("it has no values"));
        }
        listed.iter().try_for_each(|value| take(value))?;
        let (key, cells) = found(key);
        Ok(Self { key, values: AxisValues::Listed(listed), cells })
    }

    /// How many values it has in a grid; `None` if it is a range to draw from.
    pub fn levels(&self) -> Option<u64> {
        match &self.values {
            AxisValues::Listed(values) => Some(values.len() as u64),
            AxisValues::Range { count, .. } => *count,
        }
    }

    /// Value `level` of a grid, from 0, as text.
    pub(super) fn level(&self, level: u64) -> String {
        match &self.values {
            AxisValues::Listed(values) => {
                usize::try_from(level).ok().and_then(|level| values.get(level)).cloned().unwrap_or_default()
            }
            AxisValues::Range { count, .. } => {
                self.within(real(level) / real(count.unwrap_or(2).saturating_sub(1)))
            }
        }
    }

    /// The value at `part` of the way along the axis, 0 to 1 without the 1, as text: uniform values of `part` give
    /// uniform values, each of a list as often as the others.
    pub(super) fn at(&self, part: f64) -> String {
        match &self.values {
            AxisValues::Listed(values) => {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "below the length"
                )]
                let level = (part * real(values.len())) as u64;
                self.level(level.min(values.len() as u64 - 1))
            }
            // Each whole number as often as the others: the first and the last have a half more around them.
            AxisValues::Range { min, max, log: false, .. } if self.cells == CellKind::Whole => {
                whole((min + (part * (max - min + 1.0)).floor()).min(*max))
            }
            AxisValues::Range { .. } => self.within(part),
        }
    }

    /// The number at `part` of the way, 0 to 1, as text.
    fn within(&self, part: f64) -> String {
        let AxisValues::Range { min, max, log, .. } = &self.values else { return String::new() };
        let number = if *log {
            min * motor_model::math::exp(part * motor_model::math::ln(max / min))
        } else {
            // Its ends are exact.
            min * (1.0 - part) + max * part
        };
        // Rounding may leave the bounds by a bit.
        let number = number.clamp(*min, *max);
        if self.cells == CellKind::Whole { whole(number.round()) } else { plain(number) }
    }
}

/// A whole number as a scene takes it: without an exponent.
fn whole(number: f64) -> String {
    format!("{number:.0}")
}

/// A key that a scene has just taken, as the registry has it, and what its values are in a table.
fn found(key: &str) -> (&'static str, CellKind) {
    let setting = registry().find(|setting| setting.key == key).expect("a key that was taken");
    let cells = match setting.kind.resolved() {
        Kind::Number { .. } => CellKind::Number,
        Kind::Integer { .. } => CellKind::Whole,
        _ => CellKind::Word,
    };
    (setting.key, cells)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(text: &str) -> Axis {
        Axis::parse(text, &|_| Ok(())).unwrap_or_else(|error| panic!("{text}: {error}"))
    }

    #[test]
    fn exact_levels_of_a_grid_and_places_of_a_range() {
        let linear = axis("camera.noise_m=1e-6..3e-6:3");
        assert_eq!([0, 1, 2].map(|level| linear.level(level)), ["1e-6", "2e-6", "3e-6"]);
        let log = axis("camera.noise_m=1e-7..1e-5:log:3");
        assert_eq!(log.levels(), Some(3));
        for (level, expected) in [(0, 1e-7), (1, 1e-6), (2, 1e-5)] {
            let number: f64 = log.level(level).parse().unwrap();
            assert!((number / expected - 1.0).abs() < 1e-12, "{number}");
        }
        let marks = axis("camera.marks=2..4");
        assert_eq!(marks.levels(), None);
        let places = [0.0, 0.333, 0.334, 0.666, 0.667, 0.999_999];
        assert_eq!(places.map(|part| marks.at(part)), ["2", "2", "3", "3", "4", "4"]);
        assert_eq!(axis("seed=1..1000000:2").level(1), "1000000");
        let drives = axis("simulate.drive=b, c");
        assert_eq!([0.0, 0.499, 0.5, 0.999].map(|part| drives.at(part)), ["b", "b", "c", "c"]);
    }

    #[test]
    fn exact_axes_are_refused_by_key_value_and_form() {
        for (text, words) in [
            ("camera.noise_m", "it is not KEY=VALUES"),
            ("camera.nois_m=1e-6..2e-6", "unknown key camera.nois_m"),
            ("camera.noise_m=1e-6..1", "camera.noise_m = 1 is outside its bounds 0 to 0.001 m"),
            ("camera.noise_m=2e-6..1e-6", "MIN below MAX"),
            ("camera.noise_m=0..1e-6:log", "begins above 0"),
            ("camera.noise_m=0..1e-6:1", "two values"),
            ("camera.noise_m=0..1e-6:lag", "lag is neither"),
            ("simulate.drive=b..c", "MIN and MAX of a range are numbers"),
            ("simulate.drive=", "it has no values"),
            ("simulate.drive=b,d", "simulate.drive = d is none of b, c, off"),
        ] {
            let refused = Axis::parse(text, &|_| Ok(())).unwrap_err().to_string();
            assert!(refused.contains(words), "{text}: {refused}");
        }
    }
}
