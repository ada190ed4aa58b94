//! Hard cases under both impact rules: extreme parameters and commands. Nothing becomes NaN, the books close, the rotor stays near.

use motor_model::{
    DriveCommand, DriveMode, IMPACTS_PER_STEP_MAX, ImpactRule, Motor, MotorParams, MotorSetup, MotorState,
    Parameter, Real,
};

use crate::closeness::{Within, assert_between, assert_close};
use crate::law_energy::Accounted;
use crate::scene::{changed, epsilon};

const RULES: [ImpactRule; 2] = [ImpactRule::EndOfStep, ImpactRule::Located];

fn setups() -> impl Iterator<Item = MotorSetup> {
    RULES.into_iter().flat_map(|impact_rule| {
        [1e-6, 10e-6, 20e-6].map(|step_s| MotorSetup { impact_rule, ..MotorSetup::with_step(step_s) })
    })
}

fn rotor_is_finite<T: Real>(state: &MotorState<T>) -> bool {
    let rotor = &state.rotor;
    [rotor.height_m, rotor.velocity_m_s, rotor.rate_rad_s].iter().all(|value| value.to_f64().is_finite())
        && state.modes.displacement_m.iter().chain(&state.modes.velocity_m_s).all(|x| x.to_f64().is_finite())
}

/// Runs `commands`, step by step, from a drop of 5 um with some spin.
fn check<T: Real>(
    params: &MotorParams,
    setup: &MotorSetup,
    commands: impl Iterator<Item = DriveCommand>,
    what: &str,
) {
    let mut start = MotorState::<T>::default();
    start.rotor.height_m = T::from_f64(5e-6);
    start.rotor.rate_rad_s = T::from_f64(2.0);
    let mut accounted = Accounted::from(params, setup, start);
    let mut steps = 0;
    for command in commands {
        let impacts = accounted.run(command, setup.step_s);
        assert!(impacts as usize <= IMPACTS_PER_STEP_MAX);
        assert!(rotor_is_finite(&accounted.state), "{what}, {setup:?}: {:?}", accounted.state);
        steps += 1;
    }
    // In f32 at most the rounding of each step, all one way.
    let rounding = if size_of::<T>() == 4 { f64::from(steps) * epsilon::<T>() } else { 1e-9 };
    let what = format!("{what}, {setup:?}, {} bytes, {:?}", size_of::<T>(), accounted.flows());
    assert_close(accounted.imbalance(), 0.0, Within::absolute(rounding), &what);
    assert_between(accounted.state.rotor.height_m.to_f64(), -1e-3, 1.0, &what);
}

/// B, off, C at half drive, off; `parts` times over `time_s`.
fn schedule(step_s: f64, time_s: f64) -> impl Iterator<Item = DriveCommand> {
    let commands = [
        DriveCommand::full(DriveMode::B),
        DriveCommand::OFF,
        DriveCommand::saturating(DriveMode::C, 0.5),
        DriveCommand::OFF,
    ];
    let each = crate::scene::steps_in(time_s / 4.0, step_s);
    commands.into_iter().flat_map(move |command| (0..each).map(move |_| command))
}

fn check_motor(changes: &[(Parameter, f64)]) {
    let params = changed(changes);
    for setup in setups() {
        let what = format!("{changes:?}");
        check::<f64>(&params, &setup, schedule(setup.step_s, 0.04), &what);
        check::<f32>(&params, &setup, schedule(setup.step_s, 0.04), &what);
    }
}

#[test]
fn law_rotor_from_a_hundredth_to_a_thousand_stators() {
    for ratio in [0.01, 0.1, 1.0, 10.0, 100.0, 1000.0] {
        // Its inertia goes with its mass.
        let mass = ratio * 10.7e-6;
        check_motor(&[(Parameter::RotorMass, mass), (Parameter::RotorInertia, 4.59e-10 * mass / 46e-6)]);
    }
}

#[test]
fn law_any_squeeze_film_and_drag() {
    for damping in [0.0, 1e-6, 3.6e-3, 1.0, 1e3] {
        check_motor(&[(Parameter::VerticalDamping, damping)]);
    }
    check_motor(&[(Parameter::TangentialDrag, 0.0)]);
    check_motor(&[(Parameter::TangentialDrag, 1e3)]);
}

#[test]
fn law_any_modal_damping_below_critical() {
    for zeta in [0.0, 1e-6, 0.5, 0.99] {
        check_motor(&[
            (Parameter::ModeBDampingRatio, zeta),
            (Parameter::ModeCDampingRatio, zeta),
            (Parameter::ModeADamping, zeta * 2.0 * 10.7e-6 * std::f64::consts::TAU * 2150.0 * 0.999),
        ]);
    }
}

