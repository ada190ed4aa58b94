//! Runs of one motor: in open loop, a move, a rate, a recording. Each gives the command's JSON, and its course.

use std::ops::ControlFlow;
use std::path::PathBuf;

use host_sim::cli::in_process::{self, json_line};
use host_sim::studies::held_rates::{self, HeldRates};
use host_sim::studies::open_loop;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use simulation::runs::simulate::{MotorSample, Observer};
use simulation::runs::{RunError, position as moves, recording};

use crate::course::RunObserver;
use crate::drives::signed;
use crate::errors::Error;
use crate::interruption::{Watch, interruptible};
use crate::recorded::RecordedTables;
use crate::scene::{PyScene, with_map};
use crate::tables::{NumberColumns, Table};

/// JSON as the command prints it, and a table.
pub type Found<'py> = (String, Bound<'py, PyDict>);

/// As objects of Python.
///
/// # Errors
/// When Python has no memory left.
pub fn found(py: Python<'_>, (json, table): (String, Table)) -> Result<Found<'_>, Error> {
    Ok((json, table.into_dict(py)?))
}

/// Where a run is logged, and every how many ticks truth and estimate are.
type Log = Option<(PathBuf, u64)>;

#[pyfunction]
pub fn position<'py>(py: Python<'py>, scene: &PyScene, every: u64, log: Log) -> Result<Found<'py>, Error> {
    let scene = scene.of("position")?;
    let log = log.as_ref().map(|(path, every)| (path.as_path(), *every));
    let run = |watch: &Watch| {
        let scene = with_map(scene, watch)?;
        let mut observer = RunObserver::open(("position", &scene), every, log, watch)?;
        let ended = moves::run_with(&scene, |run, moment| observer.take(|| run.record(moment)))?;
        let ControlFlow::Continue(outcome) = ended else { return Err(observer.stopped()) };
        let json = in_process::json("position", &scene, &[], &json_line(&outcome));
        let course = observer.finish(&json)?;
        Ok((json, course))
    };
    found(py, interruptible(py, None, run)?)
}

#[pyfunction]
pub fn plan(py: Python<'_>, scene: &PyScene) -> Result<String, Error> {
    let scene = scene.of("position")?;
    interruptible(py, None, |watch| Ok(json_line(&moves::plan(&with_map(scene, watch)?)?)))
}

#[pyfunction]
pub fn rate<'py>(py: Python<'py>, scene: &PyScene, every: u64, log: Log) -> Result<Found<'py>, Error> {
    let scene = scene.of("rate")?;
    let log = log.as_ref().map(|(path, every)| (path.as_path(), *every));
    let run = |watch: &Watch| {
        let scene = with_map(scene, watch)?;
        let mut observer = RunObserver::open(("rate", &scene), every, log, watch)?;
        let ended = held_rates::hold(&scene, |_| (), |run, moment| observer.take(|| run.record(moment)))?;
        let ControlFlow::Continue(held) = ended else { return Err(observer.stopped()) };
        let of_run = in_process::json("rate", &scene, &[], &json_line(&held.outcome));
        let course = observer.finish(&of_run)?;
        let json = HeldRates::of_one(held, &[])?.json();
        Ok((in_process::json("rate", &scene, &[], &json), course))
    };
    found(py, interruptible(py, None, run)?)
}

/// Keeps the samples of a run in open loop.
struct Samples<'a> {
    interval_s: f64,
    /// Whether anybody wants them: a run is looked at in any case, so that it can be interrupted.
    kept: bool,
    columns: NumberColumns<8>,
    watch: &'a Watch,
}

/// Columns of a run in open loop, by the names of `simulate --out`.
const SAMPLES: [&str; 8] = [
    "time_s",
    "height_m",
    "velocity_m_s",
    "angle_deg",
    "rate_rad_s",
    "tooth_height_0_m",
    "tooth_height_1_m",
    "drive",
];

/// Time between two looks at a run of which no samples are kept.
const LOOK_S: f64 = 1e-3;

impl Observer for Samples<'_> {
    fn interval_s(&self) -> Option<f64> {
        Some(self.interval_s)
    }

    fn observe(&mut self, sample: &MotorSample) -> Result<(), RunError> {
        self.watch.check();
        if self.kept {
            let MotorSample { time_s, height_m, velocity_m_s, angle_deg, rate_rad_s, .. } = *sample;
            let [tooth_0, tooth_1] = sample.tooth_heights_m;
            self.columns.push([
                time_s,
                height_m,
                velocity_m_s,
                angle_deg,
                rate_rad_s,
                tooth_0,
                tooth_1,
                signed(sample.drive),
            ]);
        }
        Ok(())
    }
}

#[pyfunction]
pub fn simulate<'py>(py: Python<'py>, scene: &PyScene, every_s: Option<f64>) -> Result<Found<'py>, Error> {
    let scene = scene.of("simulate")?;
    let run = |watch: &Watch| {
        let mut samples = Samples {
            interval_s: every_s.unwrap_or(LOOK_S),
            kept: every_s.is_some(),
            columns: NumberColumns::new(SAMPLES),
            watch,
        };
        let result = open_loop::run(&scene, &mut samples)?;
        Ok((in_process::json("simulate", &scene, &[], &result.json()), samples.columns.into()))
    };
    found(py, interruptible(py, None, run)?)
}

/// JSON as the command prints it, and the tables of camera, vibrometer, drive and truth.
type Recorded<'py> = (String, [Bound<'py, PyDict>; 4]);

#[pyfunction]
pub fn record<'py>(py: Python<'py>, scene: &PyScene, every: u64, log: Log) -> Result<Recorded<'py>, Error> {
    let scene = scene.of("record")?;
    let log = log.as_ref().map(|(path, every)| (path.as_path(), *every));
    let run = |watch: &Watch| {
        let observer = RunObserver::open(("record", &scene), 0, log, watch)?;
        let mut tables = RecordedTables::new(observer, every);
        let ended = recording::run(&scene, &mut tables)?;
        let ControlFlow::Continue(outcome) = ended else { return Err(tables.observer.stopped()) };
        let json = json_line(&outcome);
        let tables = tables.finish(&json)?;
        Ok((json, tables))
    };
    let (json, tables) = interruptible(py, None, run)?;
    let [camera, vibrometer, drive, truth] = tables.map(|table| table.into_dict(py));
    Ok((json, [camera?, vibrometer?, drive?, truth?]))
}
