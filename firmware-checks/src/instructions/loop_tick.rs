//! A tick of the loop, with each filter of the firmware, alone and with a step of the twin.

use core::hint::black_box;

use controller::{PositionLoop, TickReport};
use link::FilterKind;
use motor_model::{Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::{Count, InstructionCounter, InstructionTimer, twin_step};
use crate::parity::{LoopMemory, LoopParts, TwinInstruments, tick_parts};

/// The counted operation: a tick with the instruments of [`crate::parity::LoopRun`], each with at most one measurement.
#[inline(never)]
fn tick_once(parts: &mut LoopParts, now: Time, instruments: &mut TwinInstruments) -> TickReport {
    tick_parts(parts, now, instruments)
}

/// Counts the tick alone, the tick with a step of a twin under the same drive, and the latter while the drive is on.
#[inline(never)]
fn count_kind(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    names: [&'static str; 3],
    kind: FilterKind,
) -> Result<[Count; 3], OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
    let setup = MotorSetup::with_step(PositionLoop::TICK_NANOS as f64 * 1e-9);
    let motor = Motor::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let [mut alone, mut with_step, mut driven] = names.map(Count::new);
    crate::parity::run_loop(
        memory,
        kind,
        |parts, now, instruments| {
            let now = black_box(now);
            let (report, of_tick) = black_box(counter.count(|| tick_once(parts, now, instruments)));
            let (_, of_step) =
                black_box(counter.count(|| twin_step::step(&motor, &mut state, report.applied)));
            alone.add(of_tick);
            with_step.add(of_tick + of_step);
            if report.applied.mode().is_some() {
                driven.add(of_tick + of_step);
            }
            report
        },
        |_, _| (),
    )?;
    Ok([alone, with_step, driven])
}

/// The loop with the filter `impact_aided`.
pub(super) fn run_hot_operations(memory: &mut LoopMemory) -> Result<(), OutOfBounds> {
    crate::parity::run_loop(memory, FilterKind::ImpactAided, tick_once, |report, _| {
        black_box(report);
    })
    .map(drop)
}

/// Names of a filter's operations: the tick alone, with the step, and with the step while the drive is on.
macro_rules! names {
    ($tick:literal) => {
        [$tick, concat!($tick, "_and_step"), concat!($tick, "_and_driven_step")]
    };
}

const NAMES: [(FilterKind, [&str; 3]); 3] = [
    (FilterKind::ConstantRate, names!("loop_tick")),
    (FilterKind::ImpactAided, names!("loop_tick_impact_aided")),
    (FilterKind::Twin, names!("loop_tick_twin")),
];

pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    for (kind, names) in NAMES {
        count_kind(counter, memory, names, kind)?.into_iter().for_each(&mut *report);
    }
    Ok(())
}