/// At critical damping and beyond there is no oscillation, and the model says so.
#[test]
fn exact_critical_damping_is_refused() {
    for zeta in [0.991, 1.0, 1.5] {
        assert!(MotorParams::nominal().with(Parameter::ModeBDampingRatio, zeta).is_err());
        assert!(MotorParams::nominal().with(Parameter::ModeCDampingRatio, zeta).is_err());
        let critical = 2.0 * 10.7e-6 * std::f64::consts::TAU * 2150.0;
        let params = changed(&[(Parameter::ModeADamping, zeta * critical)]);
        for setup in setups() {
            assert!(Motor::<f64>::try_new(&params, &setup).is_err(), "zeta_A = {zeta}");
        }
    }
}

#[test]
fn law_any_contact() {
    for restitution in [0.0, 0.5, 0.999_999, 1.0] {
        for friction in [0.0, 0.4, 1e6] {
            check_motor(&[(Parameter::Restitution, restitution), (Parameter::Friction, friction)]);
        }
    }
    for gravity in [0.0, -GRAVITY, 1000.0] {
        check_motor(&[(Parameter::Gravity, gravity)]);
    }
}

const GRAVITY: f64 = 9.81;

/// Another command at every step: mode, amplitude, frequency, off.
#[test]
fn law_drive_switched_every_step() {
    let commands = [
        DriveCommand::full(DriveMode::B),
        DriveCommand::full(DriveMode::C),
        DriveCommand::OFF,
        DriveCommand::saturating(DriveMode::B, 0.3),
        DriveCommand::saturating(DriveMode::C, 1e-30),
    ];
    for setup in setups() {
        let switched = || commands.into_iter().cycle().take(4000);
        check::<f64>(&changed(&[]), &setup, switched(), "switched");
        check::<f32>(&changed(&[]), &setup, switched(), "switched");
    }
}

/// Driven 20 % off resonance either way, and beating 40 Hz beside it.
#[test]
fn law_detuned_drive() {
    for (mode, hz) in [(DriveMode::B, 6300.0), (DriveMode::C, 7460.0)] {
        for offset_hz in [-0.2 * hz, 0.2 * hz, 40.0] {
            let command = DriveCommand::full(mode).with_frequency_offset(offset_hz).expect("within 2 kHz");
            for setup in setups() {
                let steps = crate::scene::steps_in(0.06, setup.step_s) as usize;
                check::<f64>(&changed(&[]), &setup, std::iter::repeat_n(command, steps), "detuned");
                check::<f32>(&changed(&[]), &setup, std::iter::repeat_n(command, steps), "detuned");
            }
        }
    }
}

/// Steps that divide the drive's period exactly, and steps near half of it.
#[test]
fn law_steps_in_tune_with_the_drive() {
    for (mode, hz) in [(DriveMode::B, 6300.0), (DriveMode::C, 7460.0)] {
        for per_period in [2.0, 2.001, 1.999, 4.0, 16.0, 1.0] {
            for impact_rule in RULES {
                let setup = MotorSetup { impact_rule, ..MotorSetup::with_step(1.0 / (hz * per_period)) };
                let motor = Motor::<f64>::try_new(&changed(&[]), &setup).expect("a valid motor");
                let mut state = MotorState::default();
                for _ in 0..4000 {
                    motor.step(&mut state, DriveCommand::full(mode));
                    assert!(rotor_is_finite(&state), "{mode:?}, {per_period} steps a period");
                }
                assert_between(state.rotor.height_m, -1e-3, 0.1, format_args!("{mode:?}, {per_period}"));
                assert_between(state.rotor.rate_rad_s, -100.0, 100.0, format_args!("{mode:?}, {per_period}"));
            }
        }
    }
}

/// Denormal heights, speeds and amplitudes.
#[test]
fn law_denormals() {
    for setup in setups() {
        let motor = Motor::<f32>::try_new(&changed(&[]), &setup).expect("a valid motor");
        let mut state = MotorState::<f32>::default();
        state.rotor.height_m = 1e-42;
        state.rotor.velocity_m_s = -1e-43;
        state.rotor.rate_rad_s = 1e-44;
        state.modes.displacement_m.fill(1e-41);
        state.modes.velocity_m_s.fill(-1e-40);
        for _ in 0..5000 {
            motor.step(&mut state, DriveCommand::saturating(DriveMode::B, 1e-40));
            assert!(rotor_is_finite(&state), "{setup:?}");
        }
        assert_between(f64::from(state.rotor.height_m), -1e-6, 1e-6, "height");
    }
}
