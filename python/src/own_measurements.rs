//! Measurements of one's own in arrays: through a filter, or into a log.

use std::ops::ControlFlow;
use std::path::PathBuf;

use estimator::{AngleFilter, Estimate, Health, Innovation, Reason, Rejection, Verdict};
use host_sim::cli::in_process::json_line;
use host_sim::log::import::{Drives, Import, Imported, MeasuredSeries, Measurements, Recording};
use host_sim::log::{Ending, LogError, LogOptions, LogRecorder};
use motor_model::{DriveCommand, Real, Time, math};
use numpy::PyReadonlyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use simulation::runs::filter::AnyFilter;
use simulation::runs::record::{Observer, RunRecord, health_level};
use simulation::scene::Scene;

use crate::drives::command;
use crate::errors::Error;
use crate::interruption::{Watch, interruptible};
use crate::scene::{PyScene, check_word};
use crate::tables::{Column, NumberColumns, Table};

/// An array of numbers.
type Numbers<'py> = PyReadonlyArray1<'py, f64>;

/// What was measured, as Python gives it: each source as times and values, the drive with frequency offsets.
#[derive(FromPyObject)]
pub struct Measured<'py> {
    camera: Option<(Numbers<'py>, Numbers<'py>)>,
    vibrometer: Option<(Numbers<'py>, Numbers<'py>)>,
    drive: Option<(Numbers<'py>, Numbers<'py>, Numbers<'py>)>,
}

fn series<'a>(
    name: &'static str,
    source: Option<&'a (Numbers<'_>, Numbers<'_>)>,
) -> Result<Option<Measurements<'a>>, Error> {
    let Some((times, values)) = source else { return Ok(None) };
    let time_s = times.as_slice().map_err(PyErr::from)?;
    let values = values.as_slice().map_err(PyErr::from)?;
    same_length(name, time_s.len(), values.len())?;
    Ok(Some(Measurements::Series(MeasuredSeries { name, time_s, values })))
}

fn same_length(name: &str, times: usize, values: usize) -> Result<(), Error> {
    if times == values {
        return Ok(());
    }
    Err(PyValueError::new_err(format!("{name}: {times} times and {values} values")).into())
}

impl Measured<'_> {
    fn drives(&self) -> Result<Option<Vec<(f64, DriveCommand)>>, Error> {
        let Some((times, drives, offsets)) = &self.drive else { return Ok(None) };
        let (times, drives) = (times.as_array(), drives.as_array());
        same_length("drive", times.len(), drives.len())?;
        same_length("drive", times.len(), offsets.as_array().len())?;
        let rows = times.iter().zip(drives).zip(offsets.as_array());
        let rows = rows.map(|((time_s, drive), offset_hz)| Ok((*time_s, command(*drive, *offset_hz)?)));
        rows.collect::<Result<_, Error>>().map(Some)
    }

    fn recording<'a>(&'a self, drives: Option<&'a Vec<(f64, DriveCommand)>>) -> Result<Recording<'a>, Error> {
        Ok(Recording {
            camera: series("camera", self.camera.as_ref())?,
            vibrometer: series("vibrometer", self.vibrometer.as_ref())?,
            drive: drives.map(|drives| Drives::Series(drives)),
        })
    }
}

/// Verdict on a frame as a code: the place of its word in [`VERDICTS`].
fn verdict_code(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Used => 0,
        Verdict::Restarted => 1,
        Verdict::Rejected(why) => 2 + why as u8,
    }
}

/// Every verdict, by its code.
pub const VERDICTS: [Verdict; 8] = [
    Verdict::Used,
    Verdict::Restarted,
    Verdict::Rejected(Rejection::OutOfHorizon),
    Verdict::Rejected(Rejection::Duplicate),
    Verdict::Rejected(Rejection::Future),
    Verdict::Rejected(Rejection::Gate),
    Verdict::Rejected(Rejection::Repeated),
    Verdict::Rejected(Rejection::Stuck),
];

/// Every reason of a health, by its code; 0 is none.
pub const REASONS: [Option<Reason>; 14] = [
    None,
    Some(Reason::VibrometerSilent),
    Some(Reason::VibrometerUnfit),
    Some(Reason::VibrometerInverted),
    Some(Reason::VibrometerScale),
    Some(Reason::VibrometerErratic),
    Some(Reason::ImpactsUnexplained),
    Some(Reason::CameraSilent),
    Some(Reason::CameraStuck),
    Some(Reason::NoiseMismatch),
    Some(Reason::FramesRefused),
    Some(Reason::ReferenceLost),
    Some(Reason::TurnUnknown),
    Some(Reason::Uncertain),
];

fn reason_code(health: Health) -> u8 {
    match health {
        Health::Good | Health::Waiting => 0,
        Health::Degraded(why) | Health::Unusable(why) => 1 + why as u8,
    }
}

/// A filter that takes in the records of a recording.
struct FilterRun<'a, T: Real> {
    filter: AnyFilter<T>,
    /// Ticks from row to row of the estimates; 0 for a row at each frame.
    every: u64,
    ticks: u64,
    watch: &'a Watch,
    estimates: NumberColumns<3>,
    covariance: Vec<f64>,
    resting: Vec<bool>,
    health: Vec<u8>,
    reason: Vec<u8>,
    innovations: NumberColumns<3>,
    verdict: Vec<u8>,
}

