//! The vibrometer on ADC1, whose samples timer 1 triggers and the DMA puts into a ring.
//!
//! It starts in the order of RM0440:
//!
//! | step | section or register |
//! |---|---|
//! | the regulator | 21.4.6 |
//! | calibration | 21.4.8 |
//! | enabling | 21.4.9 |
//! | one channel, whose input is held 6.5 clocks after it was let in | `ADC_SQR1`, `ADC_SMPR1` |
//! | a conversion for every edge of timer 1's `TRGO2` | `ADC_CFGR`: `EXTSEL`, `EXTEN` |
//! | its result is moved, for ever; one that was not moved is overwritten | `ADC_CFGR`: `DMAEN`, `DMACFG`, `OVRMOD` |

use core::sync::atomic::{AtomicU16, Ordering};

use stm32g4::stm32g474 as pac;

use super::CLOCK_HZ;
use super::dma::Channel;
use crate::board::wait::wait_until;
use crate::ring::RingReader;
use crate::tasks::{Converter, SAMPLES_PER_TICK};

/// Four ticks: a converter that stands still is told from one that has gone round.
const RING: usize = 4 * SAMPLES_PER_TICK;

static CODES: [AtomicU16; RING] = [const { AtomicU16::new(0) }; RING];

/// The vibrometer's output, shifted to half the converter's range: 4 V of a Polytec's +-2 V over 4096 codes, at 0.1 m/s
/// per volt.
const VELOCITY_M_S_PER_CODE: f32 = 0.1 * 4.0 / 4096.0;
const CODE_MAX: u16 = 4095;

/// Longest calibration, which takes 116 clocks of the converter, and longest start: hundreds of times as long.
const START_MICROS: u32 = 1000;

/// The vibrometer. A sample takes 0.5 us from its trigger: 19 clocks, and up to three until the first.
#[derive(Debug)]
pub struct Vibrometer {
    channel: Channel<0>,
    samples: RingReader<RING>,
}

impl Vibrometer {
    /// Ready for triggers; `None` if the converter does not start.
    pub(super) fn start(
        converter: &pac::ADC1,
        common: &pac::ADC12_COMMON,
        channel: Channel<0>,
    ) -> Option<Self> {
        // The bus clock over four: 42.5 MHz.
        common.ccr().modify(|_, w| w.ckmode().sync_div4());
        converter.cr().modify(|_, w| w.deeppwd().clear_bit());
        converter.cr().modify(|_, w| w.advregen().set_bit());
        // The regulator takes 20 us.
        cortex_m::asm::delay(CLOCK_HZ / 50_000);
        converter.cr().modify(|_, w| w.adcal().set_bit());
        wait_until(START_MICROS, || converter.cr().read().adcal().bit_is_clear())?;
        // Enabling has no effect within four clocks of the converter after that, sixteen of the processor.
        cortex_m::asm::delay(32);
        converter.isr().write(|w| w.adrdy().clear_bit_by_one());
        converter.cr().modify(|_, w| w.aden().set_bit());
        wait_until(START_MICROS, || converter.isr().read().adrdy().bit_is_set())?;
        #[expect(unsafe_code, reason = "the register's description does not bound its values")]
        // SAFETY: one conversion, of channel 1, which exists.
        converter.sqr1().write(|w| unsafe { w.l().set(0).sq1().bits(1) });
        converter.smpr1().modify(|_, w| w.smp1().cycles6_5());
        channel.fill_with_half_words(&CODES, converter.dr().as_ptr());
        converter.cfgr().modify(|_, w| {
            w.extsel().tim1_trgo2().exten().rising_edge();
            w.dmaen().enabled().dmacfg().circular().ovrmod().overwrite()
        });
        converter.cr().modify(|_, w| w.adstart().set_bit());
        Some(Self { channel, samples: RingReader::new() })
    }
}

impl Converter for Vibrometer {
    #[inline]
    fn velocities_m_s(&mut self) -> [Option<f32>; SAMPLES_PER_TICK] {
        self.samples.newest_two(self.channel.left()).map(|place| {
            let code = CODES.get(place?)?.load(Ordering::Relaxed);
            // Either end of the range may stand for any value beyond it.
            let within = code > 0 && code < CODE_MAX;
            within.then(|| (f32::from(code) - 0.5 * f32::from(CODE_MAX)) * VELOCITY_M_S_PER_CODE)
        })
    }
}
