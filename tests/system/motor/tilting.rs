//! The tilting motor, in the order of the data: flight, single contacts, the hub, whole motor.

mod exact_contact;
mod exact_flight;
mod exact_hub;

mod dual_height_only;
mod dual_mujoco;
mod dual_second_program;
mod dual_step_convergence;
mod law_energy;
mod law_hard_cases;
mod law_hour_at_rest;
mod law_momentum;
mod law_penetration;
mod law_rest;
mod law_rotation_sense;

use motor_model::{
    DriveCommand, Freedom, ImpactRule, MotorParams, Parameter, TiltingContacts, TiltingMotor,
    TiltingParameter, TiltingParams, TiltingSetup, TiltingState, TiltingVariation,
};

use crate::support::motors::changed;

/// Nominal tilting parameters with some changed.
#[track_caller]
fn tilting(changes: &[(TiltingParameter, f64)]) -> TiltingParams {
    changes.iter().fold(TiltingParams::nominal(), |params, &(parameter, value)| {
        params.with(parameter, value).expect("within its bounds")
    })
}

/// Two sets of parameters: of the motor and of its tilt.
type Sets = (MotorParams, TiltingParams);

/// A set that turns mode B slowly: little friction at the teeth, little damping, a tight hub.
fn slow_in_b() -> Sets {
    use TiltingParameter::{HubClearance, StatorTiltFrequency, ToothRockingExponent};
    (
        changed(&[
            (Parameter::Friction, 0.15),
            (Parameter::VerticalDamping, 0.9e-3),
            (Parameter::ModeShift, 1.25),
        ]),
        tilting(&[(HubClearance, 7e-6), (StatorTiltFrequency, 5000.0), (ToothRockingExponent, 2.0)]),
    )
}

/// A set with a tight hub and slippery teeth, on the stator that finite elements give.
fn set_g() -> Sets {
    use TiltingParameter::{HubClearance, HubFriction, StatorTiltFrequency, ToothRockingExponent};
    (
        changed(&[
            (Parameter::Friction, 0.055),
            (Parameter::VerticalDamping, 2e-3),
            (Parameter::ModeShift, -1.9),
        ]),
        tilting(&[
            (HubClearance, 5.9e-6),
            (HubFriction, 0.58),
            (StatorTiltFrequency, 3050.0),
            (ToothRockingExponent, 1.55),
        ]),
    )
}

/// A tight hub on a stator with two mode shifts, modal masses and exponents of its own and two tilting frequencies,
/// about twice as far from those of the paper and of a rigid ring as finite elements have them.
fn own_stator() -> Sets {
    use TiltingParameter::{
        HubClearance, ModeARockingExponent, ModeCExtraShift, StatorTiltMassFraction,
        StatorTiltRockingExponent, StatorTiltSplit,
    };
    (
        changed(&[
            (Parameter::Friction, 0.15),
            (Parameter::VerticalDamping, 0.9e-3),
            (Parameter::ModeShift, -1.3),
            (Parameter::ModeBExtraShift, 2.6),
            (Parameter::ModeAMassFraction, 0.9),
            (Parameter::ModeBMassFraction, 0.56),
            (Parameter::ModeCMassFraction, 0.68),
        ]),
        tilting(&[
            (HubClearance, 7e-6),
            (ModeARockingExponent, -0.4),
            (ModeCExtraShift, -1.0),
            (StatorTiltMassFraction, 0.54),
            (StatorTiltRockingExponent, 0.8),
            (StatorTiltSplit, 0.1),
        ]),
    )
}

/// Nothing but contacts: no gravity, no damping of the rotor.
fn in_space(changes: &[(Parameter, f64)]) -> MotorParams {
    let mut all =
        vec![(Parameter::Gravity, 0.0), (Parameter::VerticalDamping, 0.0), (Parameter::TangentialDrag, 0.0)];
    all.extend_from_slice(changes);
    changed(&all)
}

/// Contacts at the end of the step, and everything else as usual.
fn at_end(step_s: f64) -> TiltingSetup {
    TiltingSetup { impact_rule: ImpactRule::EndOfStep, ..TiltingSetup::with_step(step_s) }
}

/// Teeth that differ: a rotor over equal teeth never begins to tilt.
const UNEQUAL: TiltingVariation = TiltingVariation {
    amplitudes: [0.004, -0.003, 0.002, -0.005],
    heights_m: [0.0; 4],
    pin_direction_deg: 0.0,
};

#[track_caller]
fn motor((params, tilting): &Sets, setup: &TiltingSetup) -> TiltingMotor<f64> {
    TiltingMotor::try_new(params, tilting, setup).expect("a valid motor")
}

/// One step, with the state that there would be without contact: the same rotor out of reach of the teeth, the same
/// motor without a pin.
fn step_and_flight(
    (params, tilting): &Sets,
    setup: &TiltingSetup,
    start: &TiltingState<f64>,
) -> (TiltingState<f64>, TiltingState<f64>, TiltingContacts<f64>) {
    let mut after = *start;
    let contacts = motor(&(*params, *tilting), setup).step(&mut after, DriveCommand::OFF);
    let free = tilting.with(TiltingParameter::HubClearance, 1.0).expect("a wide hole");
    let mut flown = *start;
    flown.rotor.height_m += 0.1;
    assert!(motor(&(*params, free), setup).step(&mut flown, DriveCommand::OFF).is_empty());
    flown.rotor.height_m -= 0.1;
    (flown, after, contacts)
}

/// Height and spin alone.
fn height_only(setup: TiltingSetup) -> TiltingSetup {
    TiltingSetup { freedom: Freedom::HeightOnly, ..setup }
}
