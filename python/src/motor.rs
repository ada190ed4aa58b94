//! The true motor of a scene, alone and many at a time: without instruments, filter or controller.

use numpy::{AllowTypeChange, IntoPyArray as _, PyArray1, PyArrayLike1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use simulation::scene::{Scene, SceneError};
use simulation::world::plant::Plant;

use motor_model::{DriveCommand, Time};

use crate::drives::command;
use crate::errors::Error;
use crate::interruption::{Watch, interruptible};
use crate::scene::PyScene;
use crate::tables::{NumberColumns, Table};

/// Steps between two looks at the watch.
const STEPS_PER_LOOK: u64 = 10_000;

/// The plant of a scene.
fn plant(scene: &Scene) -> Result<Plant, Error> {
    let reads = |key: &&str| *key == "seed" || key.starts_with("motor.") || key.starts_with("plant.");
    if let Some(key) = scene.keys_set().find(|key| !reads(key)) {
        let refusal = format!("a motor does not read {key}");
        let hint = "it reads seed, and the keys motor. and plant.".to_owned();
        return Err(SceneError::NotRead { refusal, hint }.into());
    }
    Ok(Plant::draw(scene)?)
}

/// Takes so many steps; in how many the rotor met the teeth.
fn advance(plant: &mut Plant, command: DriveCommand, steps: u64, watch: &Watch) -> u64 {
    let mut met = 0;
    for step in 0..steps {
        if step.is_multiple_of(STEPS_PER_LOOK) {
            watch.check();
        }
        met += u64::from(plant.step(command));
    }
    met
}

/// The true motor of a scene, at rest at angle 0, alone: without instruments, filter or controller.
///
/// A drive is a number from -1 to 1: its size is the amplitude, its sign the mode. Mode B is positive.
///
/// Args:
///     scene: The keys `seed`, `motor.` and `plant.`.
///
/// Raises:
///     `SceneError`: A setting is refused.
#[pyclass(name = "Motor", module = "micromotor")]
#[derive(Clone, Debug)]
pub struct PyMotor {
    plant: Plant,
    step_s: f64,
}

#[pymethods]
impl PyMotor {
    #[new]
    #[pyo3(signature = (scene=None))]
    fn new(scene: Option<&PyScene>) -> Result<Self, Error> {
        let scene = scene.map(|scene| scene.0.clone()).unwrap_or_default();
        Ok(Self { plant: plant(&scene)?, step_s: scene.number("plant.step_s") })
    }

    /// Take so many steps under a drive; in how many of them the rotor met the teeth.
    #[pyo3(signature = (drive=0.0, steps=1, *, frequency_offset_hz=0.0))]
    fn step(
        &mut self,
        py: Python<'_>,
        drive: f64,
        steps: u64,
        frequency_offset_hz: f64,
    ) -> Result<u64, Error> {
        let (command, plant) = (command(drive, frequency_offset_hz)?, &mut self.plant);
        if steps <= STEPS_PER_LOOK {
            return Ok(py.detach(|| advance(plant, command, steps, &Watch::default())));
        }
        interruptible(py, None, |watch| Ok(advance(plant, command, steps, watch)))
    }

    /// Take so many steps under a drive, and keep a row every so many.
    ///
    /// Returns:
    ///     Columns of shape (steps / every,): `time_s`, `angle_deg`, `rate_rad_s`, `height_m`, `velocity_m_s`.
    #[pyo3(signature = (drive, steps, *, every=1, frequency_offset_hz=0.0))]
    fn run<'py>(
        &mut self,
        py: Python<'py>,
        drive: f64,
        steps: u64,
        every: u64,
        frequency_offset_hz: f64,
    ) -> Result<Bound<'py, PyDict>, Error> {
        if every == 0 {
            return Err(PyValueError::new_err("every = 0 is outside its bounds 1 to 2^64").into());
        }
        let (command, plant) = (command(drive, frequency_offset_hz)?, &mut self.plant);
        let table = interruptible(py, None, |watch| {
            let mut rows =
                NumberColumns::new(["time_s", "angle_deg", "rate_rad_s", "height_m", "velocity_m_s"]);
            for _ in 0..steps / every {
                watch.check();
                advance(plant, command, every, watch);
                let rotor = plant.rotor();
                rows.push([
                    rotor.at.seconds_since(Time::ZERO),
                    rotor.angle.degrees(),
                    rotor.rate_rad_s,
                    plant.height_m(),
                    rotor.velocity_m_s,
                ]);
            }
            Ok(Table::from(rows))
        })?;
        Ok(table.into_dict(py)?)
    }

    /// Length of a step in s.
    #[getter]
    fn step_s(&self) -> f64 {
        self.step_s
    }

    /// Steps taken.
    #[getter]
    fn steps(&self) -> u64 {
        self.plant.steps()
    }

    /// The present in s.
    #[getter]
    fn time_s(&self) -> f64 {
        self.plant.now().seconds_since(Time::ZERO)
    }

    /// Angle in degrees over all turns, clockwise positive.
    #[getter]
    fn angle_deg(&self) -> f64 {
        self.plant.rotor().angle.degrees()
    }

    /// Rate in rad/s.
    #[getter]
    fn rate_rad_s(&self) -> f64 {
        self.plant.rotor().rate_rad_s
    }

    /// Height of the rotor in m above that of a rotor at rest on teeth at rest.
    #[getter]
    fn height_m(&self) -> f64 {
        self.plant.height_m()
    }

    /// Vertical velocity in m/s, upward positive.
    #[getter]
    fn velocity_m_s(&self) -> f64 {
        self.plant.rotor().velocity_m_s
    }

    /// Whether the rotor is in sustained contact with the teeth.
    #[getter]
    fn in_contact(&self) -> bool {
        self.plant.in_contact()
    }

    /// The same motor, to branch a run.
    fn copy(&self) -> Self {
        self.clone()
    }
}

