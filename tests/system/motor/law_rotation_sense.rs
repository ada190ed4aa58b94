//! Which way each mode turns the rotor.
//!
//! A tooth strikes while it rises. When mode B drives, `u' = sin(2 th) g_B'` and `s' = L cos(2 th) g_B'`, so a rising
//! tooth moves by `s' = L cot(2 th) u'`: clockwise where `sin 2 th` and `cos 2 th` agree in sign. When mode C drives,
//! `u' = cos(2 th) g_C'` and `s' = -L sin(2 th) g_C' = -L tan(2 th) u'`: the opposite sense for the same angle. The
//! sense of both modes therefore turns with the sign of `cos 2 th` and with that of `sin 2 th`, and is back when both
//! have turned: B is driven through `sin` and pushes through `cos`, C the other way about. The nominal angle is 30
//! degrees, both positive: B clockwise, C counter-clockwise.

use motor_model::{DriveCommand, DriveMode, MotorParams, Parameter};

use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::motors::{Bench, at_end_of_step, changed};

/// The motor with its effective tooth angle at `angle_deg`.
fn with_angle(angle_deg: f64) -> MotorParams {
    changed(&[(Parameter::ModeShift, 90.0 - 62.635 - angle_deg)])
}

/// Angle turned in the last 0.2 of 0.4 s.
fn turned_rad(params: &MotorParams, mode: DriveMode, step_s: f64) -> f64 {
    let mut bench = Bench::<f64>::new(params, &at_end_of_step(step_s));
    bench.run(DriveCommand::full(mode), 0.2);
    let start = bench.angle_rad();
    bench.run(DriveCommand::full(mode), 0.2);
    bench.angle_rad() - start
}

#[test]
fn law_sense_follows_the_signs_of_sine_and_cosine() {
    for (angle_deg, sense) in [
        (30.0, 1.0),   // sin > 0, cos > 0
        (60.0, -1.0),  // sin > 0, cos < 0
        (-60.0, 1.0),  // sin < 0, cos < 0
        (117.0, 1.0),  // sin < 0, cos < 0
        (-30.0, -1.0), // sin < 0, cos > 0
        (28.0, 1.0),
        (62.0, -1.0),
    ] {
        for step_s in [1e-6, 5e-6] {
            let params = with_angle(angle_deg);
            let b = sense * turned_rad(&params, DriveMode::B, step_s);
            let c = -sense * turned_rad(&params, DriveMode::C, step_s);
            assert_between(b, 0.5, 4.0, format_args!("mode B at {angle_deg} degrees, {step_s:e} s"));
            assert_between(c, 0.05, 1.0, format_args!("mode C at {angle_deg} degrees, {step_s:e} s"));
        }
    }
}

/// Turning one sign is a mirror: same heights and impacts, opposite rotation. Compared until chaos has grown from
/// rounding.
#[test]
fn law_mirrored_teeth_turn_the_rotor_the_other_way() {
    for mode in [DriveMode::B, DriveMode::C] {
        let mut motor = Bench::<f64>::new(&with_angle(30.0), &at_end_of_step(1e-6));
        let mut mirror = Bench::<f64>::new(&with_angle(60.0), &at_end_of_step(1e-6));
        let mut count = 0;
        while count < 5 {
            let (_, impacts) = motor.step(DriveCommand::full(mode));
            let (_, mirrored) = mirror.step(DriveCommand::full(mode));
            assert_eq!(impacts.len(), mirrored.len());
            // The first impacts are those of a rotor still resting on teeth that begin to stir.
            let hard = impacts.iter().filter(|impact| impact.approach_m_s > 0.02).count();
            count += hard;
            assert!(motor.state.steps < 1_000_000, "no impacts");
        }
        let (rotor, other) = (motor.state.rotor, mirror.state.rotor);
        let within = Within { rtol: 1e-6, atol: 1e-9 };
        assert_close(other.height_m, rotor.height_m, within, format_args!("{mode:?}, height"));
        assert_close(other.velocity_m_s, rotor.velocity_m_s, within, format_args!("{mode:?}, velocity"));
        assert_close(other.rate_rad_s, -rotor.rate_rad_s, within, format_args!("{mode:?}, rate"));
        assert!(rotor.rate_rad_s.abs() > 1e-3);
    }
}

/// A symmetric tooth does not turn the rotor: at 45 degrees mode B moves the teeth straight up, and mode C leaves them
/// still.
#[test]
fn law_teeth_at_an_antinode_of_b_do_not_turn_the_rotor() {
    let params = with_angle(45.0);
    for mode in [DriveMode::B, DriveMode::C] {
        let turned = turned_rad(&params, mode, 1e-6);
        assert_close(turned, 0.0, Within::absolute(1e-3), format_args!("{mode:?}"));
    }
}
