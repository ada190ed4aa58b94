//! The loop that flies, without the twin that it positions.

use core::hint::black_box;

use controller::{PositionLoop, Report, tick};
use motor_model::{OutOfBounds, Time};

use super::{Count, InstructionTimer, Meter};
use crate::parity::Instruments;

/// What is counted: a tick with the instruments of [`crate::parity::LoopRun`], whose queues are a load and a store.
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
        |position_loop, now, instruments| {
            let now = black_box(now);
            black_box(count.sample(meter, || tick_once(position_loop, now, instruments)))
        },
        |_, _| (),
    )?;
    report(count);
    Ok(())
}
