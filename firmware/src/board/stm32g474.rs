//! STM32G474RE, as on a Nucleo-G474RE: bridge on timer 1, serial line of the debugger, vibrometer on a converter.
//!
//! This module has not run on silicon: `firmware/BRINGUP.md` says what to check, and in which order.
//!
//! | pin | what |
//! |---|---|
//! | PA8 | TIM1 channel 1: pulse width of the bridge, 170 kHz |
//! | PB0 | enables the bridge; low after a reset by an external resistor |
//! | PA2, PA3 | LPUART1 to the host, 2,000,000 baud |
//! | PA0 | ADC1 channel 1: the vibrometer's output |

mod clocks;
mod flash;
mod wait;

use core::convert::Infallible;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};
use stm32g4::stm32g474 as pac;

use link::{LINE_BAUD, ResetCause};

use super::Parts;
use crate::amplifier::Cutoff;
use crate::tasks::Converter;
pub use flash::Flash;
use wait::wait_until;

/// Frequency of the processor and of everything on its bus.
pub const CLOCK_HZ: u32 = 170_000_000;

/// Largest pulse width; the smallest is 0.
const WIDTH_MAX: u16 = 1000;

/// The vibrometer's output, shifted to half the converter's range: 4 V of a Polytec's +-2 V over 4096 codes, at 0.1 m/s
/// per volt.
const VELOCITY_M_S_PER_CODE: f32 = 0.1 * 4.0 / 4096.0;
const CODE_MAX: u16 = 4095;

/// Switches the bridge off by one store to the pin's reset register, so that it is safe at any time.
#[inline]
pub fn drive_off() {
    #[expect(unsafe_code, reason = "the port belongs to `Enable`, which a fault handler cannot reach")]
    // SAFETY: the one store that follows clears a pin and changes nothing else, so no owner of the port is disturbed.
    let port = unsafe { pac::GPIOB::steal() };
    port.bsrr().write(|w| w.br0().set_bit());
}

/// Whether the bridge is on.
pub fn drive_is_on() -> bool {
    #[expect(unsafe_code, reason = "the port belongs to `Enable`, which a fault handler cannot reach")]
    // SAFETY: a reading without effect.
    let port = unsafe { pac::GPIOB::steal() };
    port.odr().read().odr0().bit_is_set()
}

impl Parts {
    /// The parts of the board, once; `None` if a clock or the converter does not start. The bridge's pin is set first,
    /// then clocks, the other pins, devices.
    pub fn take() -> Option<Self> {
        let device = pac::Peripherals::take()?;
        let rcc = &device.RCC;
        let reset_cause = reset_cause(rcc);
        rcc.ahb2enr().modify(|_, w| w.gpioben().set_bit());
        device.GPIOB.bsrr().write(|w| w.br0().set_bit());
        device.GPIOB.moder().modify(|_, w| w.moder0().output());
        clocks::start(&device)?;
        rcc.ahb2enr().modify(|_, w| w.gpioaen().set_bit().adc12en().set_bit());
        rcc.apb2enr().modify(|_, w| w.tim1en().set_bit());
        rcc.apb1enr2().modify(|_, w| w.lpuart1en().set_bit());
        device.GPIOA.afrh().modify(|_, w| w.afrh8().af6());
        device.GPIOA.afrl().modify(|_, w| w.afrl2().af12().afrl3().af12());
        device.GPIOA.moder().modify(|_, w| {
            w.moder0().analog().moder2().alternate().moder3().alternate().moder8().alternate()
        });
        Some(Self {
            width: Width::start(device.TIM1),
            enable: Enable(device.GPIOB),
            line: Line::start(device.LPUART1),
            vibrometer: Vibrometer::start(device.ADC1, &device.ADC12_COMMON)?,
            flash: Flash::new(device.FLASH),
            watchdog: Watchdog(device.IWDG),
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

/// The bridge's enabling pin.
#[derive(Debug)]
pub struct Enable(pac::GPIOB);

impl digital::ErrorType for Enable {
    type Error = Infallible;
}

impl OutputPin for Enable {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.bsrr().write(|w| w.br0().set_bit());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.bsrr().write(|w| w.bs0().set_bit());
        Ok(())
    }
}

/// The pulse width.
#[derive(Debug)]
pub struct Width(pac::TIM1);

impl Width {
    fn start(timer: pac::TIM1) -> Self {
        timer.arr().write(|w| w.arr().set(WIDTH_MAX.into()));
        timer.ccr1().write(|w| w.ccr().set(u32::from(WIDTH_MAX / 2)));
        // Preloaded, so that a width changes between two pulses.
        timer.ccmr1_output().modify(|_, w| w.oc1m().pwm_mode1().oc1pe().set_bit());
        timer.ccer().modify(|_, w| w.cc1e().set_bit());
        timer.bdtr().modify(|_, w| w.moe().set_bit());
        timer.cr1().modify(|_, w| w.arpe().set_bit().cen().set_bit());
        Self(timer)
    }
}

impl pwm::ErrorType for Width {
    type Error = Infallible;
}

impl SetDutyCycle for Width {
    fn max_duty_cycle(&self) -> u16 {
        WIDTH_MAX
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.ccr1().write(|w| w.ccr().set(duty.into()));
        Ok(())
    }
}

impl Cutoff for Width {
    #[inline]
    fn is_cut(&self) -> bool {
        self.0.bdtr().read().moe().is_disabled_idle()
    }

    fn reconnect(&mut self) {
        self.0.bdtr().modify(|_, w| w.moe().set_bit());
    }
}

/// The serial line to the host.
#[derive(Debug)]
pub struct Line(pac::LPUART1);

impl Line {
    fn start(uart: pac::LPUART1) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "21,760")]
        const DIVIDER: u32 = (CLOCK_HZ as u64 * 256 / LINE_BAUD as u64) as u32;
        uart.brr().write(|w| w.brr().set(DIVIDER));
        uart.cr1().write(|w| w.fifoen().set_bit().te().set_bit().re().set_bit().ue().set_bit());
        Self(uart)
    }

