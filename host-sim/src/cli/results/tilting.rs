//! The scenes of tilting rotors that pages show beside the height-only one.
//!
//! Twin, response map and drive are those of Table 1 in all of them: nothing is tuned to a rotor that tilts.

use std::path::Path;

use crate::cli::CommandError;
use crate::studies::beside::BesideScene;
use simulation::scene::Scene;

/// Name of the scene without a tilt in the tables.
pub(super) const HEIGHT_ONLY: &str = "height only";

const SET_F: (&str, &str) = ("set_f_plant.toml", include_str!("../../../scenes/set_f_plant.toml"));
const SET_G: (&str, &str) = ("set_g_plant.toml", include_str!("../../../scenes/set_g_plant.toml"));

/// The motors are drawn around the set's values, those of the hub included.
const DRAWN: (&str, &str) = ("plant.parameters", "around_plant");
const ONE_MARK: (&str, &str) = ("camera.marks", "1");
const THREE_MARKS: (&str, &str) = ("camera.marks", "3");

/// A set, and what is set over it.
struct TiltingScene {
    name: &'static str,
    set: (&'static str, &'static str),
    over: &'static [(&'static str, &'static str)],
}

/// For a study of many motors.
const OF_MANY_MOTORS: [TiltingScene; 6] = [
    TiltingScene { name: "set F", set: SET_F, over: &[] },
    TiltingScene { name: "set F, drawn", set: SET_F, over: &[DRAWN] },
    TiltingScene { name: "set G", set: SET_G, over: &[] },
    TiltingScene { name: "set G, drawn", set: SET_G, over: &[DRAWN] },
    TiltingScene { name: "set F, drawn, 1 mark", set: SET_F, over: &[DRAWN, ONE_MARK] },
    TiltingScene { name: "set F, drawn, 3 marks", set: SET_F, over: &[DRAWN, THREE_MARKS] },
];

/// For a study of one motor.
const OF_ONE_MOTOR: [TiltingScene; 4] = [
    TiltingScene { name: "set F", set: SET_F, over: &[] },
    TiltingScene { name: "set G", set: SET_G, over: &[] },
    TiltingScene { name: "set F, 1 mark", set: SET_F, over: &[ONE_MARK] },
    TiltingScene { name: "set F, 3 marks", set: SET_F, over: &[THREE_MARKS] },
];

/// `scene` with a camera that tracks one mark.
pub(super) fn with_one_mark(scene: &Scene) -> Result<BesideScene, CommandError> {
    let mut scene = scene.clone();
    let (key, value) = ONE_MARK;
    scene.set(key, value)?;
    Ok(BesideScene { name: format!("{HEIGHT_ONLY}, 1 mark"), scene })
}

/// The first `count` scenes for a study of many motors, each over `scene`.
pub(super) fn of_many_motors(scene: &Scene, count: usize) -> Result<Vec<BesideScene>, CommandError> {
    OF_MANY_MOTORS.iter().take(count).map(|of| of.over(scene)).collect()
}

/// The first `count` scenes for a study of one motor, each over `scene`.
pub(super) fn of_one_motor(scene: &Scene, count: usize) -> Result<Vec<BesideScene>, CommandError> {
    OF_ONE_MOTOR.iter().take(count).map(|of| of.over(scene)).collect()
}

/// The scenes whose motors are commissioned, each over `scene`: those with the default marks, one less than `count`,
/// since a minute of such a motor takes long.
pub(super) fn to_commission(scene: &Scene, count: usize) -> Result<Vec<BesideScene>, CommandError> {
    let with_default_marks =
        OF_MANY_MOTORS.iter().filter(|of| !of.over.contains(&ONE_MARK) && !of.over.contains(&THREE_MARKS));
    with_default_marks.take(count.saturating_sub(1)).map(|of| of.over(scene)).collect()
}

impl TiltingScene {
    fn over(&self, scene: &Scene) -> Result<BesideScene, CommandError> {
        let mut scene = scene.clone();
        let (path, toml) = self.set;
        scene.set_all(toml, Path::new(path))?;
        for (key, value) in self.over {
            scene.set(key, value)?;
        }
        Ok(BesideScene { name: self.name.to_owned(), scene })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use simulation::scene::RotorModel;

    /// Each is a rotor that tilts and shifts, with a twin of Table 1.
    #[test]
    fn exact_each_scene_tilts_and_its_design_is_that_of_table_1() {
        let scene = Scene::default();
        let all = [of_many_motors(&scene, 9), of_one_motor(&scene, 9)];
        for BesideScene { name, scene } in all.into_iter().flat_map(Result::unwrap) {
            assert_eq!(RotorModel::of(&scene).unwrap().word(), "tilting", "{name}");
            assert_eq!(scene.motor_params(), motor_model::MotorParams::nominal(), "{name}");
        }
    }
}
