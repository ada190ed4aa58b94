//! Why a scene is refused, each reason as one line that names the key, the value and the bounds.

use std::io;
use std::path::PathBuf;

use controller::response_map::MapError;
use motor_model::OutOfBounds;

use super::faults::FaultWordError;
use super::schedule::ScheduleError;
use super::{Scene, registry};
use crate::math::plain_number::plain;

/// Why a scene, or a setting of it, was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// No setting has this key.
    #[error("unknown key {key}")]
    UnknownKey {
        /// The key as given.
        key: String,
        /// The key that looks most like it.
        nearest: Option<&'static str>,
    },
    /// A table of a scene file that holds no key.
    #[error("unknown table {table}")]
    UnknownTable {
        /// The table as given.
        table: String,
        /// The table that looks most like it.
        nearest: Option<&'static str>,
    },
    /// A value given to a table of keys.
    #[error("{table} is a table of keys")]
    IsTable {
        /// The table.
        table: String,
    },
    /// A number in quotes.
    #[error("{key} = \"{value}\" is a word")]
    Quoted {
        /// Key of the setting.
        key: &'static str,
        /// The value as given.
        value: String,
    },
    /// A value of a scene file that is of another type than its key's.
    #[error("{key} is {found}; it takes {wanted}")]
    WrongType {
        /// Key of the setting.
        key: &'static str,
        /// What the value is.
        found: String,
        /// What the key takes.
        wanted: &'static str,
    },
    /// A value outside the bounds of its key.
    #[error("{key} = {value} is outside its bounds {bounds}{}{unit}", if unit.is_empty() { "" } else { " " })]
    OutOfBounds {
        /// Key of the setting.
        key: String,
        /// The value as given.
        value: String,
        /// Smallest and largest value allowed.
        bounds: String,
        /// Unit of value and bounds; empty for a pure number.
        unit: &'static str,
    },
    /// A value that the scene does not set, outside its bounds: value or bounds follow from keys that it sets.
    #[error("{refused}")]
    Follows {
        /// The refusal of the value.
        refused: Box<SceneError>,
        /// What the value is, and the keys that are set, each with its value.
        from: String,
    },
    /// A value that should be a number and is not.
    #[error("{key} = {value} is not a {wanted}, bounds {bounds}{}{unit}", if unit.is_empty() { "" } else { " " })]
    NotANumber {
        /// Key of the setting.
        key: String,
        /// The value as given.
        value: String,
        /// "number" or "whole number".
        wanted: &'static str,
        /// Smallest and largest value allowed.
        bounds: String,
        /// Unit of the bounds; empty for a pure number.
        unit: &'static str,
    },
    /// A word that means no fault.
    #[error(transparent)]
    Fault(#[from] FaultWordError),
    /// A text that is no schedule of drives.
    #[error(transparent)]
    Schedule(#[from] ScheduleError),
    /// A value that is none of the words its key accepts.
    #[error("{key} = {value} is none of {}", of.join(", "))]
    NotAChoice {
        /// Key of the setting.
        key: String,
        /// The value as given.
        value: String,
        /// The words accepted.
        of: &'static [&'static str],
    },
    /// `--set` without a key and a value.
    #[error("--set {text} is not of the form key=value")]
    NotAnAssignment {
        /// The argument as given.
        text: String,
    },
    /// Two settings that do not go together.
    #[error("{conflict}")]
    Conflict {
        /// Both settings, their values and why they clash.
        conflict: String,
        /// Values that would work.
        hint: String,
    },
    /// A response map made for another motor than the scene's design.
    #[error("the response map is for {key} = {}, the design has {}", plain(*of_map), plain(*of_scene))]
    OtherDesign {
        /// Key of the parameter.
        key: &'static str,
        /// Its value in the design of the map.
        of_map: f64,
        /// Its value in the scene's design.
        of_scene: f64,
    },
    /// A response map that breaks a rule.
    #[error("{}:{line}: {source}", path.display())]
    ResponseMap {
        /// The map's file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        source: MapError,
    },
    /// A design whose motors no drive turns as a map needs.
    #[error("no response map can be made for this design: {source}")]
    NoResponseMap {
        /// What is wrong.
        source: MapError,
    },
    /// A key that the command with the scene would ignore or overwrite.
    #[error("{refusal}")]
    NotRead {
        /// The command, the key and why it is refused.
        refusal: String,
        /// The commands that read it.
        hint: String,
    },
    /// A file that cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A name that is neither that of a file nor of the gallery.
    #[error("there is no file {name}, and no scene of that name in the gallery")]
    NoSuchScene {
        /// The name as given.
        name: String,
        /// The scene of the gallery whose name looks most like it.
        nearest: Option<&'static str>,
    },
    /// A name that is neither that of a file nor of a commissioned motor's map.
    #[error("there is no file {name}, and no map of that name")]
    NoSuchMap {
        /// The name as given.
        name: String,
        /// The maps that there are by name.
        known: Vec<&'static str>,
    },
    /// A scene file that is not TOML, or holds something that is no setting.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong there.
        message: String,
    },
    /// A setting refused, and where in the scene file it stands.
    #[error("{}:{line}:{column}: {source}", path.display())]
    InFile {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// Why it was refused.
        source: Box<SceneError>,
    },
}

