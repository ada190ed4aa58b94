//! A closed loop whose controller is Python's: plant, instruments and filter of a scene, tick by tick.
//!
//! ```text
//! step(drive):  the filter is told the drive; the rig moves under it for a tick of 10 us;
//!               the filter takes what has arrived; the caller reads the estimate and decides
//! ```
//!
//! This is the order of [`controller::tick`], cut between its decision and its drive.

use controller::LoopTiming;
use controller::{Fused, TICK_NANOS, fuse};
use estimator::{AngleFilter as _, Estimate, Health};
use motor_model::{DriveCommand, Time, math};
use numpy::{IntoPyArray as _, PyArray2, PyArrayMethods as _};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use simulation::runs::closed_loop::timing;
use simulation::runs::filter::AnyFilter;
use simulation::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use simulation::scene::{Scene, SceneError};

use crate::drives::command;
use crate::errors::Error;
use crate::interruption::{Watch, interruptible};
use crate::scene::PyScene;
use crate::tables::{NumberColumns, Table};

/// Ticks that are computed without a look at signals: some milliseconds.
const TICKS_PER_LOOK: u64 = 1000;

/// Columns of a run of the loop.
const COURSE: [&str; 7] = [
    "time_s",
    "truth_angle_deg",
    "truth_rate_deg_s",
    "estimate_angle_deg",
    "estimate_angle_sd_deg",
    "estimate_rate_deg_s",
    "drive",
];

/// Angle and rate at an instant, as a filter knows them.
///
/// Attributes:
///     `angle_deg`: Angle in degrees over all turns, clockwise positive.
///     `rate_deg_s`: Rate in deg/s.
///     `angle_sd_deg`, `rate_sd_deg_s`: Their standard deviations.
///     resting: Whether the rotor lies still.
#[pyclass(name = "Estimate", module = "micromotor", frozen, get_all)]
#[derive(Clone, Copy, Debug)]
pub struct PyEstimate {
    angle_deg: f64,
    rate_deg_s: f64,
    angle_sd_deg: f64,
    rate_sd_deg_s: f64,
    resting: bool,
}

impl From<Estimate<f32>> for PyEstimate {
    fn from(estimate: Estimate<f32>) -> Self {
        let sd_deg = |variance: f32| math::sqrt(f64::from(variance)).to_degrees();
        Self {
            angle_deg: estimate.angle.degrees(),
            rate_deg_s: f64::from(estimate.rate_rad_s).to_degrees(),
            angle_sd_deg: sd_deg(estimate.angle_rad2),
            rate_sd_deg_s: sd_deg(estimate.rate_rad2_s2),
            resting: estimate.resting,
        }
    }
}

/// The end of a step of the loop: what was measured in it, the estimate, and the truth.
///
/// Attributes:
///     `time_s`: The instant in s.
///     estimate: Angle and rate; `None` before the first camera frame.
///     health: `Good`, `Waiting`, or `Degraded` or `Unusable` with the reason.
///     usable: Whether the estimate may be used.
///     frames: Camera frames that arrived, (n, 2): time in s of the middle of the exposure, angle in degrees within the
///         turn.
///     samples: Vibrometer samples that arrived, (m, 2): time in s, velocity in m/s.
///     `true_angle_deg`, `true_rate_deg_s`: The truth, which only a simulation knows.
#[pyclass(name = "Moment", module = "micromotor", frozen)]
#[derive(Clone, Debug)]
pub struct PyMoment {
    #[pyo3(get)]
    time_s: f64,
    #[pyo3(get)]
    estimate: Option<PyEstimate>,
    #[pyo3(get)]
    true_angle_deg: f64,
    #[pyo3(get)]
    true_rate_deg_s: f64,
    health: Health,
    frames: Vec<f64>,
    samples: Vec<f64>,
}

#[pymethods]
impl PyMoment {
    #[getter]
    fn health(&self) -> String {
        format!("{:?}", self.health)
    }

    #[getter]
    fn usable(&self) -> bool {
        matches!(self.health, Health::Good | Health::Degraded(_))
    }

    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        pairs(py, &self.frames)
    }

    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        pairs(py, &self.samples)
    }
}

fn pairs<'py>(py: Python<'py>, numbers: &[f64]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    numbers.to_vec().into_pyarray(py).reshape([numbers.len() / 2, 2])
}

/// The filter, which estimates and drives nothing.
#[derive(Clone, Debug)]
struct Estimating(AnyFilter);

impl TickProgram for Estimating {
    type Report = Fused;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> Fused {
        fuse(&mut self.0, now, ports)
    }
}

/// A closed loop whose controller is one's own: plant, instruments and filter of a scene, in ticks of 10 us.
///
/// A drive is a number from -1 to 1: its size is the amplitude, its sign the mode. Mode B is positive.
///
/// Args:
///     scene: The settings, with the keys that `position` reads.
///
/// Raises:
///     `SceneError`: A setting is refused.
#[pyclass(name = "Loop", module = "micromotor")]
#[derive(Clone, Debug)]
pub struct PyLoop {
    driver: TickDriver<Estimating>,
    at: Time,
}

