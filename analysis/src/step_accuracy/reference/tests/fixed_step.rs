//! The reference against the fixed step.

use motor_model::{Angle, DriveCommand, DriveMode, Motor, MotorSetup};

use super::super::state::ReferenceState;
use super::{Events, params, reference};
use crate::step_accuracy::method::start;

fn in_flight() -> ReferenceState {
    ReferenceState { height_m: 2e-6, rate_rad_s: 0.3, phase_turns: 0.1, ..ReferenceState::default() }
}

/// Times of the first two impacts of the fixed step.
fn first_two(step_s: f64, drive: DriveCommand) -> [f64; 2] {
    let motor = Motor::<f64>::try_new(&params(&[]), &MotorSetup::with_step(step_s)).unwrap();
    let mut state = start(&in_flight());
    let mut next = || {
        loop {
            if !motor.step(&mut state, drive).is_empty() {
                #[expect(clippy::cast_precision_loss, reason = "few steps")]
                return state.steps as f64 * step_s;
            }
        }
    };
    [next(), next()]
}

/// The end-of-step rule finds the first impact within one step, and the second with an error of the first order.
#[test]
fn dual_first_impacts_converge_to_the_reference() {
    for mode in [DriveMode::B, DriveMode::C] {
        let drive = DriveCommand::full(mode);
        let mut events = Events::default();
        let mut state = in_flight();
        reference(&params(&[])).run(&mut state, drive, 3e-3, &mut events).unwrap();
        let impacts = events.impacts();
        let [(first_s, _), (second_s, _)] = [impacts[0], impacts[1]];
        for step_s in [1e-7, 5e-8, 1e-8, 2e-9] {
            let [found_first_s, found_second_s] = first_two(step_s, drive);
            let late_s = found_first_s - first_s;
            assert!((-1e-15..=step_s).contains(&late_s), "{mode:?} {step_s}: {late_s}");
            assert!(
                (found_second_s - second_s).abs() < 12.0 * step_s,
                "{mode:?} {step_s} {found_second_s} {second_s}"
            );
        }
    }
}

/// Before any impact both are exact: stator, rotor, phase and angle after 0.5 ms of driven flight.
#[test]
fn dual_free_motion_agrees_to_rounding() {
    let drive = DriveCommand::full(DriveMode::B).with_frequency_offset(137.0).unwrap();
    let mut state = ReferenceState { height_m: 1e-3, ..in_flight() };
    state.modes.velocity_m_s.x = 0.01;
    let motor = Motor::<f64>::try_new(&params(&[]), &MotorSetup::with_step(1e-6)).unwrap();
    let mut model = start(&state);
    for _ in 0..500 {
        motor.step(&mut model, drive);
    }
    reference(&params(&[])).run(&mut state, drive, 5e-4, &mut ()).unwrap();
    assert!((model.modes.displacement_m - state.modes.displacement_m).norm() < 1e-13 * 1e-5);
    assert!((model.modes.velocity_m_s - state.modes.velocity_m_s).norm() < 1e-13);
    assert!((model.rotor.height_m - state.height_m).abs() < 1e-16);
    assert!((model.rotor.velocity_m_s - state.velocity_m_s).abs() < 1e-14);
    assert!((model.rotor.rate_rad_s - state.rate_rad_s).abs() < 1e-14);
    let angle_rad: f64 = model.rotor.angle.angle().radians_since(Angle::ZERO);
    assert!((angle_rad - state.angle_rad).abs() < 1e-9, "2^-32 turn");
    #[expect(clippy::cast_precision_loss, reason = "rounds to 53 bits: 1e-16 of a turn")]
    let phase_turns = model.phase.units() as f64 / 18_446_744_073_709_551_616.0;
    assert!((phase_turns - state.phase_turns).abs() < 1e-12);
}
