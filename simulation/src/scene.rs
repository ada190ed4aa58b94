//! A scene: every setting of a run by its key, each value checked when it is set.
//!
//! Later sources win: defaults, then a TOML file (nested tables, `[motor.mode_b] frequency_hz = 6300`), then
//! `--set key=value`, then the command's own flags. There is one [`registry`] of keys: the motor's, which come from the
//! model's parameters, and the tables of [`keys`]. A scene knows where each of its values comes from: [`Origin`].

mod description;
mod error;
pub mod faults;
pub mod keys;
mod origin;
#[cfg(any(test, feature = "reads"))]
pub mod reads;
mod response_map_file;
mod rotor_model;
pub mod schedule;
mod setting;
mod text;
mod toml_text;

pub use error::{SceneError, one_line};
pub use origin::Origin;
pub use response_map_file::{parse_response_map, response_map_text};
pub use rotor_model::RotorModel;
pub use setting::{Kind, Setting, registry};
pub use text::{Keys, template};

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use controller::ResponseMap;
use motor_model::{MotorParams, OutOfBounds, Parameter, TiltingParameter, TiltingParams};

use faults::Fault;
use origin::Origins;
use schedule::Schedule;
use setting::{Value, nearest_key, of_design, plant_key, tilting_plant_key, tolerance_key};

/// Whether a command takes a key: an error says why not.
pub type Admission<'a> = &'a dyn Fn(&'static str) -> Result<(), SceneError>;

/// A checked set of settings; what was not set has its default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scene {
    set: BTreeMap<&'static str, Value>,
    origins: Origins,
    response_map: Option<Arc<ResponseMap>>,
    #[cfg(any(test, feature = "reads"))]
    reads: reads::Reads,
}

impl Scene {
    /// A scene of `key=value` assignments, in this order.
    ///
    /// # Errors
    /// When a text is no assignment, or a key or value is refused.
    pub fn of_sets(sets: &[String]) -> Result<Self, SceneError> {
        let mut scene = Self::default();
        scene.assign_all(sets, &|_| Ok(()))?;
        Ok(scene)
    }

    /// Sets what each `key=value` of `sets` says, in this order, refusing every key that `admit` refuses.
    ///
    /// # Errors
    /// When a text is no assignment, or a key or value is refused; the assignments before it are then set.
    pub fn assign_all(&mut self, sets: &[String], admit: Admission) -> Result<(), SceneError> {
        for text in sets {
            let (key, value) =
                text.split_once('=').ok_or_else(|| SceneError::NotAnAssignment { text: text.clone() })?;
            self.assign(key.trim(), value.trim(), admit, Origin::Set)?;
        }
        Ok(())
    }

    /// Sets everything that `toml`, the text of the scene file at `path`, sets.
    ///
    /// # Errors
    /// When it is malformed, or a key or value is refused; what stands before the place named is then set.
    pub fn set_all(&mut self, toml: &str, path: &Path) -> Result<(), SceneError> {
        self.set_admitted(toml, path, &|_| Ok(()))
    }

    /// The same, refusing every key that `admit` refuses.
    ///
    /// # Errors
    /// When it is malformed, or a key or value is refused; what stands before the place named is then set.
    pub fn set_admitted(&mut self, toml: &str, path: &Path, admit: Admission) -> Result<(), SceneError> {
        toml_text::parse_into(self, toml, path, admit)
    }

    /// Takes back what was set of `key`: its value is the default.
    pub fn unset(&mut self, key: &'static str) {
        self.set.remove(key);
        self.origins.0.remove(key);
    }

    /// The same scene with a true motor drawn around the design: no parameter of its own.
    #[must_use]
    pub fn without_plant_overrides(&self) -> Self {
        let mut scene = self.clone();
        let of_tilting = TiltingParameter::ALL.map(tilting_plant_key);
        let keys = Parameter::ALL.map(plant_key).into_iter().chain(of_tilting).chain(["plant.stator"]);
        for key in keys {
            #[cfg(any(test, feature = "reads"))]
            scene.reads.overwrite(key);
            scene.unset(key);
        }
        scene
    }

