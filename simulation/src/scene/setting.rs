//! One setting: its key, its unit and the values that it takes; and the registry of all settings.

use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};

use motor_model::params::{ParameterSpec, Tolerance};
use motor_model::{OutOfBounds, Parameter, TiltingParameter};

use super::faults::Fault;
use super::schedule::Schedule;
use super::{SceneError, keys};
use crate::math::plain_number::plain;

/// One key that a scene can set.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Key in scene files and on the command line, with its unit as suffix.
    pub key: &'static str,
    /// Unit; empty for a pure number or a word.
    pub unit: &'static str,
    /// What values it takes.
    pub kind: Kind,
    /// What it is, in one line.
    pub meaning: &'static str,
}

/// The values a setting takes.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// A finite number within bounds.
    Number {
        /// Value when nothing sets it.
        default: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// A whole number within bounds.
    Integer {
        /// Value when nothing sets it.
        default: u64,
        /// Smallest value allowed.
        min: u64,
        /// Largest value allowed.
        max: u64,
    },
    /// One of a few words.
    Choice {
        /// Word when nothing sets it.
        default: &'static str,
        /// The words allowed.
        of: &'static [&'static str],
    },
    /// Drives, one after the other ([`super::schedule`]).
    Schedule {
        /// Schedule when nothing sets it.
        default: &'static str,
    },
    /// Faults by their words ([`super::faults`]); none when nothing sets them.
    Faults,
    /// The values that another setting takes.
    As {
        /// Key of the other setting. Its value is this one's when nothing sets this one.
        key: &'static str,
    },
}

impl Kind {
    /// What values it takes: of the other setting, where it takes those of another.
    ///
    /// # Panics
    /// When the other key is in no table: a slip in the program.
    #[must_use]
    pub fn resolved(self) -> Self {
        match self {
            Self::As { key } => find(key).kind.resolved(),
            other => other,
        }
    }
}

/// The setting of every command that takes a scene.
const SETTINGS: &[Setting] = &[Setting {
    key: "seed",
    unit: "",
    kind: Kind::Integer { default: 1, min: 0, max: u64::MAX },
    meaning: "names the random numbers of a run: same seed, same run",
}];

/// Every table of keys except the motor's: a new table adds its line here.
const TABLES: &[&[Setting]] = &[
    SETTINGS,
    keys::simulate::SETTINGS,
    keys::plant::SETTINGS,
    keys::camera::SETTINGS,
    keys::vibrometer::SETTINGS,
    #[cfg(feature = "gyroscope")]
    keys::gyroscope::SETTINGS,
    keys::faults::SETTINGS,
    keys::estimator::SETTINGS,
    keys::board::SETTINGS,
    keys::position::SETTINGS,
    keys::rate::SETTINGS,
    keys::limits::SETTINGS,
    keys::run::SETTINGS,
    keys::jog::SETTINGS,
    keys::record::SETTINGS,
    #[cfg(feature = "gyroscope")]
    keys::calibrate::SETTINGS,
    keys::stator::SETTINGS,
];

/// Every key there is: the design's parameters in the order of Table 1, what it has beside them if its rotor tilts,
/// [`keys`], and the true motor's parameters in the same order.
pub fn registry() -> impl Iterator<Item = Setting> {
    let of = |spec: ParameterSpec, key: &'static str| {
        let kind = Kind::Number { default: spec.nominal, min: spec.min, max: spec.max };
        Setting { key, unit: spec.unit, kind, meaning: spec.meaning }
    };
    let tables = TABLES.iter().flat_map(|table| table.iter().copied());
    let parameters = || Parameter::ALL.into_iter().map(|parameter| (parameter.spec(), plant_key(parameter)));
    let of_tilting = || {
        TiltingParameter::ALL.into_iter().map(|parameter| (parameter.spec(), tilting_plant_key(parameter)))
    };
    let design = parameters().chain(of_tilting()).map(move |(spec, _)| of(spec, spec.key));
    let true_motor = parameters().chain(of_tilting()).map(move |(spec, key)| of(spec, key));
    design
        .chain(tables)
        .chain(true_motor)
        .chain(parameters().chain(of_tilting()).map(|(spec, _)| tolerance(spec)))
}

