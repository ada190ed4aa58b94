//! A recording in open loop: the true motor, or its bare stator, under a schedule of drives, and what the instruments
//! deliver.
//!
//! ```text
//! schedule ----> changes of the drive ----> rig, tick by tick ----> records: a log
//! ```
//!
//! The schedule begins at the end of the first tick, 10 us after the start at rest: a record has the drive from its end
//! on. A sweep changes its frequency every [`SWEEP_TICKS`] ticks; the phase of the drive is continuous.

mod outcome;

use std::ops::ControlFlow;

use controller::{Drive as _, Sense as _, TICK_NANOS};
use motor_model::{DriveCommand, DriveMode, MotorParams, Parameter, Time};

use crate::math::count::real;
use crate::runs::RunError;
use crate::runs::record::{Observer, RunRecord, Task};
use crate::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use crate::scene::schedule::{Schedule, ScheduledDrive};
use crate::scene::{Scene, SceneError};
use crate::world::bare_stator::BareStator;
use estimator::{Health, LdvSample};

pub use outcome::RecordingOutcome;

/// Ticks from one frequency of a sweep to the next: 1 ms.
pub const SWEEP_TICKS: u64 = 100;

/// A change of the drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DriveChange {
    /// From when.
    pub from: Time,
    /// The drive from then on.
    pub command: DriveCommand,
}

/// The drive in the course of a recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DriveCourse {
    /// Its changes, in order.
    pub changes: Vec<DriveChange>,
    /// End of the recording.
    pub until: Time,
}

impl DriveCourse {
    /// The course of `schedule` for a motor of this design.
    ///
    /// # Errors
    /// When a frequency is further from that of the design than a drive may be.
    pub fn of(schedule: &Schedule, design: &MotorParams) -> Result<Self, SceneError> {
        let (mut changes, mut tick) = (Vec::new(), 1);
        for part in schedule.parts() {
            let ticks = ticks_in(part.duration_s);
            let pieces = match part.drive.and_then(|drive| drive.frequency_hz) {
                Some([from, until]) if from.to_bits() != until.to_bits() => (ticks / SWEEP_TICKS).max(1),
                _ => 1,
            };
            for piece in 0..pieces {
                let middle = (real(piece) + 0.5) / real(pieces);
                let command = match &part.drive {
                    Some(drive) => command(drive, middle, design)?,
                    None => DriveCommand::OFF,
                };
                let from = Time::from_nanos((tick + piece * ticks / pieces) * TICK_NANOS);
                changes.push(DriveChange { from, command });
            }
            tick += ticks;
        }
        let until = Time::from_nanos(tick * TICK_NANOS);
        changes.push(DriveChange { from: until, command: DriveCommand::OFF });
        Ok(Self { changes, until })
    }
}

/// Ticks in a time, at least one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1e8")]
fn ticks_in(duration_s: f64) -> u64 {
    ((1e9 * duration_s / real(TICK_NANOS)).round() as u64).max(1)
}

/// The frequency of a mode.
fn frequency_of(mode: DriveMode) -> Parameter {
    match mode {
        DriveMode::B => Parameter::ModeBFrequency,
        DriveMode::C => Parameter::ModeCFrequency,
    }
}

/// The frequency of a mode of this design, in Hz: that of a drive that says none.
pub fn design_frequency_hz(design: &MotorParams, mode: DriveMode) -> f64 {
    design.get(frequency_of(mode))
}

/// The command of a drive when the part `passed` of its time has passed.
fn command(drive: &ScheduledDrive, passed: f64, design: &MotorParams) -> Result<DriveCommand, SceneError> {
    let own_hz = design_frequency_hz(design, drive.mode);
    let offset_hz = drive.frequency_hz.map_or(0.0, |[from, until]| from + (until - from) * passed - own_hz);
    #[expect(clippy::cast_possible_truncation, reason = "a command is f32: it goes to a microcontroller")]
    let (amplitude, offset_hz) = (drive.amplitude as f32, offset_hz as f32);
    let command = DriveCommand::try_new(drive.mode, amplitude)?;
    command.with_frequency_offset(offset_hz).map_err(|_| {
        let max = f64::from(DriveCommand::FREQUENCY_OFFSET_MAX_HZ);
        SceneError::Conflict {
            conflict: format!(
                "record.schedule: {drive} is more than {max} Hz from {}",
                frequency_of(drive.mode).spec().key
            ),
            hint: format!("{} to {} Hz", own_hz - max, own_hz + max),
        }
    })
}

