//! The rotor in flight against closed forms, through the whole motor's step.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use motor_model::{DriveCommand, MotorSetup, Parameter, Real};

use crate::support::closeness::{Within, assert_close};
use crate::support::motors::{Bench, changed, epsilon, steps_in};

const GRAVITY_M_S2: f64 = 9.81;

fn check_parabola<T: Real>(launch_m_s: f64, step_s: f64) {
    let params = changed(&[(Parameter::VerticalDamping, 0.0)]);
    let mut bench = Bench::<T>::new(&params, &MotorSetup::with_step(step_s));
    bench.state.rotor.velocity_m_s = T::from_f64(launch_m_s);
    let flight_s = 2.0 * launch_m_s / GRAVITY_M_S2;
    let flight_steps = flight_s / step_s;
    let mut highest: f64 = 0.0;
    let mut steps = 0.0;
    loop {
        let (before, impacts) = bench.step(DriveCommand::OFF);
        steps += 1.0;
        highest = highest.max(before.rotor.height_m.to_f64());
        if !impacts.is_empty() {
            break;
        }
        assert!(steps < 2.0 * flight_steps, "never lands");
    }
    // Each step rounds velocity and height once, by half an ulp of up to the launch speed.
    let rounding = flight_steps * epsilon::<T>();
    let allowed = 1.0 + flight_steps * rounding;
    assert_close(steps, flight_steps + 0.5, Within::absolute(allowed), format_args!("landing, {step_s:e} s"));
    let apex = launch_m_s * launch_m_s / (2.0 * GRAVITY_M_S2);
    let sampled = GRAVITY_M_S2 * step_s * step_s / 8.0;
    let within = Within { rtol: 2.0 * rounding, atol: sampled };
    assert_close(highest, apex, within, format_args!("apex, {step_s:e} s"));
}

/// `b_z = 0`: time of flight `2 v / g`, to the step that notices it, and apex `v^2 / 2g`.
#[test]
fn exact_parabola() {
    for step_s in [1e-6, 7e-6, 50e-6] {
        for launch_m_s in [0.01, 0.3] {
            check_parabola::<f64>(launch_m_s, step_s);
            check_parabola::<f32>(launch_m_s, step_s);
        }
    }
}

fn check_fall<T: Real>(damping: f64, gravity: f64, step_s: f64) {
    let params = changed(&[(Parameter::VerticalDamping, damping), (Parameter::Gravity, gravity)]);
    let mut bench = Bench::<T>::new(&params, &MotorSetup::with_step(step_s));
    let (height, launch) = (0.5, 0.2);
    bench.state.rotor.height_m = T::from_f64(height);
    bench.state.rotor.velocity_m_s = T::from_f64(launch);
    bench.run(DriveCommand::OFF, 0.05);
    let k = damping / 46e-6;
    let t = 0.05;
    let terminal = gravity / k;
    let decay = (-k * t).exp();
    let velocity = (launch + terminal) * decay - terminal;
    let risen = (launch + terminal) * (1.0 - decay) / k - terminal * t;
    let rounding = epsilon::<T>() * f64::from(steps_in(t, step_s));
    let what = format!("b_z {damping:e}, g {gravity}, {step_s:e} s");
    let scale = 0.2 + gravity.abs() * t;
    assert_close(
        bench.state.rotor.velocity_m_s.to_f64(),
        velocity,
        Within::absolute(scale * rounding),
        &what,
    );
    assert_close(bench.state.rotor.height_m.to_f64(), height + risen, Within::absolute(rounding), &what);
}

/// Velocity and height after 50 ms under squeeze-film damping, with gravity up, down and absent.
#[test]
fn exact_damped_flight() {
    for damping in [3.6e-3, 0.6e-3, 0.5] {
        for gravity in [GRAVITY_M_S2, 0.0, -GRAVITY_M_S2] {
            for step_s in [1e-6, 10e-6, 50e-6] {
                check_fall::<f64>(damping, gravity, step_s);
            }
            check_fall::<f32>(damping, gravity, 10e-6);
        }
    }
}

fn check_drag<T: Real>(step_s: f64) {
    // A drag strong enough to matter: decay rate b_th R_t^2 / J = 20 / s.
    let drag = 20.0 * 4.59e-10 / (3.063e-3 * 3.063e-3);
    let params = changed(&[(Parameter::TangentialDrag, drag), (Parameter::Gravity, 0.0)]);
    let mut bench = Bench::<T>::new(&params, &MotorSetup::with_step(step_s));
    bench.state.rotor.height_m = T::from_f64(1e-3);
    bench.state.rotor.rate_rad_s = T::from_f64(-15.0);
    let time_s = 0.08;
    bench.run(DriveCommand::OFF, time_s);
    let decay = (-20.0 * time_s).exp();
    let rounding = epsilon::<T>() * f64::from(steps_in(time_s, step_s));
    let rate = bench.state.rotor.rate_rad_s.to_f64();
    assert_close(rate, -15.0 * decay, Within::absolute(15.0 * rounding), "rate");
    // The angle is counted in units of 2^-32 turn.
    let within = Within { rtol: rounding, atol: 2e-9 };
    assert_close(bench.angle_rad(), -15.0 / 20.0 * (1.0 - decay), within, "angle");
}

/// Rate and angle decay as `exp(-b_th R_t^2 t / J)`.
#[test]
fn exact_drag_decay() {
    for step_s in [1e-6, 10e-6, 50e-6] {
        check_drag::<f64>(step_s);
        check_drag::<f32>(step_s);
    }
}
