//! The model that a scene chooses for the open loop, and the keys that it uses.

use crate::scene::{Scene, SceneError};

/// What is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OpenLoopModel {
    /// Stator and rotor, impact by impact.
    Motor,
    /// The driven stator without a rotor.
    Stator,
    /// Mean rate and random deviations, identified from the full motor.
    Averaged,
}

/// Keys, and beginnings of keys, that stator and averaged motor use.
const OF_BOTH: &[&str] = &["simulate.model", "simulate.drive", "simulate.amplitude", "simulate.duration_s"];
/// What the stator's amplitudes depend on besides: the coil does not drive mode A.
const OF_STATOR: &[&str] = &[
    "simulate.settle_s",
    "simulate.step_s",
    "motor.tooth_angle",
    "motor.mode_shift",
    "motor.mode_b.",
    "motor.mode_c.",
];
/// What the averaged motor depends on besides: it is identified from the whole motor.
const OF_AVERAGED: &[&str] = &["seed", "motor."];

impl OpenLoopModel {
    /// The model that a scene asks for.
    ///
    /// # Errors
    /// When the scene sets a key that the model does not use.
    pub fn from_scene(scene: &Scene) -> Result<Self, SceneError> {
        let name = scene.choice("simulate.model");
        let (model, used) = match name {
            "stator" => (Self::Stator, OF_STATOR),
            "averaged" => (Self::Averaged, OF_AVERAGED),
            _ => return Ok(Self::Motor),
        };
        let is_used = |key: &str| OF_BOTH.iter().chain(used).any(|used| key.starts_with(used));
        scene.keys_set().find(|key| !is_used(key)).map_or(Ok(model), |key| {
            Err(SceneError::NotRead {
                refusal: format!("simulate.model = {name} does not use {key}"),
                hint: "simulate.model=motor uses it".to_owned(),
            })
        })
    }
}
