//! The board: the only module that accesses registers.
//!
//! - `mps2`: the emulated board, QEMU's mps2-an386 or mps2-an500: enabling pin, pulse width, serial line, watchdog.
//! - `stm32g474`, behind the feature of its name: the same of a real board.
//! - `hardware`: the one of the two that the program is built for.
//! - `faults`: handlers of panics and faults, for every program. They switch the drive off, print the reason, and end.
//! - [`stack_bytes_max`]: the most bytes that the stack has taken.

mod faults;
#[cfg(not(feature = "stm32g474"))]
pub mod mps2;
#[cfg(feature = "stm32g474")]
pub mod stm32g474;

use core::ptr;

pub use faults::end;
#[cfg(not(feature = "stm32g474"))]
pub use mps2 as hardware;
#[cfg(feature = "stm32g474")]
pub use stm32g474 as hardware;

use hardware::{Enable, Line, Vibrometer, Watchdog, Width};

/// Everything of the board that the program uses.
#[derive(Debug)]
pub struct Parts {
    /// The pulse width.
    pub width: Width,
    /// The bridge's enabling pin.
    pub enable: Enable,
    /// The serial line.
    pub line: Line,
    /// The vibrometer.
    pub vibrometer: Vibrometer,
    /// The watchdog, not yet started.
    pub watchdog: Watchdog,
}

#[expect(unsafe_code, reason = "the linker script names the ends of the stack")]
// SAFETY: both are symbols of the linker script, whatever their type; only their addresses are used.
unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// The most bytes that the stack has taken so far.
///
/// The start-up code fills the stack with one value. A word that still has this value was never used.
pub fn stack_bytes_max() -> u32 {
    let (end, start) = (ptr::addr_of!(_stack_end), ptr::addr_of!(_stack_start));
    let mut word = end;
    #[expect(unsafe_code, reason = "no variable owns the unused part of the stack")]
    // SAFETY: `word` is aligned and within the stack's memory, which exists and is only read here.
    while word < start && unsafe { word.read_volatile() } == cortex_m_rt::STACK_PAINT_VALUE {
        word = word.wrapping_add(1);
    }
    4 * u32::try_from(start.addr().saturating_sub(word.addr()) / 4).unwrap_or(u32::MAX)
}
