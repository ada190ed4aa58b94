//! A tick of the loop, with each filter of the firmware, alone and with a step of the twin; and the latency that the
//! loop needs on a processor of its own speed ([`controller::Drive::latency_ticks`]).
//!
//! A loop with latency has more to do in each tick: it keeps the decisions that do not act yet, and estimates for an
//! instant ahead of all samples. So the latency that it needs is counted of a loop that has one, the longest.

use core::hint::black_box;

use controller::{LATENCY_TICKS_MAX, PositionLoop, TickReport};
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

/// Instructions that a loop has in a tick: those of 150, 170 and 480 MHz at one a cycle, without a tenth for the
/// timer's interrupt and the link; and more, for a processor that does more than one a cycle.
const PER_TICK: [u32; 4] = [1350, 1530, 4320, 8000];

/// Names of a filter's operations.
struct Names {
    /// The tick alone, with a step of a twin under the same drive, and the latter while the drive is on.
    ticks: [&'static str; 3],
    /// A tick of the loop with the longest latency.
    late: &'static str,
    /// The latency for each of [`PER_TICK`].
    latencies: [&'static str; 4],
}

macro_rules! names {
    ($tick:literal) => {
        Names {
            ticks: [$tick, concat!($tick, "_and_step"), concat!($tick, "_and_driven_step")],
            late: concat!($tick, "_with_latency"),
            latencies: [
                concat!($tick, "_latency_at_1350"),
                concat!($tick, "_latency_at_1530"),
                concat!($tick, "_latency_at_4320"),
                concat!($tick, "_latency_at_8000"),
            ],
        }
    };
}

/// The filters, and the names of their counts.
const KINDS: [(FilterKind, Names); 3] = [
    (FilterKind::ConstantRate, names!("loop_tick")),
    (FilterKind::ImpactAided, names!("loop_tick_impact_aided")),
    (FilterKind::Twin, names!("loop_tick_twin")),
];

/// Counts the ticks of a loop without latency.
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
        0,
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

/// Counts the ticks of a loop with the longest latency, and how far it is behind.
#[inline(never)]
fn count_latencies(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    kind: FilterKind,
    late: &'static str,
    latencies: [&'static str; 4],
) -> Result<(Count, [Count; 4]), OutOfBounds> {
    let (mut late, mut latencies) = (Count::new(late), latencies.map(Count::new));
    let mut backlogs = PER_TICK.map(|per_tick| Backlog { per_tick, instructions: 0 });
    crate::parity::run_loop(
        memory,
        kind,
        LATENCY_TICKS_MAX,
        |parts, now, instruments| {
            let now = black_box(now);
            let (report, of_tick) = black_box(counter.count(|| tick_once(parts, now, instruments)));
            late.add(of_tick);
            for (backlog, latency) in backlogs.iter_mut().zip(&mut latencies) {
                latency.add(backlog.latency_ticks(of_tick));
            }
            report
        },
        |_, _| (),
    )?;
    Ok((late, latencies))
}

/// The loop with the filter `impact_aided`.
pub(super) fn run_hot_operations(memory: &mut LoopMemory) -> Result<(), OutOfBounds> {
    crate::parity::run_loop(memory, FilterKind::ImpactAided, 0, tick_once, |report, _| {
        black_box(report);
    })
    .map(drop)
}

pub(super) fn count(
    counter: &InstructionCounter<'_, impl InstructionTimer>,
    memory: &mut LoopMemory,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    for (kind, Names { ticks, late, latencies }) in KINDS {
        let ticks = count_ticks(counter, memory, kind, ticks)?;
        let (late, latencies) = count_latencies(counter, memory, kind, late, latencies)?;
        ticks.into_iter().chain([late]).chain(latencies).for_each(&mut *report);
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