/// A drive for each of several motors.
type Drives<'py> = PyArrayLike1<'py, f64, AllowTypeChange>;

/// Many motors, each drawn by a seed of its own: the scene's and those that follow it. They step on all processors.
///
/// Args:
///     scene: The keys `seed`, `motor.` and `plant.`.
///     count: How many.
///
/// Raises:
///     `SceneError`: A setting is refused.
#[pyclass(name = "Motors", module = "micromotor")]
#[derive(Clone, Debug)]
pub struct PyMotors {
    plants: Vec<Plant>,
}

#[pymethods]
impl PyMotors {
    #[new]
    fn new(py: Python<'_>, scene: &PyScene, count: u64) -> Result<Self, Error> {
        let scene = &scene.0;
        let draw = |number| plant(&scene.of_run(number)?);
        let plants: Result<Vec<Plant>, Error> = py.detach(|| (0..count).into_par_iter().map(draw).collect());
        Ok(Self { plants: plants? })
    }

    /// Take so many steps, each motor under its own drive of `drives`, an array of shape (count,).
    #[pyo3(signature = (drives, steps=1))]
    fn step(&mut self, py: Python<'_>, drives: Drives<'_>, steps: u64) -> Result<(), Error> {
        let (drives, plants) = (drives.as_slice().map_err(PyErr::from)?, &mut self.plants);
        if drives.len() != plants.len() {
            let said = format!("{} drives for {} motors", drives.len(), plants.len());
            return Err(PyValueError::new_err(said).into());
        }
        let commands: Result<Vec<DriveCommand>, _> =
            drives.iter().map(|drive| command(*drive, 0.0)).collect();
        let commands = commands?;
        interruptible(py, None, |watch| {
            plants.par_iter_mut().zip(commands).for_each(|(plant, command)| {
                advance(plant, command, steps, watch);
            });
            Ok(())
        })
    }

    fn __len__(&self) -> usize {
        self.plants.len()
    }

    /// Angles in degrees, of shape (count,).
    #[getter]
    fn angle_deg<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let angles: Vec<f64> = self.plants.iter().map(|plant| plant.rotor().angle.degrees()).collect();
        angles.into_pyarray(py)
    }

    /// Rates in rad/s, of shape (count,).
    #[getter]
    fn rate_rad_s<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let rates: Vec<f64> = self.plants.iter().map(|plant| plant.rotor().rate_rad_s).collect();
        rates.into_pyarray(py)
    }

    /// The present in s.
    #[getter]
    fn time_s(&self) -> f64 {
        self.plants.first().map_or(0.0, |plant| plant.now().seconds_since(Time::ZERO))
    }
}
