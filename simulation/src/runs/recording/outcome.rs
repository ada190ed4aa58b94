//! What a recording holds, in numbers and in words.

use std::fmt;

use motor_model::{Angle, Time};
use serde::Serialize;

use crate::math::count::real;
use crate::math::plain_number::plain;
use crate::runs::record::RunRecord;
use crate::scene::Scene;

/// What a recording holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingOutcome {
    /// What was recorded: motor or stator.
    pub model: &'static str,
    /// How its rotor moves.
    pub rotor: &'static str,
    /// The drives.
    pub schedule: String,
    /// Length.
    pub duration_s: f64,
    /// Vibrometer samples.
    pub vibrometer_samples: u64,
    /// Camera frames.
    pub camera_frames: u64,
    /// What the rotor turned by in truth; nothing of a stator.
    pub turned_deg: Option<f64>,
    /// Seed of the run, which draws the motor.
    pub seed: u64,
}

impl RecordingOutcome {
    /// That of `scene` before its first record.
    pub(super) fn of(scene: &Scene, until: Time) -> Self {
        Self {
            model: scene.choice("record.model"),
            rotor: scene.choice("plant.rotor"),
            schedule: scene.schedule("record.schedule").to_string(),
            duration_s: real(until.nanos_since(Time::ZERO)) / 1e9,
            vibrometer_samples: 0,
            camera_frames: 0,
            turned_deg: None,
            seed: scene.seed(),
        }
    }

    pub(super) fn add(&mut self, record: &RunRecord) {
        self.vibrometer_samples += record.ldv_samples.len() as u64;
        self.camera_frames += u64::from(record.camera_frame.is_some());
        // Every motor starts at angle 0.
        self.turned_deg = record.truth.map(|truth| truth.angle.minus(Angle::ZERO).degrees());
    }
}

impl fmt::Display for RecordingOutcome {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { model, rotor, schedule, duration_s, vibrometer_samples, camera_frames, turned_deg, seed } =
            self;
        let what = if *model == "stator" {
            "stator without a rotor".to_owned()
        } else {
            format!("motor with the rotor {rotor}")
        };
        writeln!(f, "recorded           {what}, drawn by seed {seed}")?;
        writeln!(f, "drives             {schedule}")?;
        writeln!(f, "length             {} s", plain(*duration_s))?;
        writeln!(f, "measurements       {vibrometer_samples} samples, {camera_frames} frames")?;
        match turned_deg {
            Some(turned_deg) => writeln!(f, "turned             {turned_deg:+.3} deg in truth"),
            None => Ok(()),
        }
    }
}
