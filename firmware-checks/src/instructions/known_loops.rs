//! Loops whose instructions are known, to check the counter.

use super::{Count, InstructionCounter, InstructionTimer};

/// Iterations of the short loop and of the long one. Their counts differ by two instructions for each further
/// iteration.
const ITERATIONS: [(&str, u32); 2] = [("loop_of_1000_turns", 1000), ("loop_of_10000_turns", 10_000)];

/// Calls of each; all take the same.
const SAMPLES: u32 = 100;

#[inline(never)]
pub(super) fn count(counter: &InstructionCounter<'_, impl InstructionTimer>, report: &mut impl FnMut(Count)) {
    let mut nothing = Count::new("nothing");
    for _ in 0..SAMPLES {
        let ((), instructions) = counter.count(|| ());
        nothing.add(instructions);
    }
    report(nothing);
    for (operation, iterations) in ITERATIONS {
        let mut count = Count::new(operation);
        for _ in 0..SAMPLES {
            let ((), instructions) = counter.count(|| counter.timer.delay_loop(iterations));
            count.add(instructions);
        }
        report(count);
    }
}
