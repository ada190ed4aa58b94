//! What further recordings would tell, of a short list, computed as for those that there are.

use motor_model::Parameter;

use super::emulator::{Summaries, TOLD};
use super::parameters::Unknown;
use super::training::{Setting, draw_motors};
use crate::runs::RunError;
use crate::scene::{Scene, SceneError};

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

/// Number of recordings that could be made.
pub const COUNT: u64 = CANDIDATES.len() as u64;

impl Candidate {
    /// What is recorded, with the instruments of `scene`.
    fn setting(&self, scene: &Scene, unknowns: &[Unknown]) -> Result<Setting, RunError> {
        let design = scene.motor_params();
        let mut schedule = self.schedule.to_owned();
        for (name, parameter) in [("b", Parameter::ModeBFrequency), ("c", Parameter::ModeCFrequency)] {
            let hz = design.get(parameter);
            schedule = schedule.replace(&format!("{{{name}-}}"), &(0.99 * hz).to_string());
            schedule = schedule.replace(&format!("{{{name}+}}"), &(1.01 * hz).to_string());
        }
        let mut scene = instruments_of(scene, self.model)?;
        scene.set("record.model", self.model)?;
        scene.set("record.schedule", &schedule)?;
        Setting::planned(scene, unknowns)
    }
}

/// `scene` without what a stator without a rotor does not have, for a recording of one.
pub(super) fn instruments_of(scene: &Scene, model: &str) -> Result<Scene, SceneError> {
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Advice {
    /// The recording that tells most of it.
    pub recording: &'static str,
    /// Expected standard deviation after it per that before.
    pub expected: f64,
}

/// Of each parameter the recording of the list that tells most of it; `None` where none tells it. Each is tried on
/// `count` motors.
///
/// # Errors
/// When the model refuses a motor.
pub fn advice(
    scene: &Scene,
    unknowns: &[Unknown],
    seed: u64,
    count: u64,
    done: &(impl Fn() + Sync),
) -> Result<Vec<Option<Advice>>, RunError> {
    let mut best: Vec<Option<Advice>> = vec![None; unknowns.len()];
    for candidate in CANDIDATES {
        let setting = candidate.setting(scene, unknowns)?;
        let motors = draw_motors(&[setting], unknowns, seed, count, done)?;
        for (best, expected) in best.iter_mut().zip(Summaries::learn(&motors).expected) {
            if expected < best.map_or(TOLD, |best| best.expected) {
                *best = Some(Advice { recording: candidate.name, expected });
            }
        }
    }
    Ok(best)
}
