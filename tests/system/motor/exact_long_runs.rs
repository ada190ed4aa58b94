//! A billion steps and a million turns in `f32`, told from seconds.
//!
//! Phase and angle are integers that wrap, so where they stand has no part in how they go on: a run is set down just
//! before the end of a billion steps and goes the rest. What an `f32` step adds to the angle, `d`, has 24 bits; the
//! part of a unit that is kept beside the integer lies on the grid of `d`'s last bit, so their sum is exact, unless it
//! passes a power of two: the angle is steps times `d`, to the bit.
//!
//! `d` itself is the rate times a constant, both rounded to `f32`: a scale that is off by 2^-23 at most, like the
//! rate's own last bit.

use std::f64::consts::TAU;

use motor_model::{
    Angle, AngleAccumulator, DriveCommand, DriveMode, DriveTuning, MotorParams, MotorSetup, Parameter, Phase,
};

use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{Bench, changed};
use crate::support::oscillator::{Oscillator, motion_of};

const UNITS_PER_TURN: f64 = 4_294_967_296.0;
/// A hundredth of a milli-degree in units of 2^-32 turn.
const HUNDREDTH_MDEG: f64 = 1e-5 / 360.0 * UNITS_PER_TURN;

/// A rotor that nothing touches or slows.
fn turning(rate_rad_s: f32, step_s: f64) -> Bench<f32> {
    let params = changed(&[
        (Parameter::TangentialDrag, 0.0),
        (Parameter::VerticalDamping, 0.0),
        (Parameter::Gravity, 0.0),
    ]);
    let mut bench = Bench::<f32>::new(&params, &MotorSetup::with_step(step_s));
    bench.state.rotor.height_m = 1.0;
    bench.state.rotor.rate_rad_s = rate_rad_s;
    bench
}

/// `d`, in units of 2^-32 turn.
#[expect(clippy::cast_possible_truncation, reason = "f32 is what the motor computes in")]
fn gain_units(rate_rad_s: f32, step_s: f64) -> f64 {
    let units_per_rad_s = (step_s * (UNITS_PER_TURN / TAU)) as f32;
    let gain = f64::from(units_per_rad_s * rate_rad_s);
    let ideal = f64::from(rate_rad_s) * step_s / TAU * UNITS_PER_TURN;
    assert_close(gain, ideal, Within::relative(f64::from(f32::EPSILON)), "scale");
    gain
}

/// What one more step may round away: half of the last bit of `d` and the part of a unit together, if their sum can
/// pass a power of two.
#[expect(clippy::cast_possible_truncation, reason = "f32 is what the motor computes in")]
fn rounding_units(gain: f64) -> f64 {
    let (single, sum) = (gain.abs() as f32, (gain.abs() + 1.0) as f32);
    let exponent = |x: f32| x.to_bits() >> 23;
    if exponent(sum) > exponent(single) { 0.5 * f64::from(sum.next_up() - sum) } else { 0.0 }
}

/// The accumulated angle in units, exactly.
fn units(accumulator: &AngleAccumulator<f32>, origin: Angle) -> f64 {
    let whole = accumulator.angle().minus(origin).units();
    #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
    let whole = whole as f64;
    whole + f64::from(accumulator.residual_units())
}

/// A million turns in earnest: 2 to 3 million steps of 1 ms at up to 3000 rad/s.
#[test]
fn exact_a_million_turns_are_steps_times_gain() {
    for rate_rad_s in [3000.0, -2345.678, 2048.0] {
        let mut bench = turning(rate_rad_s, 1e-3);
        let gain = gain_units(rate_rad_s, 1e-3);
        let mut steps = 0.0;
        while bench.state.rotor.angle.angle().units().abs() < 1_000_000 << 32 {
            bench.motor.step(&mut bench.state, DriveCommand::OFF);
            steps += 1.0;
        }
        let within = Within::absolute(HUNDREDTH_MDEG);
        assert_close(units(&bench.state.rotor.angle, Angle::ZERO), steps * gain, within, rate_rad_s);
        assert_close(
            f64::from(bench.state.rotor.rate_rad_s),
            f64::from(rate_rad_s),
            Within::absolute(0.0),
            "rate",
        );
    }
}

