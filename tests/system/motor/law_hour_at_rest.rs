//! An hour at rest, 3.6e9 steps at 1 us, told from seconds.
//!
//! With the drive off a step maps the motion (modes, height, velocities, pairs in sustained contact) to the next
//! without regard to angle, phase or time. Once a motion comes back bit for bit, it comes back for ever: an hour turns
//! the rotor by the mean rate of one cycle times 3600 s. In `f32`, and under the end-of-step rule in both precisions,
//! such a cycle is found. Located impacts in `f64` leave the last bits of the modes ringing without a cycle in sight;
//! there the largest rate, some 1e-17 rad/s, bounds the hour.
//!
//! The angle's accumulator adds at most a rounding of its residual, 2^-25 of a unit of 2^-32 turn a step in `f32`: 1e-5
//! degrees in an hour.

use motor_model::{DriveCommand, ImpactRule, MotorSetup, MotorState, Parameter, Real};

use crate::motor::law_energy::Accounted;
use crate::motor::law_rest::creep_rad_s;
use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::motors::{Bench, changed, epsilon, located, steps_in};

const STEPS_S: [f64; 4] = [1e-6, 5e-6, 10e-6, 20e-6];

/// The bits of all that the next step depends on.
fn motion_bits<T: Real>(state: &MotorState<T>) -> ([[u64; 3]; 3], [bool; 2]) {
    let (modes, rotor) = (&state.modes, &state.rotor);
    let bits = |x: &[T]| [x[0].bits(), x[1].bits(), x[2].bits()];
    let rotor = [rotor.height_m, rotor.velocity_m_s, rotor.rate_rad_s];
    (
        [bits(modes.displacement_m.as_slice()), bits(modes.velocity_m_s.as_slice()), bits(&rotor)],
        state.in_contact,
    )
}

/// A rotor dropped with some spin and left alone for 3 s.
fn settled<T: Real>(setup: &MotorSetup) -> Bench<T> {
    let mut bench = Bench::<T>::new(&changed(&[]), setup);
    bench.state.rotor.height_m = T::from_f64(20e-6);
    bench.state.rotor.rate_rad_s = T::from_f64(1.0);
    bench.run(DriveCommand::OFF, 3.0);
    bench
}

/// Mean rate over the cycle into which the motion has fallen, by Brent's search, if there is one of less than a million
/// steps.
fn mean_rate_of_cycle<T: Real>(bench: &mut Bench<T>) -> Option<f64> {
    let (mut limit, mut steps) = (1_u32, 0_u32);
    let (mut reference, mut sum_rad_s) = (motion_bits(&bench.state), 0.0);
    while limit < 1 << 20 {
        bench.motor.step(&mut bench.state, DriveCommand::OFF);
        steps += 1;
        sum_rad_s += bench.state.rotor.rate_rad_s.to_f64();
        if motion_bits(&bench.state) == reference {
            return Some(sum_rad_s / f64::from(steps));
        }
        if steps == limit {
            (limit, steps, sum_rad_s) = (2 * limit, 0, 0.0);
            reference = motion_bits(&bench.state);
        }
    }
    None
}

fn check_cycle<T: Real>(setup: &MotorSetup, most_rad_s: f64) {
    let what = format!("{:?}, {:e} s, {} bytes", setup.impact_rule, setup.step_s, size_of::<T>());
    let rate = mean_rate_of_cycle(&mut settled::<T>(setup)).unwrap_or_else(|| panic!("no cycle: {what}"));
    println!("{what}: {rate:e} rad/s");
    assert_close(rate, 0.0, Within::absolute(most_rad_s), what);
}

/// Located impacts: in `f32` less than 3.6e-6 rad, 0.2 milli-degree, in an hour; in `f64` nothing.
#[test]
fn law_an_hour_at_rest_with_located_impacts() {
    for step_s in STEPS_S {
        check_cycle::<f32>(&located(step_s), 1e-9);
        let mut bench = settled::<f64>(&located(step_s));
        let (angle, height_m) = (bench.state.rotor.angle.angle(), bench.state.rotor.height_m);
        for _ in 0..steps_in(2.0, step_s) {
            bench.motor.step(&mut bench.state, DriveCommand::OFF);
            let rate = bench.state.rotor.rate_rad_s;
            assert_close(rate, 0.0, Within::absolute(1e-15), format_args!("{step_s:e} s"));
            let within = Within::absolute(1e-20);
            assert_close(bench.state.rotor.height_m, height_m, within, format_args!("{step_s:e} s"));
            assert_eq!(bench.state.in_contact, [true; 2], "{step_s:e} s");
        }
        assert_eq!(bench.state.rotor.angle.angle(), angle, "{step_s:e} s");
    }
}

