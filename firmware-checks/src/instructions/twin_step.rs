//! A step of the twin: in flight, in steady motion of each mode, and at rest.

use core::hint::black_box;

use motor_model::{
    DriveCommand, DriveMode, ImpactRule, Impacts, Motor, MotorParams, MotorSetup, MotorState, OutOfBounds,
};

use super::{Count, InstructionCounter, InstructionTimer};

/// The twin's step in s.
const STEP_S: f64 = 10e-6;

/// 0.3 s: the resonances and the rotor have reached steady motion.
const SETTLING_STEPS: u32 = 30_000;

/// 1 s of steady motion.
const STEPS: u32 = 100_000;

/// 0.1 s of flight.
const STEPS_IN_FLIGHT: u32 = 10_000;

/// Height far above the teeth: a rotor falls 5 cm in 0.1 s.
const IN_FLIGHT_M: f32 = 1.0;

#[inline(never)]
pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
    let weak = |mode| DriveCommand::try_new(mode, 0.3);

    let located = motor(ImpactRule::Located)?;
    report(in_flight(counter, "located_step_aloft", &located, [c; 2]));
    report(in_flight(counter, "located_step_aloft_new_command", &located, [b, c]));
    report(steady(counter, "located_step_b", &located, b));
    report(steady(counter, "located_step_c", &located, c));
    report(steady(counter, "located_step_b_0.3", &located, weak(DriveMode::B)?));
    report(steady(counter, "located_step_c_0.3", &located, weak(DriveMode::C)?));
    report(steady(counter, "located_step_at_rest", &located, DriveCommand::OFF));

    let at_end = motor(ImpactRule::EndOfStep)?;
    report(in_flight(counter, "end_of_step_aloft", &at_end, [c; 2]));
    report(steady(counter, "end_of_step_b", &at_end, b));
    report(steady(counter, "end_of_step_c", &at_end, c));
    Ok(())
}

/// Driven steps in flight.
pub(super) fn run_hot_operations() -> Result<(), OutOfBounds> {
    let motor = motor(ImpactRule::Located)?;
    let mut state = MotorState::default();
    state.rotor.height_m = IN_FLIGHT_M;
    for _ in 0..100 {
        black_box(step(black_box(&motor), &mut state, black_box(DriveCommand::full(DriveMode::C))));
    }
    Ok(())
}

fn motor(impact_rule: ImpactRule) -> Result<Motor<f32>, OutOfBounds> {
    let setup = MotorSetup { impact_rule, ..MotorSetup::with_step(STEP_S) };
    Motor::try_new(&MotorParams::nominal(), &setup)
}

/// The counted operation: one step, compiled once for all states.
#[inline(never)]
pub(super) fn step(motor: &Motor<f32>, state: &mut MotorState<f32>, command: DriveCommand) -> Impacts<f32> {
    motor.step(state, command)
}

/// Steps without impact, under two commands alternately. A step with an impact is not counted.
fn in_flight(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    operation: &'static str,
    motor: &Motor<f32>,
    commands: [DriveCommand; 2],
) -> Count {
    let mut state = MotorState::default();
    state.rotor.height_m = IN_FLIGHT_M;
    let [first, second] = commands;
    step(motor, &mut state, black_box(first));
    let mut count = Count::new(operation);
    for _ in 0..STEPS_IN_FLIGHT / 2 {
        for command in [second, first] {
            let (impacts, instructions) = counted(counter, motor, &mut state, command);
            if impacts.is_empty() {
                count.add(instructions);
            }
        }
    }
    count
}

/// Steps of steady motion under one command.
fn steady(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    operation: &'static str,
    motor: &Motor<f32>,
    command: DriveCommand,
) -> Count {
    let mut state = MotorState::default();
    for _ in 0..SETTLING_STEPS {
        black_box(step(motor, &mut state, black_box(command)));
    }
    let mut count = Count::new(operation);
    for _ in 0..STEPS {
        let (_, instructions) = counted(counter, motor, &mut state, command);
        // With the drive off only steps at rest are counted: with both pairs of teeth in contact.
        if command != DriveCommand::OFF || state.in_contact == [true; 2] {
            count.add(instructions);
        }
    }
    count
}

fn counted(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    motor: &Motor<f32>,
    state: &mut MotorState<f32>,
    command: DriveCommand,
) -> (Impacts<f32>, u32) {
    let (motor, command) = (black_box(motor), black_box(command));
    black_box(counter.count(|| step(motor, state, command)))
}
