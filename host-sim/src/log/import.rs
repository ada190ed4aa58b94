//! A user's own recording into a log: angles, velocities and drives, in memory or in tables, each of which has a clock
//! of its own.
//!
//! ```text
//! value    = scale * cell * unit + offset
//! log time = (cell * unit - clock offset) / (1 + clock drift) - start
//! ```
//!
//! `start` is a tick before the first measurement, so that a log begins at 0. Tables are read row by row, twice: first
//! their beginning, for the periods of the instruments, then all of it. What cannot be used is left out and counted: a
//! row without a value, a value that is not finite, a row that is not later than the one before it. The log has a
//! record for every tick, as that of a run: samples and frames arrive in it as they would have arrived in the loop,
//! frames after the latency of the scene's camera.

mod column;
mod drive;
pub(super) mod error;
mod rows;
mod source;
mod summary;
mod table;

pub use column::{ColumnName, Quantity};
pub use drive::{DriveTable, Drives};
pub use error::ImportError;
pub use rows::Clock;
pub use source::{MeasuredSeries, MeasuredTable, Measurements};
pub use summary::{Imported, ImportedDrive, ImportedSource};

use std::ops::ControlFlow;

use controller::TICK_NANOS;
use estimator::{CameraFrame, Health, LdvSample};
use motor_model::{Angle, DriveCommand, Time};

use super::error::LogError;
use rows::SourceRows;
use simulation::runs::record::{Observer, RunRecord, Task};
use simulation::scene::{Origin, Scene};
use source::Preview;
use summary::Summary;

/// Longest gap in a recording, in s: what `replay` reads.
const GAP_MAX_S: f64 = 60.0;

/// What is imported.
#[derive(Clone, Debug, Default)]
pub struct Recording<'a> {
    /// Angles of the rotor, clockwise positive.
    pub camera: Option<Measurements<'a>>,
    /// Vertical velocities, upwards positive.
    pub vibrometer: Option<Measurements<'a>>,
    /// Drives, each from its time on; without them the drive is off.
    pub drive: Option<Drives<'a>>,
}

/// A recording whose tables have been looked at.
#[derive(Debug)]
pub struct Import<'a> {
    recording: &'a Recording<'a>,
    /// The scene of the log: that of the user with the rates of the instruments.
    scene: Scene,
    /// Time of the log's 0 in s, on the clock that all tables share once theirs are corrected.
    start_s: f64,
}

impl<'a> Import<'a> {
    /// Looks at the beginning of the tables. `scene` describes instruments and motor; what it does not set of the rates
    /// of camera and vibrometer, of the marks, and whether there is a vibrometer, comes from the tables.
    ///
    /// # Errors
    /// When a source cannot be read, lacks a column or has no measurement, or the scene refuses a rate.
    pub fn new(recording: &'a Recording<'a>, mut scene: Scene) -> Result<Self, LogError> {
        if recording.camera.is_none() && recording.vibrometer.is_none() {
            return Err(ImportError::NothingMeasured.into());
        }
        let of_stator = scene.choice("record.model") == "stator";
        if of_stator && recording.camera.is_some() {
            return Err(ImportError::CameraOfStator.into());
        }
        let set: Vec<&str> = scene.keys_set().collect();
        let unset = |key: &str| !set.contains(&key);
        let preview = |source: &Option<Measurements>, quantity| -> Result<Option<Preview>, ImportError> {
            source.as_ref().map(|source| Preview::of(source, quantity)).transpose()
        };
        let camera = preview(&recording.camera, Quantity::Angle)?;
        let vibrometer = preview(&recording.vibrometer, Quantity::Velocity)?;
        // A stator without its rotor has nothing that a camera looks at.
        let mut from_tables: Vec<(&str, String)> = Vec::new();
        if !of_stator {
            from_tables.push(("camera.marks", "1".to_owned()));
        }
        if let Some(seen) = &camera {
            from_tables.push(("camera.frame_rate_hz", seen.rate_hz.to_string()));
        }
        match &vibrometer {
            Some(seen) => from_tables.push(("ldv.sample_rate_hz", seen.rate_hz.to_string())),
            None => from_tables.push(("ldv.installed", "no".to_owned())),
        }
        for (key, value) in from_tables.into_iter().filter(|(key, _)| unset(key)) {
            scene.assign(key, &value, &|_| Ok(()), Origin::Program)?;
        }
        let first_s = [camera, vibrometer].into_iter().flatten().map(|seen| seen.first_s);
        let tick_s = 1e-9 * simulation::math::count::real(TICK_NANOS);
        let start_s = first_s.fold(f64::INFINITY, f64::min) - tick_s;
        Ok(Self { recording, scene, start_s })
    }

