//! The drive: a magnetic field strains the foil by e along itself and by -e/2 across, which bends the ring.
//!
//! The foil is held flat by a stress with a part that is the same in all directions, which drives no mode of order 2,
//! and one that follows the field's direction alpha:
//!
//! ```text
//! sigma = d [ cos 2 alpha   sin 2 alpha ;  sin 2 alpha  -cos 2 alpha ],        d = 3 E e / (4 (1 + nu))
//! ```
//!
//! Its work on a mode phi is the generalised force. The stress is uniform over the foil, so that by the divergence
//! theorem its work is done at the foil's rims, of outward normal n, by the mean of phi over the foil's thickness t:
//!
//! ```text
//! F = integral over the foil of sigma : grad phi dV = t sum over rims of  integral of phi . sigma n R d theta
//!   = F_best cos 2 (alpha - alpha_best)
//! ```
//!
//! That holds for a flat foil. Of a bowed one the height of the foil does work as well, so that there are no such
//! figures of a stressed stator.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::drawing::Drawing;
use crate::modes::wrapped;
use crate::solution::{Mode, Solution, part};

/// How the field drives a mode of order 2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeDrive {
    /// Generalised force per strain of the foil with the field at its best direction, N, on the coordinate that is the
    /// amplitude at the teeth's radius.
    pub force_per_strain_n: f64,
    /// Best direction of the field from the axis of the first spring, degrees; it comes again after 90.
    pub best_field_deg: f64,
    /// Deflection of a tooth over the coordinate: root mean square of the teeth.
    pub tooth_over_amplitude: f64,
}

impl ModeDrive {
    /// Of a mode whose antinodes lie near `axis`, rad.
    pub(crate) fn of(solution: &Solution, drawing: &Drawing, mode: &Mode, axis: f64) -> Self {
        let [along, across] = forces(solution, drawing, mode);
        let [c, s] = solution.parts_at_teeth(mode);
        let amplitude = libm::hypot(c, s);
        let (mut squares, mut teeth) = (0.0, 0.0);
        for (_, [_, _, w]) in solution.at_tips(mode) {
            squares += w * w;
            teeth += 1.0;
        }
        let tooth = if teeth > 0.0 { libm::sqrt(squares / teeth) } else { 0.0 };
        let best = axis + wrapped(0.5 * libm::atan2(across, along) - axis);
        Self {
            force_per_strain_n: libm::hypot(along, across) / amplitude,
            best_field_deg: best.to_degrees(),
            tooth_over_amplitude: tooth / amplitude,
        }
    }

    /// Force per strain with the field at an angle, N; negative where it is against that of the best direction.
    pub fn force_at_n(&self, field_deg: f64) -> f64 {
        self.force_per_strain_n * libm::cos(2.0 * (field_deg - self.best_field_deg).to_radians())
    }

    /// Amplitude at the teeth per strain at resonance, with the field at its best direction, m:
    /// `F / (2 zeta M w^2)` of a mode with modal mass `M` and damping ratio `zeta`.
    pub fn tooth_amplitude_per_strain_m(
        &self,
        modal_mass_kg: f64,
        frequency_hz: f64,
        damping_ratio: f64,
    ) -> f64 {
        let w = 2.0 * PI * frequency_hz;
        self.tooth_over_amplitude * self.force_per_strain_n / (2.0 * damping_ratio * modal_mass_kg * w * w)
    }
}

/// Force per strain on a mode of modal mass one kilogram with the field at 0 and at 45 degrees, N/sqrt(kg), with the
/// sign of the mode's shape: `F_0 cos 2 alpha + F_45 sin 2 alpha` with the field at alpha.
pub fn forces(solution: &Solution, drawing: &Drawing, mode: &Mode) -> [f64; 2] {
    let n = &drawing.numbers;
    let stress = 0.75 * n.foil_modulus_pa / (1.0 + n.foil_poisson);
    let angles = solution.mesh.angles();
    let mut forces = [0.0; 2];
    for (rim, radius, outward) in [(0, n.inner_radius_m, -1.0), (1, n.outer_radius_m, 1.0)] {
        let [x, y] = solution.foil_at_rim(mode, rim);
        let ([x_cos, x_sin], [y_cos, y_sin]) = (part(&angles, &x, 1), part(&angles, &y, 1));
        let scale = outward * stress * n.foil_thickness_m * radius * PI;
        forces[0] += scale * (x_cos - y_sin);
        forces[1] += scale * (x_sin + y_cos);
    }
    forces
}

/// A field with which two modes have given amplitudes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommonField {
    /// Its direction from the axis of the first spring, degrees, within 45 degrees of the best one of the first mode.
    pub field_deg: f64,
    /// The strain that it gives the foil.
    pub strain: f64,
}

/// The two directions, the smaller angle first, in which one strain gives both modes their amplitudes, m, at resonance,
/// from the amplitudes per strain, m, and the best directions, degrees. With `u = (cos 2 alpha, sin 2 alpha)` and a
/// vector for each mode, `a_B . u = +- r a_C . u`, so that u is across `a_B -+ r a_C`.
pub fn fields_of_both(
    amplitudes_m: [f64; 2],
    per_strain_m: [f64; 2],
    best_field_deg: [f64; 2],
) -> [CommonField; 2] {
    let vector = |mode: usize| {
        let (sin, cos) = libm::sincos(2.0 * best_field_deg[mode].to_radians());
        [per_strain_m[mode] * cos, per_strain_m[mode] * sin]
    };
    let (first, second) = (vector(0), vector(1));
    let ratio = amplitudes_m[0] / amplitudes_m[1];
    let best = best_field_deg[0].to_radians();
    let mut fields = [ratio, -ratio].map(|ratio| {
        let [x, y] = [first[0] - ratio * second[0], first[1] - ratio * second[1]];
        let angle = best + wrapped(0.5 * libm::atan2(x, -y) - best);
        let share = libm::cos(2.0 * (angle - best)).abs();
        CommonField { field_deg: angle.to_degrees(), strain: amplitudes_m[0] / (per_strain_m[0] * share) }
    });
    fields.sort_by(|one, other| one.field_deg.total_cmp(&other.field_deg));
    fields
}

#[cfg(test)]
mod tests;