    /// The response map by which the scene's motor is driven: the one that was given ([`Self::with_response_map`]), or
    /// that of Table 1.
    ///
    /// # Errors
    /// When the map is that of another design.
    pub fn response_map(&self) -> Result<Arc<ResponseMap>, SceneError> {
        let design = self.motor_params();
        let map = self.response_map.as_deref().unwrap_or(ResponseMap::table_1());
        for parameter in Parameter::ALL {
            let (of_map, of_scene) = (map.design().get(parameter), design.get(parameter));
            if of_map.to_bits() != of_scene.to_bits() {
                return Err(SceneError::OtherDesign { key: parameter.spec().key, of_map, of_scene });
            }
        }
        Ok(self.response_map.clone().unwrap_or_else(|| Arc::new(*ResponseMap::table_1())))
    }

    /// The same scene with a response map.
    #[must_use]
    pub fn with_response_map(mut self, map: ResponseMap) -> Self {
        self.response_map = Some(Arc::new(map));
        self
    }

    /// Sets one key from text.
    ///
    /// # Errors
    /// When there is no such key, or its value is malformed or out of bounds. The scene is then as it was.
    pub fn set(&mut self, key: &str, value: &str) -> Result<(), SceneError> {
        self.assign(key, value, &|_| Ok(()), Origin::Program)
    }

    /// The same, if `admit` takes the key; `origin` is where the value comes from.
    ///
    /// # Errors
    /// When there is no such key, `admit` refuses it, or its value is malformed or out of bounds. The scene is then as
    /// it was.
    pub fn assign(
        &mut self,
        key: &str,
        value: &str,
        admit: Admission,
        origin: Origin,
    ) -> Result<(), SceneError> {
        let setting = registry()
            .find(|setting| setting.key == key)
            .ok_or_else(|| SceneError::UnknownKey { key: key.to_owned(), nearest: nearest_key(key) })?;
        admit(setting.key)?;
        let value = setting.parse(value)?;
        self.put(setting.key, value, origin);
        Ok(())
    }

    fn put(&mut self, key: &'static str, value: Value, origin: Origin) {
        #[cfg(any(test, feature = "reads"))]
        self.reads.overwrite(key);
        self.set.insert(key, value);
        self.origins.0.insert(key, origin);
    }

    /// Where the value of a key comes from.
    ///
    /// # Panics
    /// When there is no such key: a slip in the program.
    pub fn origin(&self, key: &'static str) -> Origin {
        if self.set.contains_key(key) {
            return self.origins.0.get(key).cloned().unwrap_or_default();
        }
        match (setting::find(key).kind, of_design(key)) {
            (Kind::As { key }, _) => Origin::As { other: key },
            (_, Some(around)) => Origin::Drawn { around },
            _ => Origin::Default,
        }
    }

