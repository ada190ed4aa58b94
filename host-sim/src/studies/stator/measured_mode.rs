//! Modes B and C of a design, as a vibrometer measured them without the rotor.

use std::f64::consts::PI;

use simulation::scene::Scene;

/// A driven mode as the paper measured it, or as a scene has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredMode {
    /// B or C.
    pub name: &'static str,
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Amplitude of a tooth at resonance and full drive, m.
    pub tooth_amplitude_m: f64,
}

/// Modes B and C of a scene's design.
pub fn measured(scene: &Scene) -> [MeasuredMode; 2] {
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

impl MeasuredMode {
    /// Time in which the free motion falls to 1/e, s.
    pub(super) fn ring_down_s(&self) -> f64 {
        1.0 / (2.0 * PI * self.frequency_hz * self.damping_ratio)
    }
}
