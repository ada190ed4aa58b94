//! Waits that end: before the watchdog runs, nothing else would end them.

use super::hardware::CLOCK_HZ;

/// Cycles of the processor's clock that one look takes at least: a load, a test, a count and a branch.
const CYCLES_PER_LOOK: u32 = 4;

/// A device answers from two cycles of its bus after its clock was switched on (RM0440 and RM0433, chapter of the RCC).
/// As ST's drivers do, the register that switched it on is read back before the device is accessed.
pub(super) fn answers<R>(_read_back: R) {}

/// Looks until `is_so`, for `micros` at least; `None` if it never was. At the clock after a reset the time
/// is up to twenty times as long.
pub(super) fn wait_until(micros: u32, is_so: impl Fn() -> bool) -> Option<()> {
    let looks = micros * (CLOCK_HZ / 1_000_000 / CYCLES_PER_LOOK);
    (0..looks).any(|_| is_so()).then_some(())
}