    /// The keys that were set, in alphabetical order.
    pub fn keys_set(&self) -> impl Iterator<Item = &'static str> {
        self.set.keys().copied()
    }

    fn value(&self, key: &'static str) -> Value {
        #[cfg(any(test, feature = "reads"))]
        self.reads.read(key);
        match self.set.get(key) {
            Some(value) => value.clone(),
            None => setting::find(key).default().unwrap_or_else(|other| self.value(other)),
        }
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

    /// The value of a number of seconds, rounded to the nanosecond.
    ///
    /// # Panics
    /// When `key` names no number: a slip in the program, never in a scene.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "bounded by the setting; a cast saturates"
    )]
    pub fn nanos(&self, key: &'static str) -> u64 {
        (self.number(key) * 1e9).round() as u64
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

    /// The schedule of drives.
    ///
    /// # Panics
    /// When `key` names no schedule: a slip in the program.
    pub fn schedule(&self, key: &'static str) -> Arc<Schedule> {
        match self.value(key) {
            Value::Schedule(schedule) => schedule,
            other => panic!("{key} is {other:?}, not a schedule"),
        }
    }

    /// The faults that words set.
    ///
    /// # Panics
    /// When their key names no list of faults: a slip in the program, never in a scene.
    pub fn fault_words(&self) -> Arc<[Fault]> {
        match self.value(faults::KEY) {
            Value::Faults(faults) => faults,
            other => panic!("{} is {other:?}, not a list of faults", faults::KEY),
        }
    }

    /// Adds a fault by its word, if `admit` takes the key of faults.
    ///
    /// # Errors
    /// When `admit` refuses it, or the word is malformed. The scene is then as it was.
    pub fn add_fault(&mut self, word: &str, admit: Admission, origin: Origin) -> Result<(), SceneError> {
        admit(faults::KEY)?;
        let added: Fault = word.trim().parse()?;
        let faults = self.fault_words().iter().copied().chain([added]).collect();
        self.put(faults::KEY, Value::Faults(faults), origin);
        Ok(())
    }

    /// The seed of the run.
    pub fn seed(&self) -> u64 {
        self.integer("seed")
    }

    /// The seed of what happens by chance in a run: noise, losses, delays. Motor and instruments are those of
    /// [`Self::seed`]. Far apart for neighbours in seed or repetition.
    pub fn noise_seed(&self) -> u64 {
        self.seed().wrapping_add(self.integer("plant.repetition").wrapping_mul(0xD134_2543_DE82_EF95))
    }

    /// The scene of run `number` of a sample: its seed names the first run, the seeds that follow it the others. Beyond
    /// the last seed the first follows.
    ///
    /// # Errors
    /// Never, unless the bounds of the seed are changed.
    pub fn of_run(&self, number: u64) -> Result<Self, SceneError> {
        let mut scene = self.clone();
        scene.set("seed", &self.seed().wrapping_add(number).to_string())?;
        Ok(scene)
    }

    /// The design's parameters that were set, in the order of Table 1.
    pub fn motor_overrides(&self) -> impl Iterator<Item = (Parameter, f64)> {
        self.overrides(|parameter| parameter.spec().key)
    }

    /// The true motor's parameters that were set, in the order of Table 1.
    pub fn plant_overrides(&self) -> impl Iterator<Item = (Parameter, f64)> {
        self.overrides(plant_key)
    }

    fn overrides(&self, key: fn(Parameter) -> &'static str) -> impl Iterator<Item = (Parameter, f64)> {
        Parameter::ALL
            .into_iter()
            .filter_map(move |parameter| Some((parameter, self.override_of(key(parameter))?)))
    }

    /// The number that was set of a key; `None` if it was not.
    fn override_of(&self, key: &'static str) -> Option<f64> {
        #[cfg(any(test, feature = "reads"))]
        self.reads.read(key);
        match self.set.get(key) {
            Some(Value::Number(number)) => Some(*number),
            _ => None,
        }
    }

    /// The design's keys of what was set of the true motor.
    #[cfg(feature = "members")]
    pub(crate) fn keys_of_true_motor(&self) -> impl Iterator<Item = &'static str> {
        let of_motor = self.plant_overrides().map(|(parameter, _)| parameter.spec().key);
        let of_tilting = TiltingParameter::ALL
            .into_iter()
            .filter(|parameter| self.override_of(tilting_plant_key(*parameter)).is_some())
            .map(|parameter| parameter.spec().key);
        of_motor.chain(of_tilting)
    }

    /// The tolerance that the scene sets for the design's parameter with this key; `None` for that of the table.
    ///
    /// # Panics
    /// When there is no such parameter: a slip in the program.
    pub fn tolerance(&self, design_key: &'static str) -> Option<f64> {
        self.override_of(tolerance_key(design_key))
    }

    /// What the design has beside [`Self::motor_params`] if its rotor tilts.
    pub fn tilting_params(&self) -> TiltingParams {
        let nominal = TiltingParams::nominal();
        // Cannot fail: the registry's bounds are the parameter's.
        self.tilting_overrides(nominal, |parameter| parameter.spec().key).unwrap_or(nominal)
    }

    /// The same of a true motor drawn as `drawn`, with what was set of it.
    ///
    /// # Errors
    /// Never, unless the bounds of keys and parameters differ.
    pub fn tilting_plant_params(&self, drawn: TiltingParams) -> Result<TiltingParams, OutOfBounds> {
        self.tilting_overrides(drawn, tilting_plant_key)
    }

    fn tilting_overrides(
        &self,
        params: TiltingParams,
        key: fn(TiltingParameter) -> &'static str,
    ) -> Result<TiltingParams, OutOfBounds> {
        TiltingParameter::ALL.into_iter().try_fold(params, |params, parameter| {
            match self.override_of(key(parameter)) {
                Some(value) => params.with(parameter, value),
                None => Ok(params),
            }
        })
    }

    /// The design of the motor: Table 1, with what was set. Twin, drive frequencies and response map are those of the
    /// design, and motors are drawn around it.
    pub fn motor_params(&self) -> MotorParams {
        self.motor_overrides().fold(MotorParams::nominal(), |params, (parameter, value)| {
            // Cannot fail: the registry's bounds are the parameter's.
            params.with(parameter, value).unwrap_or(params)
        })
    }
}

#[cfg(test)]
mod tests;
