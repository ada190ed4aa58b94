//! A drive beside the resonance of a lightly damped stator: drive and free oscillation beat.
//!
//! From rest the free oscillation starts as the opposite of the steady one, so `D = w - w_n` apart the amplitude is
//!
//! ```text
//! |X| |exp(i D t) - exp(-zeta w_n t)|,   |X| = F / |w_n^2 - w^2 + 2 i zeta w_n w|
//! ```
//!
//! up to a share `|D| / w_n` of `|X|`, by which the free oscillation's part in the displacement exceeds that in the
//! velocity: twice the steady amplitude every `1 / D`, nearly nothing between.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use std::f64::consts::TAU;

use motor_model::{DriveCommand, DriveMode, MotorParams, MotorSetup, Parameter, Real};

use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::motors::{Bench, changed, epsilon, steps_in};
use crate::support::oscillator::{Oscillator, motion_of};

/// Damping of both modes: the free oscillation decays at 4 a second.
const DAMPING_RATIO: f64 = 1e-4;

fn lightly_damped() -> MotorParams {
    changed(&[
        (Parameter::ModeBDampingRatio, DAMPING_RATIO),
        (Parameter::ModeCDampingRatio, DAMPING_RATIO),
        (Parameter::Gravity, 0.0),
    ])
}

fn check_beating<T: Real>(mode: DriveMode, offset_hz: f32, step_s: f64) {
    let params = lightly_damped();
    let oscillator = Oscillator::of(&params, mode);
    let detuning_rad_s = TAU * f64::from(offset_hz);
    let rad_s = oscillator.natural_rad_s + detuning_rad_s;
    let (re, im) = oscillator.response(rad_s);
    let steady_m = re.hypot(im);
    let command = DriveCommand::full(mode).with_frequency_offset(offset_hz).expect("within 2 kHz");
    let mut bench = Bench::<T>::new(&params, &MotorSetup::with_step(step_s));
    // Out of the stator's way.
    bench.state.rotor.height_m = T::one();
    let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
    let beat_s = 1.0 / f64::from(offset_hz.abs());
    for step in 1..=steps_in(8.0 * beat_s, step_s) {
        bench.motor.step(&mut bench.state, command);
        let t = f64::from(step) * step_s;
        let left = (-oscillator.decay_per_s() * t).exp();
        let (sin, cos) = (detuning_rad_s * t).sin_cos();
        let expected_m = steady_m * (cos - left).hypot(sin);
        let (g, v) = motion_of(&bench.state.modes, mode);
        let amplitude_m = g.hypot(v / rad_s);
        let what = format!("{mode:?} {offset_hz} Hz, {step_s:e} s, {} bytes, {t} s", size_of::<T>());
        let rounding = if size_of::<T>() == 4 { 0.5 * epsilon::<T>() * f64::from(step) } else { 0.0 };
        let share = 1.05 * detuning_rad_s.abs() / oscillator.natural_rad_s + rounding;
        assert_close(amplitude_m, expected_m, Within::absolute(share * steady_m), what);
        // From the second beat on.
        if t > beat_s {
            (least, most) = (least.min(amplitude_m / steady_m), most.max(amplitude_m / steady_m));
        }
    }
    // It is beating that is seen: eight beats of 25 ms leave half of the free oscillation.
    assert_between(most, 1.7, 2.1, "twice the steady amplitude at most");
    assert_between(least, 0.0, 0.2, "and almost nothing between");
}

#[test]
fn exact_beating_of_the_stator() {
    for mode in [DriveMode::B, DriveMode::C] {
        for offset_hz in [40.0, -40.0, 90.0] {
            for step_s in [1e-6, 10e-6, 20e-6] {
                check_beating::<f64>(mode, offset_hz, step_s);
                check_beating::<f32>(mode, offset_hz, step_s);
            }
        }
    }
}
