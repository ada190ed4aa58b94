//! The drawing of a stator: a ring of silicon on foil, four teeth, four springs, what is held, and the materials.
//!
//! ```text
//!            tooth, h_t high            angles from the axis of the first spring
//!         ___|__|________               ring from R_i to R_o, tooth from R_t outward
//!        |  silicon      |              spring "t": stem of length g from the rim, then two arms along the rim,
//!        |__foil_________|              clamped at + alpha and - alpha; "l": the arm at + alpha alone
//! ```
//!
//! The foil lies under the silicon. Bonded when hot it shrinks more, so that the inner rim comes to be highest.

pub mod table;

use self::table::{NUMBERS, Numbers};

/// The kind of springs, four of which hold the ring.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Springs {
    /// A stem and two arms.
    #[default]
    T,
    /// A stem and the arm at the side of rising angle.
    L,
    /// No springs.
    None,
}

/// What is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clamp {
    /// The ends of the arms.
    #[default]
    Arms,
    /// The inner rim of the ring.
    InnerRim,
    /// The outer rim of the ring.
    OuterRim,
    /// Nothing: a free ring.
    Nothing,
}

/// How silicon deforms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Silicon {
    /// As a cubic crystal, a (100) plane in the plane of the ring.
    #[default]
    Crystal,
    /// Alike in all directions.
    Isotropic,
}

/// All that the finite-element model knows of a stator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Drawing {
    /// Lengths, angles, materials, temperatures, mesh.
    pub numbers: Numbers,
    /// Kind of springs.
    pub springs: Springs,
    /// What is held.
    pub clamp: Clamp,
    /// Silicon.
    pub silicon: Silicon,
    /// Whether modes are those about the state that bonding leaves.
    pub stressed: bool,
    /// Names the random numbers of the springs' spread.
    pub spread_seed: u64,
}

/// Why a drawing is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum DrawingError {
    /// A value outside its bounds, which are fixed or follow from another value.
    #[error("{key} = {value} is outside its bounds {min} to {max}{}{unit}{}", if unit.is_empty() { "" } else { " " },
            if why.is_empty() { String::new() } else { format!(" ({why})") })]
    OutOfBounds {
        /// Key.
        key: &'static str,
        /// Value.
        value: f64,
        /// Smallest value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
        /// Unit; empty for a pure number.
        unit: &'static str,
        /// What the bounds follow from; empty for fixed bounds.
        why: &'static str,
    },
    /// Two values that do not go together.
    #[error("{0}")]
    Conflict(&'static str),
    /// A mesh of more nodes than the memory and the time of a run are meant for.
    #[error("stator.mesh_size_m = {mesh_size_m} makes {nodes} nodes, bounds 1 to {max}")]
    TooFine {
        /// Longest edge of a brick, m.
        mesh_size_m: f64,
        /// Nodes that it makes, roughly.
        nodes: usize,
        /// Most nodes allowed.
        max: usize,
    },
}

/// The angle by which a tooth of this drawing, its inner edge, spreads to each side.
fn half_angle(width: f64, radius: f64) -> f64 {
    0.5 * width / radius
}

impl Drawing {
    /// Whether there are teeth.
    pub fn has_teeth(&self) -> bool {
        self.numbers.tooth_radial_m > 0.0 && self.numbers.tooth_tangential_m > 0.0
    }

    /// Half of the angle that a tooth covers, rad.
    #[cfg(feature = "solver")]
    pub(crate) fn tooth_half_angle(&self) -> f64 {
        half_angle(
            self.numbers.tooth_tangential_m,
            self.numbers.tooth_radius_m + 0.5 * self.numbers.tooth_radial_m,
        )
    }

    /// Half of the angle that a stem covers at the rim, rad.
    pub(crate) fn stem_half_angle(&self) -> f64 {
        half_angle(self.numbers.spring_stem_width_m, self.numbers.outer_radius_m)
    }

