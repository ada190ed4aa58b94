//! The keys `motor.` that follow from a stator or from an ensemble, as a scene file that every command takes.

use std::fmt::Write as _;

use simulation::math::statistics::Spread;
use simulation::world::kept_stators::member_keys;
use stator::drawing::table::{NUMBERS, SPREAD_SEED_KEY};
use stator::ensemble::Member;
use stator::{Clamp, Silicon, Springs};

use super::SolvedStator;
use super::driven::DrivenStator;
use super::members::Ensemble;
use super::quantities::{QUANTITIES, Quantity};

impl SolvedStator {
    /// Keys and values of the motor that has this stator. What does not follow from a drawing is left at its default:
    /// damping, drive, rotor, hub.
    pub fn motor_keys(&self) -> Vec<(&'static str, f64)> {
        let n = &self.drawing.numbers;
        let mut keys = vec![
            ("motor.stator_inner_radius_m", n.inner_radius_m),
            ("motor.stator_outer_radius_m", n.outer_radius_m),
            ("motor.tooth_radius_m", n.tooth_radius_m),
            ("motor.tooth_height_m", n.tooth_height_m),
            ("motor.tooth_angle_deg", n.tooth_angle_deg),
        ];
        keys.extend(member_keys(&Member::of(0, &self.drawing, &self.figures)));
        keys
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

    /// The motor that has this stator as a scene file, with the keys of `given` that do not follow from a stator.
    pub fn motor_scene(&self, given: &[(&'static str, f64)]) -> String {
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
        if let Some(driven) = DrivenStator::of(self) {
            for (name, value) in driven.lines(self.drawing.numbers.field_angle_deg) {
                let _ = writeln!(toml, "# {name}: {value}");
            }
        }
        toml
    }
}

impl Ensemble {
    /// The mean motor of those that meet the frequencies, with twice the standard deviation as tolerance.
    pub fn motor_scene(&self) -> String {
        let mut toml = String::from(
            "# The motor that follows from an ensemble of stators: host-sim stator --ensemble. Tolerances are\n\
             # twice the standard deviation; a key that all have within a thousandth has none. Values vary\n\
             # together, which a scene cannot say: members.csv has the rows.\n",
        );
        let rows: Vec<_> = self.met().map(member_keys).collect();
        let Some(first) = rows.first() else { return toml };
        for (place, (key, _)) in first.iter().enumerate() {
            let spread: Spread = rows.iter().map(|row| row[place].1).collect();
            let comment = if needs_tilt(key) { "# " } else { "" };
            let _ = writeln!(toml, "{comment}{key} = {}", significant(spread.mean));
            if spread.sd > 1e-3 * spread.mean.abs() {
                let _ = writeln!(toml, "{comment}plant.tolerance.{key} = {}", significant(2.0 * spread.sd));
            }
        }
        let is_beside = |of: &&Quantity| ["mN/ppm", "ppm"].contains(&of.unit) || of.name.contains("field");
        for quantity in QUANTITIES.iter().filter(is_beside) {
            let spread = self.spread(*quantity);
            if spread.mean.is_finite() {
                let (name, unit) = (quantity.name, quantity.unit);
                let _ = writeln!(toml, "# {name}: {:.3} +- {:.3} {unit}", spread.mean, spread.sd);
            }
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
        scene.set_all(&solved.motor_scene(&given), Path::new("motor.toml")).unwrap();
        assert!((scene.number("motor.rotor_mass_kg") - 4e-5).abs() < 1e-12);
        for (key, value) in solved.motor_keys().into_iter().filter(|(key, _)| !needs_tilt(key)) {
            assert!((scene.number(key) - value).abs() <= 1e-5 * value.abs(), "{key}");
        }
        let ensemble = Ensemble { members: vec![Member::of(0, &drawing, &solved.figures); 2] };
        let mut mean = Scene::default();
        mean.set_all(&ensemble.motor_scene(), Path::new("motor.toml")).unwrap();
        let mass = mean.number("motor.stator_mass_kg");
        assert!((mass / solved.figures.stator_mass_kg - 1.0).abs() < 1e-5, "{mass}");
        let mut again = Scene::default();
        again.set_all(&solved.drawing_toml(), Path::new("drawing.toml")).unwrap();
        assert_eq!(super::super::drawing(&again), drawing);
    }
}
