//! The counter against loops whose instructions are known.

use super::{Count, InstructionTimer, Meter};

/// Turns of the short loop and of the long one; their counts differ by two instructions for every turn between them.
const TURNS: [(&str, u32); 2] = [("loop_of_1000_turns", 1000), ("loop_of_10000_turns", 10_000)];

/// Samples of each: all alike.
const SAMPLES: u32 = 100;

#[inline(never)]
pub(super) fn count(meter: &Meter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    let mut nothing = Count::of("nothing");
    for _ in 0..SAMPLES {
        let ((), instructions) = meter.instructions(|| ());
        nothing.add(instructions);
    }
    report(nothing);
    for (operation, turns) in TURNS {
        let mut count = Count::of(operation);
        for _ in 0..SAMPLES {
            let ((), instructions) = meter.instructions(|| meter.timer.turn(turns));
            count.add(instructions);
        }
        report(count);
    }
}
