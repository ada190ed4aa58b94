//! Any valid motor under any sequence of commands: no panic, no NaN, impacts that push, books that balance.
//!
//! Parameters are drawn over the whole of their bounds, evenly in the logarithm where the bounds span decades; the
//! cases are the same on every run.
#![expect(clippy::disallowed_methods, reason = "log-uniform draws")]

use motor_model::{
    AmplitudeVariation, DriveCommand, DriveMode, DriveTuning, EnergyLedger, FrictionLaw,
    IMPACTS_PER_STEP_MAX, ImpactRule, Motor, MotorParams, MotorSetup, MotorState, Parameter, Real,
};
use proptest::prelude::*;

use crate::support::closeness::Within;
use crate::support::motors::{epsilon, is_finite};
use crate::support::oscillator::Oscillator;

/// A pair that comes up while the other is in sustained contact is noticed at the end of a span: 0.1 m/s times 4 us at
/// worst (41 nm measured).
const DEEPEST_M: f64 = 4e-7;
const RULES: [ImpactRule; 2] = [ImpactRule::EndOfStep, ImpactRule::Located];

/// A value within the bounds of a parameter, `share` of the way from one end to the other.
fn within_bounds(parameter: Parameter, share: f64) -> f64 {
    let spec = parameter.spec();
    let value = if spec.min > 0.0 && spec.max / spec.min > 100.0 {
        spec.min * (spec.max / spec.min).powf(share)
    } else if spec.min >= 0.0 && !(0.5..=1.0).contains(&spec.max) {
        // From nothing, over fifteen decades.
        if share < 0.1 { 0.0 } else { spec.max * 10.0_f64.powf(-15.0 * (1.0 - share)) }
    } else {
        spec.min + (spec.max - spec.min) * share
    };
    value.clamp(spec.min, spec.max)
}

/// A value within a factor of ten of nominal, and within the bounds.
fn near_nominal(parameter: Parameter, share: f64) -> f64 {
    let spec = parameter.spec();
    let value = match parameter {
        Parameter::Gravity | Parameter::ModeShift => spec.nominal * (4.0 * share - 2.0),
        Parameter::ToothAngle => 50.0 + 35.0 * share,
        _ => spec.nominal * 10.0_f64.powf(2.0 * share - 1.0),
    };
    value.clamp(spec.min, spec.max)
}

fn params_from(value_of: fn(Parameter, f64) -> f64) -> impl Strategy<Value = MotorParams> {
    proptest::collection::vec(0.0..=1.0_f64, Parameter::ALL.len()).prop_map(move |shares| {
        let mut params = MotorParams::nominal();
        for (parameter, share) in Parameter::ALL.into_iter().zip(shares) {
            params = params.with(parameter, value_of(parameter, share)).expect("within its bounds");
        }
        // Mode A's damping is bounded by that of the others: 0.99 of critical.
        let critical = 2.0
            * params.get(Parameter::StatorMass)
            * std::f64::consts::TAU
            * params.get(Parameter::ModeAFrequency);
        let damping = params.get(Parameter::ModeADamping).min(0.98 * critical);
        params.with(Parameter::ModeADamping, damping).expect("less than before")
    })
}

fn setups(steps_s: std::ops::RangeInclusive<f64>) -> impl Strategy<Value = MotorSetup> {
    let tuning = prop_oneof![
        Just(DriveTuning::Resonant),
        (100.0..20_000.0_f64, 100.0..20_000.0_f64).prop_map(|(b_hz, c_hz)| DriveTuning::Fixed { b_hz, c_hz }),
    ];
    let log_steps = steps_s.start().ln()..=steps_s.end().ln();
    (log_steps, any::<bool>(), tuning, -0.3..0.3_f64, -0.3..0.3_f64).prop_map(
        |(log_step, paper, tuning, first, second)| MotorSetup {
            step_s: log_step.exp().clamp(1e-9, 1e-3),
            // Both rules are run.
            impact_rule: ImpactRule::EndOfStep,
            friction_law: if paper { FrictionLaw::Paper } else { FrictionLaw::Coulomb },
            tuning,
            variation: AmplitudeVariation { pairs: [first, second] },
        },
    )
}

fn commands() -> impl Strategy<Value = Vec<(DriveCommand, u32)>> {
    let command = prop_oneof![
        1 => Just(DriveCommand::OFF),
        4 => (any::<bool>(), 0.0..=1.0_f32, -2000.0..=2000.0_f32).prop_map(|(b, amplitude, offset_hz)| {
            let mode = if b { DriveMode::B } else { DriveMode::C };
            DriveCommand::try_new(mode, amplitude)
                .and_then(|command| command.with_frequency_offset(offset_hz))
                .expect("a valid command")
        }),
    ];
    proptest::collection::vec((command, prop_oneof![Just(1_u32), 1..600_u32]), 1..8)
}

/// What a run left behind.
struct Outcome {
    /// The ledger's, as a share of turnover and of what is stored.
    imbalance: f64,
    /// Of the rotor in a tooth at the end of a step.
    deepest_m: f64,
}