    /// A byte, if one was received.
    pub fn read(&mut self) -> Option<u8> {
        let status = self.0.isr().read();
        if status.ore().bit_is_set() {
            self.0.icr().write(|w| w.orecf().clear_bit_by_one());
        }
        #[expect(clippy::cast_possible_truncation, reason = "eight bits")]
        status.rxne().bit_is_set().then(|| self.0.rdr().read().rdr().bits() as u8)
    }

    /// Writes a byte without waiting; whether there was room for it.
    pub fn write(&mut self, byte: u8) -> bool {
        let free = self.0.isr().read().txe().bit_is_set();
        if free {
            self.0.tdr().write(|w| w.tdr().set(byte.into()));
        }
        free
    }
}

/// The vibrometer on a converter that runs continuously. It starts in the order of RM0440, sections 21.4.6 (regulator),
/// 21.4.8 (calibration) and 21.4.9 (enabling).
#[derive(Debug)]
pub struct Vibrometer(pac::ADC1);

impl Vibrometer {
    /// Longest calibration, which takes 116 clocks of the converter, and longest start: hundreds of times as long.
    const START_MICROS: u32 = 1000;

    fn start(converter: pac::ADC1, common: &pac::ADC12_COMMON) -> Option<Self> {
        // The bus clock over four: 42.5 MHz.
        common.ccr().modify(|_, w| w.ckmode().sync_div4());
        converter.cr().modify(|_, w| w.deeppwd().clear_bit());
        converter.cr().modify(|_, w| w.advregen().set_bit());
        // The regulator takes 20 us.
        cortex_m::asm::delay(CLOCK_HZ / 50_000);
        converter.cr().modify(|_, w| w.adcal().set_bit());
        wait_until(Self::START_MICROS, || converter.cr().read().adcal().bit_is_clear())?;
        // Enabling has no effect within four clocks of the converter after that, sixteen of the processor.
        cortex_m::asm::delay(32);
        converter.isr().write(|w| w.adrdy().clear_bit_by_one());
        converter.cr().modify(|_, w| w.aden().set_bit());
        wait_until(Self::START_MICROS, || converter.isr().read().adrdy().bit_is_set())?;
        #[expect(unsafe_code, reason = "the register's description does not bound its values")]
        // SAFETY: one conversion, of channel 1, which exists.
        converter.sqr1().write(|w| unsafe { w.l().bits(0).sq1().bits(1) });
        converter.cfgr().modify(|_, w| w.cont().set_bit().ovrmod().set_bit());
        converter.cr().modify(|_, w| w.adstart().set_bit());
        Some(Self(converter))
    }
}

impl Converter for Vibrometer {
    fn velocity_m_s(&mut self) -> Option<f32> {
        let code = self.0.dr().read().rdata().bits();
        // Either end of the range may stand for any value beyond it.
        let within = code > 0 && code < CODE_MAX;
        within.then(|| (f32::from(code) - 0.5 * f32::from(CODE_MAX)) * VELOCITY_M_S_PER_CODE)
    }
}

/// Restarts the board when it is not fed for 10 ms, longer than construction of a filter. It cannot be stopped.
#[derive(Debug)]
pub struct Watchdog(pac::IWDG);

impl Watchdog {
    /// Periods of 32 kHz / 4 in 10 ms.
    const PERIODS: u16 = 80;
    /// The most that the register holds: half a second. A description takes two erasures of 25 ms and 440 words of 90
    /// us, and to forget one four erasures.
    const STORING_PERIODS: u16 = 4095;
    /// Longest time until a new period is taken: ten of the clock's.
    const CHANGE_MICROS: u32 = 1000;

    /// Starts it. From now on it must be fed.
    pub fn start(&mut self) {
        self.0.kr().write(|w| w.key().start());
        self.0.kr().write(|w| w.key().unlock());
        self.0.pr().write(|w| w.pr().divide_by4());
        self.wait_for(Self::PERIODS);
    }

    /// Restarts the count.
    #[inline]
    pub fn feed(&mut self) {
        self.0.kr().write(|w| w.key().feed());
    }

    /// Does `work` of the store, for which the watchdog waits half a second: the flash may hold the processor.
    pub fn while_storing<T>(&mut self, work: impl FnOnce() -> T) -> T {
        self.wait_for(Self::STORING_PERIODS);
        let done = work();
        self.wait_for(Self::PERIODS);
        done
    }

    /// From now on it waits for so many periods of its clock. A count takes the new number once the register's update
    /// is over (`IWDG_SR` of RM0440).
    fn wait_for(&mut self, periods: u16) {
        self.0.kr().write(|w| w.key().unlock());
        self.0.rlr().write(|w| w.rl().set(periods));
        let _ = wait_until(Self::CHANGE_MICROS, || self.0.sr().read().rvu().bit_is_clear());
        self.feed();
    }
}
