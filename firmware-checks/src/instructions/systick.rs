//! The timer of every Cortex-M, at the clock of the processor.

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

use super::InstructionTimer;

/// The value after 0: all 24 bits.
const RELOAD: u32 = 0x00ff_ffff;

/// The running timer.
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
    // Never inlined, so that every reading takes the same.
    #[inline(never)]
    fn ticks(&self) -> u32 {
        SYST::get_current()
    }

    #[inline(never)]
    fn delay_loop(&self, iterations: u32) {
        // `delay` makes one iteration more than its argument.
        cortex_m::asm::delay(iterations - 1);
    }
}
