//! The rotor as a rigid body beside MuJoCo: `tests/mujoco/rigid_body.py` makes the numbers of
//! `tests/mujoco/rigid_body.json`.
//!
//! Its contacts are springs. A stiff spring without damping is an impact with restitution 1; other restitutions,
//! friction in an impact and several contacts at once have no counterpart there.

use motor_model::{DriveCommand, Parameter, TiltingParameter, TiltingSetup, TiltingState, TiltingVariation};
use nalgebra::Vector2;
use serde_json::Value;

use super::{in_space, motor, tilting};
use crate::support::checkout;
use crate::support::closeness::{Within, assert_close};
use crate::support::motors::steps_in;

fn table() -> Value {
    let text = checkout::text(&checkout::root().join("tests/mujoco/rigid_body.json"));
    serde_json::from_str(&text).expect("a table")
}

#[track_caller]
fn number(of: &Value) -> f64 {
    of.as_f64().expect("a number")
}

#[track_caller]
fn pair(of: &Value) -> Vector2<f64> {
    Vector2::new(number(&of[0]), number(&of[1]))
}

/// A tilted spinning rotor without torque, falling. The model is of first order in the slopes `s`: the angle by which
/// their circle is turned is off by `s^2` of itself.
#[test]
fn dual_free_flight_is_that_of_mujoco() {
    let hole = tilting(&[(TiltingParameter::HubClearance, 1.0)]);
    let motor = motor(&(in_space(&[(Parameter::Gravity, 9.81)]), hole), &TiltingSetup::with_step(1e-5));
    let table = table();
    let flights = table["flights"].as_array().expect("flights");
    assert_eq!(flights.len(), 3);
    for flight in flights {
        let (rate, time_s) = (number(&flight["clockwise_rad_s"]), number(&flight["time_s"]));
        let (slope, slope_rate) = (pair(&flight["slope"]), pair(&flight["slope_rate_rad_s"]));
        let mut state = TiltingState::<f64>::default();
        state.rotor.height_m = 1.0;
        state.rotor.velocity_m_s = 0.1;
        state.rotor.rate_rad_s = rate;
        (state.tilt.slope, state.tilt.rate_rad_s) = (slope, slope_rate);
        state.shift.velocity_m_s = Vector2::new(1e-3, -2e-3);
        for _ in 0..steps_in(time_s, 1e-5) {
            assert!(motor.step(&mut state, DriveCommand::OFF).is_empty());
        }
        let turn_per_s = 2.0 * rate.abs();
        let swept = slope_rate.norm() * time_s;
        let steep = slope.norm() + swept.min(2.0 * slope_rate.norm() / turn_per_s);
        let second = steep * steep;
        let end = &flight["end_slope_rate_rad_s"];
        let rate_error = (state.tilt.rate_rad_s - pair(end)).norm();
        assert!(rate_error < second * (1.0 + turn_per_s * time_s) * slope_rate.norm(), "{flight} {state:?}");
        let slope_error = (state.tilt.slope - pair(&flight["end_slope"])).norm();
        assert!(slope_error < second * (slope.norm() + swept), "{flight} {slope_error:e}");
        let (place, velocity) = (&flight["end_place_m"], &flight["end_velocity_m_s"]);
        let fallen = state.rotor.height_m - 1.0;
        assert_close(fallen, number(&place[2]), Within::absolute(1e-12), "height");
        assert_close(state.rotor.velocity_m_s, number(&velocity[2]), Within::absolute(1e-10), "fall");
        assert!((state.shift.displacement_m - pair(place)).norm() < 1e-12, "{flight}");
    }
}

/// A level rotor falls on one tooth that does not give and bounces without loss. MuJoCo's spring acts for 5000 steps;
/// where in a step it begins and ends is open, twice 2e-4 of the impulse.
#[test]
fn dual_one_impact_is_that_of_mujoco() {
    let params =
        in_space(&[(Parameter::StatorMass, 1.0), (Parameter::Restitution, 1.0), (Parameter::Friction, 0.0)]);
    let hole = tilting(&[(TiltingParameter::HubClearance, 1.0)]);
    let variation = TiltingVariation { heights_m: [0.0, -1e-3, -1e-3, -1e-3], ..TiltingVariation::default() };
    let motor = motor(&(params, hole), &TiltingSetup { variation, ..TiltingSetup::with_step(1e-6) });
    let table = table();
    let impacts = table["impacts"].as_array().expect("impacts");
    assert_eq!(impacts.len(), 2);
    for impact in impacts {
        let fall = number(&impact["fall_m_s"]);
        let mut state = TiltingState::<f64>::default();
        state.rotor.height_m = 1e-6;
        state.rotor.velocity_m_s = -fall;
        let struck = (0..100).any(|_| !motor.step(&mut state, DriveCommand::OFF).is_empty());
        assert!(struck, "{state:?}");
        let rise = number(&impact["rise_m_s"]);
        assert_close(state.rotor.velocity_m_s, rise, Within::absolute(4e-4 * fall), "rise");
        let tilt = number(&impact["tilt_rad_s"]);
        assert_close(state.tilt.rate_rad_s.norm(), tilt, Within::relative(4e-4), "tilt");
    }
}