/// The tolerance of a parameter, from which true motors are drawn.
fn tolerance(spec: ParameterSpec) -> Setting {
    let default = match spec.tolerance {
        Tolerance::Exact => 0.0,
        Tolerance::Normal(tolerance) => tolerance,
        Tolerance::Uniform(low, high) => 0.5 * (high - low),
    };
    let kind = Kind::Number { default, min: 0.0, max: spec.max - spec.min };
    Setting { key: tolerance_key(spec.key), unit: spec.unit, kind, meaning: TOLERANCE_MEANING }
}

/// What a tolerance that is set means.
const TOLERANCE_MEANING: &str = "tolerance of true motors about the design, in the place of that of the table: normal, \
                                 half of it is the standard deviation, cut off at it";

/// The key of the tolerance of the design's parameter `design_key`.
///
/// # Panics
/// When there is no such parameter: a slip in the program.
pub(super) fn tolerance_key(design_key: &'static str) -> &'static str {
    static KEYS: LazyLock<BTreeMap<&'static str, &'static str>> = LazyLock::new(|| {
        let of_motor = Parameter::ALL.into_iter().map(|parameter| parameter.spec().key);
        let of_tilting = TiltingParameter::ALL.into_iter().map(|parameter| parameter.spec().key);
        of_motor.chain(of_tilting).map(|key| (key, &*format!("plant.tolerance.{key}").leak())).collect()
    });
    KEYS.get(design_key).unwrap_or_else(|| panic!("{design_key} is no parameter of the design"))
}

/// The key of the true motor's `parameter`: `plant.` and the key of the design's.
pub(super) fn plant_key(parameter: Parameter) -> &'static str {
    static KEYS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
        let key = |parameter: Parameter| &*format!("plant.{}", parameter.spec().key).leak();
        Parameter::ALL.map(key).to_vec()
    });
    KEYS[parameter as usize]
}

/// The same of a parameter that the motor has if its rotor tilts.
pub(super) fn tilting_plant_key(parameter: TiltingParameter) -> &'static str {
    static KEYS: LazyLock<Vec<&'static str>> = LazyLock::new(|| {
        let key = |parameter: TiltingParameter| &*format!("plant.{}", parameter.spec().key).leak();
        TiltingParameter::ALL.map(key).to_vec()
    });
    KEYS[parameter as usize]
}

