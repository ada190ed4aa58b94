//! A scene: every setting of a run by its key, each value checked when it is set.
//!
//! Later sources win: defaults, then a TOML file (nested tables, `[motor.mode_b] frequency_hz = 6300`), then
//! `--set key=value`, then the command's own flags. There is one [`registry`] of keys: the tables of
//! [`keys`], and the motor's, which come from the model's parameters.

mod error;
mod file;
pub mod keys;

pub use error::{SceneError, one_line};

use std::collections::BTreeMap;
use std::path::Path;

use motor_model::{MotorParams, OutOfBounds, Parameter};

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
}

/// Settings that belong to every command.
pub const SETTINGS: &[Setting] = &[Setting {
    key: "seed",
    unit: "",
    kind: Kind::Integer { default: 1, min: 0, max: u64::MAX },
    meaning: "names the random numbers of a run: same seed, same run",
}];

/// Every table of keys besides the motor's: a new table adds its line here.
const TABLES: &[&[Setting]] = &[
    SETTINGS,
    keys::simulate::SETTINGS,
    keys::plant::SETTINGS,
    keys::camera::SETTINGS,
    keys::vibrometer::SETTINGS,
    keys::gyroscope::SETTINGS,
    keys::faults::SETTINGS,
    keys::estimator::SETTINGS,
    keys::position::SETTINGS,
    keys::rate::SETTINGS,
    keys::calibrate::SETTINGS,
];