/// Drives as a course says.
#[derive(Clone, Debug)]
pub struct CourseProgram<'a> {
    left: &'a [DriveChange],
    command: DriveCommand,
}

impl<'a> CourseProgram<'a> {
    /// A program that begins with the drive off.
    pub fn new(course: &'a DriveCourse) -> Self {
        Self { left: &course.changes, command: DriveCommand::OFF }
    }

    /// The command from `now` on.
    fn command_at(&mut self, now: Time) -> DriveCommand {
        while let Some((next, left)) = self.left.split_first()
            && next.from <= now
        {
            (self.command, self.left) = (next.command, left);
        }
        self.command
    }
}

impl TickProgram for CourseProgram<'_> {
    type Report = DriveCommand;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> DriveCommand {
        while ports.ldv_sample().is_some() {}
        while ports.camera_frame().is_some() {}
        ports.drive(self.command_at(now))
    }
}

/// Refuses a scene of which nothing is measured: a stator without its rotor has no marks for a camera.
fn refuse_nothing_measured(scene: &Scene) -> Result<(), SceneError> {
    if scene.choice("record.model") != "stator" || scene.choice("ldv.installed") == "yes" {
        return Ok(());
    }
    Err(SceneError::Conflict {
        conflict: "record.model = stator with ldv.installed = no measures nothing".to_owned(),
        hint:
            "a stator without a rotor has no marks for the camera: ldv.installed=yes, or record.model=motor"
                .to_owned(),
    })
}

/// Records what `scene` asks for.
///
/// # Errors
/// When the scene is refused, or has neither vibrometer nor rotor.
pub fn run(
    scene: &Scene,
    observer: &mut impl Observer,
) -> Result<ControlFlow<(), RecordingOutcome>, RunError> {
    refuse_nothing_measured(scene)?;
    let course = DriveCourse::of(&scene.schedule("record.schedule"), &scene.motor_params())?;
    let mut outcome = RecordingOutcome::of(scene, course.until);
    let ended = run_course(scene, &course, &mut |record: &RunRecord| {
        outcome.add(record);
        observer.observe(record)
    })?;
    Ok(match ended {
        ControlFlow::Continue(()) => ControlFlow::Continue(outcome),
        ControlFlow::Break(()) => ControlFlow::Break(()),
    })
}

/// Runs the motor of `scene`, or its bare stator, under `course`, and gives its records to `take`.
///
/// # Errors
/// When the scene is refused.
pub fn run_course(
    scene: &Scene,
    course: &DriveCourse,
    take: &mut impl FnMut(&RunRecord) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, RunError> {
    if scene.choice("record.model") == "stator" {
        return Ok(run_stator(BareStator::new(scene)?, course, take));
    }
    let mut driver = TickDriver::new(scene, CourseProgram::new(course))?;
    Ok(driver.run(|driver, moment| {
        let ended = take(&driver.record(&moment));
        if ended.is_break() {
            return ControlFlow::Break(ended);
        }
        if moment.at < course.until { ControlFlow::Continue(()) } else { ControlFlow::Break(ended) }
    }))
}

fn run_stator(
    mut stator: BareStator,
    course: &DriveCourse,
    take: &mut impl FnMut(&RunRecord) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let mut program = CourseProgram::new(course);
    let mut command = DriveCommand::OFF;
    let mut samples: Vec<LdvSample> = Vec::new();
    loop {
        let at = stator.tick(command);
        samples.clear();
        samples.extend(std::iter::from_fn(|| stator.ldv_sample()));
        command = program.command_at(at);
        take(&RunRecord {
            at,
            truth: None,
            impacts: &[],
            ldv_samples: &samples,
            camera_frame: None,
            marked: None,
            innovation: None,
            estimate: None,
            health: Health::Waiting,
            asked: command,
            applied: command,
            task: Task::None,
        })?;
        if at >= course.until {
            return ControlFlow::Continue(());
        }
    }
}

#[cfg(test)]
mod tests;