/// Follows `count` steps and returns by how much the angle left steps times `d`.
fn worst_error(bench: &mut Bench<f32>, gain: f64, count: u32) -> f64 {
    let origin = bench.state.rotor.angle.angle();
    let from = f64::from(bench.state.rotor.angle.residual_units());
    (1..=count).fold(0.0, |worst: f64, step| {
        bench.motor.step(&mut bench.state, DriveCommand::OFF);
        worst.max((units(&bench.state.rotor.angle, origin) - from - f64::from(step) * gain).abs())
    })
}

/// At the rates and steps of the motor the first million steps are exact, but for the least gains, and the last of a
/// billion steps, a million turns on, like the first. Rounding all one way would add up to less than a hundredth of a
/// milli-degree in a billion steps.
#[test]
fn exact_angle_after_a_billion_steps() {
    for rate_rad_s in [15.142, -1.528, 0.025, 1e-4_f32] {
        for step_s in [1e-6, 10e-6, 20e-6] {
            let what = format!("{rate_rad_s} rad/s, {step_s:e} s");
            let gain = gain_units(rate_rad_s, step_s);
            let rounding = rounding_units(gain);
            assert!(1e9 * rounding < HUNDREDTH_MDEG, "{what}: {rounding:e} units a step");
            let mut bench = turning(rate_rad_s, step_s);
            let early = worst_error(&mut bench, gain, 1_000_000);
            assert_close(early, 0.0, Within::absolute(1e6 * rounding), &what);
            let far = bench.state.rotor.angle.angle().plus(Angle::from_units(1_000_000 << 32));
            bench.state.rotor.angle = AngleAccumulator::at(far);
            bench.state.steps = 1_000_000_000 - 100_000;
            let late = worst_error(&mut bench, gain, 100_000);
            assert_close(late, 0.0, Within::absolute(1e5 * rounding), &what);
        }
    }
}

/// The drive after a billion and seven steps in `f32`: phase by integer arithmetic, and the stator moves as that phase
/// says.
#[test]
fn exact_drive_after_a_billion_steps() {
    let (b_hz, step_s, settling) = (6301.7, 3e-6, 40_000_u32);
    let setup =
        MotorSetup { tuning: DriveTuning::Fixed { b_hz, c_hz: 7460.0 }, ..MotorSetup::with_step(step_s) };
    let params = changed(&[(Parameter::Gravity, 0.0)]);
    let mut bench = Bench::<f32>::new(&params, &setup);
    bench.state.rotor.height_m = 1.0;
    let command = DriveCommand::full(DriveMode::B);
    let increment = bench.motor.modes().forcing(command).increment().units();
    let before = 1_000_000_007_u64 - u64::from(settling);
    bench.state.phase = Phase::from_units(increment.wrapping_mul(before));
    bench.state.steps = before;
    for _ in 0..settling {
        bench.motor.step(&mut bench.state, command);
    }
    // 6301.7 Hz times 3 us is 0.0189051 turns a step: 18,905,100 turns and seven steps more.
    let expected_turns = 7.0 * 0.018_905_1;
    #[expect(clippy::cast_precision_loss, reason = "1e-16 of a turn")]
    let turns = bench.state.phase.units() as f64 / 18_446_744_073_709_551_616.0;
    // Frequency, step and their product are rounded to f64 once, for 19 million turns.
    let rounding = 3.0 * 0.5 * f64::EPSILON * 1.9e7;
    assert_close(turns, expected_turns, Within::absolute(rounding), "phase in turns");
    assert_eq!(bench.state.steps, 1_000_000_007);
    let oscillator = Oscillator::of(&MotorParams::nominal(), DriveMode::B);
    let (re, im) = oscillator.response(TAU * b_hz);
    let (sin, cos) = motor_model::math::sin_cos(TAU * expected_turns);
    let (g, v) = motion_of(&bench.state.modes, DriveMode::B);
    // Two roundings a step, all one way, over the time in which the oscillator forgets.
    let share = 2.0 * f64::from(f32::EPSILON) / (oscillator.decay_per_s() * step_s);
    let within = Within::absolute(share * oscillator.antinode_m);
    assert_close(g, re * sin + im * cos, within, "displacement");
    assert_close(v / (TAU * b_hz), re * cos - im * sin, within, "velocity");
}
