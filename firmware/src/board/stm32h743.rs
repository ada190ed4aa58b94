//! STM32H743ZI of revision V, as on a Nucleo-H743ZI2: bridge on timer 1, serial line of the debugger, vibrometer on a
//! converter.
//!
//! This module has not run on silicon: `firmware/BRINGUP.md` says what to check, and in which order.
//!
//! | pin | what |
//! |---|---|
//! | PE9 | timer 1, channel 1: pulse width of the bridge, 200 kHz |
//! | PE11 | timer 1, channel 2: enables the bridge; low after a reset by an external resistor |
//! | PA6 | timer 1, break input: low cuts the bridge off; pulled up |
//! | PD8, PD9 | USART3 to the host, 2,000,000 baud |
//! | PA3 | ADC1 channel 15: the vibrometer's output |
//!
//! Pulses, samples and interrupts lie as on an STM32G474 (`stm32g474.rs`).

mod caches;
mod clocks;
mod dma;
#[cfg(feature = "keep")]
mod flash;
mod vibrometer;

use link::{LINE_BAUD, ResetCause};
pub(super) use stm32h7::stm32h743v as pac;

pub use super::bridge::{Enable, Pulses, Width, drive_is_on, drive_off};
pub use super::line::Line;
use super::wait::answers;
pub use super::watchdog::Watchdog;
use super::{Parts, bridge};
pub(super) use dma::{RECEIVED, Receiver, SENT, Transmitter};
#[cfg(feature = "keep")]
pub use flash::Flash;
pub(super) use pac::USART3 as Uart;
pub use vibrometer::Vibrometer;

/// Frequency of the processor.
pub const CLOCK_HZ: u32 = 480_000_000;

/// Frequency of the timers' clock.
pub(super) const TIMER_HZ: u32 = CLOCK_HZ / 2;

/// Periods of 8 ms for which the watchdog waits while the flash works, 32 s: the most that its register holds. To
/// forget a description takes two erasures of 2.2 s at most.
pub(super) const STORING_PERIODS: u16 = 4095;

/// Clocks of the timer from a trigger of the converter to the next pulse, 375 ns: of the converter's clocks of 33 ns at
/// most 2.5 pass until it samples (data sheet, trigger latency), and 8.5 while it does.
pub(super) const TRIGGER_ADVANCE: u16 = 90;

/// Frequency of the clock of the serial lines and other slow devices.
const DEVICE_HZ: u32 = CLOCK_HZ / 4;

/// Clocks of a bit.
pub(super) const BAUD_DIVIDER: u16 = (DEVICE_HZ / LINE_BAUD) as u16;

impl Parts {
    /// The parts of the board, once; `None` if the supply, a clock or the converter does not start. The bridge's pin is
    /// set first, then clocks, devices, the other pins.
    pub fn take() -> Option<Self> {
        let device = pac::Peripherals::take()?;
        let rcc = &device.RCC;
        let reset_cause = reset_cause(rcc);
        rcc.ahb4enr().modify(|_, w| w.gpioeen().set_bit());
        answers(rcc.ahb4enr().read());
        device.GPIOE.bsrr().write(|w| w.br11().set_bit());
        device.GPIOE.moder().modify(|_, w| w.moder11().output());
        clocks::start(&device)?;
        rcc.ahb1enr().modify(|_, w| w.dma1en().set_bit().adc12en().set_bit());
        rcc.ahb2enr().modify(|_, w| w.sram1en().set_bit());
        rcc.ahb4enr().modify(|_, w| w.gpioaen().set_bit().gpioden().set_bit());
        rcc.apb1lenr().modify(|_, w| w.usart3en().set_bit());
        rcc.apb2enr().modify(|_, w| w.tim1en().set_bit());
        answers(rcc.apb2enr().read());
        caches::start();
        // The break input before the timer looks at it.
        device.GPIOA.pupdr().modify(|_, w| w.pupdr6().pull_up());
        device.GPIOA.afrl().modify(|_, w| w.afr6().af1());
        device.GPIOA.moder().modify(|_, w| w.moder3().analog().moder6().alternate());
        device.GPIOD.afrh().modify(|_, w| w.afr8().af7().afr9().af7());
        device.GPIOD.moder().modify(|_, w| w.moder8().alternate().moder9().alternate());
        cut_off_by_lockup();
        device.DBGMCU.apb2fz1().modify(|_, w| w.dbg_tim1().set_bit());
        let (width, enable, pulses) = bridge::start(device.TIM1, |w| w.cc1e().set_bit().cc2e().set_bit());
        device.GPIOE.afrh().modify(|_, w| w.afr9().af1().afr11().af1());
        device.GPIOE.moder().modify(|_, w| w.moder9().alternate().moder11().alternate());
        let (samples, receiver, transmitter) = dma::streams(&device.DMAMUX1);
        Some(Self {
            width,
            enable,
            pulses,
            line: Line::start(device.USART3, receiver, transmitter)?,
            vibrometer: Vibrometer::start(&device.ADC1, &device.ADC12_COMMON, samples)?,
            #[cfg(feature = "keep")]
            flash: Flash::new(device.FLASH),
            watchdog: Watchdog::new(device.IWDG),
            reset_cause,
        })
    }
}

/// A lockup of the processor cuts the bridge off until the next reset. Part and ST's `stm32h743xx.h` have the register
/// `SYSCFG_CFGR`; the register crate of this part leaves it out.
fn cut_off_by_lockup() {
    /// Offset of `SYSCFG_CFGR`.
    const CFGR: usize = 0x18;
    /// Its bit `CM7L`.
    const CM7L: u32 = 1 << 6;
    let register = pac::SYSCFG::PTR.cast::<u32>().wrapping_byte_add(CFGR).cast_mut();
    #[expect(unsafe_code, reason = "the register crate has no name for this register")]
    // SAFETY: a register of a device whose clock is on; its bits are set by a one, and nobody else writes it.
    unsafe {
        register.write_volatile(CM7L);
    }
}

/// Why the board started (register `RCC_RSR` of RM0433). Its flags stay until they are cleared here. Any cause pulls
/// the pin as well, and a loss of power sinks the supply first, so these come last.
fn reset_cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.rsr().read();
    rcc.rsr().modify(|_, w| w.rmvf().set_bit());
    let causes = [
        (flags.iwdg1rstf().bit_is_set() || flags.wwdg1rstf().bit_is_set(), ResetCause::Watchdog),
        (flags.sftrstf().bit_is_set(), ResetCause::Software),
        (flags.lpwrrstf().bit_is_set(), ResetCause::Other),
        (flags.porrstf().bit_is_set() || flags.borrstf().bit_is_set(), ResetCause::Power),
        (flags.pinrstf().bit_is_set(), ResetCause::Pin),
    ];
    causes.into_iter().find_map(|(is_set, cause)| is_set.then_some(cause)).unwrap_or_default()
}
