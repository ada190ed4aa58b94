//! Drive off: landing, spin-down, rest on the teeth, for impacts noticed at the end of a step.

use motor_model::{DriveCommand, DriveMode, FrictionLaw, MotorSetup, Parameter, Phase, Real};

use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::motors::{Bench, at_end_of_step, changed, steps_in};

/// Extremes of a quantity over a run.
struct Range {
    low: f64,
    high: f64,
    mean: f64,
}

/// Height of the rotor over `time_s` with the drive off.
fn height_over<T: Real>(bench: &mut Bench<T>, time_s: f64) -> Range {
    let steps = steps_in(time_s, bench.motor.step_s());
    let mut range = Range { low: f64::INFINITY, high: f64::NEG_INFINITY, mean: 0.0 };
    for _ in 0..steps {
        bench.motor.step(&mut bench.state, DriveCommand::OFF);
        let height = bench.state.rotor.height_m.to_f64();
        range.low = range.low.min(height);
        range.high = range.high.max(height);
        range.mean += height / f64::from(steps);
    }
    range
}

/// How far the rotor's weight presses the stator down: mode A carries it all, `m_r g / (m_s w_A^2)`.
pub fn sag_m() -> f64 {
    let natural = std::f64::consts::TAU * 2150.0;
    46e-6 * 9.81 / (10.7e-6 * natural * natural)
}

/// Rate at which a rotor at rest may creep: the end-of-step rule locks into a rhythm of impacts, one in two or three
/// steps, that tilts a little to one side. Measured 0.5e-6 to 1.1e-6 rad/s at 1 us, 4e-6 at 2 us, up to 130e-6 at 5 us,
/// the same in either precision; twice that is allowed. At 10 us there are rhythms of seven steps too, which turn the
/// rotor by up to 0.1 rad/s: no rest at all.
pub fn creep_rad_s(step_s: f64) -> f64 {
    if step_s > 5e-6 { 0.2 } else { 2.2e-6 * (step_s / 1e-6) * (step_s / 1e-6) * (step_s / 1e-6) }
}

fn check_rest<T: Real>(step_s: f64, time_s: f64) {
    let mut bench = Bench::<T>::new(&changed(&[]), &at_end_of_step(step_s));
    bench.state.rotor.height_m = T::from_f64(50e-6);
    bench.state.rotor.rate_rad_s = T::from_f64(1.0);
    bench.run(DriveCommand::OFF, 0.2);
    let angle = bench.state.rotor.angle.angle();
    let range = height_over(&mut bench, time_s);
    let what = format!("{step_s:e} s");
    // Falling for a step and being put back: the rotor stays within a few steps' fall of the sagged teeth.
    let slack = 20.0 * 9.81 * step_s * step_s + 0.05 * sag_m();
    assert_close(
        range.mean,
        -sag_m(),
        Within { rtol: 0.05, atol: slack },
        format_args!("mean height, {what}"),
    );
    assert_between(range.low, -2.0 * sag_m() - slack, 0.0, format_args!("lowest, {what}"));
    assert_between(range.high, -2.0 * sag_m(), slack, format_args!("highest, {what}"));
    assert_close(
        bench.state.rotor.rate_rad_s.to_f64(),
        0.0,
        Within::absolute(creep_rad_s(step_s)),
        format_args!("rate, {what}"),
    );
    let turned_rad = bench.state.rotor.angle.angle().minus(angle).degrees().to_radians();
    let within = Within::absolute(creep_rad_s(step_s) * time_s);
    assert_close(turned_rad, 0.0, within, format_args!("angle at rest, {what}"));
}

/// Dropped and left alone for seconds, the rotor rests on teeth that sag under its weight: no sinking, no creeping.
#[test]
fn law_rest_on_sagging_teeth_for_seconds() {
    check_rest::<f64>(1e-6, 3.0);
    check_rest::<f64>(5e-6, 10.0);
    check_rest::<f64>(10e-6, 10.0);
    check_rest::<f32>(1e-6, 3.0);
    check_rest::<f32>(10e-6, 10.0);
}

/// A rotor that spins on still teeth: Coulomb's law stops it in `rate J / (mu m_r g R_t)`, after half of `rate` times
/// that.
#[test]
fn exact_spin_down_on_still_teeth() {
    let (rate, friction) = (15.0, 0.4);
    let torque = friction * 46e-6 * 9.81 * 3.063e-3;
    let stop_s = rate * 4.59e-10 / torque;
    for step_s in [0.5e-6, 2e-6] {
        for sense in [1.0, -1.0] {
            let mut bench = Bench::<f64>::new(&changed(&[]), &at_end_of_step(step_s));
            bench.run(DriveCommand::OFF, 0.1);
            bench.state.rotor.rate_rad_s = sense * rate;
            let origin = bench.angle_rad();
            bench.run(DriveCommand::OFF, 0.5 * stop_s);
            assert_close(bench.state.rotor.rate_rad_s, 0.5 * sense * rate, Within::relative(0.02), "halfway");
            bench.run(DriveCommand::OFF, 0.6 * stop_s);
            assert_close(bench.state.rotor.rate_rad_s, 0.0, Within::absolute(creep_rad_s(step_s)), "stopped");
            let turned = bench.angle_rad() - origin;
            assert_close(
                turned,
                0.5 * sense * rate * stop_s,
                Within::relative(0.02),
                "angle of the spin-down",
            );
        }
    }
}

