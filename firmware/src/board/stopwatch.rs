//! What the work of a tick is timed by.
//!
//! | board | clock | longest time |
//! |---|---|---|
//! | real | the cycle counter of the DWT (ARMv7-M manual, C1.8) | 2^32 cycles |
//! | emulated, which has no cycle counter | the timer of the ticks, which counts down | a tick |

#[cfg(not(feature = "silicon"))]
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::{DCB, DWT};

/// An instant, in clocks of the processor.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    begun: u32,
}

impl Stopwatch {
    /// Switches the cycle counter on, where there is one.
    pub fn enable(trace: &mut DCB, watchpoints: &mut DWT) {
        trace.enable_trace();
        DWT::unlock();
        watchpoints.enable_cycle_counter();
    }

    /// From now on.
    #[inline]
    pub fn start() -> Self {
        Self { begun: now() }
    }

    /// Clocks since the start.
    #[inline]
    pub fn clocks(self) -> u32 {
        since(self.begun)
    }
}

#[cfg(feature = "silicon")]
fn now() -> u32 {
    DWT::cycle_count()
}

#[cfg(feature = "silicon")]
fn since(begun: u32) -> u32 {
    now().wrapping_sub(begun)
}

#[cfg(not(feature = "silicon"))]
fn now() -> u32 {
    SYST::get_current()
}

#[cfg(not(feature = "silicon"))]
fn since(begun: u32) -> u32 {
    (begun + SYST::get_reload() + 1).wrapping_sub(now()) % (SYST::get_reload() + 1)
}
