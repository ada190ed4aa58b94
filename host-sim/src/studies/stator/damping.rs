//! What silicon alone would be damped by.
//!
//! Heat that flows across a bent plate damps it (Zener, Phys. Rev. 52 (1937) 230; Lifshitz and Roukes, Phys. Rev. B 61
//! (2000) 5600). With thickness h, diffusivity D and volumetric heat capacity C:
//!
//! ```text
//! zeta = (E alpha^2 T / (2 C)) w tau / (1 + (w tau)^2),      tau = h^2 / (pi^2 D)
//! ```
//!
//! That is the one structural part that follows from text-book constants. It is assumed for the silicon as a plate of
//! its own; losses of the foil, of the bond, of the anchors and of the air are left out, so that it is a lower bound.

use std::f64::consts::PI;

use super::SolvedStator;

/// Text-book constants of silicon at room temperature: conductivity, W/(m K), and heat capacity, J/(kg K).
const CONDUCTIVITY: f64 = 148.0;
const HEAT_CAPACITY: f64 = 713.0;
/// Temperature, K.
const ROOM_K: f64 = 293.0;

/// Damping ratio of the silicon of a stator as a plate, at a frequency.
pub(super) fn thermoelastic(solved: &SolvedStator, frequency_hz: f64) -> f64 {
    let n = &solved.drawing.numbers;
    let capacity = n.silicon_density_kg_m3 * HEAT_CAPACITY;
    let tau = n.silicon_thickness_m * n.silicon_thickness_m * capacity / (PI * PI * CONDUCTIVITY);
    let wt = 2.0 * PI * frequency_hz * tau;
    let alpha = n.silicon_expansion_per_k;
    0.5 * n.silicon_modulus_pa * alpha * alpha * ROOM_K / capacity * wt / (1.0 + wt * wt)
}
