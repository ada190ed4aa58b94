//! The deck: a mesh as the input of CalculiX, in mm, t, s, MPa and K.
//!
//! Two steps. The first cools the stator from the bonding temperature; the second finds modes. A stressed stator is
//! cooled with large deflections, and its modes are those of the state that results:
//!
//! ```text
//! (K - w^2 M) phi = 0,  phi' M phi = 1,     K the tangent stiffness of the cooled state, or that of the flat one
//! ```
//!
//! A free stator is held at three places while it cools, by no more than rigid motion needs, and let go for its modes.

use std::fmt::Write as _;

use crate::drawing::{Clamp, Drawing, Silicon};
use crate::mesh::{Material, Mesh};

/// Modes asked for: two or three more than the five that are read.
const MODES: usize = 8;
/// Rigid motions of a free stator come before its modes.
const RIGID: usize = 6;

/// The name of the set of nodes whose displacements are printed, as CalculiX prints it.
pub const PROBES: &str = "PROBES";

/// The deck of a drawing.
pub fn of(drawing: &Drawing, mesh: &Mesh) -> String {
    let mut deck = String::new();
    heading(&mut deck, mesh);
    materials(&mut deck, drawing);
    steps(&mut deck, drawing, mesh);
    deck
}

/// A line of the deck. Writing to a string cannot fail.
macro_rules! line {
    ($deck:expr, $($argument:tt)*) => {{ let _ = writeln!($deck, $($argument)*); }};
}

/// Numbers of nodes or bricks, counted from 1, eight a line.
fn numbered(deck: &mut String, numbers: impl Iterator<Item = usize>) {
    let numbers: Vec<String> = numbers.map(|number| (number + 1).to_string()).collect();
    for row in numbers.chunks(8) {
        line!(deck, "{}", row.join(","));
    }
}

fn heading(deck: &mut String, mesh: &Mesh) {
    line!(deck, "*NODE, NSET=ALL");
    for (number, node) in mesh.nodes.iter().enumerate() {
        let [x, y, z] = node.xyz().map(|metres| 1e3 * metres);
        line!(deck, "{},{x:.9e},{y:.9e},{z:.9e}", number + 1);
    }
    for (material, set) in [(Material::Foil, "FOIL"), (Material::Silicon, "SILICON")] {
        line!(deck, "*ELEMENT, TYPE=C3D20R, ELSET={set}");
        let bricks = mesh.bricks.iter().enumerate().filter(|(_, (_, of))| *of == material);
        for (number, (brick, _)) in bricks {
            let nodes: Vec<String> = brick.0.iter().map(|node| (node + 1).to_string()).collect();
            line!(deck, "{},{},\n{}", number + 1, nodes[..10].join(","), nodes[10..].join(","));
        }
    }
    line!(deck, "*NSET, NSET={PROBES}");
    numbered(deck, mesh.probes());
    if !mesh.clamped.is_empty() {
        line!(deck, "*NSET, NSET=FACE");
        numbered(deck, mesh.clamped.iter().copied());
        line!(deck, "*NSET, NSET=LINE");
        numbered(deck, mesh.clamped_in_height.iter().copied());
    }
}

fn materials(deck: &mut String, drawing: &Drawing) {
    let n = &drawing.numbers;
    let (sin, cos) = libm::sincos(n.crystal_angle_deg.to_radians());
    line!(deck, "*ORIENTATION, NAME=CRYSTAL, SYSTEM=RECTANGULAR");
    line!(deck, "{cos:.9e},{sin:.9e},0.,{:.9e},{cos:.9e},0.", -sin);
    line!(deck, "*MATERIAL, NAME=SILICON");
    match drawing.silicon {
        Silicon::Crystal => {
            let [c11, c12, c44] = [n.silicon_c11_pa, n.silicon_c12_pa, n.silicon_c44_pa].map(|pa| 1e-6 * pa);
            line!(deck, "*ELASTIC, TYPE=ORTHO");
            line!(deck, "{c11:.9e},{c12:.9e},{c11:.9e},{c12:.9e},{c12:.9e},{c11:.9e},{c44:.9e},{c44:.9e}");
            line!(deck, "{c44:.9e}");
        }
        Silicon::Isotropic => {
            line!(deck, "*ELASTIC\n{:.9e},{:.9e}", 1e-6 * n.silicon_modulus_pa, n.silicon_poisson);
        }
    }
    line!(deck, "*DENSITY\n{:.9e}", 1e-12 * n.silicon_density_kg_m3);
    line!(deck, "*EXPANSION\n{:.9e}", n.silicon_expansion_per_k);
    line!(deck, "*MATERIAL, NAME=FOIL");
    line!(deck, "*ELASTIC\n{:.9e},{:.9e}", 1e-6 * n.foil_modulus_pa, n.foil_poisson);
    line!(deck, "*DENSITY\n{:.9e}", 1e-12 * n.foil_density_kg_m3);
    line!(deck, "*EXPANSION\n{:.9e}", n.foil_expansion_per_k);
    let orientation = if drawing.silicon == Silicon::Crystal { ", ORIENTATION=CRYSTAL" } else { "" };
    line!(deck, "*SOLID SECTION, ELSET=SILICON, MATERIAL=SILICON{orientation}");
    line!(deck, "*SOLID SECTION, ELSET=FOIL, MATERIAL=FOIL");
}

