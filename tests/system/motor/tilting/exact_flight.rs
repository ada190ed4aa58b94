//! A tilted rotor in free flight against the closed form of a symmetric top.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use motor_model::{DriveCommand, Parameter, TiltingParameter, TiltingSetup, TiltingState};
use nalgebra::Vector2;

use super::{in_space, motor, slow_in_b, tilting};

/// `I = J/2 + m h^2/12` of the nominal rotor.
const INERTIA: f64 = 4.59e-10 / 2.0 + 46e-6 * 350e-6 * 350e-6 / 12.0;

/// Without torque the transverse part of a symmetric top's angular velocity turns about its axis, seen from outside, at
/// `J W / I`: the slopes run on a circle about the fixed direction of the angular momentum (Landau and Lifshitz,
/// Mechanics, section 33, at first order in the slopes). Damping makes the circle a spiral.
#[test]
fn exact_tilted_rotor_is_a_symmetric_top() {
    let hole = tilting(&[(TiltingParameter::HubClearance, 1.0)]);
    for damping in [0.0, 3.6e-3] {
        let params = in_space(&[(Parameter::VerticalDamping, damping)]);
        for (rate, step_s) in [(15.0, 1e-6), (-300.0, 1e-5), (15.0, 1e-4)] {
            let motor = motor(&(params, hole), &TiltingSetup::with_step(step_s));
            let mut state = TiltingState::default();
            state.rotor.height_m = 1.0;
            state.rotor.rate_rad_s = rate;
            state.tilt.slope = Vector2::new(0.01, -0.02);
            state.tilt.rate_rad_s = Vector2::new(3.0, 5.0);
            state.shift.velocity_m_s = Vector2::new(1e-3, -2e-3);
            let steps = (0.05_f64 / step_s).round();
            let mut taken = 0.0;
            while taken < steps {
                assert!(motor.step(&mut state, DriveCommand::OFF).is_empty());
                taken += 1.0;
            }
            let t = 0.05;
            // p(t) = p exp(l t), l = -b + i g, eta = eta_0 + p (exp(l t) - 1) / l; the spin counter-clockwise is -rate.
            let b = damping * (4.35e-3 * 4.35e-3 + 1e-6) / 4.0 / INERTIA;
            let g = -rate * 4.59e-10 / INERTIA;
            let (grown, turned) = ((-b * t).exp(), (g * t).sin_cos());
            let times = |(re, im): (f64, f64), (x, y): (f64, f64)| (re * x - im * y, re * y + im * x);
            let end = (grown * turned.1, grown * turned.0);
            let p = times(end, (3.0, 5.0));
            let square = b * b + g * g;
            let over = times((end.0 - 1.0, end.1), (-b / square, -g / square));
            let swept = times(over, (3.0, 5.0));
            // The rest of one span's slope is b g h^2 / 12 of what it sweeps.
            let within = 1e-11 + square * step_s * step_s;
            let what = format!("{damping} {rate} {step_s}");
            let rate_error = state.tilt.rate_rad_s - Vector2::new(p.0, p.1);
            assert!(rate_error.amax() < 6.0 * within, "{what}: {rate_error}");
            let slope_error = state.tilt.slope - Vector2::new(0.01 + swept.0, -0.02 + swept.1);
            assert!(slope_error.amax() < within, "{what}: {slope_error}");
            assert!((state.shift.displacement_m - Vector2::new(5e-5, -1e-4)).amax() < 1e-15, "{what}");
        }
    }
}

/// A level rotor at rest does not tilt by itself, however it spins.
#[test]
fn exact_level_rotor_stays_level() {
    let motor = motor(&slow_in_b(), &TiltingSetup::with_step(1e-5));
    let mut state = TiltingState::default();
    state.rotor.height_m = 1e-3;
    state.rotor.rate_rad_s = 1e4;
    for _ in 0..500 {
        motor.step(&mut state, DriveCommand::OFF);
    }
    assert!(state.tilt.slope.amax() <= 0.0 && state.shift.displacement_m.amax() <= 0.0);
}
