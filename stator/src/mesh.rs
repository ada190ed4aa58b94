//! The structured mesh: 20-node bricks in cylinder coordinates, foil, silicon on it, teeth on top, springs.
//!
//! Ring, stems and arms are blocks of their own. Blocks share the nodes that lie at the same place, to the last bit:
//! a stem has the ring's angles, the arms begin at the stem's. The number of bricks depends on the mesh size and the
//! ring alone, so that frequencies are smooth in thickness, half-angle and length of stem.

mod block;
pub mod brick;
mod ring;
mod springs;

use std::collections::HashMap;

use crate::drawing::{Drawing, DrawingError};
use brick::Brick;

/// What a brick is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Material {
    /// The foil.
    Foil,
    /// Silicon.
    Silicon,
}

/// A node, by its cylinder coordinates: m, rad, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Distance from the axis.
    pub r: f64,
    /// Angle from the axis of the first spring.
    pub theta: f64,
    /// Height over the lower face of the foil.
    pub z: f64,
}

impl Node {
    /// Cartesian coordinates, m.
    pub fn xyz(&self) -> [f64; 3] {
        let (sin, cos) = libm::sincos(self.theta);
        [self.r * cos, self.r * sin, self.z]
    }
}

/// Mass and moments of inertia about the axis and across it, through the centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass, kg.
    pub mass_kg: f64,
    /// Height of the centre of mass over the lower face, m.
    pub centre_m: f64,
    /// Moment of inertia about the axis, kg m2.
    pub polar_kg_m2: f64,
    /// Mean of the moments about the two axes across, kg m2.
    pub transverse_kg_m2: f64,
}

/// A mesh.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Nodes; a brick names them by their place here.
    pub nodes: Vec<Node>,
    /// Bricks with their material.
    pub bricks: Vec<(Brick, Material)>,
    /// Nodes of the ring between foil and silicon, on circles that every brick's edge lies on: the place at which modes
    /// are read. One row a circle, from the inner rim; in a row, rising angles over one turn.
    pub circles: Vec<Vec<usize>>,
    /// The row of the teeth's inner edge.
    pub tooth_circle: usize,
    /// Nodes of the foil's lower face at the inner and at the outer rim, at the angles of the circles.
    pub foil_rims: [Vec<usize>; 2],
    /// The middle of the upper inner edge of each tooth; empty without teeth.
    pub tips: Vec<usize>,
    /// Nodes that are held in the plane: all of a clamped face.
    pub clamped: Vec<usize>,
    /// Those that are held in height as well: a line of the face. The others move as the thickness does when the part
    /// bends, so that a coarse brick beside the face is not too stiff.
    pub clamped_in_height: Vec<usize>,
    known: HashMap<[u64; 3], usize>,
}

impl Mesh {
    /// The mesh of a drawing.
    ///
    /// # Errors
    /// When the drawing is refused.
    pub fn of(drawing: &Drawing) -> Result<Self, DrawingError> {
        drawing.check()?;
        let mut mesh = Self::default();
        let lines = ring::Lines::of(drawing);
        ring::add(&mut mesh, drawing, &lines);
        springs::add(&mut mesh, drawing, &lines);
        mesh.clamped.sort_unstable();
        mesh.clamped.dedup();
        let is_line =
            |number: &usize| mesh.nodes[*number].z.total_cmp(&drawing.numbers.foil_thickness_m).is_eq();
        mesh.clamped_in_height = mesh.clamped.iter().copied().filter(is_line).collect();
        Ok(mesh)
    }

    /// The node at a place, a new one if there is none yet.
    fn node(&mut self, node: Node) -> usize {
        let count = self.nodes.len();
        let number = *self.known.entry([node.r, node.theta, node.z].map(f64::to_bits)).or_insert(count);
        if number == count {
            self.nodes.push(node);
        }
        number
    }

    /// Volume of foil and of silicon, m3.
    pub fn volumes(&self) -> [f64; 2] {
        let mut volumes = [0.0; 2];
        for (brick, material) in &self.bricks {
            let of_material = &mut volumes[usize::from(*material == Material::Silicon)];
            brick.integrate(&self.nodes, |_, volume| *of_material += volume);
        }
        volumes
    }

    /// Nodes whose displacements are read: circles, rims of the foil, tips, one after the other.
    pub fn probes(&self) -> impl Iterator<Item = usize> + '_ {
        self.circles.iter().chain(&self.foil_rims).flatten().chain(&self.tips).copied()
    }

    /// Angles of the nodes of a circle, rad; all circles have the same.
    pub fn angles(&self) -> Vec<f64> {
        self.circles.first().into_iter().flatten().map(|number| self.nodes[*number].theta).collect()
    }

    /// Mass properties of the bricks, each integrated over its own curved shape.
    pub fn mass_properties(&self, drawing: &Drawing) -> MassProperties {
        let (mut mass, mut first, mut polar, mut squares) = (0.0, 0.0, 0.0, 0.0);
        for (brick, material) in &self.bricks {
            let density = match material {
                Material::Foil => drawing.numbers.foil_density_kg_m3,
                Material::Silicon => drawing.numbers.silicon_density_kg_m3,
            };
            brick.integrate(&self.nodes, |[x, y, z], volume| {
                let part = density * volume;
                mass += part;
                first += part * z;
                polar += part * (x * x + y * y);
                squares += part * z * z;
            });
        }
        let centre = first / mass;
        let transverse = 0.5 * polar + squares - mass * centre * centre;
        MassProperties { mass_kg: mass, centre_m: centre, polar_kg_m2: polar, transverse_kg_m2: transverse }
    }
}

#[cfg(test)]
mod tests;
