//! The loop that flies, without the twin that it positions.

use core::hint::black_box;

use controller::{PositionLoop, Report, tick};
use motor_model::{OutOfBounds, Time};

use super::{Count, InstructionTimer, Meter};
use crate::parity::Instruments;

/// What is counted: a tick with the instruments of [`crate::parity::LoopRun`], whose queues hold one measurement each.
#[inline(never)]
fn tick_once(position_loop: &mut PositionLoop, now: Time, instruments: &mut Instruments) -> Report {
    tick(position_loop, now, instruments)
}

pub(super) fn count(
    meter: &Meter<'_, impl InstructionTimer>,
    report: &mut impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    let mut count = Count::of("loop_tick");
    crate::parity::follow_loop(
        &mut None,
        || Ok(crate::parity::constant_rate()),
        |position_loop, now, instruments| {
            let now = black_box(now);
            let (report, instructions) =
                black_box(meter.instructions(|| tick_once(position_loop, now, instruments)));
            count.add(instructions);
            report
        },
        |_, _| (),
    )?;
    report(count);
    Ok(())
}
