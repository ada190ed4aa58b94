//! What further recordings would tell beside those that there are: each of a short list is made of the motors that were
//! drawn, and its statistics are set beside theirs.

use motor_model::{DriveMode, MotorParams};

use super::emulator::{Summaries, TOLD};
use super::parameters::Unknown;
use super::training::{DrawnMotor, Setting, draw_motors};
use simulation::runs::RunError;
use simulation::runs::recording::design_frequency_hz;
use simulation::scene::{Scene, SceneError};

/// A recording that could be made.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    name: &'static str,
    model: &'static str,
    schedule: &'static str,
}

/// Recordings that could be made. `{b+}` is a frequency above that of mode B's design, `{b-}` one below it.
const CANDIDATES: [Candidate; 6] = [
    Candidate {
        name: "the ring-down of the bare stator",
        model: "stator",
        schedule: "(b:1 for 0.03, off for 0.02, c:1 for 0.03, off for 0.02) x2",
    },
    Candidate {
        name: "a sweep of the bare stator",
        model: "stator",
        schedule: "b:0.2@{b-}..{b+} for 0.2, off for 0.02, c:0.2@{c-}..{c+} for 0.2, off for 0.02",
    },
    Candidate {
        name: "full drive in B and coasting",
        model: "motor",
        schedule: "(b:1 for 0.1, off for 0.05) x2",
    },
    Candidate {
        name: "full drive in C and coasting",
        model: "motor",
        schedule: "(c:1 for 0.1, off for 0.05) x2",
    },
    Candidate {
        name: "half drive in B and coasting",
        model: "motor",
        schedule: "(b:0.5 for 0.1, off for 0.05) x2",
    },
    Candidate {
        name: "half drive in C and coasting",
        model: "motor",
        schedule: "(c:0.5 for 0.1, off for 0.05) x2",
    },
];

/// Place of the first of them among the recordings of a motor: beyond all that there are.
const FIRST_PLACE: u64 = 512;

/// Number of recordings that could be made.
pub const COUNT: u64 = CANDIDATES.len() as u64;

impl Candidate {
    /// The schedule for a motor of this design.
    fn schedule(&self, design: &MotorParams) -> String {
        let mut schedule = self.schedule.to_owned();
        for (name, mode) in [("b", DriveMode::B), ("c", DriveMode::C)] {
            let hz = design_frequency_hz(design, mode);
            schedule = schedule.replace(&format!("{{{name}-}}"), &(0.99 * hz).round().to_string());
            schedule = schedule.replace(&format!("{{{name}+}}"), &(1.01 * hz).round().to_string());
        }
        schedule
    }

    /// How it is made of a motor of this design.
    fn command(&self, design: &MotorParams) -> String {
        let model = if self.model == "motor" { "" } else { " --model stator" };
        format!("record{model} --schedule '{}'", self.schedule(design))
    }

    /// What is recorded, with the instruments of `scene`.
    fn setting(&self, scene: &Scene, unknowns: &[Unknown], place: u64) -> Result<Setting, RunError> {
        let schedule = self.schedule(&scene.motor_params());
        let mut scene = instruments_of(scene, self.model)?;
        scene.set("record.model", self.model)?;
        scene.set("record.schedule", &schedule)?;
        Setting::planned(scene, unknowns, place)
    }
}

/// `scene` without what a stator without a rotor does not have, for a recording of one.
///
/// # Errors
/// When the scene is refused.
pub fn instruments_of(scene: &Scene, model: &str) -> Result<Scene, SceneError> {
    if model == "motor" {
        return Ok(scene.clone());
    }
    let mut bare = Scene::default();
    let kept = |key: &&str| ["motor.", "ldv.", "plant.rotor"].iter().any(|kept| key.starts_with(kept));
    for key in scene.keys_set().filter(kept) {
        bare.set(key, scene.value_text(key).trim_matches('"'))?;
    }
    Ok(bare)
}

/// What would tell a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// The recording that tells most of it beside those that there are.
    pub recording: &'static str,
    /// How it is made.
    pub command: String,
    /// Expected standard deviation after all of them per that before.
    pub expected: f64,
}

/// Of each parameter the recording of the list that tells most of it beside those of `motors`, which are the first of
/// the sample that `seed` names; `None` where none tells it.
///
/// # Errors
/// When the model refuses a motor.
pub fn advice(
    scene: &Scene,
    unknowns: &[Unknown],
    seed: u64,
    motors: &[DrawnMotor],
    done: &(impl Fn() + Sync),
) -> Result<Vec<Option<Advice>>, RunError> {
    let mut best: Vec<Option<Advice>> = vec![None; unknowns.len()];
    for (candidate, place) in CANDIDATES.iter().zip(FIRST_PLACE..) {
        let setting = candidate.setting(scene, unknowns, place)?;
        let further = draw_motors(&[setting], unknowns, seed, motors.len() as u64, done)?;
        let both: Vec<DrawnMotor> =
            motors.iter().zip(&further).map(|(one, other)| one.beside(other)).collect();
        for (best, expected) in best.iter_mut().zip(Summaries::learn(&both).expected) {
            if expected < best.as_ref().map_or(TOLD, |best| best.expected) {
                let command = candidate.command(&scene.motor_params());
                *best = Some(Advice { recording: candidate.name, command, expected });
            }
        }
    }
    Ok(best)
}
