//! Many runs: positioning trials, calibrations, identification. They report progress and end at Ctrl-C.

use std::path::PathBuf;

use host_sim::cli::in_process::{self, json_line};
use host_sim::studies::gyroscope_calibration::CalibrationPlan;
use host_sim::studies::identification::{Effort, IdentificationPlan, Recorded};
use host_sim::studies::positioning_trials::{PositioningTrials, PositioningTrialsPlan, Strategy};
use numpy::{IntoPyArray as _, PyArray2, PyArrayMethods as _};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Error;
use crate::interruption::interruptible;
use crate::runs::{Found, found};
use crate::scene::{PyScene, with_map};
use crate::tables::{NumberColumns, Table};

/// A callable that is told what is done, and the total.
type Progress = Option<Py<PyAny>>;

/// Refuses a count outside its bounds.
fn check_count(name: &str, count: u64, least: u64, most: u64) -> Result<(), Error> {
    if (least..=most).contains(&count) {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name} = {count} is outside its bounds {least} to {most}")).into())
}

#[pyfunction]
pub fn trials<'py>(
    py: Python<'py>,
    scene: &PyScene,
    motors: u64,
    progress: Progress,
) -> Result<Found<'py>, Error> {
    check_count("motors", motors, 1, 10_000_000)?;
    let scene = scene.of("positioning-trials")?;
    let result = interruptible(py, progress, |watch| {
        let scene = with_map(scene, watch)?;
        let plan = PositioningTrialsPlan::new(&scene, Strategy::Planned, motors)?;
        watch.expect(plan.trials());
        let trials = plan.run(&|trials| watch.advance(trials))?;
        let all = PositioningTrials::alone(&scene, trials);
        let json = in_process::json("positioning-trials", &scene, &all.key_figures(), &all.json());
        Ok((json, Table::of_rows(&all.trials.trials)?))
    })?;
    found(py, result)
}

/// JSON as the command prints it; tables of all runs, of the first gyroscope's rate, and of its Allan deviation.
type Calibrated<'py> = (String, [Bound<'py, PyDict>; 3]);

#[pyfunction]
pub fn calibrate<'py>(
    py: Python<'py>,
    scene: &PyScene,
    runs: u64,
    motors: u64,
    progress: Progress,
) -> Result<Calibrated<'py>, Error> {
    check_count("runs", runs, 1, 1_000_000)?;
    check_count("motors", motors, 1, 100_000)?;
    let scene = scene.of("calibrate")?;
    let (json, tables) = interruptible(py, progress, |watch| {
        let scene = with_map(scene, watch)?;
        let plan = CalibrationPlan::new(&scene, runs, motors)?;
        watch.expect(plan.motors_of_part());
        let found = plan.run(&|| watch.advance(1))?;
        let mut rates = NumberColumns::new(["time_s", "rate_deg_s"]);
        found.first.rates_deg_s.iter().for_each(|(time_s, rate)| rates.push([*time_s, *rate]));
        let mut allan = NumberColumns::new(["span_s", "deviation_deg_h", "model_deg_h"]);
        found.allan_deg_h.iter().for_each(|(span_s, seen, model)| allan.push([*span_s, *seen, *model]));
        let json = in_process::json("calibrate", &scene, &found.all_key_figures(), &found.json());
        Ok((json, [Table::of_rows(&found.outcomes)?, rates.into(), allan.into()]))
    })?;
    let [runs, rates, allan] = tables.map(|table| table.into_dict(py));
    Ok((json, [runs?, rates?, allan?]))
}

/// JSON as the command prints it, the identified scene in TOML, the keys that are told, and a sample of their values.
type Identified<'py> = (String, String, Vec<&'static str>, Bound<'py, PyArray2<f64>>);

#[pyfunction]
pub fn identify(
    py: Python<'_>,
    logs: Vec<PathBuf>,
    rotor: Option<String>,
    effort: (u64, f64, bool, u64),
    progress: Progress,
) -> Result<Identified<'_>, Error> {
    let (motors, prior_width, advice, seed) = effort;
    check_count("motors", motors, 100, 100_000)?;
    check_count("seed", seed, 0, 1_000_000)?;
    if !(0.1..=10.0).contains(&prior_width) {
        let said = format!("prior_width = {prior_width} is outside its bounds 0.1 to 10");
        return Err(PyValueError::new_err(said).into());
    }
    let found = interruptible(py, progress, |watch| {
        let mut recordings = Vec::new();
        for path in &logs {
            let mut recorded = Recorded::read(path)?;
            if let Some(rotor) = &rotor {
                recorded.scene.set("plant.rotor", rotor)?;
            }
            recordings.push(recorded);
        }
        let effort = Effort { motors, advice, prior_width, seed };
        let plan = IdentificationPlan::new(recordings, effort)?;
        watch.expect(plan.work());
        Ok(plan.run(&|| watch.advance(1))?)
    })?;
    let told: Vec<&'static str> = found.told.iter().map(|number| found.parameters[*number].key).collect();
    let (rows, columns) = (found.sample.len(), told.len());
    let sample = found.sample.concat().into_pyarray(py).reshape([rows, columns])?;
    Ok((json_line(&found), found.scene(), told, sample))
}
