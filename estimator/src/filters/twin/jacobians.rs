//! The derivatives of the stator filter against difference quotients of what they are the derivatives of.
//!
//! A state is an error, truth less estimate. So a quotient moves the estimate by a little, in the sense of the error.

use motor_model::Parameter::{ModeADamping, ModeAFrequency, ModeBFrequency, ModeCFrequency};
use motor_model::{DriveCommand, DriveMode, MotorParams, Time};
use nalgebra::Vector3;
use ud_filter::UdCovariance;

use super::checked_motor::{CheckedMotor, PERIOD_S};
use super::measured_impact::MeasuredImpact;
use super::states::{
    DRIVE_PHASE, Errors, HEIGHT, INSTANT, JUMP, MASS_RATIO, MODE_PARAMETERS, MODES, PAIR_AMPLITUDES, Row,
    STATES, TOOTH_ANGLE, TOOTH_VELOCITY, entry,
};
use super::stator::StatorFilter;
use super::tests::set_entry;
use super::tuning::TwinTuning;
use crate::instruments::Instruments;

/// The stator of a motor 4 ms after the drive went on, far from its steady swing, and all modes struck.
fn driven(params: &MotorParams, mode: DriveMode) -> StatorFilter<f64> {
    let motor = CheckedMotor::try_new(params).unwrap();
    let mut stator = StatorFilter::at_rest(&motor, &TwinTuning::new(params, &Instruments::default()));
    for micros in [0, 4000] {
        stator.advance(Time::from_micros(micros), DriveCommand::full(mode));
    }
    stator.state.modes.displacement_m += Vector3::new(5e-6, 3e-6, 2e-6);
    stator.state.modes.velocity_m_s += Vector3::new(0.1, -0.05, 0.08);
    stator.predict_covariance();
    stator
}

/// A step of a state, in its unit: small enough for what is quadratic in it, large enough for rounding.
fn step_of(state: usize) -> f64 {
    match state {
        INSTANT => 1e-8,
        JUMP => 1e-5,
        HEIGHT => 1e-9,
        MODES..INSTANT => [1e-9, 1e-5][(state - MODES) % 2],
        _ => 1e-4,
    }
}

/// The stator whose state is larger by `by`.
fn moved(stator: &StatorFilter<f64>, state: usize, by: f64) -> StatorFilter<f64> {
    let (mut moved, mut errors) = (stator.clone(), Errors::zeros());
    errors[state] = by;
    moved.correct(&errors);
    moved
}

/// The difference quotient by a state of numbers that follow from how much larger it is.
fn quotient<const K: usize>(state: usize, of: impl Fn(f64) -> [f64; K]) -> [f64; K] {
    let step = step_of(state);
    let (less, more) = (of(-step), of(step));
    core::array::from_fn(|k| (more[k] - less[k]) / (2.0 * step))
}

/// The same covariance of which all is known but one state, with a variance of 1.
fn all_but(state: usize) -> UdCovariance<f64, STATES> {
    let mut covariance = UdCovariance::known();
    covariance.replace_state(state, 1.0);
    covariance
}

/// Height, and displacement and velocity of modes A, B and C.
fn motion(stator: &StatorFilter<f64>) -> [f64; 7] {
    let (g, v) = (&stator.state.modes.displacement_m, &stator.state.modes.velocity_m_s);
    [stator.height_m, g.x, v.x, g.y, v.y, g.z, v.z]
}

/// What the errors of parameters and of the drive's phase do to the modes. The filter adds the inputs of four periods,
/// and lets the sum act at their middle without the spring: a constant input turns a mode by `1 + i x` instead of
/// `exp(i x)`, `x = 2 h w`, which is off by `x^2 / 2` of it. In a motor that swings and decays ten times more slowly
/// than the nominal one that is 0.11 % at most. Inputs cancel over the cycles, their errors do not: 1 % of the rest.
#[test]
fn dual_errors_of_parameters_move_the_modes_as_those_of_another_motor() {
    let mut params = MotorParams::nominal();
    for parameter in [ModeAFrequency, ModeADamping, ModeBFrequency, ModeCFrequency] {
        params = params.with(parameter, 0.1 * params.get(parameter)).unwrap();
    }
    for mode in [DriveMode::B, DriveMode::C] {
        let (start, command) = (driven(&params, mode), DriveCommand::full(mode));
        let end = start.at.unwrap().plus_nanos(6_005_000);
        for state in (MODE_PARAMETERS..MASS_RATIO).chain([DRIVE_PHASE]) {
            let mut predicted = start.clone();
            predicted.covariance = all_but(state);
            predicted.advance(end, command);
            predicted.predict_covariance();
            let column = predicted.covariance.column(state);
            let expected = quotient(state, |by| {
                let mut other = moved(&start, state, by);
                other.advance(end, command);
                motion(&other)
            });
            for (m, oscillator) in start.oscillators.iter().enumerate() {
                let (rad_s, first) = (oscillator.stiffness_per_s2.sqrt(), 1 + 2 * m);
                let [g, v] = [first, first + 1].map(|index| column[HEIGHT + index] - expected[index]);
                let (off, size) =
                    ((rad_s * g).hypot(v), (rad_s * expected[first]).hypot(expected[first + 1]));
                assert!(off <= 0.01 * size, "{mode:?} {state} {m}: {off:e} of {size:e}");
            }
        }
    }
}

