//! A rotor dropped on a stator that cannot give way, and the order of convergence of impacts noticed at the end of a
//! step.
//!
//! The rebound from a rigid floor reaches `e^2` of the height. The end-of-step rule notices the impact late by `t` in
//! `0..h`, when the rotor falls faster by `g t`, and puts it back on the floor: the rebound is too high by `((v + g
//! t)^2 - v^2) e^2 / 2g = e^2 v t`, which averages to `e^2 v h / 2` over all phases of the drop. First order, with a
//! constant known beforehand.
#![expect(clippy::disallowed_methods, reason = "an independent yardstick")]

use motor_model::{DriveCommand, DriveMode, MotorParams, Parameter};

use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::live_teeth::{GRAVITY_M_S2, LiveTeeth, on_rigid_floor};
use crate::support::motors::{Bench, at_end_of_step, changed};

const STEPS_S: [f64; 4] = [8e-6, 4e-6, 2e-6, 1e-6];
/// Teeth in mode C turn by 0.1 rad in the coarsest of these: fine enough for the leading term to lead.
const STEPS_ON_LIVE_TEETH_S: [f64; 4] = [2e-6, 1e-6, 0.5e-6, 0.25e-6];

/// Highest point after the first impact.
fn rebound_m(params: &MotorParams, drop_m: f64, step_s: f64) -> f64 {
    let mut bench = Bench::<f64>::new(params, &at_end_of_step(step_s));
    bench.state.rotor.height_m = drop_m;
    bench.until_impact(DriveCommand::OFF, 1_000_000);
    // The apex by its own closed form, so that sampling it adds nothing.
    let up = bench.state.rotor.velocity_m_s;
    bench.state.rotor.height_m + up * up / (2.0 * GRAVITY_M_S2)
}

/// Drops whose contact falls at 64 evenly spread phases of the coarsest step, and so of the finer ones.
fn drops_m(fall_s: f64) -> impl Iterator<Item = f64> {
    (0..64).map(move |k| {
        let t = fall_s + STEPS_S[0] * (f64::from(k) + 0.37) / 64.0;
        0.5 * GRAVITY_M_S2 * t * t
    })
}

/// Slope of the least-squares line of `ln error` against `ln h`.
fn order(steps_s: &[f64], errors: &[f64]) -> f64 {
    let x: Vec<f64> = steps_s.iter().map(|h| h.ln()).collect();
    let y: Vec<f64> = errors.iter().map(|error| error.ln()).collect();
    let count = f64::from(u32::try_from(x.len()).expect("few"));
    let (x_mean, y_mean) = (x.iter().sum::<f64>() / count, y.iter().sum::<f64>() / count);
    let covariance: f64 = x.iter().zip(&y).map(|(x, y)| (x - x_mean) * (y - y_mean)).sum();
    covariance / x.iter().map(|x| (x - x_mean) * (x - x_mean)).sum::<f64>()
}

#[test]
fn law_rebound_height_is_e_squared() {
    for restitution in [0.0, 0.3, 0.6, 0.9, 1.0] {
        let params = on_rigid_floor(restitution);
        for drop_m in [20e-6, 1e-3] {
            let rebound = rebound_m(&params, drop_m, 0.1e-6);
            let expected = restitution * restitution * drop_m;
            // At most a whole step late: e^2 v h.
            let late = restitution * restitution * (2.0 * GRAVITY_M_S2 * drop_m).sqrt() * 0.1e-6;
            assert_close(
                rebound,
                expected,
                Within { rtol: 1e-7, atol: 1e-15 + 1.01 * late },
                format_args!("e = {restitution}"),
            );
        }
    }
}

#[test]
fn law_rebound_error_is_first_order_with_the_predicted_constant() {
    let params = on_rigid_floor(0.6);
    let fall_s = 2e-3;
    let errors = STEPS_S.map(|step_s| {
        let excess: f64 =
            drops_m(fall_s).map(|drop_m| rebound_m(&params, drop_m, step_s) - 0.36 * drop_m).sum::<f64>()
                / 64.0;
        let predicted = 0.36 * GRAVITY_M_S2 * fall_s * step_s / 2.0;
        assert_close(excess, predicted, Within::relative(0.06), format_args!("mean excess at {step_s:e} s"));
        excess
    });
    assert_between(order(&STEPS_S, &errors), 0.95, 1.05, "order of the rebound height");
}

/// A rotor thrown down at 1.5 m/s on teeth in full mode C motion, 0.17 m/s at most: one crossing, no grazing. Instant
/// and velocity after the first impact against the closed form, over 64 phases of the drive: first order in the step.
#[test]
fn law_first_impact_on_live_teeth_is_first_order_in_time_and_velocity() {
    let params = changed(&[(Parameter::VerticalDamping, 0.0), (Parameter::Gravity, 0.0)]);
    let mode = DriveMode::C;
    let restitution = params.get(Parameter::Restitution);
    let mass_ratio = params.get(Parameter::RotorMass) / params.get(Parameter::StatorMass);
    let mut time_errors = [0.0; 4];
    let mut velocity_errors = [0.0; 4];
    for k in 0..64 {
        let scene = LiveTeeth::thrown_at(&params, mode, k, 64);
        let (contact, down) = (scene.first_contact(), scene.down_m_s());
        let rise = (1.0 + restitution) * (contact.tooth_velocity_m_s - down) / (1.0 + 3.0 * mass_ratio);
        for (index, step_s) in STEPS_ON_LIVE_TEETH_S.into_iter().enumerate() {
            let mut bench = Bench::<f64>::new(&params, &at_end_of_step(step_s));
            scene.set(&mut bench.state);
            let (steps, _) = bench.until_impact(DriveCommand::full(mode), 1000);
            let lateness = f64::from(steps) * step_s - contact.time_s;
            assert_between(lateness, -1e-12, step_s * (1.0 + 1e-9), "lateness of the impact");
            time_errors[index] += lateness / 64.0;
            velocity_errors[index] += (bench.state.rotor.velocity_m_s - (down + rise)).abs() / 64.0;
        }
    }
    for (error, step_s) in time_errors.into_iter().zip(STEPS_ON_LIVE_TEETH_S) {
        assert_close(
            error,
            0.5 * step_s,
            Within::relative(0.15),
            format_args!("mean lateness at {step_s:e} s"),
        );
    }
    assert_between(order(&STEPS_ON_LIVE_TEETH_S, &time_errors), 0.9, 1.1, "order of the impact's instant");
    assert_between(
        order(&STEPS_ON_LIVE_TEETH_S, &velocity_errors),
        0.85,
        1.15,
        "order of the velocity after it",
    );
}
