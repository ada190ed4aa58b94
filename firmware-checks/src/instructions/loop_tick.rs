//! A tick of the loop, with each filter of the firmware, alone and with a step of the twin.

use core::hint::black_box;

use controller::{LoopTiming, PositionLoop, TickReport};
use link::FilterKind;
use motor_model::{Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::{Count, InstructionCounter, InstructionTimer, twin_step};
use crate::parity::{LoopMemory, LoopParts, TwinInstruments, tick_parts};

/// The counted operation: a tick with the instruments of [`crate::parity::LoopRun`], at most one frame and two samples
/// of the vibrometer.
#[inline(never)]
fn tick_once<'a>(parts: &'a mut LoopParts, now: Time, instruments: &mut TwinInstruments) -> &'a TickReport {
    tick_parts(parts, now, instruments)
}

/// The filters, and the names of their counts.
///
/// A name is that of the tick alone, with a step of a twin under the same drive, and the latter while the drive is on.
const KINDS: [(FilterKind, [&str; 3]); 3] = [
    (FilterKind::ConstantRate, ["loop_tick", "loop_tick_and_step", "loop_tick_and_driven_step"]),
    (
        FilterKind::ImpactAided,
        [
            "loop_tick_impact_aided",
            "loop_tick_impact_aided_and_step",
            "loop_tick_impact_aided_and_driven_step",
        ],
    ),
    (FilterKind::Twin, ["loop_tick_twin", "loop_tick_twin_and_step", "loop_tick_twin_and_driven_step"]),
];

/// Counts the ticks of a loop.
#[inline(never)]
fn count_ticks(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    kind: FilterKind,
    names: [&'static str; 3],
) -> Result<[Count; 3], OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
    let setup = MotorSetup::with_step(PositionLoop::TICK_NANOS as f64 * 1e-9);
    let motor = Motor::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let [mut alone, mut with_step, mut driven] = names.map(Count::new);
    crate::parity::run_loop(
        memory,
        kind,
        LoopTiming::default(),
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
    crate::parity::run_loop(memory, FilterKind::ImpactAided, LoopTiming::default(), tick_once, |report, _| {
        black_box(report);
    })
    .map(drop)
}

pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    for (kind, names) in KINDS {
        count_ticks(counter, memory, kind, names)?.into_iter().for_each(&mut *report);
    }
    Ok(())
}
