//! A drawing solved: every mode with its content around the ring, and the state after cooling.
//!
//! The deflection of a mode on the circle of radius r is a sum over the number n of nodal diameters:
//!
//! ```text
//! w(r, theta) = sum over n of  c_n(r) cos n theta + s_n(r) sin n theta
//! ```
//!
//! The coordinate of a mode of order n is the amplitude of its n-part at the teeth's radius `R_t`, as in the parametric
//! modal model. CalculiX gives shapes of modal mass one, so that the modal mass of this coordinate is
//!
//! ```text
//! M = 1 / (c_n(R_t)^2 + s_n(R_t)^2),        k = R_t d ln(amplitude) / d r     (the radial exponent)
//! ```

use std::f64::consts::PI;

use crate::deck;
use crate::drawing::{Drawing, DrawingError};
use crate::mesh::{MassProperties, Mesh};
use crate::solver::output::{self, Output, OutputFault};
use crate::solver::{Solver, SolverError};

/// Numbers of nodal diameters that are told apart: 0 to this less one.
const ORDERS: usize = 5;
/// A frequency below this part of the highest one that was found is a rigid motion's.
const RIGID_PART: f64 = 1e-3;
/// By how much the solver's volumes may differ from the mesh's own: it prints seven digits, and integrates a curved
/// brick at 8 points where the mesh takes 27.
const VOLUME_TOLERANCE: f64 = 2e-3;

/// Why a drawing has no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StatorError {
    /// The drawing is refused.
    #[error(transparent)]
    Drawing(#[from] DrawingError),
    /// The solver gave none.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// The stator has no mode of a kind among those found.
    #[error("no mode {mode} among the {found} lowest modes of this stator")]
    NoMode {
        /// Name of the mode.
        mode: &'static str,
        /// How many were found.
        found: usize,
    },
    /// No drawing was found that meets the frequencies.
    #[error(
        "no drawing meets the frequencies: after {rounds} rounds {mode} is {found_hz:.0} Hz, wanted {wanted_hz:.0} Hz"
    )]
    NotMet {
        /// Rounds of the search.
        rounds: usize,
        /// Name of the mode that is furthest off.
        mode: &'static str,
        /// Its frequency, Hz.
        found_hz: f64,
        /// What was wanted, Hz.
        wanted_hz: f64,
    },
}

impl StatorError {
    /// Whether another drawing may have a result: the solver is there, and works.
    pub fn is_of_the_drawing(&self) -> bool {
        match self {
            Self::Solver(SolverError::NotThere { .. } | SolverError::File { .. }) => false,
            Self::Solver(_) | Self::Drawing(_) | Self::NoMode { .. } | Self::NotMet { .. } => true,
        }
    }

    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::Drawing(DrawingError::TooFine { .. }) => Some("a larger stator.mesh_size_m"),
            Self::Drawing(_) => Some("`host-sim keys stator` lists keys, bounds and meanings"),
            Self::Solver(error) => error.hint(),
            Self::NoMode { .. } => Some("a ring that its springs hold up has modes A, tilt, B and C"),
            Self::NotMet { .. } => Some("other springs or other teeth may meet them"),
        }
    }
}

/// A mode as it was found.
#[derive(Clone, Debug)]
pub struct Mode {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Number of nodal diameters of its largest part.
    pub order: usize,
    /// Amplitudes of cosine and sine of that part on each circle, for a modal mass of one kilogram (1/sqrt(kg)).
    parts: Vec<[f64; 2]>,
    /// Displacements of the probes, for a modal mass of one kilogram (1/sqrt(kg)).
    shape: Vec<[f64; 3]>,
}

/// All that was found.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Its mesh.
    pub mesh: Mesh,
    /// Mass and inertia.
    pub mass: MassProperties,
    /// Modes out of the plane, frequencies rising, without rigid motions.
    pub modes: Vec<Mode>,
    /// Height of the inner rim over the outer one after cooling, means around the ring, m.
    pub bow_m: f64,
    /// Displacements of the probes after cooling, m.
    pub cooled: Vec<[f64; 3]>,
}

