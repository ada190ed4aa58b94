//! A step of the tilting motor without shift: in flight, in steady motion of each mode, and at rest.
//!
//! The motor has a tight hub and slippery teeth, on which mode B rubs on the pin most of the time.

use core::hint::black_box;

use motor_model::{
    ContactPlace, DriveCommand, DriveMode, Freedom, MotorParams, OutOfBounds, Parameter, TiltingContacts,
    TiltingMotor, TiltingParameter, TiltingParams, TiltingSetup, TiltingState, TiltingVariation,
};

use super::{Count, InstructionCounter, InstructionTimer};

/// Step in s: that of the twin.
const STEP_S: f64 = 10e-6;

/// 0.2 s: the resonances and the rotor have reached steady motion.
const SETTLING_STEPS: u32 = 20_000;

/// 1 ms: a rotor that is set down on the teeth is at rest, one above them is in flight.
const SETTLING_STEPS_ALIKE: u32 = 100;

/// 0.3 s of steady motion.
const STEPS: u32 = 30_000;

/// 10 ms of flight or rest.
const STEPS_ALIKE: u32 = 1_000;

/// Height far above the teeth.
const IN_FLIGHT_M: f32 = 1.0;

const ALOFT: &str = "tilting_step_aloft";
const AT_REST: &str = "tilting_step_at_rest";

#[inline(never)]
pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    let motor = motor()?;
    let (b, c) = (DriveCommand::full(DriveMode::B), DriveCommand::full(DriveMode::C));
    let mut in_flight = TiltingState::default();
    in_flight.rotor.height_m = IN_FLIGHT_M;
    report(steps(counter, ALOFT, &motor, (in_flight, SETTLING_STEPS_ALIKE), c, STEPS_ALIKE));
    let start = (TiltingState::default(), SETTLING_STEPS);
    report(steps(counter, "tilting_step_b", &motor, start, b, STEPS));
    report(steps(counter, "tilting_step_c", &motor, start, c, STEPS));
    let at_rest = (TiltingState::default(), SETTLING_STEPS_ALIKE);
    report(steps(counter, AT_REST, &motor, at_rest, DriveCommand::OFF, STEPS_ALIKE));
    Ok(())
}

fn motor() -> Result<TiltingMotor<f32>, OutOfBounds> {
    let params = MotorParams::nominal()
        .with(Parameter::Friction, 0.15)?
        .with(Parameter::VerticalDamping, 0.9e-3)?
        .with(Parameter::ModeShift, 1.25)?;
    let tilting = TiltingParams::nominal()
        .with(TiltingParameter::HubClearance, 7e-6)?
        .with(TiltingParameter::StatorTiltFrequency, 5000.0)?
        .with(TiltingParameter::ToothRockingExponent, 2.0)?;
    let variation =
        TiltingVariation { amplitudes: [0.004, -0.003, 0.002, -0.005], ..TiltingVariation::default() };
    let setup = TiltingSetup { freedom: Freedom::WithoutShift, variation, ..TiltingSetup::with_step(STEP_S) };
    TiltingMotor::try_new(&params, &tilting, &setup)
}

/// The counted operation: one step, compiled once for all states.
#[inline(never)]
fn step(
    motor: &TiltingMotor<f32>,
    state: &mut TiltingState<f32>,
    command: DriveCommand,
) -> TiltingContacts<f32> {
    motor.step(state, command)
}

/// Steps under one command, after those that `start` has to settle.
fn steps(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    operation: &'static str,
    motor: &TiltingMotor<f32>,
    start: (TiltingState<f32>, u32),
    command: DriveCommand,
    steps: u32,
) -> Count {
    let (mut state, settling) = start;
    for _ in 0..settling {
        black_box(step(motor, &mut state, black_box(command)));
    }
    let mut count = Count::new(operation);
    for _ in 0..steps {
        let (motor, command) = (black_box(motor), black_box(command));
        let (contacts, instructions) = black_box(counter.count(|| step(motor, &mut state, command)));
        // Of steps in flight only those without contact are counted, of steps at rest only those on three teeth or
        // four.
        let is_meant = match operation {
            ALOFT => contacts.is_empty(),
            AT_REST => {
                (0..4).filter(|tooth| state.in_contact.contains(ContactPlace::Tooth(*tooth))).count() > 2
            }
            _ => true,
        };
        if is_meant {
            count.add(instructions);
        }
    }
    count
}
