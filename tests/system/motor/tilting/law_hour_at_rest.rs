//! An hour at rest, told from a tenth of a second: the rotor neither turns nor creeps in height, tilt or shift.
//!
//! An hour has 7e8 steps of 5 us, minutes of work for each case. With the drive off a motion at rest repeats but for
//! its last bits, so that what it drifts in a tenth of a second, 36,000 times, bounds the hour.

use motor_model::{
    DriveCommand, Freedom, Real, TiltingMotor, TiltingParameter, TiltingSetup, TiltingState, TiltingVariation,
};
use nalgebra::Vector2;

use super::tilting;
use crate::support::motors::{changed, steps_in};

/// Height, the rise of the plane at the teeth, and shift.
fn place_m<T: Real>(state: &TiltingState<T>) -> [f64; 5] {
    let (slope, shift) = (state.tilt.slope, state.shift.displacement_m);
    [
        state.rotor.height_m.to_f64(),
        3e-3 * slope.x.to_f64(),
        3e-3 * slope.y.to_f64(),
        shift.x.to_f64(),
        shift.y.to_f64(),
    ]
}

/// Less than a micrometre an hour, and less than a unit of the angle, 8e-8 degrees, in a tenth of a second.
fn check<T: Real>(own: &[(TiltingParameter, f64)], heights_m: [f64; 4], freedom: Freedom, step_s: f64) {
    let variation = TiltingVariation { heights_m, ..TiltingVariation::default() };
    let setup = TiltingSetup { variation, freedom, ..TiltingSetup::with_step(step_s) };
    let motor = TiltingMotor::<T>::try_new(&changed(&[]), &tilting(own), &setup).expect("valid");
    let mut state = TiltingState::<T>::default();
    let [_, second, ..] = motor.teeth();
    // Off the middle, so that three teeth carry the weight.
    let aside = second.outward.map(|x| x * T::from_f64(10e-6));
    state.shift.displacement_m = if freedom == Freedom::Full { aside } else { Vector2::zeros() };
    state.rotor.height_m = T::from_f64(10e-6);
    state.rotor.rate_rad_s = T::from_f64(1.0);
    let run = |state: &mut TiltingState<T>, time_s: f64| {
        for _ in 0..steps_in(time_s, step_s) {
            motor.step(state, DriveCommand::OFF);
        }
    };
    run(&mut state, 0.25);
    let (place, angle) = (place_m(&state), state.rotor.angle.angle());
    run(&mut state, 0.1);
    let what = format!("{own:?} {heights_m:?} {freedom:?} {step_s:e} {} bytes", size_of::<T>());
    for (before, after) in place.into_iter().zip(place_m(&state)) {
        assert!((after - before).abs() * 36_000.0 < 1e-6, "{what}: {before:e} {after:e}");
    }
    let turned = state.rotor.angle.angle().minus(angle).units();
    assert!(turned.abs() <= 1, "{what}: {turned} units");
    assert!(state.in_contact.len() >= 3, "{what} {state:?}");
}

#[test]
fn law_an_hour_at_rest_moves_nothing() {
    let level = [0.0; 4];
    let uneven = [5e-6, -3e-6, 0.0, -6e-6];
    for step_s in [1e-6, 5e-6] {
        for (own, heights_m, freedom) in [
            (vec![], level, Freedom::Full),
            (vec![], level, Freedom::WithoutShift),
            (vec![], uneven, Freedom::Full),
            (vec![(TiltingParameter::PinSlope, 5e-3)], level, Freedom::Full),
        ] {
            check::<f64>(&own, heights_m, freedom, step_s);
            // A fifth of the step is the plant's, whose precision is the other.
            if step_s > 1e-6 {
                check::<f32>(&own, heights_m, freedom, step_s);
            }
        }
    }
}