/// Cosine and sine part of order `n` of values on a circle of `mesh`, by Simpson's rule over each brick.
pub(crate) fn part(angles: &[f64], values: &[f64], n: usize) -> [f64; 2] {
    #[expect(clippy::cast_precision_loss, reason = "a few")]
    let order = n as f64;
    let mut sums = [0.0; 2];
    for first in (0..angles.len()).step_by(2) {
        let last = (first + 2) % angles.len();
        let end = if last == 0 { angles[0] + 2.0 * PI } else { angles[last] };
        let length = end - angles[first];
        for (at, theta, weight) in
            [(first, angles[first], 1.0), (first + 1, angles[first + 1], 4.0), (last, end, 1.0)]
        {
            let (sin, cos) = libm::sincos(order * theta);
            let share = weight / 6.0 * length * values[at];
            sums[0] += share * cos;
            sums[1] += share * sin;
        }
    }
    let norm = if n == 0 { 2.0 * PI } else { PI };
    sums.map(|sum| sum / norm)
}

impl Solution {
    /// The drawing, solved.
    ///
    /// # Errors
    /// When the drawing is refused, or the solver gives no result.
    pub fn of(drawing: &Drawing, solver: &Solver) -> Result<Self, StatorError> {
        let mesh = Mesh::of(drawing)?;
        let mass = mesh.mass_properties(drawing);
        let probes: Vec<usize> = mesh.probes().collect();
        let volumes = mesh.volumes();
        let read = |text: &str| {
            let output = output::read(text, &probes)?;
            let off = |index: usize| (output.volumes[index] / (1e9 * volumes[index]) - 1.0).abs();
            if off(0) > VOLUME_TOLERANCE || off(1) > VOLUME_TOLERANCE {
                return Err(OutputFault::Part("its volumes are not those of the drawing"));
            }
            Ok(output)
        };
        let output = solver.solve(&deck::of(drawing, &mesh), read)?;
        Ok(Self::read(mesh, mass, &output))
    }

    fn read(mesh: Mesh, mass: MassProperties, output: &Output) -> Self {
        // From tonnes to kilograms: a shape of unit mass is smaller by the root of a thousand.
        let scale = 1.0 / libm::sqrt(1e3);
        let highest = output.modes.last().map_or(0.0, |mode| mode.eigenvalue);
        let is_mode = |eigenvalue: f64| eigenvalue > RIGID_PART * RIGID_PART * highest;
        let circle_of = |shape: &[[f64; 3]], circle: usize| -> Vec<f64> {
            let begin: usize = mesh.circles[..circle].iter().map(Vec::len).sum();
            shape[begin..begin + mesh.circles[circle].len()].iter().map(|[_, _, w]| *w).collect()
        };
        let angles = mesh.angles();
        let mut modes = Vec::new();
        for mode in output.modes.iter().filter(|mode| is_mode(mode.eigenvalue)) {
            let shape: Vec<[f64; 3]> = mode.shape.iter().map(|at| at.map(|value| scale * value)).collect();
            let squares = |i: usize| shape.iter().map(|at| at[i] * at[i]).sum::<f64>();
            if squares(0) + squares(1) > squares(2) {
                continue;
            }
            let at_teeth = circle_of(&shape, mesh.tooth_circle);
            let energy = |n: usize| {
                let [c, s] = part(&angles, &at_teeth, n);
                (c * c + s * s) * if n == 0 { 2.0 } else { 1.0 }
            };
            let order = (0..ORDERS).max_by(|a, b| energy(*a).total_cmp(&energy(*b))).unwrap_or(0);
            let parts = (0..mesh.circles.len())
                .map(|circle| part(&angles, &circle_of(&shape, circle), order))
                .collect();
            let frequency_hz = libm::sqrt(mode.eigenvalue) / (2.0 * PI);
            modes.push(Mode { frequency_hz, order, parts, shape });
        }
        let cooled: Vec<[f64; 3]> = output.cooled.iter().map(|at| at.map(|value| 1e-3 * value)).collect();
        let level = |circle: usize| part(&angles, &circle_of(&cooled, circle), 0)[0];
        let bow_m = level(0) - level(mesh.circles.len() - 1);
        Self { mesh, mass, modes, bow_m, cooled }
    }

    /// Cosine and sine part of a mode at the teeth's radius, for a modal mass of one kilogram (1/sqrt(kg)).
    pub fn parts_at_teeth(&self, mode: &Mode) -> [f64; 2] {
        mode.parts[self.mesh.tooth_circle]
    }

