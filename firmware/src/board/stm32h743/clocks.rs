//! The processor's clock: 480 MHz from the debugger's 8 MHz, `8 * 120 / 2`.
//!
//! The steps are those of ST's reference manual RM0433, with the bits of its registers:
//!
//! | step | register |
//! |---|---|
//! | the part is of revision V: an older one stops at 400 MHz | `DBGMCU_IDC`: `REV_ID` |
//! | the core's supply is the regulator, which is written once after power-on | `PWR_CR3`: `LDOEN`, `SCUEN` |
//! | the supply is at its level | `PWR_CSR1`: `ACTVOSRDY` |
//! | scale 1, and from there scale 0 | `PWR_D3CR`: `VOS`, `VOSRDY`, `SYSCFG_PWRCR`: `ODEN` |
//! | a clock comes from outside | `RCC_CR`: `HSEBYP`, `HSEON`, `HSERDY` |
//! | the PLL runs at 960 MHz, and half of it leaves | `RCC_PLLCKSELR`, `RCC_PLLCFGR`, `RCC_PLL1DIVR`, `RCC_CR` |
//! | four wait states of the flash, read back | `FLASH_ACR`: `LATENCY`, `WRHIGHFREQ` |
//! | buses at 240 MHz, slow devices at 120, timers at 240 | `RCC_D1CFGR`, `RCC_D2CFGR`, `RCC_D3CFGR` |
//! | the PLL is the clock | `RCC_CFGR`: `SW`, `SWS` |
//! | from now on a clock that stops cuts the bridge off, and ends the program | `RCC_CR`: `HSECSSON` |

#![expect(unsafe_code, reason = "registers whose description does not bound their values")]

use stm32h7::stm32h743v as pac;

use crate::board::wait::{answers, wait_until};

/// Longest start of the clock from outside.
const START_MICROS: u32 = 100_000;
/// Longest locking of the PLL.
const PLL_MICROS: u32 = 2000;
/// Longest change of the supply.
const SUPPLY_MICROS: u32 = 10_000;
/// Longest change of a multiplexer or of the wait states.
const SWITCH_MICROS: u32 = 1000;

/// The first revision that bears 480 MHz, in the order of ST's numbers.
const REVISION_V: u16 = 0x2003;

/// Scale 1 of the core's supply.
const SCALE_1: u8 = 0b11;
/// Wait states of the flash at 240 MHz in scale 0, and what its writing needs there.
const WAIT_STATES: u8 = 4;
const WRITING_DELAY: u8 = 0b10;
/// The PLL's multiplier.
const MULTIPLIER: u16 = 120;

/// Sets the clock to [`super::CLOCK_HZ`]; `None` if supply, clock, flash or PLL do not follow, or the part is too old.
pub(super) fn start(device: &pac::Peripherals) -> Option<()> {
    let rcc = &device.RCC;
    (device.DBGMCU.idc().read().rev_id().bits() >= REVISION_V).then_some(())?;
    raise_supply(device)?;
    rcc.cr().modify(|_, w| w.hsebyp().set_bit());
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    wait_until(START_MICROS, || rcc.cr().read().hserdy().bit_is_set())?;
    rcc.pllckselr().modify(|_, w| w.pllsrc().hse().divm1().set(1));
    rcc.pllcfgr().modify(|_, w| {
        w.pll1rge().range8().pll1vcosel().wide_vco().pll1fracen().clear_bit();
        w.divp1en().set_bit().divq1en().clear_bit().divr1en().clear_bit()
    });
    // SAFETY: 120 is within the multiplier's 4 to 512.
    rcc.pll1divr().modify(|_, w| unsafe { w.divn1().bits(MULTIPLIER - 1).divp1().div2() });
    rcc.cr().modify(|_, w| w.pll1on().set_bit());
    wait_until(PLL_MICROS, || rcc.cr().read().pll1rdy().bit_is_set())?;
    // SAFETY: both are among the register's values.
    device
        .FLASH
        .acr()
        .modify(|_, w| unsafe { w.latency().bits(WAIT_STATES).wrhighfreq().bits(WRITING_DELAY) });
    wait_until(SWITCH_MICROS, || device.FLASH.acr().read().latency().bits() == WAIT_STATES)?;
    rcc.d1cfgr().modify(|_, w| w.d1cpre().div1().hpre().div2().d1ppre().div2());
    rcc.d2cfgr().modify(|_, w| w.d2ppre1().div2().d2ppre2().div2());
    rcc.d3cfgr().modify(|_, w| w.d3ppre().div2());
    rcc.cfgr().modify(|_, w| w.sw().pll1());
    wait_until(SWITCH_MICROS, || rcc.cfgr().read().sws().is_pll1())?;
    rcc.cr().modify(|_, w| w.hsecsson().set_bit());
    Some(())
}

/// Raises the core's supply to scale 0, which 480 MHz needs.
fn raise_supply(device: &pac::Peripherals) -> Option<()> {
    let power = &device.PWR;
    power.cr3().modify(|_, w| w.scuen().set_bit().ldoen().set_bit().bypass().clear_bit());
    wait_until(SUPPLY_MICROS, || power.csr1().read().actvosrdy().bit_is_set())?;
    // SAFETY: a scale.
    power.d3cr().modify(|_, w| unsafe { w.vos().bits(SCALE_1) });
    wait_until(SUPPLY_MICROS, || power.d3cr().read().vosrdy().bit_is_set())?;
    device.RCC.apb4enr().modify(|_, w| w.syscfgen().set_bit());
    answers(device.RCC.apb4enr().read());
    device.SYSCFG.pwrcr().modify(|_, w| w.oden().set_bit());
    // The register is not written where its clock is off, and the supply is still ready, at scale 1.
    device.SYSCFG.pwrcr().read().oden().bit_is_set().then_some(())?;
    wait_until(SUPPLY_MICROS, || power.d3cr().read().vosrdy().bit_is_set())
}