fn steps(deck: &mut String, drawing: &Drawing, mesh: &Mesh) {
    let n = &drawing.numbers;
    let is_free = mesh.clamped.is_empty();
    line!(deck, "*INITIAL CONDITIONS, TYPE=TEMPERATURE\nALL,{:.9e}", n.bonding_temperature_c);
    let about = if drawing.stressed {
        line!(deck, "*STEP, INC=40, NLGEOM");
        // A thin ring takes more iterations than the default allows before it calls them divergent, and its residual is
        // hard to bring to half a per cent of the mean force. Two per cent change a frequency by a ten-thousandth.
        line!(deck, "*CONTROLS, PARAMETERS=TIME INCREMENTATION\n8,12,16,25,16,4,,,,");
        line!(deck, "*CONTROLS, PARAMETERS=FIELD\n0.02,0.02,,,,,,");
        // Steps of a sixteenth converge; larger ones come once the ring has bowed. A ring that takes steps below a
        // thousandth, or more than 40 of them, is about to buckle: it has no solution, which is told within minutes.
        line!(deck, "*STATIC\n0.0625,1.,1.e-3,0.25");
        ", PERTURBATION"
    } else {
        line!(deck, "*STEP\n*STATIC");
        ""
    };
    line!(deck, "*BOUNDARY");
    if is_free {
        // On one circle: all of a node, height and tangent of the one opposite, height of one between.
        let circle = &mesh.circles[0];
        let at = |quarter: usize| circle[quarter * circle.len() / 4] + 1;
        let along = |quarter: usize| {
            let [x, y, _] = mesh.nodes[at(quarter) - 1].xyz();
            if x.abs() > y.abs() { 2 } else { 1 }
        };
        line!(deck, "{},1,3\n{},{},{}", at(0), at(2), along(2), along(2));
        line!(deck, "{},3,3\n{},3,3", at(2), at(1));
    } else {
        line!(deck, "FACE,1,2\nLINE,3,3");
    }
    line!(deck, "*TEMPERATURE\nALL,{:.9e}", n.temperature_c);
    print(deck);
    line!(deck, "*EL PRINT, ELSET=FOIL, TOTALS=ONLY, FREQUENCY=1000\nEVOL");
    line!(deck, "*EL PRINT, ELSET=SILICON, TOTALS=ONLY, FREQUENCY=1000\nEVOL");
    line!(deck, "*END STEP");
    line!(deck, "*STEP{about}");
    line!(deck, "*FREQUENCY\n{}", if drawing.clamp == Clamp::Nothing { RIGID + MODES } else { MODES });
    if is_free {
        line!(deck, "*BOUNDARY, OP=NEW");
    }
    print(deck);
    line!(deck, "*END STEP");
}

/// Displacements of the probes, at the end of the step.
fn print(deck: &mut String) {
    line!(deck, "*NODE PRINT, NSET={PROBES}, FREQUENCY=1000\nU");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::table::{NUMBERS, NumberField};

    /// The same drawing makes the same deck, and what a drawing changes, the deck has.
    #[test]
    fn law_a_deck_follows_its_drawing() {
        let deck = |drawing: &Drawing| of(drawing, &Mesh::of(drawing).unwrap());
        let drawing = Drawing::default();
        let first = deck(&drawing);
        assert_eq!(first, deck(&drawing));
        assert!(!first.contains("PERTURBATION") && first.contains("ORIENTATION=CRYSTAL"));
        let stressed = deck(&Drawing { stressed: true, ..drawing });
        assert!(stressed.contains("*STEP, PERTURBATION") && stressed.contains("NLGEOM"));
        // The direction of the field changes what the modes do, not the modes.
        let is_of_deck = |field: &&NumberField| field.key != "stator.field_angle_deg";
        for field in NUMBERS.iter().filter(is_of_deck) {
            let mut changed = Drawing { spread_seed: 1, ..drawing };
            let value = changed.numbers.value_mut(field.key).unwrap();
            *value += (0.01 * value.abs()).max(1e-3 * (field.max - field.min).min(1.0));
            if field.key.starts_with("stator.silicon_modulus")
                || field.key.starts_with("stator.silicon_poisson")
            {
                changed.silicon = Silicon::Isotropic;
            }
            let other = deck(&changed);
            changed.numbers = drawing.numbers;
            assert_ne!(other, deck(&changed), "{} changes nothing", field.key);
        }
    }
}
