//! The board: the only module that accesses registers.
//!
//! - `mps2`: the emulated board, QEMU's mps2-an386 or mps2-an500: enabling pin, pulse width, serial line, watchdog,
//!   and memory that stands for a flash.
//! - `stm32g474`, `stm32h743`, each behind the feature of its name: the same of real boards.
//! - `hardware`: the one of them that the program is built for.
//! - `bridge`, `line`, `watchdog`: of the real boards, bridge, serial line and independent watchdog.
//! - [`Stopwatch`]: what the work of a tick is timed by.
//! - `wait`: waits of real boards for their hardware, which end.
//! - `faults`: handlers of panics, faults and other exceptions, for every program. They switch the drive off, keep the
//!   reason, and end.
//! - `crash`: what they keep until the program has started again.
//! - [`stack_words`], [`stack_word_is_unused`]: what [`crate::stack_gauge`] looks at.

#[cfg(feature = "silicon")]
mod bridge;
pub mod crash;
mod faults;
#[cfg(feature = "silicon")]
mod line;
#[cfg(not(feature = "silicon"))]
pub mod mps2;
#[cfg(feature = "stm32g474")]
pub mod stm32g474;
#[cfg(feature = "stm32h743")]
pub mod stm32h743;
mod stopwatch;
#[cfg(feature = "silicon")]
mod wait;
#[cfg(feature = "silicon")]
mod watchdog;

use core::ptr;

use cortex_m_rt::STACK_PAINT_VALUE;
#[cfg(feature = "checks")]
pub use faults::be_alone;
pub use faults::end;
#[cfg(not(feature = "silicon"))]
pub use mps2 as hardware;
#[cfg(feature = "stm32g474")]
pub use stm32g474 as hardware;
#[cfg(feature = "stm32h743")]
pub use stm32h743 as hardware;
pub use stopwatch::Stopwatch;

use link::ResetCause;

#[cfg(feature = "keep")]
use hardware::Flash;
use hardware::{Enable, Line, Pulses, Vibrometer, Watchdog, Width};

/// Everything of the board that the program uses.
#[derive(Debug)]
pub struct Parts {
    /// The pulse width, and what cuts the bridge off.
    pub width: Width,
    /// The bridge's enabling pin.
    pub enable: Enable,
    /// What starts pulses and samples, together with the timer of the ticks.
    pub pulses: Pulses,
    /// The serial line.
    pub line: Line,
    /// The vibrometer.
    pub vibrometer: Vibrometer,
    /// The flash of the kept description, from offset 0: [`crate::store::store_bytes`].
    #[cfg(feature = "keep")]
    pub flash: Flash,
    /// The watchdog, not yet started.
    pub watchdog: Watchdog,
    /// Why the board started.
    pub reset_cause: ResetCause,
}

#[expect(unsafe_code, reason = "the linker script names the ends of the stack")]
// SAFETY: both are symbols of the linker script, whatever their type; only their addresses are used.
unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Words of the stack's memory.
pub fn stack_words() -> usize {
    let (end, start) = (ptr::addr_of!(_stack_end), ptr::addr_of!(_stack_start));
    start.addr().saturating_sub(end.addr()) / 4
}

/// Whether the word at this distance from the far end was never used, or was used for the value that the start-up code
/// fills the stack with. False beyond [`stack_words`].
#[inline]
pub fn stack_word_is_unused(word: usize) -> bool {
    #[expect(unsafe_code, reason = "no variable owns the unused part of the stack")]
    // SAFETY: the word is aligned and within the stack's memory, which exists and is only read here.
    let is_unused = || unsafe { ptr::addr_of!(_stack_end).add(word).read_volatile() } == STACK_PAINT_VALUE;
    word < stack_words() && is_unused()
}

/// The word `index` words above `address`; 0 outside of the stack's memory.
fn word_of_stack(address: u32, index: u32) -> u32 {
    let end = ptr::addr_of!(_stack_end);
    let offset = (address as usize).wrapping_sub(end.addr());
    let word = (offset / 4).saturating_add(index as usize);
    if !offset.is_multiple_of(4) || word >= stack_words() {
        return 0;
    }
    #[expect(unsafe_code, reason = "no variable owns the frame of an exception")]
    // SAFETY: the word is aligned and within the stack's memory, which exists and is only read here.
    unsafe {
        end.add(word).read_volatile()
    }
}
