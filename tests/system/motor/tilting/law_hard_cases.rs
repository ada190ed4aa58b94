//! Hard cases: extreme parameters and commands. Everything stays finite and bounded.

use motor_model::{
    CONTACTS_PER_STEP_MAX, DriveCommand, DriveMode, Freedom, ImpactRule, Parameter, Real, TiltingMotor,
    TiltingParameter, TiltingSetup, TiltingState, TiltingVariation,
};

use super::{Sets, UNEQUAL, slow_in_b};
use crate::support::motors::steps_in;

fn is_finite<T: Real>(state: &TiltingState<T>) -> bool {
    (state.modes.displacement_m.iter().chain(&state.modes.velocity_m_s))
        .chain(state.stator_tilt.displacement_m.iter().chain(&state.stator_tilt.velocity_m_s))
        .chain(state.tilt.slope.iter().chain(&state.tilt.rate_rad_s))
        .chain(state.shift.displacement_m.iter().chain(&state.shift.velocity_m_s))
        .chain([&state.rotor.height_m, &state.rotor.velocity_m_s, &state.rotor.rate_rad_s])
        .all(|value| value.to_f64().is_finite())
}

/// B, off, C at half drive, off, and a drive that changes every step; returns the last state.
fn run<T: Real>((params, tilting): &Sets, setup: &TiltingSetup) -> TiltingState<T> {
    let motor = TiltingMotor::<T>::try_new(params, tilting, setup).expect("valid");
    let mut state = TiltingState::default();
    let each = steps_in(0.02, setup.step_s);
    let commands = [
        DriveCommand::full(DriveMode::B),
        DriveCommand::OFF,
        DriveCommand::saturating(DriveMode::C, 0.5),
        DriveCommand::OFF,
    ];
    for step in 0..5 * each {
        let part = usize::try_from(if step < 4 * each { step / each } else { step % 4 }).expect("four");
        let contacts = motor.step(&mut state, commands[part]);
        assert!(contacts.len() <= CONTACTS_PER_STEP_MAX);
        assert!(contacts.iter().all(|contact| contact.normal_impulse_n_s > T::zero()));
        assert!(is_finite(&state), "{setup:?} {params:?} {tilting:?} {state:?}");
    }
    state
}

/// One change of set F and its like; the rotor stays near.
#[track_caller]
fn check(own: &[(TiltingParameter, f64)], shared: &[(Parameter, f64)], bounded_by_pin: bool) {
    let (mut params, mut tilting) = slow_in_b();
    for &(parameter, value) in own {
        tilting = tilting.with(parameter, value).expect("within bounds");
    }
    for &(parameter, value) in shared {
        params = params.with(parameter, value).expect("within bounds");
    }
    for impact_rule in [ImpactRule::Located, ImpactRule::EndOfStep] {
        for freedom in [Freedom::Full, Freedom::WithoutShift] {
            for step_s in [1e-6, 5e-6] {
                let setup = TiltingSetup {
                    impact_rule,
                    freedom,
                    variation: UNEQUAL,
                    ..TiltingSetup::with_step(step_s)
                };
                let single = run::<f32>(&(params, tilting), &setup);
                let double = run::<f64>(&(params, tilting), &setup);
                let what = format!("{own:?} {shared:?} {setup:?} {double:?}");
                for (height_m, slope) in [
                    (single.rotor.height_m.to_f64(), f64::from(single.tilt.slope.amax())),
                    (double.rotor.height_m, double.tilt.slope.amax()),
                ] {
                    assert!(height_m > -1e-3 && height_m < 1e-2, "{what}");
                    assert!(!bounded_by_pin || slope < 0.1, "{what}");
                }
            }
        }
    }
}

#[test]
fn law_clearance_from_none_to_all() {
    check(&[(TiltingParameter::HubClearance, 0.0)], &[], true);
    check(&[(TiltingParameter::HubClearance, 1e-7)], &[], true);
    check(&[(TiltingParameter::HubClearance, 1.0)], &[], false);
}

#[test]
fn law_friction_and_restitution_from_none_to_all() {
    for (friction, restitution) in [(0.0, 0.0), (0.0, 1.0), (1e6, 0.0), (1e6, 1.0)] {
        check(
            &[(TiltingParameter::HubFriction, friction), (TiltingParameter::HubRestitution, restitution)],
            &[],
            true,
        );
    }
    for (friction, restitution) in [(0.0, 0.0), (1e6, 0.0), (1e6, 1.0)] {
        check(&[], &[(Parameter::Friction, friction), (Parameter::Restitution, restitution)], false);
    }
}