    /// Modal mass of a mode, kg, of the coordinate that is its amplitude at the teeth's radius.
    pub fn modal_mass_kg(&self, mode: &Mode) -> f64 {
        let [c, s] = self.parts_at_teeth(mode);
        1.0 / (c * c + s * s)
    }

    /// How the amplitude of a mode goes with the radius at the teeth: the exponent of a power, by the parabola through
    /// the circle of the teeth and both beside it.
    pub fn exponent(&self, mode: &Mode) -> f64 {
        let tooth = self.mesh.tooth_circle.clamp(1, mode.parts.len() - 2);
        let direction = self.parts_at_teeth(mode);
        let along = |circle: usize| {
            let [c, s] = mode.parts[circle];
            c * direction[0] + s * direction[1]
        };
        let radius = |circle: usize| self.mesh.nodes[self.mesh.circles[circle][0]].r;
        let (r0, r1, r2) = (radius(tooth - 1), radius(tooth), radius(tooth + 1));
        let (f0, f1, f2) = (along(tooth - 1), along(tooth), along(tooth + 1));
        let (d01, d12) = ((f1 - f0) / (r1 - r0), (f2 - f1) / (r2 - r1));
        let curvature = (d12 - d01) / (r2 - r0);
        let at = radius(self.mesh.tooth_circle);
        let slope = d01 + curvature * ((at - r0) + (at - r1));
        at * slope / along(self.mesh.tooth_circle)
    }

    /// Displacements of a mode at the teeth's tips, with the tips' angles; for a modal mass of one kilogram
    /// (1/sqrt(kg)).
    pub fn at_tips<'a>(&'a self, mode: &'a Mode) -> impl Iterator<Item = (f64, [f64; 3])> + 'a {
        let begin = mode.shape.len() - self.mesh.tips.len();
        let angles = self.mesh.tips.iter().map(|number| self.mesh.nodes[*number].theta);
        angles.zip(mode.shape[begin..].iter().copied())
    }

    /// Mean displacements along x and y of the foil's face at its inner (0) or outer (1) rim in a mode, over the foil's
    /// thickness, at the angles of the circles; for a modal mass of one kilogram (1/sqrt(kg)).
    pub(crate) fn foil_at_rim(&self, mode: &Mode, rim: usize) -> [Vec<f64>; 2] {
        let sizes: Vec<usize> = self.mesh.circles.iter().map(Vec::len).collect();
        let upper = if rim == 0 { 0 } else { sizes[..sizes.len() - 1].iter().sum() };
        let lower = sizes.iter().sum::<usize>() + rim * self.mesh.foil_rims[0].len();
        let mean = |i: usize| {
            let along = |at: usize| 0.5 * (mode.shape[upper + at][i] + mode.shape[lower + at][i]);
            (0..self.mesh.foil_rims[rim].len()).map(along).collect()
        };
        [mean(0), mean(1)]
    }

    /// Mean height of each circle after cooling, with its radius, m.
    pub fn cooled_profile(&self) -> Vec<(f64, f64)> {
        let (angles, mut at) = (self.mesh.angles(), self.cooled.iter().map(|[_, _, w]| *w));
        let mut level = |circle: &Vec<usize>| {
            let heights: Vec<f64> = at.by_ref().take(circle.len()).collect();
            (self.mesh.nodes[circle[0]].r, part(&angles, &heights, 0)[0])
        };
        self.mesh.circles.iter().map(&mut level).collect()
    }

    /// Heights along the outer rim after cooling, m.
    pub fn cooled_rim(&self) -> impl Iterator<Item = f64> {
        let rim = self.mesh.circles.last().map_or(0, Vec::len);
        let inside: usize = self.mesh.circles.iter().map(Vec::len).sum::<usize>() - rim;
        self.cooled.iter().skip(inside).take(rim).map(|[_, _, height]| *height)
    }

    /// Deflections of a mode on each circle, from the inner rim, for a modal mass of one kilogram (1/sqrt(kg)).
    pub fn deflections(&self, mode: &Mode) -> Vec<Vec<f64>> {
        let mut at = mode.shape.iter().map(|[_, _, w]| *w);
        self.mesh.circles.iter().map(|circle| at.by_ref().take(circle.len()).collect()).collect()
    }
}

#[cfg(test)]
mod annular_plate;
#[cfg(test)]
mod laminate_plate;
#[cfg(test)]
mod tests;
