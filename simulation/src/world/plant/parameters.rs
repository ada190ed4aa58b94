//! The parameters of a true motor: drawn around the design by the seed, with what the scene sets of it, and with a
//! stator of finite elements if the scene asks for one.

use motor_model::{MotorParams, TiltingParams};

use crate::math::random_streams::{self, RandomSource};
use crate::scene::{Scene, SceneError};
#[cfg(feature = "members")]
use crate::world::kept_stators::{self, KeptStator};

/// Those of the true motor that a scene names, and what it has beside them if its rotor tilts.
///
/// # Errors
/// When a value is out of its bounds, or two settings clash.
pub(super) fn of_true_motor(scene: &Scene) -> Result<(MotorParams, TiltingParams), SceneError> {
    let (params, tilting) = drawn(scene)?;
    #[cfg(feature = "members")]
    if let Some(kept) = kept_stator(scene)? {
        return Ok(kept.in_motor(params, tilting)?);
    }
    Ok((params, tilting))
}

/// As the design and the tolerances say, with what was set of the true motor.
fn drawn(scene: &Scene) -> Result<(MotorParams, TiltingParams), SceneError> {
    let (design, tilting_design) = (scene.motor_params(), scene.tilting_params());
    let set = |params: MotorParams| {
        scene.plant_overrides().try_fold(params, |params, (parameter, value)| params.with(parameter, value))
    };
    let mut draw = random_streams::stream(scene.seed(), RandomSource::PlantDraw);
    let mut drawn = |params: MotorParams, tilting: TiltingParams| {
        (
            params.draw_within(|parameter| scene.tolerance(parameter.spec().key), &mut draw),
            tilting.draw_within(|parameter| scene.tolerance(parameter.spec().key), &mut draw),
        )
    };
    Ok(match scene.choice("plant.parameters") {
        "around_plant" => drawn(set(design)?, scene.tilting_plant_params(tilting_design)?),
        // What the scene sets of the true motor is not drawn.
        how => {
            let (around, tilting) =
                if how == "drawn" { drawn(design, tilting_design) } else { (design, tilting_design) };
            (set(around)?, scene.tilting_plant_params(tilting)?)
        }
    })
}

/// The stator of finite elements that the seed draws, if the scene asks for one.
#[cfg(feature = "members")]
fn kept_stator(scene: &Scene) -> Result<Option<&'static KeptStator>, SceneError> {
    if scene.choice("plant.stator") != "finite_elements" {
        return Ok(None);
    }
    if let Some(key) = scene.keys_of_true_motor().find(|key| kept_stators::tells(key)) {
        return Err(SceneError::Conflict {
            conflict: format!("plant.{key}, and plant.stator=finite_elements, which has a value of its own"),
            hint: "leave one of them out".to_owned(),
        });
    }
    Ok(kept_stators::of_seed(scene.seed()))
}
