//! A tilting rotor comes to rest with the drive off, on three of four teeth, and stays there.

use motor_model::{
    ContactPlace, DriveCommand, DriveMode, Freedom, TiltingMotor, TiltingSetup, TiltingState,
    TiltingVariation,
};

use super::{UNEQUAL, motor, slow_in_b, tilting};
use crate::support::motors::{changed, steps_in};

fn run(motor: &TiltingMotor<f64>, state: &mut TiltingState<f64>, command: DriveCommand, time_s: f64) -> u32 {
    (0..steps_in(time_s, motor.step_s()))
        .map(|_| {
            let contacts = motor.step(state, command);
            u32::from(contacts.iter().any(|contact| !contact.sustained))
        })
        .sum()
}

/// With the weight towards tooth 1, teeth 0, 1 and 2 carry. Teeth 0 and 2 are opposite and 5 um apart in height; tooth
/// 1 is 5.5 um below their mean. The stator gives by up to 0.3 um, 1e-4 of the radius.
#[test]
fn exact_rest_on_three_of_four_teeth() {
    let variation = TiltingVariation { heights_m: [5e-6, -3e-6, 0.0, -6e-6], ..TiltingVariation::default() };
    let motor =
        motor(&(changed(&[]), tilting(&[])), &TiltingSetup { variation, ..TiltingSetup::with_step(2e-6) });
    let [first, second, ..] = motor.teeth();
    let radius = 3.063e-3;
    let mut state = TiltingState::<f64>::default();
    state.rotor.height_m = 6e-6;
    state.shift.displacement_m = second.outward * 10e-6;
    run(&motor, &mut state, DriveCommand::OFF, 0.1);
    let (along, across) = (state.tilt.slope.dot(&first.outward), state.tilt.slope.dot(&second.outward));
    assert!((along - 5e-6 / (2.0 * radius)).abs() < 1e-4, "{along}");
    assert!((across + 5.5e-6 / radius).abs() < 1e-4, "{across}");
    for (tooth, carries) in [(0, true), (1, true), (2, true), (3, false)] {
        let place = ContactPlace::Tooth(tooth);
        assert_eq!(state.in_contact.contains(place), carries, "{tooth}");
        let gap = motor.gap_m(&state, place).expect("a tooth");
        assert!(if carries { gap.abs() < 1e-10 } else { gap > 1e-6 }, "{tooth} {gap:e}");
    }
    // What it drifts in 0.1 s, for an hour: less than a micrometre, and not a unit of the angle.
    let (at, angle) = (state.shift.displacement_m, state.rotor.angle.angle());
    assert_eq!(run(&motor, &mut state, DriveCommand::OFF, 0.1), 0, "no impacts at rest");
    let drift = (state.shift.displacement_m - at).amax();
    assert!(drift < 1e-6 / 36_000.0, "{drift:e}");
    assert_eq!(state.rotor.angle.angle(), angle);
}

/// With the drive off a turning rotor is at rest in 0.2 s: energy leaves by every impact, by the film and by friction.
#[test]
fn law_drive_off_brings_it_to_rest() {
    for freedom in [Freedom::Full, Freedom::WithoutShift] {
        for mode in [DriveMode::B, DriveMode::C] {
            for step_s in [1e-6, 5e-6] {
                let setup = TiltingSetup { freedom, variation: UNEQUAL, ..TiltingSetup::with_step(step_s) };
                let motor = motor(&slow_in_b(), &setup);
                let mut state = TiltingState::<f64>::default();
                run(&motor, &mut state, DriveCommand::full(mode), 0.05);
                run(&motor, &mut state, DriveCommand::OFF, 0.2);
                let what = format!("{freedom:?} {mode:?} {step_s} {state:?}");
                assert_eq!(run(&motor, &mut state, DriveCommand::OFF, 0.01), 0, "{what}");
                assert!(state.in_contact.len() >= 3, "{what}");
                // Below what gravity gives in a hundredth of a step.
                assert!(state.rotor.velocity_m_s.abs() < 0.1 * step_s, "{what}");
                assert!((state.rotor.rate_rad_s * 3e-3).abs() < 0.1 * step_s, "{what}");
                assert!((state.tilt.rate_rad_s * 3e-3).amax() < 0.1 * step_s, "{what}");
            }
        }
    }
}
