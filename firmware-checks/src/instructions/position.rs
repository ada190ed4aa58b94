//! The loop that flies, with each filter as the firmware picks it, and with the twin's step beside it.

use core::hint::black_box;

use controller::{PositionLoop, TickReport, tick};
use link::FilterKind;
use motor_model::{Motor, MotorParams, MotorSetup, MotorState, OutOfBounds, Time};

use super::{Count, InstructionTimer, Meter, twin};
use crate::parity::{Instruments, LoopPlace};
use firmware::filter::SelectedFilter;

/// What is counted: a tick with the instruments of [`crate::parity::LoopRun`], whose queues hold one measurement each.
#[inline(never)]
fn tick_once(
    position_loop: &mut PositionLoop<SelectedFilter>,
    now: Time,
    instruments: &mut Instruments,
) -> TickReport {
    tick(position_loop, now, instruments)
}

/// Counts the tick alone, with a twin that steps under the same drive, and those of the latter that drive.
#[inline(never)]
fn follow(
    meter: &Meter<'_, impl InstructionTimer>,
    place: &mut LoopPlace,
    names: [&'static str; 3],
    kind: FilterKind,
) -> Result<[Count; 3], OutOfBounds> {
    #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
    let setup = MotorSetup::with_step(PositionLoop::TICK_NANOS as f64 * 1e-9);
    let motor = Motor::try_new(&MotorParams::nominal(), &setup)?;
    let mut state = MotorState::default();
    let [mut alone, mut whole, mut driven] = names.map(Count::of);
    crate::parity::follow_loop(
        place,
        || SelectedFilter::try_new(kind),
        |position_loop, now, instruments| {
            let now = black_box(now);
            let (report, of_tick) =
                black_box(meter.instructions(|| tick_once(position_loop, now, instruments)));
            let (_, of_step) =
                black_box(meter.instructions(|| twin::step(&motor, &mut state, report.applied)));
            alone.add(of_tick);
            whole.add(of_tick + of_step);
            if report.applied.mode().is_some() {
                driven.add(of_tick + of_step);
            }
            report
        },
        |_, _| (),
    )?;
    Ok([alone, whole, driven])
}

/// The loop with the impact-aided filter.
pub(super) fn rehearse(place: &mut LoopPlace) -> Result<(), OutOfBounds> {
    let filter = || SelectedFilter::try_new(FilterKind::ImpactAided);
    crate::parity::follow_loop(place, filter, tick_once, |report, _| {
        black_box(report);
    })
    .map(drop)
}

/// The names of each filter's rows: the tick alone, with the step, and with the step while the drive is on.
const NAMES: [(FilterKind, [&str; 3]); 3] = [
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

pub(super) fn count(
    meter: &Meter<'_, impl InstructionTimer>,
    place: &mut LoopPlace,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    for (kind, names) in NAMES {
        follow(meter, place, names, kind)?.into_iter().for_each(&mut *report);
    }
    Ok(())
}
