//! The keys `motor.` that follow from a stator, as a scene file that every command takes.

use std::fmt::Write as _;

use stator::drawing::table::{NUMBERS, SPREAD_SEED_KEY};
use stator::{Clamp, Silicon, Springs};

use super::SolvedStator;

impl SolvedStator {
    /// Keys and values of the motor that has this stator. What does not follow from a drawing is left at its default:
    /// damping, drive, rotor, hub.
    pub fn motor_keys(&self) -> Vec<(&'static str, f64)> {
        let (f, n) = (&self.figures, &self.drawing.numbers);
        let [t1, t2] = f.tilt;
        let tilt_hz = 0.5 * (t1.frequency_hz + t2.frequency_hz);
        let [shift_b_deg, shift_c_deg] = f.mode_shift_deg;
        let fraction = |modal_mass_kg: f64| modal_mass_kg / f.stator_mass_kg;
        vec![
            ("motor.stator_inner_radius_m", n.inner_radius_m),
            ("motor.stator_outer_radius_m", n.outer_radius_m),
            ("motor.tooth_radius_m", n.tooth_radius_m),
            ("motor.stator_thickness_m", n.foil_thickness_m + n.silicon_thickness_m),
            ("motor.tooth_height_m", n.tooth_height_m),
            ("motor.tooth_angle_deg", n.tooth_angle_deg),
            ("motor.mode_shift_deg", shift_c_deg),
            ("motor.mode_b.extra_shift_deg", shift_b_deg - shift_c_deg),
            ("motor.mode_a.frequency_hz", f.a.frequency_hz),
            ("motor.mode_b.frequency_hz", f.b.frequency_hz),
            ("motor.mode_c.frequency_hz", f.c.frequency_hz),
            ("motor.mode_a.mass_fraction", fraction(f.a.modal_mass_kg)),
            ("motor.mode_b.mass_fraction", fraction(f.b.modal_mass_kg)),
            ("motor.mode_c.mass_fraction", fraction(f.c.modal_mass_kg)),
            ("motor.stator_tilt.frequency_hz", tilt_hz),
            ("motor.stator_tilt.split", (t2.frequency_hz - t1.frequency_hz).abs() / tilt_hz),
            ("motor.stator_tilt.mass_fraction", fraction(0.5 * (t1.modal_mass_kg + t2.modal_mass_kg))),
            ("motor.stator_tilt.rocking_exponent", 0.5 * (t1.exponent + t2.exponent)),
            ("motor.mode_a.rocking_exponent", f.a.exponent),
            ("motor.tooth_rocking_exponent", f.b.exponent),
            ("motor.mode_c.extra_rocking_exponent", f.c.exponent - f.b.exponent),
            ("motor.stator_mass_kg", f.stator_mass_kg),
        ]
    }

    /// The drawing with what a fit has found, as a scene file of the command `stator`.
    pub(super) fn drawing_toml(&self) -> String {
        let mut toml = String::from("# The drawing of this stator: host-sim stator --scene drawing.toml\n");
        for (field, value) in NUMBERS.iter().zip(self.drawing.numbers.values()) {
            let _ = writeln!(toml, "{} = {}", field.key, simulation::math::plain_number::plain(value));
        }
        let stressed = if self.drawing.stressed { "yes" } else { "no" };
        let springs = match self.drawing.springs {
            Springs::T => "t",
            Springs::L => "l",
            Springs::None => "none",
        };
        let silicon = match self.drawing.silicon {
            Silicon::Crystal => "crystal",
            Silicon::Isotropic => "isotropic",
        };
        let clamp = match self.drawing.clamp {
            Clamp::Arms => "arms",
            Clamp::InnerRim => "inner_rim",
            Clamp::OuterRim => "outer_rim",
            Clamp::Nothing => "nothing",
        };
        let words = [("springs", springs), ("clamp", clamp), ("silicon", silicon), ("stressed", stressed)];
        for (key, word) in words {
            let _ = writeln!(toml, "stator.{key} = \"{word}\"");
        }
        let _ = writeln!(toml, "{SPREAD_SEED_KEY} = {}", self.drawing.spread_seed);
        toml
    }

    /// The same as a scene file, with the keys of `given` that do not follow from a stator.
    pub(super) fn motor_toml(&self, given: &[(&'static str, f64)]) -> String {
        let mut toml = String::from(
            "# The motor that follows from a stator by finite elements: host-sim stator.\n# Damping, drive, rotor and \
             hub do not follow from it.\n",
        );
        let follows = self.motor_keys();
        let is_other = |(key, _): &&(&'static str, f64)| follows.iter().all(|(other, _)| other != key);
        for (key, value) in given.iter().filter(is_other) {
            let _ = writeln!(toml, "{key} = {}", simulation::math::plain_number::plain(*value));
        }
        for (key, value) in &follows {
            // Six digits: the mesh is good for three. A height-only rotor refuses what only one that tilts uses.
            let comment = if needs_tilt(key) { "# " } else { "" };
            let _ = writeln!(toml, "{comment}{key} = {}", significant(*value));
        }
        toml
    }
}

/// Whether a key is read with `plant.rotor = "tilting"` only.
fn needs_tilt(key: &str) -> bool {
    key.contains("stator_tilt") || key.contains("rocking_exponent")
}

/// A value with six digits, as TOML takes it.
fn significant(value: f64) -> String {
    let rounded: f64 = format!("{value:.5e}").parse().unwrap_or(value);
    simulation::math::plain_number::plain(rounded)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use simulation::scene::Scene;
    use stator::solver::Solver;

    use super::*;

    /// The scene file of a solved stator is a scene, with its values.
    #[test]
    fn law_the_motor_of_a_stator_is_a_scene() {
        let mut drawing = stator::Drawing::default();
        drawing.numbers.mesh_size_m = 0.8e-3;
        let solved = SolvedStator::as_drawn(&drawing, &Solver::default()).unwrap();
        let mut scene = Scene::default();
        let given = [("motor.rotor_mass_kg", 4e-5), ("motor.mode_b.frequency_hz", 1.0)];
        scene.set_all(&solved.motor_toml(&given), Path::new("motor.toml")).unwrap();
        assert!((scene.number("motor.rotor_mass_kg") - 4e-5).abs() < 1e-12);
        for (key, value) in solved.motor_keys().into_iter().filter(|(key, _)| !needs_tilt(key)) {
            assert!((scene.number(key) - value).abs() <= 1e-5 * value.abs(), "{key}");
        }
        let mut again = Scene::default();
        again.set_all(&solved.drawing_toml(), Path::new("drawing.toml")).unwrap();
        assert_eq!(super::super::drawing(&again), drawing);
    }
}
