//! The bridge of real boards: pulses and enabling pin are outputs of timer 1, which the break input cuts off by itself.
//!
//! | step | register of RM0440 and RM0433, chapter of the advanced-control timers |
//! |---|---|
//! | a pulse takes 5 us, two a tick; its width changes between two pulses | `TIMx_ARR`, `TIMx_CCMR1`: `OC1M`, `OC1PE` |
//! | the enabling pin is channel 2, forced to either level | `TIMx_CCMR1`: `OC2M` |
//! | channel 3 has no pin: it triggers the converter, once a pulse | `TIMx_CCMR2`: `OC3M`, `TIMx_CR2`: `MMS2` |
//! | cut off, both pins are low | `TIMx_CR2`: `OIS1`, `OIS2` or `OIS2N`, `TIMx_BDTR`: `OSSI` |
//! | a low break input cuts; the program reconnects | `TIMx_AF1`: `BKINE`, `TIMx_BDTR`: `BKE`, `BKP`, `BKF`, `AOE` |
//!
//! More cuts off, which each part's own file sets:
//!
//! | what | register of RM0440 | register of RM0433 |
//! |---|---|---|
//! | a clock from outside that stops | `RCC_CR`: `CSSON` | `RCC_CR`: `HSECSSON` |
//! | a halt in the debugger, which stops the timer | `DBGMCU_APB2FZR`: `DBG_TIM1_STOP` | `DBGMCU_APB2FZ1`: `DBG_TIM1` |
//! | a lockup of the processor | `SYSCFG_CFGR2`: `CLL` | `SYSCFG_CFGR`: `CM7L` |
//!
//! The break input is for an over-current output that is low in a fault and has an open drain, as the fault output of
//! TI's DRV8412. The pull-up of the pin is on: with nothing at the pin nothing is cut off.

#![expect(unsafe_code, reason = "two owners share the timer, and a fault handler owns nothing")]
#![allow(clippy::useless_conversion, reason = "registers have 16 or 32 bits, by the part")]

use core::convert::Infallible;

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};

use super::hardware::{TIMER_HZ, TRIGGER_ADVANCE, pac};
use crate::amplifier::Cutoff;

/// Clocks of the timer in a pulse of 5 us; the largest pulse width is as long, and the smallest is 0.
const PULSE: u16 = (TIMER_HZ / 200_000) as u16;

/// Where in a pulse the converter is triggered. It holds its input before the next pulse begins; the present pulse has
/// ended, unless it is wider than 0.94 (G474) or 0.92 (H743) of the whole.
const SAMPLE: u16 = PULSE - TRIGGER_ADVANCE;

/// The filter of the break input: eight samples at [`TIMER_HZ`], 50 ns at most.
const FILTER: u8 = 0b0011;

/// The trigger of the converter: output of channel 3, whether or not the bridge is cut off.
const TRIGGER_BY_CHANNEL_3: u8 = 0b0110;

/// The timer, for somebody who does not own it.
fn timer() -> pac::TIM1 {
    // SAFETY: every use below writes what no other owner writes, or cuts the bridge off.
    unsafe { pac::TIM1::steal() }
}

/// The break input as it is used, and the bridge cut off.
fn cut_off(w: &mut pac::tim1::bdtr::W) -> &mut pac::tim1::bdtr::W {
    // SAFETY: the filter has sixteen values.
    unsafe { w.bkf().bits(FILTER) };
    w.ossi().idle_level().bke().enabled().bkp().active_low().aoe().manual().moe().disabled_idle()
}

/// Switches the bridge off by one store to the timer, so that it is safe at any time.
#[inline]
pub fn drive_off() {
    timer().bdtr().write(cut_off);
}

/// Whether the bridge is on.
pub fn drive_is_on() -> bool {
    let timer = timer();
    timer.bdtr().read().moe().is_enabled() && timer.ccmr1_output().read().oc2m().is_force_active()
}

/// Pulse width and enabling pin, both low: the timer stands, and the bridge is cut off until [`Pulses::start`]. The
/// pins become the timer's after this. `connect` enables the outputs of channels 1 and 2 that have the pins.
pub(super) fn start(
    timer: pac::TIM1,
    connect: impl FnOnce(&mut pac::tim1::ccer::W) -> &mut pac::tim1::ccer::W,
) -> (Width, Enable, Pulses) {
    timer.arr().write(|w| w.arr().set((PULSE - 1).into()));
    timer.ccr1().write(|w| w.ccr().set((PULSE / 2).into()));
    timer.ccr3().write(|w| w.ccr().set(SAMPLE.into()));
    timer.ccmr1_output().write(|w| w.oc1m().pwm_mode1().oc1pe().set_bit().oc2m().force_inactive());
    timer.ccmr2_output().write(|w| w.oc3m().pwm_mode2());
    timer.ccer().write(connect);
    // The levels at rest, `OIS`, are those after a reset: low.
    // SAFETY: one of the register's sixteen triggers.
    timer.cr2().write(|w| unsafe { w.mms2().bits(TRIGGER_BY_CHANNEL_3) });
    timer.cr1().write(|w| w.arpe().set_bit());
    // What is preloaded acts from now on.
    timer.egr().write(|w| w.ug().set_bit());
    timer.af1().modify(|_, w| w.bkine().set_bit().bkinp().clear_bit());
    timer.bdtr().write(cut_off);
    (Width(timer), Enable(()), Pulses(()))
}

/// While the break input is low, the hardware refuses it.
fn reconnect(timer: &pac::TIM1) {
    timer.sr().write(|w| w.bif().clear().sbif().clear());
    timer.bdtr().modify(|_, w| w.moe().enabled());
}

/// The pulses, which do not run yet.
#[derive(Debug)]
pub struct Pulses(());

impl Pulses {
    /// Clocks from a trigger of the converter to the interrupt whose sample it is: 1 us.
    const LEAD: u16 = (TIMER_HZ / 1_000_000) as u16;

    /// Starts pulses and samples, a whole number of ticks before an interrupt of the timer.
    pub fn start(self) {
        let timer = timer();
        timer.cnt().write(|w| w.cnt().set(SAMPLE + Self::LEAD - PULSE));
        timer.cr1().modify(|_, w| w.cen().set_bit());
        reconnect(&timer);
    }
}

/// The bridge's enabling pin.
#[derive(Debug)]
pub struct Enable(());

impl digital::ErrorType for Enable {
    type Error = Infallible;
}

impl OutputPin for Enable {
    fn set_low(&mut self) -> Result<(), Infallible> {
        timer().ccmr1_output().modify(|_, w| w.oc2m().force_inactive());
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        timer().ccmr1_output().modify(|_, w| w.oc2m().force_active());
        Ok(())
    }
}

/// The pulse width.
#[derive(Debug)]
pub struct Width(pac::TIM1);

impl pwm::ErrorType for Width {
    type Error = Infallible;
}

impl SetDutyCycle for Width {
    fn max_duty_cycle(&self) -> u16 {
        PULSE
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.ccr1().write(|w| w.ccr().set(duty.into()));
        Ok(())
    }
}

impl Cutoff for Width {
    /// Every cause clears `MOE`; the break flag `BIF` alone would miss a lockup and a crystal that has stopped.
    #[inline]
    fn is_cut(&self) -> bool {
        self.0.bdtr().read().moe().is_disabled_idle()
    }

    fn reconnect(&mut self) {
        reconnect(&self.0);
    }
}
