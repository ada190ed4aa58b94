//! A recording: what its instruments delivered, and under which drives.

use std::path::{Path, PathBuf};

use motor_model::{Angle, Time};

use super::IdentificationError;
use crate::log::{LogError, LogMessage, LogPart, open};
use analysis::identification::measured::Measured;
use analysis::identification::training::Setting;
use simulation::runs::recording::{DriveChange, DriveCourse};
use simulation::scene::Scene;

/// A recording of the motor that is to be identified.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// The log.
    pub path: PathBuf,
    /// The command that wrote it.
    pub command: String,
    /// Its scene.
    pub scene: Scene,
    /// The drives.
    pub course: DriveCourse,
    /// The measurements.
    pub measured: Measured,
    /// Where the log is damaged: it is read up to there.
    pub damage: Option<String>,
}

impl Recorded {
    /// Reads the log at `path`, up to its end or to the first damage.
    ///
    /// # Errors
    /// When it cannot be read, or holds a measurement that is no number.
    pub fn read(path: &Path) -> Result<Self, IdentificationError> {
        let (head, mut reader) = open(path)?;
        let mut recorded = Self {
            path: path.to_owned(),
            command: head.command,
            scene: head.scene,
            course: DriveCourse::default(),
            measured: Measured::default(),
            damage: None,
        };
        loop {
            match reader.next_part() {
                Ok(Some(LogPart::Message(at, message))) => recorded.take(at, message)?,
                Ok(Some(_)) => {}
                Ok(None) => return Ok(recorded),
                Err(damage @ LogError::Damaged { .. }) => {
                    recorded.damage = Some(damage.to_string());
                    return Ok(recorded);
                }
                Err(other) => return Err(other.into()),
            }
        }
    }

    /// What is recorded of every motor beside this one, at `place` among the recordings.
    pub(super) fn setting(&self, place: u64) -> Setting {
        Setting::of(self.scene.clone(), self.course.clone(), &self.measured, place)
    }

    fn take(&mut self, at: Time, message: LogMessage) -> Result<(), IdentificationError> {
        let path = self.path.clone();
        let no_number =
            |channel| IdentificationError::NotANumber { path, channel, at_s: at.seconds_since(Time::ZERO) };
        match message {
            LogMessage::VibrometerSample(sample) => {
                if !sample.velocity_m_s.is_finite() {
                    return Err(no_number("/vibrometer"));
                }
                self.measured.sample(at, sample.velocity_m_s);
            }
            LogMessage::CameraFrame(frame) => self.measured.frame(at, Angle::from_units(frame.angle_units)),
            LogMessage::Marks(marks) => {
                if ![marks.shift_x_m, marks.shift_y_m, marks.residual_m].iter().all(|m| m.is_finite()) {
                    return Err(no_number("/camera/marks"));
                }
                self.measured.marks(at, [marks.shift_x_m, marks.shift_y_m], marks.residual_m);
            }
            LogMessage::Drive(drive) => {
                let command = drive.command().ok_or_else(|| no_number("/drive"))?;
                self.course.changes.push(DriveChange { from: at, command });
            }
            _ => {}
        }
        self.course.until = self.course.until.max(at);
        Ok(())
    }
}