#[test]
fn law_leaning_pin_and_ceiling() {
    check(&[(TiltingParameter::PinSlope, 5e-3)], &[], true);
    check(&[(TiltingParameter::CeilingHeight, 20e-6), (TiltingParameter::RimDepth, 100e-6)], &[], true);
}

/// With the drive off for 0.2 s the rotor lies on two teeth at least, and on teeth 0 and 2, 5 um apart, as a plane
/// does: the stator gives by up to 0.3 um, 1e-4 of the radius.
#[test]
fn law_teeth_of_unequal_height() {
    let (params, tilting) = slow_in_b();
    let variation = TiltingVariation { heights_m: [5e-6, -3e-6, 0.0, -6e-6], ..TiltingVariation::default() };
    for freedom in [Freedom::Full, Freedom::WithoutShift] {
        let setup = TiltingSetup { variation, freedom, ..TiltingSetup::with_step(1e-6) };
        let motor = TiltingMotor::<f64>::try_new(&params, &tilting, &setup).expect("valid");
        let mut state = run::<f64>(&(params, tilting), &setup);
        run::<f32>(&(params, tilting), &setup);
        for _ in 0..steps_in(0.2, setup.step_s) {
            motor.step(&mut state, DriveCommand::OFF);
        }
        let [first, ..] = motor.teeth();
        let along = state.tilt.slope.dot(&first.outward);
        assert!((along - 5e-6 / (2.0 * 3.063e-3)).abs() < 1e-4, "{freedom:?} {along}");
        assert!(state.in_contact.len() >= 2, "{freedom:?} {state:?}");
    }
}

/// 1e7 steps of drawn motors under drawn commands, a new one every 20 steps, on two threads.
#[test]
fn law_any_drawn_motor_under_any_commands() {
    std::thread::scope(|scope| {
        for first in [0, 1] {
            scope.spawn(move || {
                for seed in (first..DRAWN).step_by(2) {
                    if seed % 4 < 2 { check_drawn::<f64>(seed) } else { check_drawn::<f32>(seed) }
                }
            });
        }
    });
}

/// Motors drawn, and steps of each: 1e7 in all.
const DRAWN: u64 = 250;
const DRAWN_STEPS: u32 = 40_000;

fn check_drawn<T: Real>(seed: u64) {
    use motor_model::{MotorParams, TiltingParams};
    use rand_core::SeedableRng;
    use rand_distr::{Distribution, StandardUniform};
    let unit = |rng: &mut rand_pcg::Pcg64| -> f64 { StandardUniform.sample(rng) };
    let mut rng = rand_pcg::Pcg64::seed_from_u64(seed);
    let mut tilting = TiltingParams::nominal()
        .with(TiltingParameter::HubClearance, 1e-6 + 39e-6 * unit(&mut rng))
        .and_then(|set| set.with(TiltingParameter::ToothHeightScatter, 2e-6))
        .expect("within bounds");
    tilting = tilting.draw(&mut rng);
    let params = MotorParams::nominal().draw(&mut rng);
    let variation = TiltingVariation::draw(&params, &tilting, &mut rng);
    let freedom = if seed.is_multiple_of(3) { Freedom::WithoutShift } else { Freedom::Full };
    let step_s = [1e-6, 5e-6, 20e-6][usize::try_from(seed % 5 / 2).expect("below 3")];
    let setup = TiltingSetup { variation, freedom, ..TiltingSetup::with_step(step_s) };
    let motor = TiltingMotor::<T>::try_new(&params, &tilting, &setup).expect("valid");
    let mut state = TiltingState::default();
    let mut command = DriveCommand::OFF;
    for step in 0..DRAWN_STEPS {
        if step.is_multiple_of(20) {
            let mode = if unit(&mut rng) < 0.5 { DriveMode::B } else { DriveMode::C };
            #[expect(clippy::cast_possible_truncation, reason = "any amplitude")]
            let amplitude = (1.2 * unit(&mut rng) - 0.2) as f32;
            command = DriveCommand::saturating(mode, amplitude);
        }
        let contacts = motor.step(&mut state, command);
        assert!(contacts.iter().all(|contact| contact.normal_impulse_n_s > T::zero()));
        assert!(is_finite(&state), "{seed} {step} {state:?}");
        let (height_m, slope) = (state.rotor.height_m.to_f64(), state.tilt.slope.map(Real::to_f64));
        assert!(height_m.abs() < 5e-3 && slope.amax() < 0.3, "{seed} {step} {state:?}");
    }
}