/// At the end of the step: a rhythm of impacts for ever, which creeps as it does over seconds. There is no rest beyond
/// 5 us.
#[test]
fn law_an_hour_at_rest_with_impacts_at_the_end_of_the_step() {
    for step_s in [1e-6, 2e-6, 5e-6] {
        let setup = MotorSetup { impact_rule: ImpactRule::EndOfStep, ..MotorSetup::with_step(step_s) };
        check_cycle::<f32>(&setup, creep_rad_s(step_s));
        check_cycle::<f64>(&setup, creep_rad_s(step_s));
    }
}

/// A rotor of a hundredth to a thousand stators lies on both pairs and neither hops from one to the other nor turns.
fn check_any_weight<T: Real>(ratio: f64, step_s: f64) {
    let mass = ratio * 10.7e-6;
    let params = changed(&[(Parameter::RotorMass, mass), (Parameter::RotorInertia, 4.59e-10 * mass / 46e-6)]);
    let mut start = MotorState::<T>::default();
    start.rotor.height_m = T::from_f64(5e-6);
    start.rotor.rate_rad_s = T::from_f64(2.0);
    let mut accounted = Accounted::from(&params, &located(step_s), start);
    // The heavy one bounces on its stator for long.
    accounted.run(DriveCommand::OFF, if ratio > 100.0 { 2.5 } else { 0.5 });
    let what = format!("m_r / m_s = {ratio}, {step_s:e} s, {} bytes", size_of::<T>());
    let angle = accounted.state.rotor.angle.angle();
    for _ in 0..steps_in(0.1, step_s) {
        assert_eq!(accounted.run(DriveCommand::OFF, step_s), 0, "{what}");
        assert_eq!(accounted.state.in_contact, [true; 2], "{what}");
    }
    let single = size_of::<T>() == 4;
    let rate = accounted.state.rotor.rate_rad_s.to_f64();
    assert_close(
        rate,
        0.0,
        Within::absolute(if single { 1e-8 } else { 1e-15 }),
        format_args!("rate, {what}"),
    );
    let turned = accounted.state.rotor.angle.angle().minus(angle).units();
    assert!(turned.abs() <= 1, "{what}: {turned} units");
}

#[test]
fn law_rest_of_any_weight() {
    for ratio in [0.01, 0.03, 0.1, 1.0, 10.0, 100.0, 1000.0] {
        for step_s in STEPS_S {
            check_any_weight::<f64>(ratio, step_s);
            check_any_weight::<f32>(ratio, step_s);
        }
    }
}

/// Enormous friction: both pairs hold the rotor with up to `L = mu m_r g span R_t^2 / J` a span, against each other,
/// and where they balance the rotor keeps the rounding of `L`.
fn check_residual_rate<T: Real>(friction: f64, step_s: f64) {
    let mut bench = Bench::<T>::new(&changed(&[(Parameter::Friction, friction)]), &located(step_s));
    bench.state.rotor.rate_rad_s = T::from_f64(15.0);
    bench.run(DriveCommand::OFF, 0.5);
    let radius = 3.063e-3;
    let limit_m_s = friction * 9.81 * step_s.min(5e-6) * 46e-6 * radius * radius / 4.59e-10;
    let bound_rad_s = 0.5 * epsilon::<T>() * limit_m_s / radius;
    let mut most = 0.0_f64;
    for _ in 0..steps_in(0.1, step_s) {
        bench.motor.step(&mut bench.state, DriveCommand::OFF);
        most = most.max(bench.state.rotor.rate_rad_s.to_f64().abs());
    }
    println!("mu {friction:e} {step_s:e} {most:e} of {bound_rad_s:e}");
    let what = format!("mu = {friction:e}, {step_s:e} s, {} bytes", size_of::<T>());
    // The last bits of the modes ring and take the rotor with them, whatever the friction.
    assert_between(most, 0.0, bound_rad_s + if size_of::<T>() == 4 { 1e-8 } else { 1e-15 }, what);
}

#[test]
fn law_enormous_friction_leaves_its_rounding() {
    for friction in [1.0, 1e2, 1e4, 1e6] {
        for step_s in STEPS_S {
            check_residual_rate::<f64>(friction, step_s);
            check_residual_rate::<f32>(friction, step_s);
        }
    }
}