/// Every key there is: the motor's parameters in the order of Table 1, then the tables of the modules.
pub fn registry() -> impl Iterator<Item = Setting> {
    let motor = Parameter::ALL.into_iter().map(|parameter| {
        let spec = parameter.spec();
        let kind = Kind::Number { default: spec.nominal, min: spec.min, max: spec.max };
        Setting { key: spec.key, unit: spec.unit, kind, meaning: spec.meaning }
    });
    motor.chain(TABLES.iter().flat_map(|table| table.iter().copied()))
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Value {
    Number(f64),
    Integer(u64),
    Choice(&'static str),
}

/// A checked set of settings; what was not set has its default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    set: BTreeMap<&'static str, Value>,
}

impl Scene {
    /// A scene from an optional TOML file and `key=value` assignments, in this order.
    ///
    /// # Errors
    /// When the file cannot be read or is malformed, or a key or value is refused.
    pub fn load(file: Option<&Path>, sets: &[String]) -> Result<Self, SceneError> {
        let mut scene = Self::default();
        if let Some(path) = file {
            file::read_into(&mut scene, path)?;
        }
        for text in sets {
            let (key, value) =
                text.split_once('=').ok_or_else(|| SceneError::NotAnAssignment { text: text.clone() })?;
            scene.set(key.trim(), value.trim())?;
        }
        Ok(scene)
    }

    /// Sets everything that `toml`, the text of the scene file at `path`, sets.
    ///
    /// # Errors
    /// When it is malformed, or a key or value is refused; what stands before the place named is then set.
    pub fn set_all(&mut self, toml: &str, path: &Path) -> Result<(), SceneError> {
        file::parse_into(self, toml, path)
    }

    /// Sets one key from text.
    ///
    /// # Errors
    /// When there is no such key, or its value is malformed or out of bounds. The scene is then as it was.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SceneError> {
        let setting = registry()
            .find(|setting| setting.key == key)
            .ok_or_else(|| SceneError::UnknownKey { key: key.to_owned(), nearest: nearest_key(key) })?;
        self.set.insert(setting.key, setting.parse(value)?);
        Ok(())
    }

    fn value(&self, key: &'static str) -> Value {
        let default = || {
            let setting = registry().find(|setting| setting.key == key);
            match setting.unwrap_or_else(|| panic!("{key} is in no table of settings")).kind {
                Kind::Number { default, .. } => Value::Number(default),
                Kind::Integer { default, .. } => Value::Integer(default),
                Kind::Choice { default, .. } => Value::Choice(default),
            }
        };
        self.set.get(key).copied().unwrap_or_else(default)
    }

    /// The value of a number.
    ///
    /// # Panics
    /// When `key` names no number: a slip in the program, never in a scene.
    pub fn number(&self, key: &'static str) -> f64 {
        match self.value(key) {
            Value::Number(number) => number,
            other => panic!("{key} is {other:?}, not a number"),
        }
    }

    /// The value of a whole number.
    ///
    /// # Panics
    /// When `key` names no whole number: a slip in the program, never in a scene.
    pub fn integer(&self, key: &'static str) -> u64 {
        match self.value(key) {
            Value::Integer(integer) => integer,
            other => panic!("{key} is {other:?}, not a whole number"),
        }
    }

    /// The word chosen.
    ///
    /// # Panics
    /// When `key` names no choice: a slip in the program, never in a scene.
    pub fn choice(&self, key: &'static str) -> &'static str {
        match self.value(key) {
            Value::Choice(choice) => choice,
            other => panic!("{key} is {other:?}, not a choice"),
        }
    }

    /// The seed of the run.
    pub fn seed(&self) -> u64 {
        self.integer("seed")
    }

    /// The motor's parameters that were set, in the order of Table 1.
    pub fn motor_overrides(&self) -> impl Iterator<Item = (Parameter, f64)> {
        Parameter::ALL.into_iter().filter_map(|parameter| match self.set.get(parameter.spec().key) {
            Some(Value::Number(number)) => Some((parameter, *number)),
            _ => None,
        })
    }

    /// The nominal motor, with what was set.
    pub fn motor_params(&self) -> MotorParams {
        self.motor_overrides().fold(MotorParams::nominal(), |params, (parameter, value)| {
            // Cannot fail: the registry's bounds are the parameter's.
            params.with(parameter, value).unwrap_or(params)
        })
    }
}

impl Setting {
    /// The whole number that `text` means, for a flag that is no key of scenes.
    ///
    /// # Errors
    /// When it is malformed or out of bounds.
    ///
    /// # Panics
    /// When the setting takes no whole number: a slip in the program.
    pub fn integer(&self, text: &str) -> Result<u64, SceneError> {
        match self.parse(text)? {
            Value::Integer(integer) => Ok(integer),
            other => panic!("{} is {other:?}, not a whole number", self.key),
        }
    }

    /// The value that `text` means, if the setting takes it.
    fn parse(&self, text: &str) -> Result<Value, SceneError> {
        let not_a = |wanted, bounds| SceneError::NotANumber {
            key: self.key.to_owned(),
            value: text.to_owned(),
            wanted,
            bounds,
            unit: self.unit,
        };
        match self.kind {
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
        }
    }
}

/// The registered key most like `key`, unless none is.
///
/// A key without its first table counts as well: `stator_mass_kg` is near `motor.stator_mass_kg`.
fn nearest_key(key: &str) -> Option<&'static str> {
    // Beyond any key's length there is nothing to compare, only time to lose.
    if key.len() > 200 {
        return None;
    }
    let alike = |known: &str| {
        let short = known.split_once('.').map_or(known, |(_, rest)| rest);
        let score = |text| strsim::normalized_damerau_levenshtein(key, text);
        score(known).max(score(short))
    };
    registry()
        .map(|setting| (alike(setting.key), setting.key))
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .filter(|(score, _)| *score >= 0.5)
        .map(|(_, known)| known)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::io::Write as _;

    fn scene_file(text: &str) -> tempfile::NamedTempFile {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file
    }

    fn refused(sets: &[&str]) -> String {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        Scene::load(None, &sets).unwrap_err().one_line()
    }

    #[test]
    fn exact_keys_are_unique() {
        let mut keys: Vec<_> = registry().map(|setting| setting.key).collect();
        let count = keys.len();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), count);
    }

    #[test]
    fn exact_defaults_are_values_that_could_be_set() {
        for setting in registry() {
            let text = match setting.kind {
                Kind::Number { default, .. } => default.to_string(),
                Kind::Integer { default, .. } => default.to_string(),
                Kind::Choice { default, .. } => default.to_owned(),
            };
            assert!(setting.parse(&text).is_ok(), "{} = {text}", setting.key);
        }
    }

    #[test]
    fn exact_later_sources_win() {
        let file = scene_file(
            "seed = 9\n[motor]\nfriction = 0.5\nrestitution = 0.61\n[motor.mode_b]\nfrequency_hz = 6301\n",
        );
        let mut scene = Scene::load(Some(file.path()), &["motor.friction=0.25".to_owned()]).unwrap();
        let params = scene.motor_params();
        let got =
            [Parameter::Friction, Parameter::Restitution, Parameter::ModeBFrequency, Parameter::RotorMass];
        for (parameter, value) in got.into_iter().zip([0.25, 0.61, 6301.0, 46e-6]) {
            assert!((params.get(parameter) - value).abs() <= 0.0, "{parameter:?}");
        }
        assert_eq!(scene.motor_overrides().count(), 3);
        assert_eq!(scene.seed(), 9);
        scene.set("seed", "18446744073709551615").unwrap();
        assert_eq!(scene.seed(), u64::MAX);
    }

    #[test]
    fn exact_refusals_name_key_value_bounds_and_the_nearest_key() {
        assert_eq!(
            refused(&["motor.stator_mas_kg=1"]),
            "error: unknown key motor.stator_mas_kg; hint: did you mean motor.stator_mass_kg?"
        );
        assert_eq!(refused(&["stator_mass_kg=1"]), refused(&["stator_mass_kg=2"]));
        assert!(refused(&["stator_mass_kg=1"]).ends_with("did you mean motor.stator_mass_kg?"));
        assert!(refused(&["xyzzy=1"]).ends_with("`host-sim keys` lists every key"));
        assert_eq!(
            refused(&["motor.restitution=1.5"]),
            "error: motor.restitution = 1.5 is outside its bounds 0 to 1"
        );
        assert_eq!(
            refused(&["motor.stator_mass_kg=nan"]),
            "error: motor.stator_mass_kg = nan is not a number, bounds 1e-9 to 1 kg"
        );
        assert!(
            refused(&["seed=-1"])
                .starts_with("error: seed = -1 is outside its bounds 0 to 18446744073709551615")
        );
        assert!(refused(&["seed=1.5"]).starts_with("error: seed = 1.5 is not a whole number"));
        assert!(
            refused(&["motor.friction"])
                .starts_with("error: --set motor.friction is not of the form key=value")
        );
        assert_eq!(refused(&["simulate.drive=a"]), "error: simulate.drive = a is none of b, c, off");
    }

    #[test]
    fn exact_a_refused_value_leaves_the_scene_as_it_was() {
        let mut scene = Scene::default();
        scene.set("motor.friction", "0.3").unwrap();
        let before = scene.clone();
        assert!(scene.set("motor.friction", "-1").is_err());
        assert_eq!(scene, before);
    }

    proptest! {
        /// Whatever the text, a scene takes it whole or refuses it, and what it takes is finite and within bounds.
        #[test]
        fn law_accepted_values_are_finite_and_within_bounds(
            index in 0..registry().count(),
            value in prop_oneof![any::<f64>().prop_map(|x| x.to_string()), any::<i64>().prop_map(|x| x.to_string()), ".*"],
        ) {
            let setting = registry().nth(index).unwrap();
            let mut scene = Scene::default();
            if scene.set(setting.key, &value).is_ok() {
                match setting.kind {
                    Kind::Number { min, max, .. } => {
                        let number = scene.number(setting.key);
                        prop_assert!(number.is_finite() && number >= min && number <= max);
                    }
                    Kind::Integer { min, max, .. } => prop_assert!((min..=max).contains(&scene.integer(setting.key))),
                    Kind::Choice { of, .. } => prop_assert!(of.contains(&scene.choice(setting.key))),
                }
            } else {
                prop_assert_eq!(scene, Scene::default());
            }
        }

        #[test]
        fn law_every_number_within_bounds_is_accepted(index in 0..registry().count(), part in 0.0..=1.0_f64) {
            let setting = registry().nth(index).unwrap();
            if let Kind::Number { min, max, .. } = setting.kind {
                let number: f64 = f64::min(min + part * (max - min), max);
                let mut scene = Scene::default();
                scene.set(setting.key, &number.to_string()).unwrap();
                prop_assert!((scene.number(setting.key) - number).abs() <= 0.0);
            }
        }

        /// No text makes the reader panic, and every error is a single line.
        #[test]
        fn law_any_text_gives_a_scene_or_one_line(text in "\\PC*|(\\[?[a-z_.]{0,12}\\]? ?=? ?[0-9a-z\".'\\[{-]{0,6}\n){0,4}", set in ".*") {
            let file = scene_file(&text);
            if let Err(error) = Scene::load(Some(file.path()), &[]) {
                prop_assert_eq!(error.one_line().lines().count(), 1);
            }
            if let Err(error) = Scene::load(None, &[set]) {
                prop_assert_eq!(error.one_line().lines().count(), 1);
            }
        }
    }
}
