//! The timer that every Cortex-M has, at the processor's clock.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

use super::InstructionTimer;

/// Ticks after which the timer starts again: all its 24 bits.
const RELOAD: u32 = 0x00ff_ffff;

/// The timer, running.
#[derive(Debug)]
pub struct SysTick(());

impl SysTick {
    /// Starts it.
    pub fn start(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        Self(())
    }
}

impl InstructionTimer for SysTick {
    // Never inlined, so that a reading costs the same wherever it stands.
    #[inline(never)]
    fn ticks(&self) -> u32 {
        SYST::get_current()
    }

    #[inline(never)]
    fn turn(&self, turns: u32) {
        // It makes one turn more than it is told.
        cortex_m::asm::delay(turns - 1);
    }
}
