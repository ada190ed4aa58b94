//! The drive switched on from rest and off from full speed at every phase of it, impacts located: 32 phases, modes B
//! and C, both precisions.
//!
//! Each time the rotor lies still again afterwards and the books close. A half turn of the phase later the two pairs of
//! teeth, alike but in antiphase, have changed roles, so the net turn is the same: nothing tells the first pair from
//! the second.

use motor_model::{
    AngleAccumulator, DriveCommand, DriveMode, Forcing, ModalState, MotorParams, MotorState, Phase, Real,
    RotorState,
};

use crate::motor::law_energy::Accounted;
use crate::support::closeness::{Within, assert_between, assert_close};
use crate::support::motors::{Bench, epsilon, located, steps_in};

const PHASES: usize = 32;
const STEP_S: f64 = 10e-6;
/// Long enough to land and to come to rest.
const SETTLING_S: f64 = 0.15;

/// Drives `state`, lets it come to rest and returns the turn in milli-degrees that it took.
fn turn_mdeg<T: Real>(
    state: MotorState<T>,
    command: DriveCommand,
    on_s: f64,
    step_s: f64,
    what: &str,
) -> f64 {
    let origin = state.rotor.angle.angle();
    let mut accounted = Accounted::from(&MotorParams::nominal(), &located(step_s), state);
    accounted.run(command, on_s);
    accounted.run(DriveCommand::OFF, SETTLING_S);
    assert_eq!(accounted.state.in_contact, [true; 2], "{what}");
    let single = size_of::<T>() == 4;
    let still = Within::absolute(if single { 1e-8 } else { 1e-12 });
    assert_close(accounted.state.rotor.rate_rad_s.to_f64(), 0.0, still, format_args!("rate, {what}"));
    // In f32 the rounding of each step, all one way.
    let steps = f64::from(steps_in(on_s + SETTLING_S, step_s));
    let rounding = Within::absolute(if single { steps * epsilon::<T>() } else { 1e-9 });
    assert_close(accounted.imbalance(), 0.0, rounding, format_args!("books, {what}"));
    accounted.state.rotor.angle.angle().minus(origin).degrees() * 1e3
}

/// Net turns of the drive switched on from rest at each phase.
fn turns_from_rest<T: Real>(command: DriveCommand, on_s: f64) -> Vec<f64> {
    let mut bench = Bench::<T>::new(&MotorParams::nominal(), &located(STEP_S));
    bench.run(DriveCommand::OFF, 0.1);
    (0..PHASES)
        .map(|k| {
            let turns = f64::from(u8::try_from(k).expect("few")) / 32.0;
            let state = MotorState { phase: Phase::from_turns(turns), ..bench.state };
            let what = format!("{command:?} for {on_s:e} s from {turns} turns, {} bytes", size_of::<T>());
            turn_mdeg(state, command, on_s, STEP_S, &what)
        })
        .collect()
}

/// Mean and its standard error; half of the phases only mirror the others.
fn mean(turns: &[f64]) -> (f64, f64) {
    let turns = &turns[..PHASES / 2];
    let count = f64::from(u8::try_from(turns.len()).expect("few"));
    let mean = turns.iter().sum::<f64>() / count;
    let square = turns.iter().map(|turn| (turn - mean) * (turn - mean)).sum::<f64>() / (count - 1.0);
    (mean, motor_model::math::sqrt(square / count))
}

/// Turns at opposite phases are equal; sense by mode; the spread over phases.
fn check_burst(mode: DriveMode, amplitude: f32, on_s: f64, precision: f64, (low, high): (f64, f64)) {
    let command = DriveCommand::try_new(mode, amplitude).expect("a valid amplitude");
    let (double, single) = (turns_from_rest::<f64>(command, on_s), turns_from_rest::<f32>(command, on_s));
    for (k, (&turn, &rounded)) in double.iter().zip(&single).enumerate() {
        let what = format!("{command:?} for {on_s:e} s, phase {k}");
        let opposite = double[(k + PHASES / 2) % PHASES];
        assert_close(turn, opposite, Within::relative(1e-6), format_args!("opposite, {what}"));
        assert_close(rounded, turn, Within::relative(precision), format_args!("f32, {what}"));
        assert_between(turn, low, high, what);
    }
}

