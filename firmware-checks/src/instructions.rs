//! The number of instructions that each operation takes on the microcontroller.
//!
//! In an emulator that gives every instruction the same virtual time, a timer counts instructions. Under QEMU's
//! `-icount shift=10` an instruction takes 1024 ns, and a tick of the mps2 boards' timer (25 MHz) [`TICK_NANOS`], so
//!
//! ```text
//! instructions = ticks * 40 ns / 1024 ns
//! ```
//!
//! is exact after rounding. The instructions of the readings themselves are measured by two readings with nothing
//! between them, and subtracted. The call of the operation and the passing of its arguments are counted with it.
//!
//! - [`InstructionTimer`]: the timer, and a loop whose instructions are known.
//! - [`count_all`]: one [`Count`] for each operation of the twin, the filters and the loop, and for sines and angles.
//! - `known_loops`, `twin_step`, `tilting_step`, `filter_core`, `constant_rate`, `filters`, `loop_tick`,
//!   `program_tick`, `trigonometry`: the operations, in the order in which they are counted.
//! - `hot_operations`: some of them once more, for a program that is followed instruction by instruction.

mod constant_rate;
mod filter_core;
mod filters;
mod hot_operations;
mod known_loops;
mod loop_tick;
#[cfg(feature = "peers")]
mod peers;
mod program_tick;
#[cfg(target_os = "none")]
mod systick;
mod tilting_step;
mod trigonometry;
mod twin_step;

use core::fmt;

use motor_model::OutOfBounds;

use crate::parity::LoopMemory;

pub use hot_operations::run_hot_operations;
#[cfg(feature = "peers")]
pub use peers::count_peers;
pub use program_tick::ProgramMemory;
#[cfg(target_os = "none")]
pub use systick::SysTick;

/// Duration of a tick of the timer.
pub const TICK_NANOS: u32 = 40;

/// Virtual time of an instruction: 2^10 ns.
pub const INSTRUCTION_NANOS: u32 = 1024;

/// The timer has 24 bits, so an operation may take 655,360 instructions.
const TICKS_MASK: u32 = (1 << 24) - 1;

/// The timer of the machine.
pub trait InstructionTimer {
    /// A 24-bit value that decreases by one every [`TICK_NANOS`] and continues from its maximum after 0.
    fn ticks(&self) -> u32;

    /// A loop of two instructions an iteration; at least one iteration.
    fn delay_loop(&self, iterations: u32);
}

/// The instructions of an operation. Its text is a line of the program: `operation samples total max`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// Name of the operation.
    pub operation: &'static str,
    /// Number of counted calls.
    pub samples: u32,
    /// Instructions of all calls.
    pub total: u64,
    /// Instructions of the longest call.
    pub max: u32,
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { operation, samples, total, max } = self;
        write!(f, "{operation} {samples} {total} {max}")
    }
}

impl Count {
    /// No call yet.
    fn new(operation: &'static str) -> Self {
        Self { operation, samples: 0, total: 0, max: 0 }
    }

    fn add(&mut self, instructions: u32) {
        self.samples += 1;
        self.total += u64::from(instructions);
        self.max = self.max.max(instructions);
    }
}

/// Counts instructions by the timer.
struct InstructionCounter<'a, C> {
    timer: &'a C,
    /// Instructions between two readings with nothing between them.
    of_readings: u32,
}

impl<'a, C: InstructionTimer> InstructionCounter<'a, C> {
    fn new(timer: &'a C) -> Self {
        let ((), of_readings) = Self { timer, of_readings: 0 }.count(|| ());
        Self { timer, of_readings }
    }

    /// Runs `operation` once; its result and its instructions.
    #[inline]
    fn count<R>(&self, operation: impl FnOnce() -> R) -> (R, u32) {
        let start = self.timer.ticks();
        let result = operation();
        let end = self.timer.ticks();
        (result, instructions_between(start, end).saturating_sub(self.of_readings))
    }
}

/// Instructions from a reading to a later one, rounded to the nearest.
fn instructions_between(start: u32, end: u32) -> u32 {
    let ticks = start.wrapping_sub(end) & TICKS_MASK;
    (ticks * TICK_NANOS + INSTRUCTION_NANOS / 2) / INSTRUCTION_NANOS
}