    /// The scene of the log.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Reads the tables and gives the records to `observer`.
    ///
    /// # Errors
    /// When a table cannot be read, has a cell that is no number or a gap of more than a minute, or `observer` ends it.
    pub fn run<O: Observer>(&self, observer: &mut O) -> Result<Imported, LogError> {
        let Recording { camera, vibrometer, drive } = self.recording;
        let rows = |source: &'a Option<Measurements<'a>>, quantity| match source {
            Some(source) => source.rows(quantity, self.start_s),
            None => Ok(SourceRows::none()),
        };
        let mut ticks = Ticks {
            frames: rows(camera, Quantity::Angle)?,
            samples: rows(vibrometer, Quantity::Velocity)?,
            drives: match drive {
                Some(drives) => drives.rows(self.start_s, self.scene.motor_params())?,
                None => SourceRows::none(),
            },
            latency_nanos: latency_nanos(&self.scene),
            drive: DriveCommand::OFF,
            summary: Summary::default(),
        };
        let end = ticks.run(observer)?;
        let left_out = [ticks.frames.left_out(), ticks.samples.left_out()];
        let camera_scale = camera.as_ref().map_or(1.0, Measurements::scale);
        let imported = ticks.summary.told(left_out, camera_scale, (self.start_s, end));
        let drive = drive.as_ref().map(|_| ticks.summary.drive(ticks.drives.left_out()));
        Ok(Imported { drive, ..imported })
    }
}

/// From the middle of a frame's exposure to its arrival.
fn latency_nanos(scene: &Scene) -> u64 {
    let period_s = 1.0 / scene.number("camera.frame_rate_hz");
    let frames = simulation::math::count::real(scene.integer("camera.latency_frames"));
    let after_middle = frames + 0.5 * scene.number("camera.exposure_frames");
    rows::nanos(after_middle * period_s + scene.number("camera.latency_s"))
}

/// The ticks of a log, from its sources.
struct Ticks<'a> {
    frames: SourceRows<'a, f64>,
    samples: SourceRows<'a, f64>,
    drives: SourceRows<'a, DriveCommand>,
    latency_nanos: u64,
    drive: DriveCommand,
    summary: Summary,
}

impl Ticks<'_> {
    /// Gives the records up to the last measurement to `observer`; the end of the last tick.
    fn run<O: Observer>(&mut self, observer: &mut O) -> Result<Time, LogError> {
        let mut now = Time::ZERO;
        let mut samples = Vec::new();
        while let Some(due) = self.next_arrival() {
            if due.seconds_since::<f64>(now) > GAP_MAX_S {
                return Err(ImportError::Gap { from_s: now.seconds_since(Time::ZERO) }.into());
            }
            now = now.plus_nanos(TICK_NANOS);
            samples.clear();
            while let Some((taken_at, velocity_m_s)) = self.samples.take_until(now, 0)? {
                self.summary.velocity(taken_at, velocity_m_s);
                #[expect(clippy::cast_possible_truncation, reason = "a sample is f32")]
                samples.push(LdvSample { taken_at, velocity_m_s: velocity_m_s as f32 });
            }
            // A second frame of a tick is taken in by the next one.
            let frame = self.frames.take_until(now, self.latency_nanos)?;
            while let Some((_, drive)) = self.drives.take_until(now, 0)? {
                self.drive = drive;
                self.summary.drive_row();
            }
            self.summary.tick(self.drive.mode());
            if let Some((at, angle_deg)) = frame {
                self.summary.angle(at, angle_deg, self.drive.mode());
            }
            if let ControlFlow::Break(()) = observer.observe(&record(now, &samples, frame, self.drive)) {
                return Err(LogError::Ended);
            }
        }
        Ok(now)
    }

    /// When the next measurement arrives; `None` after the last.
    fn next_arrival(&self) -> Option<Time> {
        let frame = self.frames.upcoming().map(|at| at.plus_nanos(self.latency_nanos));
        [frame, self.samples.upcoming()].into_iter().flatten().min()
    }
}

/// The record of a tick that has no truth, no estimate and no controller.
fn record(
    at: Time,
    ldv_samples: &[LdvSample],
    frame: Option<(Time, f64)>,
    drive: DriveCommand,
) -> RunRecord<'_> {
    let camera_frame = frame.map(|(exposed_at, angle_deg)| {
        CameraFrame::new(exposed_at, Angle::from_degrees(angle_deg).wrapped())
    });
    RunRecord {
        at,
        truth: None,
        impacts: &[],
        ldv_samples,
        camera_frame,
        marked: None,
        innovation: None,
        estimate: None,
        health: Health::Waiting,
        asked: drive,
        applied: drive,
        task: Task::None,
    }
}

#[cfg(test)]
mod tests;