/// Two cycles of B, five of C, at 0.3: C walks on teeth in sustained contact, and its turn depends on the phase by less
/// than 1 %; B throws the rotor once or twice, and its turn depends on when. In `f32` an impact amplifies rounding by
/// about a hundred.
#[test]
fn law_weak_burst_from_rest_at_every_phase() {
    check_burst(DriveMode::C, 0.3, 680e-6, 1e-3, (-3.66, -3.59));
    check_burst(DriveMode::B, 0.3, 320e-6, 0.1, (3.0, 27.0));
}

/// Two cycles of B at full drive throw the rotor so that it lands on teeth nearly at rest.
#[test]
fn law_full_burst_from_rest_at_every_phase() {
    check_burst(DriveMode::B, 1.0, 320e-6, 0.1, (20.0, 200.0));
}

/// 20 ms at full drive are chaos: `f32` and `f64` part, and their means over the phases agree to four standard errors.
#[test]
fn dual_full_drive_from_rest_at_every_phase() {
    for mode in [DriveMode::B, DriveMode::C] {
        let command = DriveCommand::full(mode);
        let (double, double_error) = mean(&turns_from_rest::<f64>(command, 0.02));
        let (single, single_error) = mean(&turns_from_rest::<f32>(command, 0.02));
        let within = Within::absolute(4.0 * (double_error + single_error));
        assert_close(single, double, within, format_args!("{mode:?}"));
        let sense = if mode == DriveMode::B { 1.0 } else { -1.0 };
        assert!(double * sense > 4.0 * double_error, "{mode:?}: {double} +- {double_error}");
    }
}

/// The same state in another precision, the drive off, the angle at zero.
fn rounded<T: Real>(state: &MotorState<f64>) -> MotorState<T> {
    let (modes, rotor) = (&state.modes, &state.rotor);
    MotorState {
        steps: 0,
        phase: state.phase,
        modes: ModalState {
            displacement_m: modes.displacement_m.map(T::from_f64),
            velocity_m_s: modes.velocity_m_s.map(T::from_f64),
        },
        rotor: RotorState {
            height_m: T::from_f64(rotor.height_m),
            velocity_m_s: T::from_f64(rotor.velocity_m_s),
            angle: AngleAccumulator::default(),
            rate_rad_s: T::from_f64(rotor.rate_rad_s),
        },
        forcing: Forcing::default(),
        in_contact: state.in_contact,
    }
}

/// One state at full speed in each of 32 parts of the drive's period.
fn full_speed_at_every_phase(mode: DriveMode) -> Vec<MotorState<f64>> {
    let mut bench = Bench::<f64>::new(&MotorParams::nominal(), &located(STEP_S));
    bench.run(DriveCommand::full(mode), 0.3);
    let mut at_phase = vec![None; PHASES];
    for _ in 0..10_000 {
        bench.run(DriveCommand::full(mode), STEP_S);
        let bin = usize::try_from(bench.state.phase.units() >> 59).expect("five bits");
        at_phase[bin].get_or_insert(bench.state);
    }
    at_phase.into_iter().map(|state| state.expect("every phase comes up")).collect()
}

/// From the same state the way to rest is the same in `f32`, and, at every fourth phase, at a tenth of the step: to 0.5
/// % in B, whose rotor lands on teeth at rest, to 10 % of the mean in C, whose rotor is among them.
#[test]
fn dual_drive_off_at_every_phase() {
    for (mode, band) in [(DriveMode::B, 0.005), (DriveMode::C, 0.1)] {
        let states = full_speed_at_every_phase(mode);
        let turns: Vec<f64> = (states.iter().enumerate())
            .map(|(k, state)| {
                turn_mdeg::<f64>(
                    rounded(state),
                    DriveCommand::OFF,
                    0.0,
                    STEP_S,
                    &format!("{mode:?}, phase {k}"),
                )
            })
            .collect();
        let mean = turns.iter().sum::<f64>() / 32.0;
        let within = Within::absolute(band * mean.abs());
        for (k, (state, turn)) in states.iter().zip(turns).enumerate() {
            let what = format!("{mode:?} cut at phase {k}");
            // The rotor goes on the way it turned.
            assert!(turn * state.rotor.rate_rad_s > 0.0, "{what}: {turn} mdeg");
            let single = turn_mdeg::<f32>(rounded(state), DriveCommand::OFF, 0.0, STEP_S, &what);
            assert_close(single, turn, within, format_args!("f32, {what}"));
            if k % 4 == 0 {
                let fine = turn_mdeg::<f64>(rounded(state), DriveCommand::OFF, 0.0, 0.1 * STEP_S, &what);
                assert_close(fine, turn, within, format_args!("1 us, {what}"));
            }
        }
    }
}
