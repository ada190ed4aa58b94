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
//! - [`count_all`]: every operation in turn, one [`Count`] each: the twin, the filter, the loop that flies.

mod calibration;
mod estimation;
mod position;
mod twin;

use core::fmt;

use motor_model::OutOfBounds;

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

    /// Runs `operation` once more and counts it.
    #[inline]
    fn sample<R>(&mut self, meter: &Meter<'_, impl InstructionTimer>, operation: impl FnOnce() -> R) -> R {
        let (result, instructions) = meter.instructions(operation);
        self.samples += 1;
        self.total += u64::from(instructions);
        self.max = self.max.max(instructions);
        result
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

/// Counts every operation and hands each count to `report`.
///
/// # Errors
/// When the model refuses the nominal motor or a command: never, unless their bounds are changed.
pub fn count_all(timer: &impl InstructionTimer, mut report: impl FnMut(Count)) -> Result<(), OutOfBounds> {
    let meter = Meter::new(timer);
    calibration::count(&meter, &mut report);
    twin::count(&meter, &mut report)?;
    estimation::count(&meter, &mut report);
    position::count(&meter, &mut report)
}
