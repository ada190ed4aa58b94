//! Instructions that an operation takes on the microcontroller, counted one by one.
//!
//! An emulator that gives every instruction the same virtual time makes a timer count instructions: under QEMU's `-icount shift=10` one
//! instruction takes 1024 ns, a tick of the mps2 boards' 25 MHz [`TICK_NANOS`], so
//!
//! ```text
//! instructions = ticks * 40 ns / 1024 ns
//! ```
//!
//! is exact once rounded. What the reading itself takes is measured by two readings with nothing between them and taken off; the call of the
//! operation and the passing of its arguments stay in.
//!
//! - [`InstructionTimer`]: the timer, and a loop of known length to prove it by.
//! - [`count_all`]: every operation in turn, one [`Count`] each: the twin, the filters, the loop that flies, sines and angles.

mod calibration;
mod core;
mod estimation;
mod filters;
#[cfg(feature = "peers")]
mod peers;
mod position;
mod rehearsal;
#[cfg(target_os = "none")]
mod systick;
mod trigonometry;
mod twin;

use ::core::fmt;

use motor_model::OutOfBounds;

use crate::parity::LoopPlace;

#[cfg(feature = "peers")]
pub use peers::count_peers;
pub use rehearsal::rehearse;
#[cfg(target_os = "none")]
pub use systick::SysTick;

/// A tick of the timer.
pub const TICK_NANOS: u32 = 40;

/// Virtual time of an instruction, 2^10 ns.
pub const INSTRUCTION_NANOS: u32 = 1024;

/// The timer has 24 bits: an operation may take 655,360 instructions.
const TICKS_MASK: u32 = (1 << 24) - 1;

/// What counting needs of the machine.
pub trait InstructionTimer {
    /// A 24-bit count that falls by one every [`TICK_NANOS`] and starts again at the top.
    fn ticks(&self) -> u32;

    /// A loop of two instructions a turn; at least one turn.
    fn turn(&self, turns: u32);
}

/// What an operation took. Its text is what the program prints: `operation samples total max`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// Name of the operation.
    pub operation: &'static str,
    /// How many times it was counted.
    pub samples: u32,
    /// Instructions of all samples.
    pub total: u64,
    /// Instructions of the longest.
    pub max: u32,
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { operation, samples, total, max } = self;
        write!(f, "{operation} {samples} {total} {max}")
    }
}

impl Count {
    /// Nothing counted yet.
    fn of(operation: &'static str) -> Self {
        Self { operation, samples: 0, total: 0, max: 0 }
    }

    fn add(&mut self, instructions: u32) {
        self.samples += 1;
        self.total += u64::from(instructions);
        self.max = self.max.max(instructions);
    }
}

/// The timer as a counter of instructions.
struct Meter<'a, C> {
    timer: &'a C,
    /// What two readings with nothing between them show.
    reading: u32,
}

impl<'a, C: InstructionTimer> Meter<'a, C> {
    fn new(timer: &'a C) -> Self {
        let ((), reading) = Self { timer, reading: 0 }.instructions(|| ());
        Self { timer, reading }
    }

    /// Runs `operation` once: what it returned, and its instructions.
    #[inline]
    fn instructions<R>(&self, operation: impl FnOnce() -> R) -> (R, u32) {
        let start = self.timer.ticks();
        let result = operation();
        let end = self.timer.ticks();
        (result, instructions_between(start, end).saturating_sub(self.reading))
    }
}

/// Instructions from a reading to a later one, to the nearest.
fn instructions_between(start: u32, end: u32) -> u32 {
    let ticks = start.wrapping_sub(end) & TICKS_MASK;
    (ticks * TICK_NANOS + INSTRUCTION_NANOS / 2) / INSTRUCTION_NANOS
}

/// Counts every operation and hands each count to `report`; `place` is where the loop lies.
///
/// # Errors
/// When the model refuses the nominal motor or a command: never, unless their bounds are changed.
pub fn count_all(
    timer: &impl InstructionTimer,
    place: &mut LoopPlace,
    mut report: impl FnMut(Count),
) -> Result<(), OutOfBounds> {
    let meter = Meter::new(timer);
    calibration::count(&meter, &mut report);
    twin::count(&meter, &mut report)?;
    core::count(&meter, &mut report);
    estimation::count(&meter, &mut report);
    filters::count(&meter, place, &mut report)?;
    position::count(&meter, place, &mut report)?;
    trigonometry::count(&meter, &mut report);
    Ok(())
}

#[cfg(test)]
mod tests {
    extern crate std;

    use ::core::cell::Cell;
    use std::vec::Vec;

    use super::*;

    /// Virtual time in ns, which a reading and a loop pass.
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

        fn turn(&self, turns: u32) {
            self.execute(2 * turns + 7);
        }
    }

    /// Whatever the fraction of a tick and wherever the timer starts again.
    #[test]
    fn exact_instructions_from_any_instant() {
        for start in (0..3).chain([671_088_600, 671_088_639]) {
            let timer = Virtual(Cell::new(start));
            let meter = Meter::new(&timer);
            assert_eq!(meter.reading, 6);
            for turns in [1, 2, 10, 1000, 100_000, 300_000] {
                let ((), instructions) = meter.instructions(|| timer.turn(turns));
                assert_eq!(instructions, 2 * turns + 7);
            }
        }
    }

    #[test]
    fn exact_sums() {
        let mut count = Count::of("a");
        for instructions in [7, 9, 8] {
            count.add(instructions);
        }
        assert_eq!(count, Count { operation: "a", samples: 3, total: 24, max: 9 });
        assert_eq!(std::format!("{count}"), "a 3 24 9");
    }

    /// Each operation is what it is called - aloft without impact, refused, at rest - as often as it was meant to be.
    #[test]
    fn law_every_operation_is_reached_and_only_loops_take_this_timers_time() {
        let mut counts = Vec::new();
        count_all(&Virtual(Cell::new(0)), &mut None, |count| counts.push(count)).unwrap();
        let samples = |operation: &str| {
            counts.iter().filter(|count| count.operation == operation).map(|count| count.samples).sum::<u32>()
        };
        for (operation, expected) in [
            ("located_step_aloft", 10_000),
            ("located_step_aloft_new_command", 10_000),
            ("end_of_step_aloft", 10_000),
            ("located_step_at_rest", 100_000),
            ("located_step_c", 100_000),
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
        ] {
            assert_eq!(samples(operation), expected, "{operation}");
        }
        // 20 frames make a rest.
        assert!(samples("camera_frame_used_at_rest") > 9000);
        for Count { operation, samples, total, max } in counts {
            let expected = match operation {
                "loop_of_1000_turns" => 2007,
                "loop_of_10000_turns" => 20_007,
                _ => 0,
            };
            assert_eq!((max, total), (expected, u64::from(samples * expected)), "{operation}");
        }
    }
}
