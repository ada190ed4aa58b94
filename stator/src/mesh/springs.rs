//! Springs: a stem of constant width from the rim, then a band along the rim whose parts right and left of the stem are
//! the arms.
//!
//! Each arm has a width and an end of its own, drawn about those of the drawing if `stator.spring_spread` is not 0.

use std::f64::consts::FRAC_PI_2;

use rand_core::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::block::{divided, halfway, parts};
use super::ring::Lines;
use super::{Material, Mesh, Node};
use crate::drawing::{Clamp, Drawing, Springs};

/// Bricks along a stem, and along the width of an arm: bending of a short, and of a narrow part is resolved by one
/// quadratic brick or two.
const ALONG_STEM: usize = 2;
const ACROSS_ARM: usize = 1;
/// Drawn deviations are cut off at this many standard deviations.
const SPREAD_MAX: f64 = 3.0;

/// An arm: width, m, and angle from the spring's axis to its end, rad.
#[derive(Clone, Copy, Debug)]
struct Arm {
    width: f64,
    end: f64,
}

/// The arms of the four springs, left and right of each.
fn arms(drawing: &Drawing) -> [[Arm; 2]; 4] {
    let n = &drawing.numbers;
    let mut rng = Pcg64::seed_from_u64(drawing.spread_seed);
    let mut factor = || {
        let drawn: f64 = StandardNormal.sample(&mut rng);
        1.0 + n.spring_spread * drawn.clamp(-SPREAD_MAX, SPREAD_MAX)
    };
    std::array::from_fn(|_| {
        std::array::from_fn(|_| Arm {
            width: n.spring_arm_width_m * factor(),
            end: n.spring_half_angle_deg.to_radians() * factor(),
        })
    })
}

/// Adds the springs, and the ends that are held.
pub(super) fn add(mesh: &mut Mesh, drawing: &Drawing, lines: &Lines) {
    let arms = arms(drawing);
    for ((number, (first, last)), arms) in (0_u8..).zip(&lines.stems).zip(arms) {
        let spring = Spring::of(drawing, lines, f64::from(number) * FRAC_PI_2, *first..=*last);
        spring.add_stem(mesh);
        spring.add_band(mesh, drawing, arms);
    }
}

/// One spring, its places before the arms.
struct Spring {
    axis: f64,
    rim: f64,
    stem: f64,
    /// Angles of the ring's lines where the stem begins.
    lines: Vec<f64>,
    bottom: f64,
    top: f64,
    mesh_size: f64,
}

impl Spring {
    fn of(drawing: &Drawing, lines: &Lines, axis: f64, stem: std::ops::RangeInclusive<usize>) -> Self {
        let n = &drawing.numbers;
        Self {
            axis,
            rim: n.outer_radius_m,
            stem: n.spring_stem_m,
            lines: lines.angles[stem].to_vec(),
            bottom: n.foil_thickness_m,
            top: n.foil_thickness_m + n.silicon_thickness_m,
            mesh_size: n.mesh_size_m,
        }
    }

    /// Angle of the stem's line that leaves the ring at `angle`, at radius `r`: the stem is as wide everywhere.
    fn angle_at(&self, angle: f64, r: f64) -> f64 {
        if r > self.rim { self.axis + (angle - self.axis) * (self.rim / r) } else { angle }
    }

    fn add_stem(&self, mesh: &mut Mesh) {
        let radii = divided(self.rim, self.rim + self.stem, ALONG_STEM);
        let heights = [self.bottom, self.top];
        let place = |[i, j, k]: [usize; 3]| {
            let r = halfway(&radii, i);
            Node { r, theta: self.angle_at(halfway(&self.lines, j), r), z: halfway(&heights, k) }
        };
        mesh.add_block([ALONG_STEM, self.lines.len() - 1, 1], Material::Silicon, place, |_| true);
    }

    fn add_band(&self, mesh: &mut Mesh, drawing: &Drawing, [left, right]: [Arm; 2]) {
        let inner = self.rim + self.stem;
        // The stem's middles of edges lie halfway on the ring, and so here too.
        let hub: Vec<f64> =
            (0..2 * self.lines.len() - 1).map(|j| self.angle_at(halfway(&self.lines, j), inner)).collect();
        let (from, to) = (hub[0], hub[hub.len() - 1]);
        let both = drawing.springs == Springs::T;
        // As many as an arm of 45 degrees at a fifth beyond the rim needs.
        let along = 2 * parts(0.5 * FRAC_PI_2 * 1.2 * self.rim, self.mesh_size);
        let mut angles = if both { divided(self.axis - left.end, from, along) } else { vec![from] };
        angles.extend(&hub[1..]);
        angles.extend(&divided(to, self.axis + right.end, along)[1..]);
        let width = |theta: f64| {
            let share = ((theta - from) / (to - from)).clamp(0.0, 1.0);
            if both { left.width + (right.width - left.width) * share } else { right.width }
        };
        let heights = [self.bottom, self.top];
        let place = |[i, j, k]: [usize; 3]| {
            let theta = angles[j];
            #[expect(clippy::cast_precision_loss, reason = "a few")]
            let share = i as f64 / (2 * ACROSS_ARM) as f64;
            Node { r: inner + width(theta) * share, theta, z: halfway(&heights, k) }
        };
        let count = angles.len() / 2;
        mesh.add_block([ACROSS_ARM, count, 1], Material::Silicon, place, |_| true);
        if drawing.clamp == Clamp::Arms {
            let ends: &[usize] = if both { &[0, 2 * count] } else { &[2 * count] };
            for &j in ends {
                for i in 0..=2 * ACROSS_ARM {
                    for k in 0..=2 {
                        // The middle of a face is no node of a brick.
                        if i % 2 == 0 || k % 2 == 0 {
                            let number = mesh.node(place([i, j, k]));
                            mesh.clamped.push(number);
                        }
                    }
                }
            }
        }
    }
}
