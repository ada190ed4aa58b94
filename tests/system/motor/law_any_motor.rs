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
/// worst (41 nm measured), of a motor whose pairs pass each other by [`PASSED_M`] in a step or less. All speeds being
/// larger by a factor, so is the depth.
const DEEPEST_M: f64 = 4e-7;
/// 1.6 m/s times 4 us: pairs at 20 um in mode B, one up and one down.
const PASSED_M: f64 = 6.4e-6;
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
        Parameter::ModeBExtraShift => 8.0 * share - 4.0,
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
            * params.get(Parameter::ModeAMassFraction)
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

/// Most steps of a run.
const STEPS_MAX: f64 = 4200.0;

/// What a run left behind.
struct Outcome {
    /// Energy stored less the ledger's net flow.
    error_j: f64,
    /// Turnover, and what is stored.
    scale_j: f64,
    /// Rounding of the steps: each is rounded like the steady motion that it is reckoned from, however small the motion
    /// yet is.
    rounding_j: f64,
    /// Of the rotor in a tooth at the end of a step.
    deepest_m: f64,
    /// How far the two pairs of teeth pass each other in a step at most.
    passed_m: f64,
}

impl Outcome {
    /// Fails unless the books balance to `part` of the energy, and the rotor was nowhere deeper than [`DEEPEST_M`]
    /// allows.
    fn check(&self, part: f64, impact_rule: ImpactRule) -> Result<(), TestCaseError> {
        let Self { error_j, scale_j, rounding_j, deepest_m, passed_m } = *self;
        let within = Within::absolute(part * scale_j + rounding_j);
        prop_assert!(within.holds(error_j, 0.0), "{impact_rule:?}: {error_j:e} J of {scale_j:e} J");
        let deepest_max_m = DEEPEST_M * (passed_m / PASSED_M).max(1.0);
        prop_assert!(deepest_m <= deepest_max_m, "{impact_rule:?}: {deepest_m:e} m deep");
        Ok(())
    }
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
    let (mut steps, mut deepest_m, mut apart_m_s) = (0, 0.0_f64, 0.0_f64);
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
            apart_m_s = apart_m_s.max(fastest_apart_m_s(params, &motor, &state));
        }
    }
    prop_assert_eq!(state.steps, steps);
    let flows = ledger.flows();
    let stored = ledger.stored_j(&state);
    // Potential and kinetic energy may cancel in what is stored, but not in its rounding.
    let potential = potential_energy_j(params, &state);
    let scale_j = flows.turnover_j() + stored.abs() + potential;
    prop_assert!(scale_j.is_finite());
    let rounding_j = STEPS_MAX * epsilon::<T>() * steady_energy_j(params);
    let passed_m = apart_m_s * setup.step_s;
    Ok(Outcome { error_j: stored - flows.net_j(), scale_j, rounding_j, deepest_m, passed_m })
}

/// The fastest that one pair of teeth rises beside the other in the free motion of `state`: in the phase of each mode
/// that makes it so. Mode A lifts both alike.
fn fastest_apart_m_s<T: Real>(params: &MotorParams, motor: &Motor<T>, state: &MotorState<T>) -> f64 {
    let [first, second] = motor.teeth();
    [(DriveMode::B, 1), (DriveMode::C, 2)]
        .map(|(mode, index)| {
            let (displacement, velocity) =
                (state.modes.displacement_m[index].to_f64(), state.modes.velocity_m_s[index].to_f64());
            let speed_m_s = velocity.hypot(Oscillator::of(params, mode).natural_rad_s * displacement);
            (first.shape[index] - second.shape[index]).to_f64().abs() * speed_m_s
        })
        .iter()
        .sum()
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

/// Checks the books of a run in both precisions.
fn balances(
    params: &MotorParams,
    setup: &MotorSetup,
    commands: &[(DriveCommand, u32)],
) -> Result<(), TestCaseError> {
    run::<f64>(params, setup, commands)?.check(1e-9, setup.impact_rule)?;
    // At most the rounding of each step, all one way.
    run::<f32>(params, setup, commands)?.check(STEPS_MAX * epsilon::<f32>(), setup.impact_rule)
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
            balances(&params, &setup, &commands)?;
        }
    }
}

/// The motor of these values, in the order of [`Parameter::ALL`].
fn motor_of(values: [f64; 24]) -> MotorParams {
    Parameter::ALL.into_iter().zip(values).fold(MotorParams::nominal(), |params, (parameter, value)| {
        params.with(parameter, value).expect("within its bounds")
    })
}

fn setup_of(step_s: f64, pairs: [f64; 2]) -> MotorSetup {
    MotorSetup { variation: AmplitudeVariation { pairs }, ..MotorSetup::with_step(step_s) }
}

