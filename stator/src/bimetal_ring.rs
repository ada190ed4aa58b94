//! Timoshenko's bimetal (J. Opt. Soc. Am. 11 (1925) 233), with which the bow and the force of the foil are compared: a
//! free ring of two isotropic layers with one Poisson's ratio. Where one layer wants to be longer than the other by a
//! strain e, it bends without any moment, whatever its rims:
//!
//! ```text
//! m = t_f / t_s,   n = E_f / E_s,   h = t_f + t_s
//! curvature = 6 e (1 + m)^2 / (h (3 (1 + m)^2 + (1 + m n) (m^2 + 1 / (m n))))
//! ```

use crate::drawing::{Clamp, Drawing, Silicon, Springs};

/// The ring of the default drawing.
pub(crate) fn drawing() -> Drawing {
    let mut drawing = Drawing {
        springs: Springs::None,
        silicon: Silicon::Isotropic,
        clamp: Clamp::Nothing,
        ..Drawing::default()
    };
    drawing.numbers.tooth_radial_m = 0.0;
    drawing.numbers.foil_poisson = drawing.numbers.silicon_poisson;
    drawing
}

/// Its curvature, 1/m, per strain of the foil against the silicon.
pub(crate) fn curvature_per_strain(drawing: &Drawing) -> f64 {
    let n = &drawing.numbers;
    let (m, h) = (n.foil_thickness_m / n.silicon_thickness_m, n.foil_thickness_m + n.silicon_thickness_m);
    let ratio = n.foil_modulus_pa / n.silicon_modulus_pa;
    let one = (1.0 + m) * (1.0 + m);
    6.0 * one / (h * (3.0 * one + (1.0 + m * ratio) * (m * m + 1.0 / (m * ratio))))
}
