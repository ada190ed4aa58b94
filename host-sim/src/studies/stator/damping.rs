//! Damping: what silicon alone would have, beside what the paper measured, and the sweep of a vibrometer.
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

use motor_model::math;

use super::SolvedStator;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::scene::Scene;

/// Text-book constants of silicon at room temperature: conductivity, W/(m K), and heat capacity, J/(kg K).
const CONDUCTIVITY: f64 = 148.0;
const HEAT_CAPACITY: f64 = 713.0;
/// Temperature, K.
const ROOM_K: f64 = 293.0;

/// A driven mode as the paper measured it.
#[derive(Clone, Copy, Debug)]
pub(super) struct MeasuredMode {
    name: &'static str,
    frequency_hz: f64,
    pub(super) damping_ratio: f64,
    tooth_amplitude_m: f64,
}

/// Modes B and C of a scene's design.
pub(super) fn measured(scene: &Scene) -> [MeasuredMode; 2] {
    let of = |name, [frequency, damping, amplitude]: [&'static str; 3]| MeasuredMode {
        name,
        frequency_hz: scene.number(frequency),
        damping_ratio: scene.number(damping),
        tooth_amplitude_m: scene.number(amplitude),
    };
    let b = ["motor.mode_b.frequency_hz", "motor.mode_b.damping_ratio", "motor.mode_b.tooth_amplitude_m"];
    let c = ["motor.mode_c.frequency_hz", "motor.mode_c.damping_ratio", "motor.mode_c.tooth_amplitude_m"];
    [of("B", b), of("C", c)]
}

/// Damping ratio of the silicon of a stator as a plate, at a frequency.
pub(super) fn thermoelastic(solved: &SolvedStator, frequency_hz: f64) -> f64 {
    let n = &solved.drawing.numbers;
    let capacity = n.silicon_density_kg_m3 * HEAT_CAPACITY;
    let tau = n.silicon_thickness_m * n.silicon_thickness_m * capacity / (PI * PI * CONDUCTIVITY);
    let wt = 2.0 * PI * frequency_hz * tau;
    let alpha = n.silicon_expansion_per_k;
    0.5 * n.silicon_modulus_pa * alpha * alpha * ROOM_K / capacity * wt / (1.0 + wt * wt)
}

impl MeasuredMode {
    /// Steady amplitude at the teeth under a drive of constant force, m.
    fn amplitude(&self, frequency_hz: f64) -> f64 {
        let ratio = frequency_hz / self.frequency_hz;
        let (stiff, damped) = (1.0 - ratio * ratio, 2.0 * self.damping_ratio * ratio);
        2.0 * self.damping_ratio * self.tooth_amplitude_m / math::sqrt(stiff * stiff + damped * damped)
    }

    fn panel(&self, colour: Colour) -> Panel {
        let half = 8.0 * self.damping_ratio * self.frequency_hz;
        let at = |part: u32| self.frequency_hz + half * (f64::from(part) / 100.0 - 1.0);
        let curve = (0..=200).map(|part| (at(part), 1e6 * self.amplitude(at(part)))).collect();
        let peak = vec![(self.frequency_hz, 1e6 * self.tooth_amplitude_m)];
        Panel::new(format!("Mode {}", self.name), Axis::new("frequency (Hz)"), Axis::new("amplitude (um)"))
            .series(Series::line(curve).colour(colour).label("a mode of the published damping"))
            .series(Series::points(peak).colour(Colour::Black).width(3.5).label("paper, vibrometer"))
    }
}

/// Amplitude at the teeth against the frequency of the drive.
pub(super) fn sweep(scene: &Scene) -> Figure {
    let [b, c] = measured(scene);
    Figure::new("Frequency sweep of the stator without its rotor")
        .panel(b.panel(Colour::Vermilion))
        .panel(c.panel(Colour::Blue))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At its frequency a mode has its amplitude, and half of its power where the damping says.
    #[test]
    fn exact_a_sweep_has_the_width_of_its_damping() {
        for mode in measured(&Scene::default()) {
            assert!((mode.amplitude(mode.frequency_hz) / mode.tooth_amplitude_m - 1.0).abs() < 1e-12);
            let z = mode.damping_ratio;
            let side = mode.frequency_hz * math::sqrt(1.0 - 2.0 * z * z + 2.0 * z * math::sqrt(1.0 + z * z));
            let share = mode.amplitude(side) / mode.tooth_amplitude_m;
            // (1 - r^2)^2 + (2 z r)^2 = 8 z^2 (1 + ..) there, to the first order in z.
            assert!((share * share - 0.5).abs() < 2.0 * z, "{share}");
        }
    }
}