impl PyLoop {
    fn advance(&mut self, command: DriveCommand, ticks: u64, watch: &Watch) -> PyMoment {
        let (mut frames, mut samples) = (Vec::new(), Vec::new());
        let seconds = |at: Time| at.seconds_since::<f64>(Time::ZERO);
        let mut done = 0;
        loop {
            // The filter's clock begins with the first drive, or with the end of the first tick.
            if self.at > Time::ZERO || command != DriveCommand::OFF {
                self.driver.program_mut().0.drive(self.at, command);
            }
            self.driver.overrule(command);
            let moment = self.driver.next_tick();
            self.at = moment.at;
            let measured = self.driver.measurements();
            if let Some(frame) = measured.camera_frame {
                frames.extend([seconds(frame.exposed_at), frame.angle.degrees()]);
            }
            for sample in &measured.ldv_samples {
                samples.extend([seconds(sample.taken_at), f64::from(sample.velocity_m_s)]);
            }
            done += 1;
            if done >= ticks {
                let Fused { estimate, health, .. } = moment.report;
                return PyMoment {
                    time_s: moment.seconds(),
                    estimate: estimate.map(PyEstimate::from),
                    true_angle_deg: moment.angle.degrees(),
                    true_rate_deg_s: moment.rate_rad_s.to_degrees(),
                    health,
                    frames,
                    samples,
                };
            }
            if done.is_multiple_of(TICKS_PER_LOOK) {
                watch.check();
            }
        }
    }
}

#[pymethods]
impl PyLoop {
    #[new]
    #[pyo3(signature = (scene=None))]
    fn new(scene: Option<&PyScene>) -> Result<Self, Error> {
        let scene = scene.map_or_else(|| Ok(Scene::default()), |scene| scene.of("position"))?;
        if timing(&scene) != LoopTiming::default() {
            return Err(SceneError::Conflict {
                conflict: "board.latency_ticks, board.decision_ticks: a loop of one's own decides in each tick, and \
                           its drive acts at once"
                    .to_owned(),
                hint: "give the drive later".to_owned(),
            }
            .into());
        }
        let filter = AnyFilter::of(&scene)?;
        Ok(Self { driver: TickDriver::new(&scene, Estimating(filter))?, at: Time::ZERO })
    }

    /// Apply a drive for so many ticks of 10 us, and give the moment at their end.
    #[pyo3(signature = (drive=0.0, ticks=1, *, frequency_offset_hz=0.0))]
    fn step(
        &mut self,
        py: Python<'_>,
        drive: f64,
        ticks: u64,
        frequency_offset_hz: f64,
    ) -> Result<PyMoment, Error> {
        let command = command(drive, frequency_offset_hz)?;
        if ticks <= TICKS_PER_LOOK {
            return Ok(py.detach(|| self.advance(command, ticks, &Watch::default())));
        }
        interruptible(py, None, |watch| Ok(self.advance(command, ticks, watch)))
    }

    /// Call `controller` with each moment, and apply the drive that it gives for the next ticks.
    ///
    /// Args:
    ///     controller: Takes a `Moment`, gives a drive from -1 to 1.
    ///     `duration_s`: How long, in s.
    ///     ticks: Ticks of 10 us from call to call.
    ///
    /// Returns:
    ///     A row a call, each column of shape (calls,): `time_s`, `truth_angle_deg`, `truth_rate_deg_s`,
    ///     `estimate_angle_deg`, `estimate_angle_sd_deg`, `estimate_rate_deg_s` (NaN before the first estimate), and
    ///     the `drive` that was applied before it.
    #[pyo3(signature = (controller, duration_s, *, ticks=1))]
    fn run<'py>(
        slf: &Bound<'py, Self>,
        controller: &Bound<'py, PyAny>,
        duration_s: f64,
        ticks: u64,
    ) -> Result<Bound<'py, PyDict>, Error> {
        let py = slf.py();
        let (mut rows, mut drive) = (NumberColumns::new(COURSE), 0.0);
        let tick_s = 1e-9 * simulation::math::count::real(TICK_NANOS);
        let end_s = slf.borrow().time_s() + duration_s - 0.5 * tick_s;
        while slf.borrow().time_s() < end_s {
            let moment = slf.borrow_mut().step(py, drive, ticks, 0.0)?;
            let of = |of: fn(&PyEstimate) -> f64| moment.estimate.as_ref().map_or(f64::NAN, of);
            rows.push([
                moment.time_s,
                moment.true_angle_deg,
                moment.true_rate_deg_s,
                of(|estimate| estimate.angle_deg),
                of(|estimate| estimate.angle_sd_deg),
                of(|estimate| estimate.rate_deg_s),
                drive,
            ]);
            drive = controller.call1((Py::new(py, moment)?,))?.extract()?;
        }
        Ok(Table::from(rows).into_dict(py)?)
    }

    /// The present in s.
    #[getter]
    fn time_s(&self) -> f64 {
        self.at.seconds_since(Time::ZERO)
    }

    /// The same loop, to branch a run.
    fn copy(&self) -> Self {
        self.clone()
    }
}
