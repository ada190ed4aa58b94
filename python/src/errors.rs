//! Errors of Rust as exceptions of Python. Their classes are those of `micromotor/errors.py`.

use host_sim::CommandError;
use host_sim::log::LogError;
use host_sim::studies::identification::IdentificationError;
use motor_model::OutOfBounds;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyDict;
use simulation::runs::RunError;
use simulation::scene::SceneError;

/// Why a function of the module fails.
#[derive(Debug)]
pub enum Error {
    /// What the command would say.
    Command(Box<CommandError>),
    /// An exception of Python.
    Python(PyErr),
}

impl From<PyErr> for Error {
    fn from(error: PyErr) -> Self {
        Self::Python(error)
    }
}

macro_rules! of_command {
    ($($error:ty),+) => {
        $(impl From<$error> for Error {
            fn from(error: $error) -> Self {
                Self::Command(Box::new(error.into()))
            }
        })+
    };
}

of_command!(CommandError, SceneError, RunError, LogError, IdentificationError, OutOfBounds);

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        match error {
            Error::Python(error) => error,
            Error::Command(error) => {
                Python::attach(|py| raised(py, &error).unwrap_or_else(|failure| failure))
            }
        }
    }
}

/// The exception that says what `error` says.
fn raised(py: Python<'_>, error: &CommandError) -> PyResult<PyErr> {
    static CLASSES: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    let classes = CLASSES
        .get_or_try_init(py, || Ok::<_, PyErr>(py.import("micromotor.errors")?.into_any().unbind()))?;
    let line = error.one_line();
    let message = line.strip_prefix("error: ").unwrap_or(&line);
    let named = PyDict::new(py);
    named.set_item("hint", error.hint())?;
    let class = match (scene_error(error), error) {
        (Some(scene_error), _) => {
            let Parts { key, value, bounds } = Parts::of(scene_error);
            named.set_item("key", key)?;
            named.set_item("value", value)?;
            named.set_item("bounds", bounds)?;
            "SceneError"
        }
        (None, CommandError::Log(_)) => "LogError",
        (None, CommandError::Identification(_)) => "IdentificationError",
        _ => "RunError",
    };
    Ok(PyErr::from_value(classes.bind(py).getattr(class)?.call((message,), Some(&named))?))
}

/// The refusal of a scene, wherever it was met.
fn scene_error(error: &CommandError) -> Option<&SceneError> {
    fn of_run(error: &RunError) -> Option<&SceneError> {
        if let RunError::Scene(error) = error { Some(error) } else { None }
    }
    fn of_log(error: &LogError) -> Option<&SceneError> {
        match error {
            LogError::Scene(error) => Some(error),
            LogError::Run(error) => of_run(error),
            _ => None,
        }
    }
    match error {
        CommandError::Run(error) | CommandError::Identification(IdentificationError::Run(error)) => {
            of_run(error)
        }
        CommandError::Log(error) | CommandError::Identification(IdentificationError::Log(error)) => {
            of_log(error)
        }
        _ => None,
    }
}

/// What a refusal names.
#[derive(Default)]
struct Parts {
    key: Option<String>,
    value: Option<String>,
    bounds: Option<String>,
}

impl Parts {
    fn of(error: &SceneError) -> Self {
        let key_and_value = |key: &str, value: &str| Self {
            key: Some(key.to_owned()),
            value: Some(value.to_owned()),
            bounds: None,
        };
        let with_unit = |bounds: &str, unit: &str| Some(format!("{bounds} {unit}").trim_end().to_owned());
        match error {
            SceneError::InFile { source, .. } | SceneError::Follows { refused: source, .. } => {
                Self::of(source)
            }
            SceneError::UnknownKey { key, .. } => Self { key: Some(key.clone()), ..Self::default() },
            SceneError::UnknownTable { table, .. } | SceneError::IsTable { table } => {
                Self { key: Some(table.clone()), ..Self::default() }
            }
            SceneError::Quoted { key, value } => key_and_value(key, value),
            SceneError::WrongType { key, found, .. } => key_and_value(key, found),
            SceneError::OutOfBounds { key, value, bounds, unit }
            | SceneError::NotANumber { key, value, bounds, unit, .. } => {
                Self { bounds: with_unit(bounds, unit), ..key_and_value(key, value) }
            }
            SceneError::NotAChoice { key, value, of } => {
                Self { bounds: Some(of.join(", ")), ..key_and_value(key, value) }
            }
            SceneError::OtherDesign { key, of_scene, .. } => key_and_value(key, &of_scene.to_string()),
            _ => Self::default(),
        }
    }
}
