//! Half widths of the resonances of a design.

use motor_model::{MotorParams, Parameter};

/// Half widths of the resonances of modes B and C in Hz, `zeta f`: what the offset is for half of the power.
#[expect(clippy::cast_possible_truncation, reason = "single precision suffices")]
pub(super) const fn half_widths_hz(design: &MotorParams) -> [f32; 2] {
    use Parameter::{ModeBDampingRatio, ModeBFrequency, ModeCDampingRatio, ModeCFrequency};
    [
        (design.get(ModeBFrequency) * design.get(ModeBDampingRatio)) as f32,
        (design.get(ModeCFrequency) * design.get(ModeCDampingRatio)) as f32,
    ]
}
