//! A scene: the settings of a run by their keys, as the command takes them.

use std::path::{Path, PathBuf};

use analysis::response_map;
use host_sim::cli::in_process;
use host_sim::scene_files::{self, GALLERY, read_response_map};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString};
use serde_json::Value;
use simulation::scene::{Origin, Scene, SceneError, Setting, registry};

use crate::errors::Error;
use crate::interruption::{Watch, interruptible};

/// The settings of a run by their keys, as the command takes them: a mapping that has every key.
///
/// `scene["position.to_deg"] = 37` sets one; what is not set has its default. A value is a number, a word, `True` or
/// `False` for yes and no, or a list of words.
///
/// Args:
///     sets: Keys and values.
///
/// Raises:
///     `SceneError`: There is no such key, or its value is refused.
#[pyclass(name = "Scene", module = "micromotor", eq, mapping)]
#[derive(Clone, Debug, PartialEq)]
pub struct PyScene(pub Scene);

impl PyScene {
    /// The scene for `command`.
    ///
    /// # Errors
    /// When it sets a key that the command does not read.
    pub fn of(&self, command: &str) -> Result<Scene, Error> {
        in_process::refuse_unread_keys(command, &self.0)?;
        Ok(self.0.clone())
    }

    fn set_all(&mut self, sets: &Bound<'_, PyDict>) -> Result<(), Error> {
        for (key, value) in sets {
            self.__setitem__(&key.extract::<String>()?, &value)?;
        }
        Ok(())
    }
}

/// `scene` with a response map of its design: the one that it has, that of Table 1, or one that is made.
///
/// # Errors
/// When no map can be made.
pub fn with_map(scene: Scene, watch: &Watch) -> Result<Scene, Error> {
    if response_map::is_table_1(&scene) || scene.response_map().is_ok() {
        return Ok(scene);
    }
    let map = response_map::of_design(&scene, &|_| watch.check(), |_| ())?;
    Ok(scene.with_response_map(map))
}

/// The setting of a key.
fn setting(key: &str) -> Result<Setting, Error> {
    registry().find(|setting| setting.key == key).ok_or_else(|| PyKeyError::new_err(key.to_owned()).into())
}

/// A value as the text of an assignment: `--set key=text`.
fn text_of(value: &Bound<'_, PyAny>) -> Result<String, Error> {
    if let Ok(yes) = value.cast::<PyBool>() {
        return Ok(if yes.is_true() { "yes" } else { "no" }.to_owned());
    }
    if value.is_instance_of::<PyString>() {
        return Ok(value.extract()?);
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.str()?.extract()?);
    }
    if let Ok(words) = value.cast::<PyList>() {
        let words: Vec<String> = words.extract()?;
        return Ok(words.join(","));
    }
    // Whole numbers of numpy are no `int`.
    if let Ok(index) = value.call_method0("__index__") {
        return Ok(index.str()?.extract()?);
    }
    let number: f64 = value.extract().map_err(|_| {
        PyTypeError::new_err("a value is a number, a word, True or False, or a list of words")
    })?;
    Ok(number.to_string())
}

/// A value of JSON as one of Python.
fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Number(number) if number.is_f64() => {
            PyFloat::new(py, number.as_f64().unwrap_or(f64::NAN)).into_any()
        }
        Value::Number(number) => number.as_u64().into_pyobject(py)?.into_any(),
        Value::String(word) => PyString::new(py, word).into_any(),
        Value::Array(words) => {
            PyList::new(py, words.iter().filter_map(Value::as_str).collect::<Vec<_>>())?.into_any()
        }
        _ => py.None().into_bound(py),
    })
}

#[pymethods]
#[expect(clippy::unused_self, reason = "every scene has every key")]
impl PyScene {
    #[new]
    #[pyo3(signature = (sets=None, /))]
    fn new(sets: Option<&Bound<'_, PyDict>>) -> Result<Self, Error> {
        let mut scene = Self(Scene::default());
        sets.map_or(Ok(()), |sets| scene.set_all(sets))?;
        Ok(scene)
    }

    /// The scene of a TOML file, or of the gallery by its name, with `sets` over it.
    #[staticmethod]
    #[pyo3(signature = (path, sets=None))]
    fn load(path: PathBuf, sets: Option<&Bound<'_, PyDict>>) -> Result<Self, Error> {
        let mut scene = Self(scene_files::load(Some(&path), &[])?);
        sets.map_or(Ok(()), |sets| scene.set_all(sets))?;
        Ok(scene)
    }

