//! What goes wrong with the motor during a move: an amplifier that is weak, dead or wired the wrong way round, and a jolt of the rotor.
//!
//! Faults of the instruments are settings of theirs (`camera.`, `ldv.`); a resonance that has drifted is a parameter of the motor (`motor.mode_b.frequency_hz`).

use motor_model::{DriveCommand, DriveMode, Time};

use crate::scene::{Kind, Scene, Setting};

/// Settings of the disturbances.
pub const SETTINGS: &[Setting] = &[
    Setting {
        key: "fault.from_s",
        unit: "s",
        kind: Kind::Number { default: 0.0, min: 0.0, max: 1e5 },
        meaning: "from when on the drive is faulty, and when the rotor is jolted",
    },
    Setting {
        key: "fault.drive_gain",
        unit: "",
        kind: Kind::Number { default: 1.0, min: 0.0, max: 1.0 },
        meaning: "amplitude that reaches the coil, per amplitude that the amplifier reports",
    },
    Setting {
        key: "fault.modes",
        unit: "",
        kind: Kind::Choice { default: "right", of: &["right", "swapped"] },
        meaning: "whether the coil is driven in the other mode than the amplifier reports",
    },
    Setting {
        key: "fault.jolt_rad_s",
        unit: "rad/s",
        kind: Kind::Number { default: 0.0, min: -100.0, max: 100.0 },
        meaning: "change of the rotor's rate by a jolt",
    },
];

/// The disturbances of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disturbance {
    from: Time,
    drive_gain: f32,
    swapped: bool,
    /// Until it has struck.
    jolt_rad_s: Option<f64>,
}

impl Disturbance {
    /// Those of a scene; `None` if it sets none.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded by the settings")]
    pub fn of(scene: &Scene) -> Option<Self> {
        let jolt_rad_s = scene.number("fault.jolt_rad_s");
        let disturbance = Self {
            from: Time::from_nanos((scene.number("fault.from_s") * 1e9) as u64),
            drive_gain: scene.number("fault.drive_gain") as f32,
            swapped: scene.choice("fault.modes") == "swapped",
            jolt_rad_s: (jolt_rad_s.abs() > 0.0).then_some(jolt_rad_s),
        };
        let Self { drive_gain, swapped, jolt_rad_s, .. } = disturbance;
        (drive_gain < 1.0 || swapped || jolt_rad_s.is_some()).then_some(disturbance)
    }

    /// What reaches the coil at `now` of `command`.
    pub fn drive(&self, now: Time, command: DriveCommand) -> DriveCommand {
        match command.mode() {
            Some(mode) if now >= self.from => {
                let mode = match (self.swapped, mode) {
                    (false, mode) => mode,
                    (true, DriveMode::B) => DriveMode::C,
                    (true, DriveMode::C) => DriveMode::B,
                };
                DriveCommand::saturating(mode, self.drive_gain * command.amplitude())
            }
            _ => command,
        }
    }

    /// The jolt, in rad/s, once, when it is due.
    pub fn jolt(&mut self, now: Time) -> Option<f64> {
        if now >= self.from { self.jolt_rad_s.take() } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_faults_begin_when_they_should() {
        let mut scene = Scene::default();
        for (key, value) in
            [("from_s", "1"), ("drive_gain", "0.5"), ("modes", "swapped"), ("jolt_rad_s", "-2")]
        {
            scene.set(&format!("fault.{key}"), value).unwrap();
        }
        let mut disturbance = Disturbance::of(&scene).unwrap();
        let (before, after) = (Time::from_nanos(999_999_999), Time::from_nanos(1_000_000_000));
        let command = DriveCommand::saturating(DriveMode::B, 0.8);
        assert_eq!(disturbance.drive(before, command), command);
        assert_eq!(disturbance.drive(after, command), DriveCommand::saturating(DriveMode::C, 0.4));
        assert_eq!(disturbance.drive(after, DriveCommand::OFF), DriveCommand::OFF);
        assert_eq!([before, after, after].map(|now| disturbance.jolt(now)), [None, Some(-2.0), None]);
        assert_eq!(Disturbance::of(&Scene::default()), None);
    }
}