/// Between impacts the speeds of the modes and the height wander: their variances grow with the time, which here is no
/// whole number of the spans in which sensitivities are added.
#[test]
fn exact_the_noise_grows_with_the_time() {
    let mut stator = driven(&MotorParams::nominal(), DriveMode::B);
    stator.covariance = UdCovariance::known();
    let end = stator.at.unwrap().plus_nanos(605_000);
    stator.advance(end, DriveCommand::full(DriveMode::B));
    stator.predict_covariance();
    let [a, b, c] = stator.velocity_noise_m2_s3;
    for (state, per_s) in
        [(MODES + 1, a), (MODES + 3, b), (MODES + 5, c), (HEIGHT, stator.height_noise_m2_s), (MODES, 0.0)]
    {
        let (own, expected) = (stator.covariance.variances()[state], 605e-6 * per_s);
        assert!((own - expected).abs() <= 1e-9 * expected, "{state}: {own:e} {expected:e}");
    }
}

/// How far an acceleration is off, in m/s^2, within half a period: there the drive's push is held, without the spring.
fn held_drive_m_s2(stator: &StatorFilter<f64>) -> f64 {
    let [_, b, _] = &stator.oscillators;
    0.5 * b.stiffness_per_s2 * (0.5 * PERIOD_S).powi(2) * stator.drive_amplitude_m_s2().norm()
}

/// Gap and approach by each state, of either pair, and of an impact whose sample comes between two periods.
#[test]
fn dual_the_rows_of_a_contact_are_quotients_of_gap_and_approach() {
    let stator = driven(&MotorParams::nominal(), DriveMode::B);
    for (pair, behind_s) in [(0, 0.0), (1, 0.0), (0, 3e-6)] {
        let impact = struck(behind_s);
        let measured = |errors: &Row<f64>| stator.contact_measurements(&impact, pair, errors);
        let rows = measured(&Row::zeros()).map(|measurement| measurement.row);
        for state in (HEIGHT..=JUMP).chain(MASS_RATIO..STATES) {
            let expected = quotient(state, |by| {
                let mut errors = Row::zeros();
                set_entry(&mut errors, state, by);
                measured(&errors).map(|measurement| measurement.row.dot(&errors) - measurement.innovation)
            });
            for (row, expected) in rows.iter().zip(expected) {
                let own = entry(row, state);
                let rounding = 1e-4 * own.abs() + 1e-9;
                let bound = if state == INSTANT { held_drive_m_s2(&stator) + rounding } else { rounding };
                assert!((own - expected).abs() < bound, "{pair} {state}: {own} {expected}");
            }
        }
    }
}

/// An impact in the middle of its period.
fn struck(behind_s: f64) -> MeasuredImpact<f64> {
    MeasuredImpact {
        before_m_s: -0.03,
        jump_m_s: 0.05,
        jump_m2_s2: 4e-8,
        within_s: PERIOD_S,
        behind_s,
        drift_m_s: 0.0,
    }
}

/// The tooth's velocity at the impact by modes, instant, tooth angle and amplitude of its pair.
#[test]
fn dual_the_tooth_s_velocity_follows_the_errors() {
    let (start, impact) = (driven(&MotorParams::nominal(), DriveMode::B), struck(0.0));
    for state in (MODES..=INSTANT).chain(PAIR_AMPLITUDES..=TOOTH_ANGLE) {
        let velocity = |of: &mut StatorFilter<f64>, instant_s: f64| {
            let tooth = of.tooth(1, &Row::zeros());
            of.begin_tooth_velocity(&tooth, impact.back_s(instant_s), 0.0)
        };
        let mut own = start.clone();
        own.covariance = all_but(state);
        let variance = velocity(&mut own, 0.0).variance;
        let own = own.covariance.column(state)[TOOTH_VELOCITY];
        let [expected] = quotient(state, |by| {
            let instant_s = if state == INSTANT { by } else { 0.0 };
            [velocity(&mut moved(&start, state, by), instant_s).value]
        });
        let rounding = 1e-4 * own.abs() + 1e-9;
        let bound = if state == INSTANT { held_drive_m_s2(&start) + rounding } else { rounding };
        assert!((own - expected).abs() < bound, "{state}: {own} {expected}");
        assert!((variance - own * own).abs() <= 1e-9 * variance, "{state}: {variance} {own}");
    }
}

/// What the recoil leaves of height and modes, by the states that it depends on.
#[test]
fn dual_the_recoil_follows_the_errors() {
    let mut start = driven(&MotorParams::nominal(), DriveMode::B);
    start.jump_m_s = 0.05;
    for (state, behind_s) in [TOOTH_ANGLE, PAIR_AMPLITUDES, MASS_RATIO, JUMP, INSTANT]
        .into_iter()
        .flat_map(|state| [(state, 0.0), (state, 3e-6)])
    {
        let impact = struck(behind_s);
        let recoil = |of: &mut StatorFilter<f64>, instant_s: f64| {
            let tooth = of.tooth(0, &Row::zeros());
            of.apply_recoil(&tooth, impact.back_s(instant_s), behind_s);
        };
        let mut own = start.clone();
        own.covariance = all_but(state);
        recoil(&mut own, 0.0);
        let column = own.covariance.column(state);
        let expected = quotient(state, |by| {
            let mut other = moved(&start, state, by);
            recoil(&mut other, if state == INSTANT { by } else { 0.0 });
            motion(&other)
        });
        for (index, expected) in expected.into_iter().enumerate() {
            let own = column[HEIGHT + index];
            let off = (own - expected).abs();
            assert!(off < 1e-4 * expected.abs() + 1e-9, "{state} {index}: {own:e} {expected:e}");
        }
    }
}
