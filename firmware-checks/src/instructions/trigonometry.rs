//! Sines for the drive and angles from quadratures, in `f32`, by this project and three libraries: instructions and
//! largest error.
//!
//! | operation | largest error in milli-degrees |
//! |---|---|
//! | `sine_phase_table`, [`motor_model::Phase::sin_cos`], which the drive and the twin use | 0.007 |
//! | `sine_libm` of a phase in radians | 0.018 |
//! | `sine_micromath`, the same | 63 |
//! | `sine_idsp`, sine and cosine at once, of a 32-bit phase | 1.1 |
//! | `angle_libm`, `atan2f` | 0.015 |
//! | `angle_micromath` | 163 |
//! | `angle_idsp`, of 32-bit quadratures | 0.15 |
//!
//! The error of a sine is given as an angle, by the slope of the sine at 0. A test holds the errors to this table.
//! Instructions are counted on the microcontroller, with the conversion of a 64-bit phase to radians.

use core::f32::consts::TAU;
use core::hint::black_box;

use motor_model::Phase;

use super::{Count, InstructionCounter, InstructionTimer};

/// Inputs of each operation.
const SAMPLES: u32 = 10_000;

/// An odd number near the golden section of 2^64: the phases are spread evenly over all octants.
const PHASE_STEP: u64 = 0x9E37_79B9_7F4A_7C15;

/// The upper half, signed: -1/2 to 1/2 turn.
fn half(phase: Phase) -> i32 {
    ((phase.units() >> 32) as u32).cast_signed()
}

/// Units of 2^-32 turn in radians.
#[expect(clippy::cast_precision_loss, reason = "f32 holds 24 bits")]
fn radians(units: i32) -> f32 {
    units as f32 * (TAU / 4_294_967_296.0)
}

/// 2^-31 of the value.
#[expect(clippy::cast_precision_loss, reason = "f32 holds 24 bits")]
fn fraction(value: i32) -> f32 {
    value as f32 * (1.0 / 2_147_483_648.0)
}

#[inline(never)]
fn sine_phase_table(phase: Phase) -> f32 {
    phase.sin_cos::<f32>().0
}

#[inline(never)]
fn sine_libm(phase: Phase) -> f32 {
    libm::sinf(radians(half(phase)))
}

#[inline(never)]
fn sine_micromath(phase: Phase) -> f32 {
    micromath::F32Ext::sin(radians(half(phase)))
}

#[inline(never)]
fn sine_idsp(phase: Phase) -> f32 {
    fraction(idsp::cossin(half(phase)).1)
}

#[inline(never)]
fn angle_libm(y: f32, x: f32) -> f32 {
    libm::atan2f(y, x)
}

#[inline(never)]
fn angle_micromath(y: f32, x: f32) -> f32 {
    micromath::F32Ext::atan2(y, x)
}

#[inline(never)]
#[expect(clippy::cast_possible_truncation, reason = "saturates at full scale")]
fn angle_idsp(y: f32, x: f32) -> f32 {
    const FULL_SCALE: f32 = 2_147_483_648.0;
    radians(idsp::atan2((y * FULL_SCALE) as i32, (x * FULL_SCALE) as i32))
}

type Sine = fn(Phase) -> f32;
type AngleOf = fn(f32, f32) -> f32;

const SINES: [(&str, Sine); 4] = [
    ("sine_phase_table", sine_phase_table),
    ("sine_libm", sine_libm),
    ("sine_micromath", sine_micromath),
    ("sine_idsp", sine_idsp),
];

const ANGLES: [(&str, AngleOf); 3] =
    [("angle_libm", angle_libm), ("angle_micromath", angle_micromath), ("angle_idsp", angle_idsp)];

#[inline(never)]
pub(super) fn count(counter: &InstructionCounter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    let step = Phase::from_units(PHASE_STEP);
    for (operation, sine) in SINES {
        let mut count = Count::new(operation);
        let mut phase = Phase::ZERO;
        for _ in 0..SAMPLES {
            phase = phase.advanced(step);
            let at = black_box(phase);
            let (value, instructions) = counter.count(|| sine(at));
            black_box(value);
            count.add(instructions);
        }
        report(count);
    }
    for (operation, angle) in ANGLES {
        let mut count = Count::new(operation);
        let mut phase = Phase::ZERO;
        for _ in 0..SAMPLES {
            phase = phase.advanced(step);
            let (y, x) = black_box(phase.sin_cos::<f32>());
            let (value, instructions) = counter.count(|| angle(y, x));
            black_box(value);
            count.add(instructions);
        }
        report(count);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::f64::consts::TAU;

    use super::*;

    const MDEG_PER_RAD: f64 = 180_000.0 / core::f64::consts::PI;

    fn phases() -> impl Iterator<Item = Phase> {
        let step = Phase::from_units(PHASE_STEP);
        core::iter::successors(Some(step), move |phase| Some(phase.advanced(step))).take(1_000_000)
    }

    /// The phase that all operations get: its upper half, in turns.
    fn turns(phase: Phase) -> f64 {
        f64::from(half(phase)) / 4_294_967_296.0
    }

    fn in_table(operation: &str, error_mdeg: f64) -> bool {
        let table = include_str!("trigonometry.rs");
        let row = table.lines().find(|line| line.starts_with(&std::format!("//! | `{operation}`"))).unwrap();
        let cell = row.trim_end_matches(" |").rsplit("| ").next().unwrap();
        let stated: f64 = cell.parse().unwrap();
        std::println!("{operation} {error_mdeg:.4}, stated {stated}");
        error_mdeg <= stated && error_mdeg > 0.8 * stated
    }

    /// Each error is at most that of the table, and more than four fifths of it.
    #[test]
    fn dual_errors_are_those_of_the_table() {
        let mut all = true;
        for (operation, sine) in SINES {
            let errors = phases().map(|phase| (f64::from(sine(phase)) - libm::sin(TAU * turns(phase))).abs());
            all &= in_table(operation, MDEG_PER_RAD * errors.fold(0.0, f64::max));
        }
        for (operation, angle) in ANGLES {
            let errors = phases().map(|phase| {
                let (y, x) = phase.sin_cos::<f32>();
                let off = f64::from(angle(y, x)) - libm::atan2(y.into(), x.into());
                // Angles that differ by a turn are equal.
                off.abs().min((off.abs() - TAU).abs())
            });
            all &= in_table(operation, MDEG_PER_RAD * errors.fold(0.0, f64::max));
        }
        assert!(all);
    }
}
