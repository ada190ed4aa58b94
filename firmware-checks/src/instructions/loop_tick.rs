//! A tick of the loop, with each filter of the firmware, alone and with a step of the twin; and the latency that the
//! loop needs on a processor of its own speed ([`controller::Drive::latency_ticks`]).

use core::hint::black_box;

use controller::{PositionLoop, TickReport};
use link::FilterKind;
use motor_model::{Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::{Count, InstructionCounter, InstructionTimer, twin_step};
use crate::parity::{LoopMemory, LoopParts, TwinInstruments, tick_parts};

/// The counted operation: a tick with the instruments of [`crate::parity::LoopRun`], at most one frame and two samples
/// of the vibrometer.
#[inline(never)]
fn tick_once(parts: &mut LoopParts, now: Time, instruments: &mut TwinInstruments) -> TickReport {
    tick_parts(parts, now, instruments)
}

/// Work that waits for a processor of a given speed.
struct Backlog {
    /// Instructions that the loop has in a tick.
    per_tick: u32,
    instructions: u32,
}

impl Backlog {
    /// Ticks, begun ones included, after which the work of this tick is done, that of earlier ones before it.
    fn latency_ticks(&mut self, work: u32) -> u32 {
        let all = self.instructions.saturating_add(work);
        self.instructions = all.saturating_sub(self.per_tick);
        all.div_ceil(self.per_tick).max(1)
    }
}

/// Counts the tick alone, the tick with a step of a twin under the same drive, the latter while the drive is on, and
/// the latency where the loop has so many instructions in a tick, for either of `speeds`.
#[inline(never)]
fn count_kind(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    names: [&'static str; 5],
    kind: FilterKind,
    speeds: [u32; 2],
) -> Result<[Count; 5], OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
    let setup = MotorSetup::with_step(PositionLoop::TICK_NANOS as f64 * 1e-9);
    let motor = Motor::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let [mut alone, mut with_step, mut driven, mut slow, mut fast] = names.map(Count::new);
    let mut backlogs = speeds.map(|per_tick| Backlog { per_tick, instructions: 0 });
    crate::parity::run_loop(
        memory,
        kind,
        |parts, now, instruments| {
            let now = black_box(now);
            let (report, of_tick) = black_box(counter.count(|| tick_once(parts, now, instruments)));
            let (_, of_step) =
                black_box(counter.count(|| twin_step::step(&motor, &mut state, report.applied)));
            alone.add(of_tick);
            for (backlog, latency) in backlogs.iter_mut().zip([&mut slow, &mut fast]) {
                latency.add(backlog.latency_ticks(of_tick));
            }
            with_step.add(of_tick + of_step);
            if report.applied.mode().is_some() {
                driven.add(of_tick + of_step);
            }
            report
        },
        |_, _| (),
    )?;
    Ok([alone, with_step, driven, slow, fast])
}

/// The loop with the filter `impact_aided`.
pub(super) fn run_hot_operations(memory: &mut LoopMemory) -> Result<(), OutOfBounds> {
    crate::parity::run_loop(memory, FilterKind::ImpactAided, tick_once, |report, _| {
        black_box(report);
    })
    .map(drop)
}

/// Names of a filter's operations: the tick alone, with the step, with the step while the drive is on, and the latency
/// on a slower and on a faster processor.
macro_rules! names {
    ($tick:literal, $slow:literal, $fast:literal) => {
        [
            $tick,
            concat!($tick, "_and_step"),
            concat!($tick, "_and_driven_step"),
            concat!($tick, "_latency_at_", $slow),
            concat!($tick, "_latency_at_", $fast),
        ]
    };
}

/// The filters, the names of their counts, and instructions of a tick: 1,530 and 4,320 are those of 170 and of 480 MHz
/// at one a cycle, without a tenth for the timer's interrupt and the link.
const KINDS: [(FilterKind, [&str; 5], [u32; 2]); 3] = [
    (FilterKind::ConstantRate, names!("loop_tick", "1530", "4320"), [1530, 4320]),
    (FilterKind::ImpactAided, names!("loop_tick_impact_aided", "1530", "4320"), [1530, 4320]),
    (FilterKind::Twin, names!("loop_tick_twin", "4320", "8000"), [4320, 8000]),
];

pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    for (kind, names, speeds) in KINDS {
        count_kind(counter, memory, names, kind, speeds)?.into_iter().for_each(&mut *report);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 100 instructions a tick: 250 take two ticks and a half, and what is left of them makes the next ticks late.
    #[test]
    fn exact_work_waits_for_the_work_before_it() {
        let mut backlog = Backlog { per_tick: 100, instructions: 0 };
        let latencies = [50, 250, 0, 0, 100, 101, 99, 0].map(|work| backlog.latency_ticks(work));
        assert_eq!(latencies, [1, 3, 2, 1, 1, 2, 1, 1]);
    }
}