fn check_drive_off<T: Real>(mode: DriveMode, step_s: f64) {
    let setup = at_end_of_step(step_s);
    let mut running = Bench::<T>::new(&changed(&[]), &setup);
    running.run(DriveCommand::full(mode), 0.3);
    let origin = running.angle_rad();
    running.run(DriveCommand::full(mode), 0.3);
    assert_between((running.angle_rad() - origin).abs() / 0.3, 1.0, 25.0, "full speed");
    for phase in 0..8 {
        // A few steps further each time, so that the drive stops at another phase of it and of the bounce.
        running.run(DriveCommand::full(mode), 0.013 + f64::from(phase) * 19.7e-6);
        let mut bench = running.clone();
        let phase_at_stop = bench.state.phase;
        bench.run(DriveCommand::OFF, 0.25);
        assert_close(
            bench.state.rotor.rate_rad_s.to_f64(),
            0.0,
            Within::absolute(creep_rad_s(step_s)),
            format_args!("{mode:?} {phase}"),
        );
        let angle = bench.state.rotor.angle.angle();
        let range = height_over(&mut bench, 0.25);
        let slack = 2.0 * sag_m() + 20.0 * 9.81 * step_s * step_s;
        assert_between(range.low, -slack, slack, "lowest");
        assert_between(range.high, -slack, slack, "highest");
        let turned_rad = bench.state.rotor.angle.angle().minus(angle).degrees().to_radians();
        assert_close(turned_rad, 0.0, Within::absolute(creep_rad_s(step_s) * 0.25), "angle at rest");
        assert_eq!(bench.state.phase, phase_at_stop);
    }
}

/// From full speed to rest in a quarter of a second, whenever the drive is cut.
#[test]
fn law_drive_off_from_full_speed_at_several_phases() {
    for mode in [DriveMode::B, DriveMode::C] {
        check_drive_off::<f64>(mode, 2e-6);
        check_drive_off::<f64>(mode, 5e-6);
        check_drive_off::<f64>(mode, 10e-6);
        check_drive_off::<f32>(mode, 5e-6);
    }
}

/// Perfectly plastic and perfectly elastic contacts, under both friction laws and full drive, stay finite and near the
/// teeth.
#[test]
fn law_extreme_restitution_stays_finite() {
    for restitution in [0.0, 0.999_999, 1.0] {
        for friction_law in [FrictionLaw::Coulomb, FrictionLaw::Paper] {
            for mode in [DriveMode::B, DriveMode::C] {
                let setup = MotorSetup { friction_law, ..at_end_of_step(2e-6) };
                let params = changed(&[(Parameter::Restitution, restitution)]);
                let mut bench = Bench::<f64>::new(&params, &setup);
                bench.state.phase = Phase::from_turns(0.3);
                for _ in 0..20 {
                    bench.run(DriveCommand::full(mode), 0.02);
                    let rotor = bench.state.rotor;
                    let what = format!("e = {restitution}, {friction_law:?}, {mode:?}");
                    assert_between(rotor.height_m, -1e-4, 0.1, &what);
                    assert_between(rotor.rate_rad_s, -100.0, 100.0, &what);
                }
            }
        }
    }
}

/// Without bounce a dropped rotor is at rest at once: the sagging teeth ring, but it stays down.
#[test]
fn law_plastic_landing_does_not_bounce() {
    let params = changed(&[(Parameter::Restitution, 0.0), (Parameter::VerticalDamping, 0.0)]);
    let mut bench = Bench::<f64>::new(&params, &at_end_of_step(1e-6));
    let drop = 20e-6;
    bench.state.rotor.height_m = drop;
    bench.until_impact(DriveCommand::OFF, 1_000_000);
    let range = height_over(&mut bench, 0.05);
    // The heavy rotor and the teeth under it leave the impact with one velocity; the teeth's spring throws them back a
    // little.
    assert_between(range.high, -drop, 0.9 * drop, "height after a plastic landing");
    let last = height_over(&mut bench, 0.05);
    assert_between(last.high, -2.0 * sag_m(), 1e-8, "height a little later");
}
