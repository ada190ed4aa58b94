//! Which model of the rotor a scene chooses, and the keys that only one of them uses.

use motor_model::{Freedom, TiltingParameter};

use super::setting::tilting_plant_key;
use super::{Scene, SceneError};

/// A model of the rotor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RotorModel {
    /// It moves up and down and turns: [`motor_model::Motor`].
    HeightOnly,
    /// It tilts as well, over four teeth, and shifts on its pin as far as the freedom says:
    /// [`motor_model::TiltingMotor`].
    Tilting(Freedom),
}

impl RotorModel {
    /// The words of a scene.
    pub const WORDS: &'static [&'static str] = &["height_only", "tilting", "tilting_without_shift"];

    /// The model that `scene` chooses.
    ///
    /// # Errors
    /// When the scene sets a key that the model does not use.
    pub fn of(scene: &Scene) -> Result<Self, SceneError> {
        let model = match scene.choice("plant.rotor") {
            "tilting" => Self::Tilting(Freedom::Full),
            "tilting_without_shift" => Self::Tilting(Freedom::WithoutShift),
            _ => Self::HeightOnly,
        };
        let of_tilting = |key: &str| {
            TiltingParameter::ALL
                .into_iter()
                .any(|parameter| key == parameter.spec().key || key == tilting_plant_key(parameter))
        };
        match scene.keys_set().find(|key| model == Self::HeightOnly && of_tilting(key)) {
            None => Ok(model),
            Some(key) => Err(SceneError::NotRead {
                refusal: format!("plant.rotor = height_only does not use {key}"),
                hint: "plant.rotor=tilting uses it".to_owned(),
            }),
        }
    }

    /// Whether the rotor shifts on a pin.
    pub fn has_hub(self) -> bool {
        self == Self::Tilting(Freedom::Full)
    }

    /// Its word in a scene.
    pub fn word(self) -> &'static str {
        match self {
            Self::HeightOnly => "height_only",
            Self::Tilting(Freedom::Full) => "tilting",
            Self::Tilting(_) => "tilting_without_shift",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(sets: &[&str]) -> Result<RotorModel, String> {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        RotorModel::of(&Scene::of_sets(&sets).unwrap()).map_err(|error| error.one_line())
    }

    #[test]
    fn exact_every_word_names_its_model() {
        for word in RotorModel::WORDS {
            assert_eq!(of(&[&format!("plant.rotor={word}")]).unwrap().word(), *word);
        }
        assert_eq!(of(&[]), Ok(RotorModel::HeightOnly));
    }

    #[test]
    fn exact_keys_of_the_tilting_motor_need_it() {
        for key in ["motor.hub.friction", "plant.motor.hub.clearance_m", "motor.stator_tilt.frequency_hz"] {
            let set = format!("{key}=0.4").replace("frequency_hz=0.4", "frequency_hz=4e3");
            let line = of(&[&set]).unwrap_err();
            assert!(line.contains(&format!("plant.rotor = height_only does not use {key}")), "{line}");
            assert!(line.contains("plant.rotor=tilting uses it"), "{line}");
            assert!(
                of(&[&set, "plant.rotor=tilting"]).is_ok()
                    && of(&[&set, "plant.rotor=tilting_without_shift"]).is_ok()
            );
        }
    }
}