/// Found by other seeds: a rotor that starts inside a tooth and rises, whose first descent was sought outside of the
/// step; and steps of many periods, over which a sustained contact feeds energy to the modes without bound.
#[test]
fn regress_contacts_of_extreme_motors_stay_within_the_step_and_bounded() {
    let rising = motor_of([
        1e-5,
        1e-5,
        1e-5,
        0.0,
        0.0,
        46.0,
        -39.521_120_880_290_91,
        250_876.590_047_020_84,
        2.777_047_956_990_916_5e-5,
        712.968_421_525_324_4,
        0.849_766_304_027_979_3,
        0.0,
        209_809.154_704_745_57,
        0.918_666_352_675_803_9,
        1.668_405_848_123_733_8e-11,
        0.002_318_096_858_876_823,
        1e-18,
        2.092_749_987_387_591_8e-7,
        0.118_081_961_356_912_29,
        0.0,
        0.870_642_262_059_514,
        0.0,
        0.0,
        407.387_964_365_587_1,
    ]);
    let unresolved = motor_of([
        1e-5,
        1e-5,
        1e-5,
        0.0,
        7.100_292_702_385_314e-9,
        46.0,
        -90.0,
        187_955.991_115_530_72,
        0.159_560_366_395_030_27,
        279_217.619_703_706_24,
        0.895_264_653_816_906_6,
        0.0,
        1.0,
        0.0,
        0.0,
        0.026_675_279_720_382_08,
        1e-18,
        4.387_996_464_180_089e-6,
        0.0,
        0.0,
        0.0,
        0.0,
        0.0,
        16.562_680_199_490_273,
    ]);
    let weak =
        DriveCommand::try_new(DriveMode::C, 0.320_154_64).and_then(|c| c.with_frequency_offset(181.3118));
    let cases = [
        (
            rising,
            setup_of(1.060_110_380_812_066_2e-4, [-0.250_037_583_800_859, 0.076_086_378_804_742_8]),
            vec![(weak.expect("a valid command"), 1), (DriveCommand::OFF, 314)],
        ),
        (unresolved, setup_of(1e-3, [0.0; 2]), vec![(DriveCommand::OFF, 367)]),
    ];
    for (params, setup, commands) in cases {
        run::<f64>(&params, &setup, &commands).expect("finite and within the step");
        run::<f32>(&params, &setup, &commands).expect("finite and within the step");
    }
}

/// Found by other seeds: in the first step from rest the motion is far smaller than the steady one, whose rounding it
/// has.
#[test]
fn regress_the_books_of_a_first_step_balance_to_the_rounding_of_the_steady_motion() {
    let small = |mode_b: [f64; 3], tooth_radius_m: f64, gravity_m_s2: f64| {
        let mut values = MotorParams::nominal();
        for parameter in Parameter::ALL {
            values = values.with(parameter, near_nominal(parameter, 0.0)).expect("within its bounds");
        }
        let changes = [
            (Parameter::ToothRadius, tooth_radius_m),
            (Parameter::ModeBFrequency, mode_b[0]),
            (Parameter::ModeBDampingRatio, mode_b[1]),
            (Parameter::ModeBToothAmplitude, mode_b[2]),
            (Parameter::Gravity, gravity_m_s2),
            (Parameter::ModeBExtraShift, 0.0),
            (Parameter::ModeAMassFraction, 1.0),
            (Parameter::ModeBMassFraction, 0.5),
            (Parameter::ModeCMassFraction, 0.5),
        ];
        changes.into_iter().fold(values, |params, (parameter, value)| {
            params.with(parameter, value).expect("within its bounds")
        })
    };
    let heavy = small(
        [5_955.915_335_493_602_5, 0.00063, 9.335_508_860_126_234e-5],
        0.024_012_255_488_662_027,
        0.003_314_087_848_765_59,
    );
    let pulled = small(
        [7_399.382_921_886_756, 0.004_813_258_165_975_985_5, 1.200_661_443_500_976e-4],
        0.000_306_3,
        -1.991_262_886_209_261_4,
    );
    for (params, step_s, amplitude) in
        [(heavy, 1.283_416_795_959_538_8e-7, 0.420_695_57), (pulled, 1.057_917_542_710_185_5e-7, 0.792_302_1)]
    {
        let commands = [(DriveCommand::try_new(DriveMode::B, amplitude).expect("a valid command"), 1)];
        for impact_rule in RULES {
            let setup = MotorSetup { impact_rule, ..setup_of(step_s, [0.0; 2]) };
            balances(&params, &setup, &commands).expect("balanced books");
        }
    }
}