impl<'a, T: Real> FilterRun<'a, T> {
    fn new(scene: &Scene, every: u64, watch: &'a Watch) -> Result<Self, Error> {
        Ok(Self {
            filter: AnyFilter::of(scene)?,
            every,
            ticks: 0,
            watch,
            estimates: NumberColumns::new(["time_s", "angle_deg", "rate_deg_s"]),
            covariance: Vec::new(),
            resting: Vec::new(),
            health: Vec::new(),
            reason: Vec::new(),
            innovations: NumberColumns::new(["time_s", "innovation_deg", "innovation_sd_deg"]),
            verdict: Vec::new(),
        })
    }

    fn add_innovation(&mut self, innovation: &Innovation<T>) {
        let variance = innovation.variance_rad2.to_f64();
        let predicted = variance > 0.0;
        let of = |number: f64| if predicted { number.to_degrees() } else { f64::NAN };
        self.innovations.push([
            innovation.taken_at.seconds_since(Time::ZERO),
            of(innovation.innovation_rad.to_f64()),
            of(math::sqrt(variance.max(0.0))),
        ]);
        self.verdict.push(verdict_code(innovation.verdict));
    }

    fn add_estimate(&mut self, at: Time, estimate: Option<Estimate<T>>, health: Health) {
        let square = 1.0_f64.to_degrees() * 1.0_f64.to_degrees();
        let or_nan = |of: fn(&Estimate<T>) -> f64| estimate.as_ref().map_or(f64::NAN, of);
        self.estimates.push([
            at.seconds_since(Time::ZERO),
            or_nan(|estimate| estimate.angle.degrees()),
            or_nan(|estimate| estimate.rate_rad_s.to_f64().to_degrees()),
        ]);
        let [angle, both, rate] = [
            or_nan(|estimate| estimate.angle_rad2.to_f64()),
            or_nan(|estimate| estimate.angle_rate_rad2_s.to_f64()),
            or_nan(|estimate| estimate.rate_rad2_s2.to_f64()),
        ];
        self.covariance.extend([angle, both, both, rate].map(|covariance| square * covariance));
        self.resting.push(estimate.is_some_and(|estimate| estimate.resting));
        self.health.push(health_level(health));
        self.reason.push(reason_code(health));
    }

    /// Estimates and innovations, with times from `start_s` on.
    fn tables(mut self, start_s: f64) -> [Table; 2] {
        self.estimates.shift(0, start_s);
        self.innovations.shift(0, start_s);
        let estimates = Table::from(self.estimates)
            .with("covariance", Column::Matrices(self.covariance, 2))
            .with("resting", Column::Flags(self.resting))
            .with("health", Column::Codes(self.health))
            .with("reason", Column::Codes(self.reason));
        [estimates, Table::from(self.innovations).with("verdict", Column::Codes(self.verdict))]
    }
}

impl<T: Real> Observer for FilterRun<'_, T>
where
    AnyFilter<T>: AngleFilter<T>,
{
    fn observe(&mut self, record: &RunRecord) -> ControlFlow<()> {
        self.watch.check();
        for sample in record.ldv_samples {
            self.filter.update_ldv(sample);
        }
        if let Some(frame) = record.camera_frame {
            let innovation = self.filter.update_camera(&frame);
            self.add_innovation(&innovation);
        }
        self.ticks += 1;
        let wanted = if self.every == 0 {
            record.camera_frame.is_some()
        } else {
            self.ticks.is_multiple_of(self.every)
        };
        if wanted {
            let (estimate, health) = self.filter.assess(record.at);
            self.add_estimate(record.at, estimate, health);
        }
        self.filter.drive(record.at, record.applied);
        ControlFlow::Continue(())
    }
}

/// Runs the filter of the import's scene in a precision.
fn filtered<T: Real>(import: &Import, every: u64, watch: &Watch) -> Result<[Table; 2], Error>
where
    AnyFilter<T>: AngleFilter<T>,
{
    let mut run = FilterRun::<T>::new(import.scene(), every, watch)?;
    let Imported { start_s, .. } = import.run(&mut run)?;
    Ok(run.tables(start_s))
}

#[pyfunction]
pub fn run_filter<'py>(
    py: Python<'py>,
    scene: &PyScene,
    measured: Measured<'py>,
    every: u64,
    precision: &str,
) -> Result<[Bound<'py, PyDict>; 2], Error> {
    check_word("precision", precision, &["f32", "f64"])?;
    let (scene, drives) = (scene.of("import")?, measured.drives()?);
    let recording = measured.recording(drives.as_ref())?;
    let [estimates, innovations] = interruptible(py, None, |watch| {
        let import = Import::new(&recording, scene)?;
        let filter = if precision == "f64" { filtered::<f64> } else { filtered::<f32> };
        filter(&import, every, watch)
    })?;
    Ok([estimates.into_dict(py)?, innovations.into_dict(py)?])
}

#[pyfunction]
pub fn write_recording(
    py: Python<'_>,
    path: PathBuf,
    scene: &PyScene,
    measured: Measured<'_>,
) -> Result<String, Error> {
    let (scene, drives) = (scene.of("import")?, measured.drives()?);
    let recording = measured.recording(drives.as_ref())?;
    interruptible(py, None, |watch| {
        let import = Import::new(&recording, scene)?;
        let options = LogOptions { every: 10 };
        let mut log = LogRecorder::create(&path, options, "import", import.scene(), watch.stop_mark())?;
        match import.run(&mut log) {
            Ok(imported) => {
                let json = json_line(&imported);
                log.finish(Ending::Whole(&json))?;
                Ok(json)
            }
            // The log has ended the import: its end says why.
            Err(LogError::Ended) => {
                Err(log.finish(Ending::Interrupted).err().unwrap_or(LogError::Ended).into())
            }
            Err(other) => Err(other.into()),
        }
    })
}