/// The design's key of the parameter that `key` sets in the true motor; `None` for any other key.
pub(super) fn of_design(key: &'static str) -> Option<&'static str> {
    key.strip_prefix("plant.").filter(|rest| rest.starts_with("motor."))
}

/// The setting of `key`.
///
/// # Panics
/// When there is none: a slip in the program.
pub(super) fn find(key: &str) -> Setting {
    let setting = registry().find(|setting| setting.key == key);
    setting.unwrap_or_else(|| panic!("{key} is in no table of settings"))
}

/// A value that a setting takes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Integer(u64),
    Choice(&'static str),
    Faults(Arc<[Fault]>),
    Schedule(Arc<Schedule>),
}

impl Value {
    /// As it stands in a scene file.
    pub(super) fn toml(&self) -> String {
        match self {
            Self::Number(number) => plain(*number),
            Self::Integer(integer) => integer.to_string(),
            Self::Choice(word) => format!("\"{word}\""),
            Self::Schedule(schedule) => format!("\"{schedule}\""),
            Self::Faults(faults) => {
                let words: Vec<String> = faults.iter().map(|fault| format!("\"{fault}\"")).collect();
                format!("[{}]", words.join(", "))
            }
        }
    }

    /// As it stands in JSON.
    pub(super) fn json(&self) -> serde_json::Value {
        match self {
            Self::Number(number) => (*number).into(),
            Self::Integer(integer) => (*integer).into(),
            Self::Choice(word) => (*word).into(),
            Self::Schedule(schedule) => schedule.to_string().into(),
            Self::Faults(faults) => faults.iter().map(Fault::to_string).collect(),
        }
    }
}

impl Setting {
    /// The value when nothing sets it, or the key whose value it is then.
    pub(super) fn default(&self) -> Result<Value, &'static str> {
        match self.kind {
            Kind::Number { default, .. } => Ok(Value::Number(default)),
            Kind::Integer { default, .. } => Ok(Value::Integer(default)),
            Kind::Choice { default, .. } => Ok(Value::Choice(default)),
            Kind::Faults => Ok(Value::Faults(Arc::default())),
            Kind::Schedule { default } => Ok(self.parse(default).unwrap_or_else(|error| panic!("{error}"))),
            Kind::As { key } => Err(key),
        }
    }

    /// The value that `text` means, if the setting takes it.
    pub(super) fn parse(&self, text: &str) -> Result<Value, SceneError> {
        let not_a = |wanted, bounds| SceneError::NotANumber {
            key: self.key.to_owned(),
            value: text.to_owned(),
            wanted,
            bounds,
            unit: self.unit,
        };
        match self.kind.resolved() {
            Kind::Number { min, max, .. } => match text.parse::<f64>() {
                Ok(number) if !number.is_nan() => {
                    Ok(Value::Number(OutOfBounds::check(self.key, number, min, max, self.unit)?))
                }
                _ => Err(not_a("number", format!("{} to {}", plain(min), plain(max)))),
            },
            Kind::Integer { min, max, .. } => match text.parse::<i128>() {
                Ok(integer) => match u64::try_from(integer) {
                    Ok(integer) if (min..=max).contains(&integer) => Ok(Value::Integer(integer)),
                    _ => Err(SceneError::OutOfBounds {
                        key: self.key.to_owned(),
                        value: text.to_owned(),
                        bounds: format!("{min} to {max}"),
                        unit: self.unit,
                    }),
                },
                Err(_) => Err(not_a("whole number", format!("{min} to {max}"))),
            },
            Kind::Choice { of, .. } => match of.iter().find(|word| **word == text) {
                Some(word) => Ok(Value::Choice(word)),
                None => Err(SceneError::NotAChoice { key: self.key.to_owned(), value: text.to_owned(), of }),
            },
            Kind::Faults => {
                let words =
                    text.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
                Ok(Value::Faults(words.map(str::parse).collect::<Result<_, _>>()?))
            }
            Kind::Schedule { .. } => Ok(Value::Schedule(Arc::new(text.parse()?))),
            // Resolved before.
            Kind::As { key } => find(key).parse(text),
        }
    }
}

/// The registered key most like `key`, unless none is.
///
/// A key without its first table counts as well: `stator_mass_kg` is near `motor.stator_mass_kg`.
pub(super) fn nearest_key(key: &str) -> Option<&'static str> {
    // Beyond any key's length there is nothing to compare, only time to lose.
    if key.len() > 200 {
        return None;
    }
    let alike = |known: &str| {
        let short = known.split_once('.').map_or(known, |(_, rest)| rest);
        let score = |text| strsim::normalized_damerau_levenshtein(key, text);
        score(known).max(score(short))
    };
    nearest(registry().map(|setting| (alike(setting.key), setting.key)))
}

/// The table of keys whose name is most like `table`, unless none is.
pub(super) fn nearest_table(table: &str) -> Option<&'static str> {
    if table.len() > 200 {
        return None;
    }
    let tables = registry().filter_map(|setting| setting.key.rsplit_once('.')).map(|(table, _)| table);
    nearest(tables.map(|known| (strsim::normalized_damerau_levenshtein(table, known), known)))
}

/// Of names with how alike they are the first of the best, if it is good enough.
fn nearest(scored: impl Iterator<Item = (f64, &'static str)>) -> Option<&'static str> {
    scored
        // Of two that are equally near, the shorter one: that of the design.
        .min_by(|(a, one), (b, other)| b.total_cmp(a).then(one.len().cmp(&other.len())))
        .filter(|(score, _)| *score >= 0.5)
        .map(|(_, known)| known)
}
