//! The processor's clock: 170 MHz from the crystal of 24 MHz, `24 / 6 * 85 / 2`.
//!
//! The crystal's frequency is the drive's: 50 ppm of 6.3 kHz are 0.3 Hz, where the internal oscillator's 1 % are 63 Hz,
//! more than the width of the resonance.
//!
//! The steps are those of ST's reference manual RM0440, in its order:
//!
//! | step | section or register |
//! |---|---|
//! | the crystal runs | 7.2.1, HSE clock |
//! | the AHB bus at half the clock, before the core's supply is raised | 6.1.5, range 1 boost mode |
//! | boost mode: without it the limit of the core is 150 MHz | 6.1.5 |
//! | four wait states of the flash, read back | 3.3.3, read access latency |
//! | the PLL runs, and is the clock | 7.2.4, PLL |
//! | after 1 us the AHB bus at the whole clock | 6.1.5 |
//! | from now on a crystal that stops cuts the bridge off, and ends the program | `RCC_CR`: `CSSON` |

use stm32g4::stm32g474 as pac;

use super::CLOCK_HZ;
use crate::board::wait::{answers, wait_until};

/// Longest start of a crystal: ST's own drivers wait as long.
const CRYSTAL_MICROS: u32 = 100_000;
/// Longest locking of the PLL: fifty times the data sheet's 40 us.
const PLL_MICROS: u32 = 2000;
/// Longest change of a multiplexer or of the wait states.
const SWITCH_MICROS: u32 = 1000;

/// Wait states of the flash at [`CLOCK_HZ`] in boost mode.
const WAIT_STATES: u8 = 4;

/// Sets the clock to [`CLOCK_HZ`]; `None` if crystal, flash or PLL do not follow.
pub(super) fn start(device: &pac::Peripherals) -> Option<()> {
    let rcc = &device.RCC;
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    wait_until(CRYSTAL_MICROS, || rcc.cr().read().hserdy().bit_is_set())?;
    rcc.cfgr().modify(|_, w| w.hpre().div2());
    rcc.apb1enr1().modify(|_, w| w.pwren().set_bit());
    answers(rcc.apb1enr1().read());
    device.PWR.cr5().modify(|_, w| w.r1mode().clear_bit());
    #[expect(unsafe_code, reason = "the register's description does not bound its values")]
    // SAFETY: four wait states are among the register's values.
    device.FLASH.acr().modify(|_, w| unsafe { w.latency().bits(WAIT_STATES) });
    wait_until(SWITCH_MICROS, || device.FLASH.acr().read().latency().bits() == WAIT_STATES)?;
    #[expect(unsafe_code, reason = "the register's description does not bound its values")]
    // SAFETY: 85 is within the multiplier's 8 to 127, and 5 divides by 6.
    rcc.pllcfgr().write(|w| unsafe {
        w.pllsrc().hse().pllm().bits(5).plln().bits(85).pllr().bits(0).pllren().set_bit()
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    wait_until(PLL_MICROS, || rcc.cr().read().pllrdy().bit_is_set())?;
    rcc.cfgr().modify(|_, w| w.sw().pll());
    wait_until(SWITCH_MICROS, || rcc.cfgr().read().sws().is_pll())?;
    cortex_m::asm::delay(CLOCK_HZ / 1_000_000);
    rcc.cfgr().modify(|_, w| w.hpre().div1());
    rcc.cr().modify(|_, w| w.csson().set_bit());
    Some(())
}