    /// Checks every bound.
    ///
    /// # Errors
    /// The first value that is outside its bounds, or does not go with another.
    pub fn check(&self) -> Result<(), DrawingError> {
        for (field, value) in NUMBERS.iter().zip(self.numbers.values()) {
            // A value that is not a number is refused as well.
            if !(field.min..=field.max).contains(&value) {
                let (key, min, max, unit) = (field.key, field.min, field.max, field.unit);
                return Err(DrawingError::OutOfBounds { key, value, min, max, unit, why: "" });
            }
        }
        let n = &self.numbers;
        let within = |key, value: f64, min: f64, max: f64, unit, why| {
            if (min..=max).contains(&value) {
                return Ok(());
            }
            Err(DrawingError::OutOfBounds { key, value, min, max, unit, why })
        };
        let (inner, outer) = (n.inner_radius_m, n.outer_radius_m);
        within("stator.inner_radius_m", inner, 1e-5, 0.98 * outer, "m", "0.98 of the outer radius")?;
        within("stator.tooth_radius_m", n.tooth_radius_m, inner, outer, "m", "between the rims")?;
        let room = outer - n.tooth_radius_m;
        within("stator.tooth_radial_m", n.tooth_radial_m, 0.0, room, "m", "up to the outer rim")?;
        within(
            "stator.tooth_tangential_m",
            n.tooth_tangential_m,
            0.0,
            n.tooth_radius_m,
            "m",
            "the tooth's radius",
        )?;
        // A cubic crystal is stable if it resists shear along its faces, and every change of volume.
        let (c11, c12) = (n.silicon_c11_pa, n.silicon_c12_pa);
        within("stator.silicon_c12_pa", c12, 0.0, 0.99 * c11, "Pa", "0.99 of stator.silicon_c11_pa")?;
        match (self.springs, self.clamp) {
            (Springs::None, Clamp::Arms) => {
                return Err(DrawingError::Conflict(
                    "stator.clamp = arms needs springs, and stator.springs is none",
                ));
            }
            (Springs::None, _) => {}
            (Springs::T | Springs::L, _) => {
                let root = self.stem_half_angle().to_degrees() + 1.0;
                let why = "beyond the stem by a degree at least";
                within("stator.spring_half_angle_deg", n.spring_half_angle_deg, root, 44.5, "deg", why)?;
                within(
                    "stator.spring_arm_width_m",
                    n.spring_arm_width_m,
                    1e-6,
                    outer,
                    "m",
                    "the outer radius",
                )?;
                within("stator.spring_stem_m", n.spring_stem_m, 1e-6, outer, "m", "the outer radius")?;
            }
        }
        let nodes = self.nodes_about();
        if nodes > NODES_MAX {
            return Err(DrawingError::TooFine { mesh_size_m: n.mesh_size_m, nodes, max: NODES_MAX });
        }
        Ok(())
    }

    /// About how many nodes the mesh has, from above: 14 for each column of two bricks.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "saturates, and is a bound then"
    )]
    fn nodes_about(&self) -> usize {
        let n = &self.numbers;
        let across = (n.outer_radius_m - n.inner_radius_m) / n.mesh_size_m + 3.0;
        let along = std::f64::consts::PI * (n.outer_radius_m + n.inner_radius_m) / n.mesh_size_m + 12.0;
        (14.0 * across * along) as usize
    }
}

/// Most nodes of a mesh: some 2 GB and two minutes of CalculiX.
pub const NODES_MAX: usize = 60_000;

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl Fn(&mut Drawing)) -> String {
        let mut drawing = Drawing::default();
        change(&mut drawing);
        drawing.check().unwrap_err().to_string()
    }

    #[test]
    fn exact_refusals_name_field_value_and_bounds() {
        assert_eq!(
            refused(|drawing| drawing.numbers.foil_poisson = 0.5),
            "stator.foil_poisson = 0.5 is outside its bounds 0 to 0.49"
        );
        assert_eq!(
            refused(|drawing| drawing.numbers.tooth_radial_m = 1e-3),
            "stator.tooth_radial_m = 0.001 is outside its bounds 0 to 0.0008269999999999996 m (up to the outer rim)"
        );
        for (change, key) in [
            ((|d| d.numbers.temperature_c = f64::NAN) as fn(&mut Drawing), "stator.temperature_c = NaN"),
            (|d| d.numbers.inner_radius_m = 3.88e-3, "stator.inner_radius_m = 0.00388 "),
            (|d| d.numbers.tooth_radius_m = 2e-3, "stator.tooth_radius_m = 0.002 "),
            (|d| d.numbers.spring_half_angle_deg = 2.0, "stator.spring_half_angle_deg = 2 "),
            (|d| d.numbers.spring_stem_m = 9e-3, "stator.spring_stem_m = 0.009 "),
            (|d| d.numbers.silicon_c12_pa = 165e9, "stator.silicon_c12_pa = 165000000000 "),
            (|d| d.numbers.mesh_size_m = 2e-5, "stator.mesh_size_m = 0.00002 makes "),
            (|d| d.springs = Springs::None, "stator.clamp = arms needs springs"),
        ] {
            let said = refused(change);
            assert!(said.starts_with(key), "{said}");
        }
    }
}