    /// The scene of the text of a TOML file; `name` is for messages.
    #[staticmethod]
    #[pyo3(signature = (text, name="scene.toml"))]
    fn from_toml(text: &str, name: &str) -> Result<Self, Error> {
        let mut scene = Scene::default();
        scene.set_all(text, Path::new(name))?;
        Ok(Self(scene))
    }

    /// The scenes that are part of the program, each with what to look at.
    #[staticmethod]
    fn gallery(py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let gallery = PyDict::new(py);
        GALLERY.iter().try_for_each(|scene| gallery.set_item(scene.name, scene.look_at()))?;
        Ok(gallery)
    }

    /// What a key is: its key, meaning, unit, bounds and default.
    #[staticmethod]
    fn describe<'py>(py: Python<'py>, key: &str) -> Result<Bound<'py, PyDict>, Error> {
        let setting = setting(key)?;
        let described = PyDict::new(py);
        described.set_item("key", setting.key)?;
        described.set_item("meaning", setting.meaning)?;
        described.set_item("unit", setting.unit)?;
        described.set_item("bounds", setting.kind.resolved().bounds_text())?;
        described.set_item("default", to_python(py, &Scene::default().value_json(setting.key))?)?;
        Ok(described)
    }

    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> Result<Bound<'py, PyAny>, Error> {
        Ok(to_python(py, &self.0.value_json(setting(key)?.key))?)
    }

    fn __setitem__(&mut self, key: &str, value: &Bound<'_, PyAny>) -> Result<(), Error> {
        Ok(self.0.assign(key, &text_of(value)?, &|_| Ok(()), Origin::Program)?)
    }

    fn __contains__(&self, key: &str) -> bool {
        registry().any(|setting| setting.key == key)
    }

    fn __len__(&self) -> usize {
        registry().count()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(PyList::new(py, Self::keys())?.try_iter()?.into_any())
    }

    /// Every key that there is.
    #[staticmethod]
    fn keys() -> Vec<&'static str> {
        registry().map(|setting| setting.key).collect()
    }

    /// The keys that were set, in alphabetical order.
    fn keys_set(&self) -> Vec<&'static str> {
        self.0.keys_set().collect()
    }

    /// Where the value of a key comes from.
    fn origin(&self, key: &str) -> Result<String, Error> {
        Ok(self.0.origin(setting(key)?.key).to_string())
    }

    /// The scene as a scene file: what was set, or with `only_set=False` every key.
    #[pyo3(signature = (*, only_set=true))]
    fn toml(&self, only_set: bool) -> String {
        self.0.text(&|_| true, only_set)
    }

    /// Add a fault by its word, for example `camera:lost@1.0..2.0`.
    fn add_fault(&mut self, word: &str) -> Result<(), Error> {
        Ok(self.0.add_fault(word, &|_| Ok(()), Origin::Program)?)
    }

    /// The same scene, to change.
    fn copy(&self) -> Self {
        self.clone()
    }

    fn __copy__(&self) -> Self {
        self.clone()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.clone()
    }

    /// The same scene with the response map by which its motor is driven: that of a file or, by its name, of a
    /// commissioned motor of the gallery (`set_f_plant`), or one that is made for its design.
    ///
    /// A run makes the map of a design other than Table 1's by itself, in seconds: make it once for many runs.
    #[pyo3(signature = (path=None))]
    fn with_response_map(&self, py: Python<'_>, path: Option<PathBuf>) -> Result<Self, Error> {
        let scene = self.0.clone();
        let Some(path) = path else {
            return interruptible(py, None, |watch| with_map(scene, watch).map(Self));
        };
        let scene = scene.with_response_map(read_response_map(&path)?);
        scene.response_map()?;
        Ok(Self(scene))
    }

    fn __repr__(&self) -> String {
        let set: Vec<String> =
            self.0.keys_set().map(|key| format!("'{key}': {}", self.0.value_text(key))).collect();
        format!("Scene({{{}}})", set.join(", "))
    }

    /// For `pickle`; a response map of one's own is not kept.
    fn __reduce__(&self, py: Python<'_>) -> PyResult<(Py<PyAny>, (String,))> {
        let load = py.get_type::<Self>().getattr("from_toml")?.unbind();
        Ok((load, (self.toml(true),)))
    }
}

/// Refuses a word that is not one of several.
///
/// # Errors
/// Then.
pub fn check_word(key: &'static str, value: &str, of: &'static [&'static str]) -> Result<(), SceneError> {
    if of.contains(&value) {
        return Ok(());
    }
    Err(SceneError::NotAChoice { key: key.to_owned(), value: value.to_owned(), of })
}
