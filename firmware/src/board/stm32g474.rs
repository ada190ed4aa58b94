//! STM32G474RE, as on a Nucleo-G474RE: bridge on timer 1, serial line of the debugger, vibrometer on a converter.
//!
//! This module has not run on silicon: `firmware/BRINGUP.md` says what to check, and in which order.
//!
//! | pin | what |
//! |---|---|
//! | PA8 | timer 1, channel 1: pulse width of the bridge, 200 kHz |
//! | PB0 | timer 1, channel 2N: enables the bridge; low after a reset by an external resistor |
//! | PA6 | timer 1, break input: low cuts the bridge off; pulled up |
//! | PA2, PA3 | LPUART1 to the host, 2,000,000 baud |
//! | PA0 | ADC1 channel 1: the vibrometer's output |
//!
//! A tick is two pulses and two samples, of one clock:
//!
//! ```text
//! pulses      |-----------.|-----------.|-----------.|-----------.|      . the converter is triggered
//! interrupts    ^                         ^                         ^     1 us after every other trigger
//! ```
//!
//! The instant of an interrupt is that of the trigger before it, and the sample of that instant has come by then. A new
//! width acts from the next pulse on.

mod clocks;
mod dma;
#[cfg(feature = "keep")]
mod flash;
mod vibrometer;

use link::{LINE_BAUD, ResetCause};
pub(super) use stm32g4::stm32g474 as pac;

pub use super::bridge::{Enable, Pulses, Width, drive_is_on, drive_off};
pub use super::line::Line;
use super::wait::answers;
pub use super::watchdog::Watchdog;
use super::{Parts, bridge};
pub(super) use dma::{RECEIVED, Receiver, SENT, Transmitter};
#[cfg(feature = "keep")]
pub use flash::Flash;
pub(super) use pac::LPUART1 as Uart;
pub use vibrometer::Vibrometer;

/// Frequency of the processor and of everything on its bus.
pub const CLOCK_HZ: u32 = 170_000_000;

/// Frequency of the timers' clock.
pub(super) const TIMER_HZ: u32 = CLOCK_HZ;

/// Periods of 8 ms for which the watchdog waits while the flash works, a second. A description takes two erasures of
/// 25 ms and 440 words of 90 us, and to forget one four erasures.
pub(super) const STORING_PERIODS: u16 = 125;

/// Clocks of the timer from a trigger of the converter to the next pulse, 294 ns: of the converter's clocks of 24 ns at
/// most 2.5 pass until it samples (data sheet, trigger latency), and 6.5 while it does.
pub(super) const TRIGGER_ADVANCE: u16 = 50;

/// Clocks of a bit times 256.
#[expect(clippy::cast_possible_truncation, reason = "21,760")]
pub(super) const BAUD_DIVIDER: u32 = (CLOCK_HZ as u64 * 256 / LINE_BAUD as u64) as u32;

impl Parts {
    /// The parts of the board, once; `None` if a clock or the converter does not start. The bridge's pin is set first,
    /// then clocks, devices, the other pins.
    pub fn take() -> Option<Self> {
        let device = pac::Peripherals::take()?;
        let rcc = &device.RCC;
        let reset_cause = reset_cause(rcc);
        rcc.ahb2enr().modify(|_, w| w.gpioben().set_bit());
        answers(rcc.ahb2enr().read());
        device.GPIOB.bsrr().write(|w| w.br0().set_bit());
        device.GPIOB.moder().modify(|_, w| w.moder0().output());
        clocks::start(&device)?;
        rcc.ahb1enr().modify(|_, w| w.dma1en().set_bit().dmamux1en().set_bit());
        rcc.ahb2enr().modify(|_, w| w.gpioaen().set_bit().adc12en().set_bit());
        rcc.apb2enr().modify(|_, w| w.tim1en().set_bit().syscfgen().set_bit());
        rcc.apb1enr2().modify(|_, w| w.lpuart1en().set_bit());
        answers(rcc.apb1enr2().read());
        // The break input before the timer looks at it.
        device.GPIOA.pupdr().modify(|_, w| w.pupdr6().pull_up());
        device.GPIOA.afrl().modify(|_, w| w.afrl2().af12().afrl3().af12().afrl6().af6());
        device.GPIOA.afrh().modify(|_, w| w.afrh8().af6());
        device.GPIOA.moder().modify(|_, w| {
            w.moder0().analog().moder2().alternate().moder3().alternate().moder6().alternate()
        });
        device.SYSCFG.cfgr2().modify(|_, w| w.cll().set_bit());
        device.DBGMCU.apb2_fz().modify(|_, w| w.dbg_tim1_stop().set_bit());
        let (width, enable, pulses) = bridge::start(device.TIM1, |w| w.cc1e().set_bit().cc2ne().set_bit());
        device.GPIOA.moder().modify(|_, w| w.moder8().alternate());
        device.GPIOB.afrl().modify(|_, w| w.afrl0().af6());
        device.GPIOB.moder().modify(|_, w| w.moder0().alternate());
        let (samples, receiver, transmitter) = dma::channels(&device.DMAMUX);
        Some(Self {
            width,
            enable,
            pulses,
            line: Line::start(device.LPUART1, receiver, transmitter)?,
            vibrometer: Vibrometer::start(&device.ADC1, &device.ADC12_COMMON, samples)?,
            #[cfg(feature = "keep")]
            flash: Flash::new(device.FLASH),
            watchdog: Watchdog::new(device.IWDG),
            reset_cause,
        })
    }
}

/// Why the board started (register `RCC_CSR` of RM0440). Its flags stay until they are cleared here. Any cause pulls
/// the pin as well, and so the pin comes last.
fn reset_cause(rcc: &pac::RCC) -> ResetCause {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    let causes = [
        (flags.iwdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set(), ResetCause::Watchdog),
        (flags.sftrstf().bit_is_set(), ResetCause::Software),
        (flags.lpwrrstf().bit_is_set() || flags.oblrstf().bit_is_set(), ResetCause::Other),
        (flags.borrstf().bit_is_set(), ResetCause::Power),
        (flags.pinrstf().bit_is_set(), ResetCause::Pin),
    ];
    causes.into_iter().find_map(|(is_set, cause)| is_set.then_some(cause)).unwrap_or_default()
}