impl SceneError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::UnknownKey { nearest: Some(nearest), .. }
            | Self::UnknownTable { nearest: Some(nearest), .. }
            | Self::NoSuchScene { nearest: Some(nearest), .. } => Some(format!("did you mean {nearest}?")),
            Self::UnknownKey { nearest: None, .. } | Self::UnknownTable { nearest: None, .. } => {
                Some("`host-sim keys` lists every key".to_owned())
            }
            Self::NoSuchScene { nearest: None, .. } => Some("`host-sim scenes` lists the gallery".to_owned()),
            Self::NoSuchMap { known, .. } => {
                Some(format!("by name: {}; `host-sim commission` makes that of another motor", known.join(", ")))
            }
            Self::IsTable { table } => Some(keys_of(table)),
            Self::Quoted { value, .. } if value.parse::<f64>().is_ok() => {
                Some(format!("a number has no quotes: {value}"))
            }
            Self::NotAnAssignment { .. } => Some("for example --set motor.stator_mass_kg=9.7e-6".to_owned()),
            Self::Conflict { hint, .. } | Self::NotRead { hint, .. } => Some(hint.clone()),
            Self::OtherDesign { .. } => Some(
                "`host-sim response-map --out map.toml` with the same scene makes one, `--map map.toml` takes it; \
                 what the true motor has beside its design are keys `plant.motor.`"
                    .to_owned(),
            ),
            Self::Follows { from, .. } => Some(from.clone()),
            Self::Fault(error) => Some(format!("possible: {}", error.possible)),
            Self::Schedule(error) => Some(format!("possible: {}", error.possible)),
            Self::InFile { source, .. } => source.hint(),
            _ => None,
        }
    }

    /// The whole report, on one line.
    pub fn one_line(&self) -> String {
        one_line(self, self.hint())
    }

    /// The same of `scene`, with the keys that it sets of those that `is_cause` names, where the refused value is of
    /// another key: nobody has set that value. `what` says what it is, in a sentence.
    #[must_use]
    pub(crate) fn following(self, scene: &Scene, what: &str, is_cause: impl Fn(&str) -> bool) -> Self {
        let Self::OutOfBounds { key, .. } = &self else { return self };
        let causes = scene.keys_set().filter(|set| *set != key && is_cause(set));
        let causes: Vec<String> = causes.map(|key| format!("{key} = {}", scene.value_json(key))).collect();
        if causes.is_empty() {
            return self;
        }
        let from = format!("{what}; it or its bounds follow from {}", causes.join(" and "));
        Self::Follows { refused: Box::new(self), from }
    }

    /// The same of a parameter of the motor, where it follows from other keys of its table.
    #[must_use]
    pub(crate) fn following_in_motor(self, scene: &Scene, what: &str) -> Self {
        let Self::OutOfBounds { key, .. } = &self else { return self };
        let Some(table) = key.rsplit_once('.').map(|(table, _)| table.to_owned()) else { return self };
        let is_cause = |set: &str| {
            let of_design = set.strip_prefix("plant.").unwrap_or(set);
            let of_design = of_design.strip_prefix("tolerance.").unwrap_or(of_design);
            of_design.strip_prefix(&table).is_some_and(|rest| rest.starts_with('.'))
        };
        self.following(scene, what, is_cause)
    }
}

/// The keys of a table, the first few of many.
fn keys_of(table: &str) -> String {
    let inner = format!("{table}.");
    let keys: Vec<_> = registry().map(|setting| setting.key).filter(|key| key.starts_with(&inner)).collect();
    let some: Vec<_> = keys.iter().take(5).copied().collect();
    let more = if keys.len() > some.len() { ", ..." } else { "" };
    format!("its keys are {}{more}", some.join(", "))
}

/// An error and its hint on one line.
pub fn one_line(error: &impl std::fmt::Display, hint: Option<String>) -> String {
    let text = match hint {
        Some(hint) => format!("error: {error}; hint: {hint}"),
        None => format!("error: {error}"),
    };
    // Values come from the user and may hold line breaks or terminal codes.
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

impl From<OutOfBounds> for SceneError {
    fn from(OutOfBounds { key, value, min, max, unit }: OutOfBounds) -> Self {
        let bounds = format!("{} to {}", plain(min), plain(max));
        Self::OutOfBounds { key: key.to_owned(), value: plain(value), bounds, unit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_one_line_even_for_values_with_line_breaks() {
        let error =
            SceneError::UnknownKey { key: "a\nb\u{1b}[31m".to_owned(), nearest: Some("motor.friction") };
        assert_eq!(error.one_line(), "error: unknown key a b [31m; hint: did you mean motor.friction?");
    }

    #[test]
    fn exact_out_of_bounds_names_key_value_bounds_and_unit() {
        let refused = OutOfBounds { key: "step_s", value: f64::NAN, min: 1e-9, max: 1e-3, unit: "s" };
        let error = SceneError::from(refused);
        assert_eq!(error.to_string(), "step_s = NaN is outside its bounds 1e-9 to 0.001 s");
    }
}