/// Runs a motor.
fn run<T: Real>(
    params: &MotorParams,
    setup: &MotorSetup,
    commands: &[(DriveCommand, u32)],
) -> Result<Outcome, TestCaseError> {
    let motor = Motor::<T>::try_new(params, setup).map_err(|error| TestCaseError::fail(error.to_string()))?;
    let mut ledger =
        EnergyLedger::try_new(params, setup).map_err(|error| TestCaseError::fail(error.to_string()))?;
    let mut state = MotorState::<T>::default();
    let (mut steps, mut deepest_m) = (0, 0.0_f64);
    for &(command, count) in commands {
        for _ in 0..count {
            let impacts = motor.step_with(&mut state, command, &mut ledger);
            steps += 1;
            for impact in &impacts {
                prop_assert!(impact.approach_m_s > T::zero(), "{impact:?}");
                // A impact too soft for the precision may round to nothing, never to less.
                prop_assert!(
                    impact.normal_impulse_n_s > T::zero() || impact.normal_impulse_n_s.to_f64() == 0.0,
                    "{impact:?}"
                );
                if setup.impact_rule == ImpactRule::EndOfStep {
                    prop_assert!(impact.gap_m <= T::zero(), "{impact:?}");
                    prop_assert!(impact.before_end_s.to_f64() == 0.0, "{impact:?}");
                }
                let inside = T::zero()..=T::from_f64(setup.step_s);
                prop_assert!(inside.contains(&impact.before_end_s), "{impact:?}");
                prop_assert!((impact.slip_m_s * impact.tangential_impulse_n_s).to_f64() >= 0.0, "{impact:?}");
            }
            prop_assert!(impacts.len() <= IMPACTS_PER_STEP_MAX);
            prop_assert!(is_finite(&state), "after {steps} steps: {state:?}");
            prop_assert!(setup.impact_rule == ImpactRule::Located || state.in_contact == [false; 2]);
            let gap_m = motor.gap_m(&state).to_f64();
            deepest_m = deepest_m.max(-gap_m);
        }
    }
    prop_assert_eq!(state.steps, steps);
    let flows = ledger.flows();
    let stored = ledger.stored_j(&state);
    // Potential and kinetic energy may cancel in what is stored, but not in its rounding.
    let potential = potential_energy_j(params, &state);
    let scale = flows.turnover_j() + stored.abs() + potential;
    // In f32 part of a step is rounded like the steady motion that it is reckoned from, however small the motion yet
    // is.
    let single = size_of::<T>() == 4 && setup.impact_rule == ImpactRule::Located;
    let scale = scale + if single { steady_energy_j(params) } else { 0.0 };
    prop_assert!(scale.is_finite());
    Ok(Outcome { imbalance: if scale > 0.0 { (stored - flows.net_j()) / scale } else { 0.0 }, deepest_m })
}

/// Energy of modes B and C at full drive and resonance.
fn steady_energy_j(params: &MotorParams) -> f64 {
    let modal_mass = 0.5 * params.get(Parameter::StatorMass);
    [DriveMode::B, DriveMode::C]
        .map(|mode| {
            let oscillator = Oscillator::of(params, mode);
            let speed = oscillator.natural_rad_s * oscillator.antinode_m;
            0.5 * modal_mass * speed * speed
        })
        .iter()
        .sum()
}

/// Magnitude of the rotor's potential energy.
fn potential_energy_j<T: Real>(params: &MotorParams, state: &MotorState<T>) -> f64 {
    let weight = params.get(Parameter::RotorMass) * params.get(Parameter::Gravity);
    (weight * state.rotor.height_m.to_f64()).abs()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, ..ProptestConfig::default() })]

    /// The whole of the bounds, in both precisions.
    #[test]
    fn law_any_valid_motor_stays_finite(
        params in params_from(within_bounds),
        setup in setups(1e-9..=1e-3),
        commands in commands(),
    ) {
        for impact_rule in RULES {
            let setup = MotorSetup { impact_rule, ..setup };
            run::<f64>(&params, &setup, &commands)?;
            run::<f32>(&params, &setup, &commands)?;
        }
    }

    /// Within a factor of ten of Table 1 and at steps that resolve the modes, the books balance too.
    #[test]
    fn law_any_motor_near_nominal_balances_its_books(
        params in params_from(near_nominal),
        setup in setups(0.1e-6..=4e-6),
        commands in commands(),
    ) {
        for impact_rule in RULES {
            let setup = MotorSetup { impact_rule, ..setup };
            let Outcome { imbalance, deepest_m } = run::<f64>(&params, &setup, &commands)?;
            prop_assert!(Within::absolute(1e-9).holds(imbalance, 0.0), "{impact_rule:?}: {imbalance:e}");
            prop_assert!(deepest_m <= DEEPEST_M, "{impact_rule:?}: {deepest_m:e} m deep");
            // In f32 at most the rounding of each of up to 4,200 steps, all one way.
            let Outcome { imbalance, deepest_m } = run::<f32>(&params, &setup, &commands)?;
            let within = Within::absolute(4200.0 * epsilon::<f32>());
            prop_assert!(within.holds(imbalance, 0.0), "{impact_rule:?}: {imbalance:e}");
            prop_assert!(deepest_m <= DEEPEST_M, "{impact_rule:?}: {deepest_m:e} m deep");
        }
    }
}
