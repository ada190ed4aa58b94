//! A schedule of commands against a Taylor series that knows only the equation of motion: the switching instant, change
//! of mode, of amplitude and of frequency, at rounding level and whatever the step.

use std::f64::consts::TAU;

use motor_model::{DriveCommand, DriveMode, MotorParams, MotorSetup, MotorState, Real};

use crate::support::motors::{command, epsilon, motor};
use crate::support::oscillator::{Force, Motion, Oscillator, assert_motion_close, motion_of};

/// A command and for how many units of 10 us it holds.
type Schedule = [(DriveCommand, u32)];

/// A unit of the schedule's time: the coarsest step.
const UNIT_S: f64 = 10e-6;

/// On at an arbitrary phase, off, B to C without a pause, C to B, weak and detuned.
fn schedule() -> Vec<(DriveCommand, u32)> {
    vec![
        (DriveCommand::full(DriveMode::B), 313),
        (DriveCommand::OFF, 77),
        (command(DriveMode::B, 0.37, 0.0), 131),
        (DriveCommand::full(DriveMode::C), 209),
        (command(DriveMode::C, 0.9, -250.0), 190),
        (command(DriveMode::C, 0.9, 1250.5), 1),
        (command(DriveMode::B, 0.5, 33.25), 400),
        (DriveCommand::OFF, 3),
        (command(DriveMode::C, 0.05, 0.0), 222),
        (DriveCommand::OFF, 500),
    ]
}

/// B and C after each entry of the schedule, by the series.
fn expected_motions(params: &MotorParams, schedule: &Schedule) -> Vec<[Motion; 2]> {
    let mut turns = 0.0;
    let mut motions = [(0.0, 0.0); 2];
    let mut after = Vec::new();
    for &(command, units) in schedule {
        let time_s = f64::from(units) * UNIT_S;
        let mut drive_hz = 0.0;
        for (mode, motion) in [DriveMode::B, DriveMode::C].into_iter().zip(&mut motions) {
            let oscillator = Oscillator::of(params, mode);
            let driven = command.mode() == Some(mode);
            let hz = oscillator.natural_rad_s / TAU + f64::from(command.frequency_offset_hz());
            if driven {
                drive_hz = hz;
            }
            let amplitude = if driven { f64::from(command.amplitude()) } else { 0.0 };
            let force = Force { amplitude, rad_s: TAU * hz, phase_rad: TAU * turns };
            *motion = oscillator.series(*motion, force, time_s);
        }
        turns = (turns + drive_hz * time_s).fract();
        after.push(motions);
    }
    after
}

/// The motor's own motion after each entry, with the rotor out of contact.
fn motions_with<T: Real>(params: &MotorParams, schedule: &Schedule, steps_per_unit: u32) -> Vec<[Motion; 2]> {
    let motor = motor::<T>(params, &MotorSetup::with_step(UNIT_S / f64::from(steps_per_unit)));
    let mut state = MotorState::<T>::default();
    state.rotor.height_m = T::from_f64(1.0);
    let mut after = Vec::new();
    for &(command, units) in schedule {
        for _ in 0..units * steps_per_unit {
            let impacts = motor.step(&mut state, command);
            assert!(impacts.is_empty());
        }
        after.push([motion_of(&state.modes, DriveMode::B), motion_of(&state.modes, DriveMode::C)]);
    }
    after
}

fn compare(params: &MotorParams, actual: &[[Motion; 2]], expected: &[[Motion; 2]], share: f64, what: &str) {
    assert_eq!(actual.len(), expected.len());
    for (entry, (actual, expected)) in actual.iter().zip(expected).enumerate() {
        for (index, mode) in [DriveMode::B, DriveMode::C].into_iter().enumerate() {
            let oscillator = Oscillator::of(params, mode);
            let what = format!("{what}, after entry {entry}, mode {mode:?}");
            assert_motion_close(actual[index], expected[index], &oscillator, share, &what);
        }
    }
}

/// `epsilon / (zeta w h)` and 16 units, as in the steady state.
fn rounding<T: Real>(steps_per_unit: u32) -> f64 {
    let decay = Oscillator::of(&MotorParams::nominal(), DriveMode::B).decay_per_s();
    epsilon::<T>() * (16.0 + f64::from(steps_per_unit) / (decay * UNIT_S))
}

#[test]
fn exact_switching_adds_no_error() {
    let params = MotorParams::nominal();
    let expected = expected_motions(&params, &schedule());
    for steps_per_unit in [1, 10, 40, 100] {
        let actual = motions_with::<f64>(&params, &schedule(), steps_per_unit);
        compare(&params, &actual, &expected, rounding::<f64>(steps_per_unit), "f64");
        let actual = motions_with::<f32>(&params, &schedule(), steps_per_unit);
        compare(&params, &actual, &expected, rounding::<f32>(steps_per_unit), "f32");
    }
}

/// A command that changes every step, as a hostile controller might send it.
#[test]
fn exact_a_new_command_every_step_adds_no_error() {
    let params = MotorParams::nominal();
    let schedule: Vec<_> = (0..600_u16)
        .map(|k| match k % 4 {
            0 => (DriveCommand::full(DriveMode::B), 1),
            1 => (command(DriveMode::C, f32::from(k) / 600.0, f32::from(k)), 1),
            2 => (DriveCommand::OFF, 1),
            _ => (command(DriveMode::B, 0.2, -2.5 * f32::from(k)), 1),
        })
        .collect();
    let expected = expected_motions(&params, &schedule);
    for steps_per_unit in [1, 10] {
        let actual = motions_with::<f64>(&params, &schedule, steps_per_unit);
        compare(&params, &actual, &expected, rounding::<f64>(steps_per_unit), "f64");
    }
}
