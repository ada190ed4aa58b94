//! The vibrometer on ADC1, whose samples timer 1 triggers and the DMA puts into a ring.
//!
//! It starts in the order of RM0433, with the bits of its registers:
//!
//! | step | register |
//! |---|---|
//! | a quarter of the bus clock, half of that in revision V: 30 MHz | `ADC12_CCR`: `CKMODE`, `ADC_CR`: `BOOST` |
//! | the regulator | `ADC_CR`: `DEEPPWD`, `ADVREGEN`, `ADC_ISR`: bit 12, `LDORDY` |
//! | calibration of offset and linearity | `ADC_CR`: `ADCALLIN`, `ADCAL` |
//! | enabling | `ADC_ISR`: `ADRDY`, `ADC_CR`: `ADEN` |
//! | one channel, whose input is held 8.5 clocks after it was let in | `ADC_PCSEL`, `ADC_SQR1`, `ADC_SMPR2` |
//! | a conversion for every edge of timer 1's `TRGO2` | `ADC_CFGR`: `EXTSEL`, `EXTEN` |
//! | its result is moved, for ever; one that was not moved is overwritten | `ADC_CFGR`: `DMNGT`, `OVRMOD` |

use core::sync::atomic::{AtomicU16, Ordering};

use stm32h7::stm32h743v as pac;

use super::CLOCK_HZ;
use super::dma::Stream;
use crate::board::wait::wait_until;
use crate::ring::RingReader;
use crate::tasks::{Converter, SAMPLES_PER_TICK};

/// Four ticks: a converter that stands still is told from one that has gone round.
const RING: usize = 4 * SAMPLES_PER_TICK;

#[expect(unsafe_code, reason = "the DMA reaches one section, which memory.x places")]
// SAFETY: what the section has at the start is a value of the type.
#[unsafe(link_section = ".dma")]
static CODES: [AtomicU16; RING] = [const { AtomicU16::new(0) }; RING];

/// The channel of the vibrometer.
const CHANNEL: u8 = 15;

/// The vibrometer's output, shifted to half the converter's range: 4 V of a Polytec's +-2 V over 65,536 codes, at 0.1
/// m/s per volt.
const VELOCITY_M_S_PER_CODE: f32 = 0.1 * 4.0 / 65_536.0;
const CODE_MAX: u16 = u16::MAX;

/// The regulator is ready: a bit that the register's description lacks.
const REGULATOR_IS_READY: u32 = 1 << 12;

/// Longest calibration: ten times the 165,000 clocks of the converter.
const CALIBRATION_MICROS: u32 = 55_000;
/// Longest start.
const START_MICROS: u32 = 1000;

/// The vibrometer. A sample takes 0.6 us from its trigger: 17 clocks, and some until the first.
#[derive(Debug)]
pub struct Vibrometer {
    stream: Stream<0>,
    samples: RingReader<RING>,
}

impl Vibrometer {
    /// Ready for triggers; `None` if the converter does not start.
    pub(super) fn start(
        converter: &pac::ADC1,
        common: &pac::ADC12_COMMON,
        stream: Stream<0>,
    ) -> Option<Self> {
        common.ccr().modify(|_, w| w.ckmode().sync_div4());
        converter.cr().modify(|_, w| w.deeppwd().clear_bit());
        converter.cr().modify(|_, w| w.advregen().set_bit().boost().lt50());
        // The regulator takes 10 us.
        cortex_m::asm::delay(CLOCK_HZ / 100_000);
        wait_until(START_MICROS, || converter.isr().read().bits() & REGULATOR_IS_READY != 0)?;
        converter.cr().modify(|_, w| w.adcaldif().clear_bit().adcallin().set_bit());
        converter.cr().modify(|_, w| w.adcal().set_bit());
        wait_until(CALIBRATION_MICROS, || converter.cr().read().adcal().bit_is_clear())?;
        // Enabling has no effect within four clocks of the converter after that, 64 of the processor.
        cortex_m::asm::delay(128);
        converter.isr().write(|w| w.adrdy().clear());
        converter.cr().modify(|_, w| w.aden().set_bit());
        wait_until(START_MICROS, || converter.isr().read().adrdy().bit_is_set())?;
        #[expect(unsafe_code, reason = "the registers' description does not bound their values")]
        // SAFETY: one conversion, of a channel that exists.
        unsafe {
            converter.pcsel().write(|w| w.pcsel().bits(1 << CHANNEL));
            converter.sqr1().write(|w| w.l().set(0).sq1().bits(CHANNEL));
        }
        converter.smpr2().modify(|_, w| w.smp15().cycles8_5());
        stream.fill_with_half_words(&CODES, converter.dr().as_ptr())?;
        converter.cfgr().modify(|_, w| {
            w.extsel().tim1_trgo2().exten().rising_edge();
            w.dmngt().dma_circular().ovrmod().overwrite()
        });
        converter.cr().modify(|_, w| w.adstart().set_bit());
        Some(Self { stream, samples: RingReader::new() })
    }
}

impl Converter for Vibrometer {
    #[inline]
    fn velocities_m_s(&mut self) -> [Option<f32>; SAMPLES_PER_TICK] {
        self.samples.newest_two(self.stream.left()).map(|place| {
            let code = CODES.get(place?)?.load(Ordering::Relaxed);
            // Either end of the range may stand for any value beyond it.
            let within = code > 0 && code < CODE_MAX;
            within.then(|| (f32::from(code) - 0.5 * f32::from(CODE_MAX)) * VELOCITY_M_S_PER_CODE)
        })
    }
}
