//! The ring: foil, silicon and teeth, in one grid of radii and angles.

use std::f64::consts::{FRAC_PI_2, PI};

use super::block::{divided, halfway, parts};
use super::{Material, Mesh, Node};
use crate::drawing::{Clamp, Drawing, Springs};

/// Angles nearer than this are one line, rad: a thousandth of the thinnest brick that is worth having.
const SAME_ANGLE: f64 = 1e-6;

/// The lines of the ring's grid.
#[derive(Clone, Debug)]
pub(super) struct Lines {
    /// Radii, from rim to rim.
    pub(super) radii: Vec<f64>,
    /// Angles over one turn, the last a turn after the first.
    pub(super) angles: Vec<f64>,
    /// Of each spring the first and the last line of its stem.
    pub(super) stems: Vec<(usize, usize)>,
}

/// The middle of tooth `number`, 0 to 3, rad.
fn tooth_angle(drawing: &Drawing, number: u8) -> f64 {
    drawing.numbers.tooth_angle_deg.to_radians() + f64::from(number) * FRAC_PI_2
}

/// An angle within the turn that begins at `start`.
fn within_turn(angle: f64, start: f64) -> f64 {
    let turned = (angle - start).rem_euclid(2.0 * PI);
    if turned > 2.0 * PI - SAME_ANGLE { start } else { start + turned }
}

impl Lines {
    pub(super) fn of(drawing: &Drawing) -> Self {
        let n = &drawing.numbers;
        let mut radii = vec![n.inner_radius_m];
        let mut marks = vec![n.tooth_radius_m, n.outer_radius_m];
        if drawing.has_teeth() {
            marks.insert(1, (n.tooth_radius_m + n.tooth_radial_m).min(n.outer_radius_m));
        }
        for mark in marks {
            let from = radii[radii.len() - 1];
            if mark > from {
                let steps = divided(from, mark, parts(mark - from, n.mesh_size_m));
                radii.extend(&steps[1..]);
            }
        }
        // Stems and teeth begin and end at lines. The turn begins at the first stem, or at its axis.
        let stem = if drawing.springs == Springs::None { 0.0 } else { drawing.stem_half_angle() };
        let start = -stem;
        let mut edges = Vec::new();
        for number in 0..4 {
            let axis = f64::from(number) * FRAC_PI_2;
            edges.extend([axis - stem, axis + stem]);
            if drawing.has_teeth() {
                let (middle, half) = (tooth_angle(drawing, number), drawing.tooth_half_angle());
                edges.extend([middle - half, middle + half]);
            }
        }
        let mut edges: Vec<f64> = edges.into_iter().map(|angle| within_turn(angle, start)).collect();
        edges.push(start + 2.0 * PI);
        edges.sort_by(f64::total_cmp);
        edges.dedup_by(|next, kept| *next - *kept < SAME_ANGLE);
        let mean_radius = 0.5 * (n.inner_radius_m + n.outer_radius_m);
        let mut angles = vec![start];
        for pair in edges.windows(2) {
            let count = parts((pair[1] - pair[0]) * mean_radius, n.mesh_size_m);
            angles.extend(&divided(pair[0], pair[1], count)[1..]);
        }
        let line_at = |angle: f64| {
            let distance = |line: usize| (angles[line] - angle).abs();
            (0..angles.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or(0)
        };
        let stem_of = |number: u8| {
            let axis = f64::from(number) * FRAC_PI_2;
            (line_at(axis - stem), line_at(axis + stem))
        };
        let stems = if drawing.springs == Springs::None { Vec::new() } else { (0..4).map(stem_of).collect() };
        Self { radii, angles, stems }
    }

    /// Bricks along the turn.
    fn turn(&self) -> usize {
        self.angles.len() - 1
    }

    /// Angle at half-step `index`; the end of the turn is its beginning.
    fn angle(&self, index: usize) -> f64 {
        halfway(&self.angles, index % (2 * self.turn()))
    }
}

/// Whether the bricks from angle line `line` lie within a tooth.
fn is_tooth(drawing: &Drawing, from: f64, to: f64) -> bool {
    let middle = 0.5 * (from + to);
    (0..4).any(|number| {
        let off = (middle - tooth_angle(drawing, number) + PI).rem_euclid(2.0 * PI) - PI;
        off.abs() < drawing.tooth_half_angle()
    })
}

/// Adds the ring and its teeth, and what is held of it.
pub(super) fn add(mesh: &mut Mesh, drawing: &Drawing, lines: &Lines) {
    let n = &drawing.numbers;
    let top = n.foil_thickness_m + n.silicon_thickness_m;
    let tip = top + n.tooth_height_m;
    let across = lines.radii.len() - 1;
    let mut layer = |from: f64, to: f64, count: usize, material, is_there: &dyn Fn([usize; 3]) -> bool| {
        let heights = divided(from, to, count);
        let place = |[i, j, k]: [usize; 3]| Node {
            r: halfway(&lines.radii, i),
            theta: lines.angle(j),
            z: halfway(&heights, k),
        };
        mesh.add_block([across, lines.turn(), count], material, place, is_there);
    };
    layer(0.0, n.foil_thickness_m, 1, Material::Foil, &|_| true);
    layer(n.foil_thickness_m, top, 1, Material::Silicon, &|_| true);
    if drawing.has_teeth() {
        let is_there = |[i, j, _]: [usize; 3]| {
            let middle = 0.5 * (lines.radii[i] + lines.radii[i + 1]) - n.tooth_radius_m;
            (0.0..n.tooth_radial_m).contains(&middle)
                && is_tooth(drawing, lines.angles[j], lines.angles[j + 1])
        };
        layer(top, tip, parts(n.tooth_height_m, n.mesh_size_m), Material::Silicon, &is_there);
    }
    let all = 2 * lines.turn();
    for r in lines.radii.iter().copied() {
        if r.total_cmp(&n.tooth_radius_m).is_eq() {
            mesh.tooth_circle = mesh.circles.len();
        }
        let at = |index: usize| Node { r, theta: lines.angle(index), z: n.foil_thickness_m };
        let circle = (0..all).map(|index| mesh.node(at(index))).collect();
        mesh.circles.push(circle);
    }
    mesh.foil_rims = [n.inner_radius_m, n.outer_radius_m]
        .map(|r| (0..all).map(|index| mesh.node(Node { r, theta: lines.angle(index), z: 0.0 })).collect());
    if drawing.has_teeth() {
        mesh.tips =
            (0..4).map(|number| tooth_tip(mesh, drawing, tooth_angle(drawing, number), tip)).collect();
    }
    let rim = match drawing.clamp {
        Clamp::InnerRim => Some(n.inner_radius_m),
        Clamp::OuterRim => Some(n.outer_radius_m),
        Clamp::Arms | Clamp::Nothing => None,
    };
    if let Some(rim) = rim {
        let on_rim = |node: &Node| node.r.total_cmp(&rim).is_eq();
        mesh.clamped.extend((0..mesh.nodes.len()).filter(|number| on_rim(&mesh.nodes[*number])));
    }
}

/// The node of the upper inner edge that is nearest to the middle of a tooth.
fn tooth_tip(mesh: &Mesh, drawing: &Drawing, middle: f64, tip: f64) -> usize {
    let distance = |node: &Node| {
        let off = (node.theta - middle + PI).rem_euclid(2.0 * PI) - PI;
        (node.r - drawing.numbers.tooth_radius_m).abs()
            + (node.z - tip).abs()
            + drawing.numbers.tooth_radius_m * off.abs()
    };
    let nearest = mesh.nodes.iter().enumerate().min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
    nearest.map_or(0, |(number, _)| number)
}
