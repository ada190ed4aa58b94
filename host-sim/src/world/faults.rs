//! Faults of the motor during a run: an amplifier that is weak, dead in one mode or both, or wired the wrong way round,
//! resonances that drift away from the drive, and a jolt of the rotor.
//!
//! Faults of the instruments are keys of theirs (`camera.`, `ldv.`). A resonance that has drifted before the start is a
//! parameter of the true motor (`plant.motor.mode_b.frequency_hz`).

use motor_model::{DriveCommand, DriveMode, Time};

use crate::scene::Scene;

/// The faults of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorFaults {
    from: Time,
    drive_gain: f32,
    swapped: bool,
    dead: Option<DriveMode>,
    /// The jolt, until it has happened.
    jolt_rad_s: Option<f64>,
    drift: Drift,
}

/// A drift of the resonances.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Drift {
    /// Relative change in the end.
    to: f64,
    over_nanos: u64,
    /// When the next change is due; `None` after the last.
    due: Option<Time>,
}

/// Time from one change of a drifting resonance to the next, in ns: a drift of a percent in a tenth of a second comes
/// in hundredths of the width of a resonance.
const DRIFT_NANOS: u64 = 1_000_000;

impl MotorFaults {
    /// Those of a scene; `None` if it sets none.
    #[expect(clippy::cast_possible_truncation, reason = "rounded to f32")]
    pub fn of(scene: &Scene) -> Option<Self> {
        let jolt_rad_s = scene.number("fault.jolt_rad_s");
        let from = Time::from_nanos(scene.nanos("fault.from_s"));
        let to = 0.01 * scene.number("fault.drift_percent");
        let faults = Self {
            from,
            drive_gain: scene.number("fault.drive_gain") as f32,
            swapped: scene.choice("fault.modes") == "swapped",
            dead: match scene.choice("fault.dead_mode") {
                "b" => Some(DriveMode::B),
                "c" => Some(DriveMode::C),
                _ => None,
            },
            jolt_rad_s: (jolt_rad_s.abs() > 0.0).then_some(jolt_rad_s),
            drift: Drift {
                to,
                over_nanos: scene.nanos("fault.drift_s"),
                due: (to.abs() > 0.0).then_some(from),
            },
        };
        let Self { drive_gain, swapped, dead, jolt_rad_s, drift, .. } = faults;
        let any =
            drive_gain < 1.0 || swapped || dead.is_some() || jolt_rad_s.is_some() || drift.due.is_some();
        any.then_some(faults)
    }

    /// Relative change of the resonances in the end.
    pub fn drift(&self) -> f64 {
        self.drift.to
    }

    /// The relative change of the resonances at `now`, whenever it is due to change.
    pub fn drifted(&mut self, now: Time) -> Option<f64> {
        let Drift { to, over_nanos, due } = &mut self.drift;
        if now < (*due)? {
            return None;
        }
        let since_nanos = now.nanos_since(self.from);
        *due = (since_nanos < *over_nanos).then(|| now.plus_nanos(DRIFT_NANOS));
        #[expect(clippy::cast_precision_loss, reason = "below 2^53 ns")]
        let part = if since_nanos < *over_nanos { since_nanos as f64 / *over_nanos as f64 } else { 1.0 };
        Some(*to * part)
    }

    /// What reaches the coil at `now` of `command`.
    pub fn drive(&self, now: Time, command: DriveCommand) -> DriveCommand {
        match command.mode() {
            Some(mode) if now >= self.from && self.dead == Some(mode) => DriveCommand::OFF,
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

    /// The jolt in rad/s, at the first call when it is due.
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
        let mut faults = MotorFaults::of(&scene).unwrap();
        let (before, after) = (Time::from_nanos(999_999_999), Time::from_nanos(1_000_000_000));
        let command = DriveCommand::saturating(DriveMode::B, 0.8);
        assert_eq!(faults.drive(before, command), command);
        assert_eq!(faults.drive(after, command), DriveCommand::saturating(DriveMode::C, 0.4));
        assert_eq!(faults.drive(after, DriveCommand::OFF), DriveCommand::OFF);
        assert_eq!([before, after, after].map(|now| faults.jolt(now)), [None, Some(-2.0), None]);
        assert_eq!(MotorFaults::of(&Scene::default()), None);
    }

    /// A percent in two seconds from the first second on: half of it at 2 s, all of it at 3 s, and then no more
    /// changes.
    #[test]
    fn exact_resonances_drift_in_proportion_to_time() {
        let mut scene = Scene::default();
        for (key, value) in [("from_s", "1"), ("drift_percent", "-1"), ("drift_s", "2")] {
            scene.set(&format!("fault.{key}"), value).unwrap();
        }
        let mut faults = MotorFaults::of(&scene).unwrap();
        let mut at = |millis: u64| faults.drifted(Time::from_nanos(millis * 1_000_000));
        assert_eq!(at(999), None);
        for (millis, expected) in [(1000, 0.0), (2000, -0.005), (3000, -0.01)] {
            assert!((at(millis).unwrap() - expected).abs() < 1e-12, "{millis}");
        }
        assert_eq!(at(3001), None);
        scene.set("fault.drift_s", "0").unwrap();
        let mut step = MotorFaults::of(&scene).unwrap();
        assert_eq!(
            [0, 2, 3].map(|s| step.drifted(Time::from_nanos(s * 1_000_000_000))),
            [None, Some(-0.01), None]
        );
    }

    #[test]
    fn exact_a_dead_mode_drives_nothing_and_the_other_everything() {
        let mut scene = Scene::default();
        scene.set("fault.dead_mode", "c").unwrap();
        let faults = MotorFaults::of(&scene).unwrap();
        for (mode, applied) in
            [(DriveMode::B, DriveCommand::full(DriveMode::B)), (DriveMode::C, DriveCommand::OFF)]
        {
            assert_eq!(faults.drive(Time::ZERO, DriveCommand::full(mode)), applied);
        }
    }
}