/// Counts every operation and gives each count to `report`; the memories are those of the loop and of the program.
///
/// # Errors
/// When the model refuses the nominal motor or a command: never, unless their bounds are changed.
pub fn count_all(
    timer: &impl InstructionTimer,
    memory: &mut LoopMemory,
    program_memory: &mut ProgramMemory,
    mut report: impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    let counter = InstructionCounter::new(timer);
    known_loops::count(&counter, &mut report);
    twin_step::count(&counter, &mut report)?;
    tilting_step::count(&counter, &mut report)?;
    filter_core::count(&counter, &mut report);
    constant_rate::count(&counter, &mut report);
    filters::count(&counter, memory, &mut report)?;
    loop_tick::count(&counter, memory, &mut report)?;
    program_tick::count(&counter, program_memory, &mut report)?;
    trigonometry::count(&counter, &mut report);
    Ok(())
}

#[cfg(test)]
mod tests {
    extern crate std;

    use core::cell::Cell;
    use std::vec::Vec;

    use super::*;

    /// A timer on virtual time in ns. A reading and a loop advance it.
    struct Virtual(Cell<u64>);

    impl Virtual {
        fn execute(&self, instructions: u32) {
            self.0.set(self.0.get() + u64::from(instructions * INSTRUCTION_NANOS));
        }
    }

    impl InstructionTimer for Virtual {
        #[expect(clippy::cast_possible_truncation, reason = "24 bits are kept")]
        fn ticks(&self) -> u32 {
            self.execute(6);
            0_u32.wrapping_sub((self.0.get() / u64::from(TICK_NANOS)) as u32) & TICKS_MASK
        }

        fn delay_loop(&self, iterations: u32) {
            self.execute(2 * iterations + 7);
        }
    }

    /// At any fraction of a tick, and across the timer's wrap-around.
    #[test]
    fn exact_instructions_from_any_instant() {
        for start in (0..3).chain([671_088_600, 671_088_639]) {
            let timer = Virtual(Cell::new(start));
            let counter = InstructionCounter::new(&timer);
            assert_eq!(counter.of_readings, 6);
            for iterations in [1, 2, 10, 1000, 100_000, 300_000] {
                let ((), instructions) = counter.count(|| timer.delay_loop(iterations));
                assert_eq!(instructions, 2 * iterations + 7);
            }
        }
    }

    #[test]
    fn exact_sums() {
        let mut count = Count::new("a");
        for instructions in [7, 9, 8] {
            count.add(instructions);
        }
        assert_eq!(count, Count { operation: "a", samples: 3, total: 24, max: 9 });
        assert_eq!(std::format!("{count}"), "a 3 24 9");
    }

    /// Each operation is in the state that its name says (in flight without impact, refused, at rest), as often as
    /// intended.
    #[test]
    fn law_every_operation_is_counted_and_only_loops_take_this_timers_time() {
        let mut counts = Vec::new();
        let memory = &mut ProgramMemory::new();
        count_all(&Virtual(Cell::new(0)), &mut None, memory, |count| counts.push(count)).unwrap();
        let samples = |operation: &str| {
            counts.iter().filter(|count| count.operation == operation).map(|count| count.samples).sum::<u32>()
        };
        for (operation, expected) in [
            ("located_step_aloft", 10_000),
            ("located_step_aloft_new_command", 10_000),
            ("end_of_step_aloft", 10_000),
            ("located_step_at_rest", 100_000),
            ("located_step_c", 100_000),
            ("tilting_step_aloft", 1000),
            ("tilting_step_b", 30_000),
            ("tilting_step_c", 30_000),
            ("tilting_step_at_rest", 1000),
            ("camera_frame_used", 9900),
            ("camera_frame_refused", 9900),
            ("camera_frame_repeated", 9900),
            ("prediction", 9900),
            ("vibrometer_sample", 10_000),
            ("impact_aided_b_camera_frame", 1000),
            ("impact_aided_c_vibrometer_sample", 20_000),
            ("constant_rate_c_prediction", 10_000),
            ("core_2_predict_and_update", 1000),
            ("loop_tick", 30_000),
            ("loop_tick_impact_aided", 30_000),
            ("loop_tick_twin_and_step", 30_000),
            ("program_tick", 30_000),
            ("program_tick_impact_aided_latency_at_1700", 30_000),
            ("program_tick_twin", 30_000),
        ] {
            assert_eq!(samples(operation), expected, "{operation}");
        }
        // The filter detects rest after 20 frames.
        assert!(samples("camera_frame_used_at_rest") > 9000);
        for Count { operation, samples, total, max } in counts {
            let expected = match operation {
                "loop_of_1000_turns" => 2007,
                "loop_of_10000_turns" => 20_007,
                // In ticks: work of no instructions is done within its own.
                latency if latency.contains("_latency_at_") => 1,
                _ => 0,
            };
            assert_eq!((max, total), (expected, u64::from(samples * expected)), "{operation}");
        }
    }
}
