//! The rotors that are compared. Their values stand in the scene files that are shipped.

use std::path::Path;

use simulation::scene::{Scene, SceneError};

/// A rotor that is compared with the experiment.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    /// Its name in tables and pictures.
    pub name: &'static str,
    /// Text of its scene file.
    file: &'static str,
    /// What is set after the file.
    sets: &'static [(&'static str, &'static str)],
}

const NOMINAL_20_UM: &str = include_str!("../../../scenes/nominal_20um.toml");
const SET_F: &str = include_str!("../../../scenes/set_f.toml");
const SET_G: &str = include_str!("../../../scenes/set_g.toml");
const SET_H: &str = include_str!("../../../scenes/set_h.toml");
const STATOR_FEM: &str = include_str!("../../../scenes/stator_fem_tilting.toml");

/// A clearance at which no pin is met: the largest that the model accepts.
const NO_PIN: (&str, &str) = ("motor.hub.clearance_m", "1e-3");

/// The rotors that are compared, in the order of the tables.
pub const VARIANTS: [Variant; 7] = [
    Variant { name: "height only", file: "", sets: &[] },
    Variant {
        name: "tilting, no pin",
        file: NOMINAL_20_UM,
        sets: &[("plant.rotor", "tilting_without_shift"), NO_PIN],
    },
    Variant { name: "tilting, 20 um", file: NOMINAL_20_UM, sets: &[] },
    Variant { name: "set F", file: SET_F, sets: &[] },
    Variant { name: "set G", file: SET_G, sets: &[] },
    Variant { name: "set H", file: SET_H, sets: &[] },
    Variant { name: "finite elements", file: STATOR_FEM, sets: &[] },
];

/// The variants whose predictions are shown: those that meet the rate of mode B.
pub const EXPLAINING: [usize; 2] = [3, 5];

impl Variant {
    /// The scene of this rotor.
    ///
    /// # Errors
    /// When it is refused, which a test excludes.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let mut scene = Scene::default();
        scene.set_all(self.file, Path::new(self.name))?;
        for (key, value) in self.sets {
            scene.set(key, value)?;
        }
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_every_variant_is_a_scene_of_its_rotor() {
        let rotor = |variant: &Variant| variant.scene().unwrap().choice("plant.rotor");
        let rotors = VARIANTS.each_ref().map(rotor);
        assert_eq!(
            rotors,
            ["height_only", "tilting_without_shift", "tilting", "tilting", "tilting", "tilting", "tilting"]
        );
        assert!(EXPLAINING.iter().all(|&index| VARIANTS[index].name.starts_with("set")));
    }
}
