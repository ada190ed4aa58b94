//! Streams of DMA 1: which device each serves, and how it moves data.
//!
//! | step | register of RM0433, chapters of DMAMUX and DMA |
//! |---|---|
//! | a stream gets the requests of its device | `DMAMUX1_CxCR`: `DMAREQ_ID` |
//! | it goes from a register into a ring, for ever | `DMA_SxCR`: `CIRC`, `MINC`, `DIR` = 0 |
//! | or from memory into a register, once, after its flags are cleared | `DMA_SxCR`: `DIR` = 1, `DMA_LIFCR` |
//! | the line's streams may buffer: without it they stop (erratum of the STM32H743) | `DMA_SxCR`: `TRBUFF` |
//! | how many transfers are left | `DMA_SxNDTR` |

#![expect(unsafe_code, reason = "a stream takes an address, and three owners share the device")]

use core::sync::atomic::{AtomicU8, AtomicU16, Ordering};

use cortex_m::asm;
use stm32h7::stm32h743v as pac;

use crate::board::line::{RECEIVED_BYTES, SENT_BYTES};
use crate::board::wait::wait_until;

/// Requests of the devices.
const ADC1: u8 = 9;
const USART3_RX: u8 = 45;
const USART3_TX: u8 = 46;

/// Longest end of a stream that is switched off.
const STOP_MICROS: u32 = 100;

/// Every flag of a stream, and where those of streams 0 to 3 begin in their register.
const FLAGS: u32 = 0b11_1101;
const FLAGS_BEGIN: [u32; 4] = [0, 6, 16, 22];

/// What the line receives, where the DMA reaches it: `memory.x` places the section.
// SAFETY: what the section has at the start is a value of the type.
#[unsafe(link_section = ".dma")]
pub static RECEIVED: [AtomicU8; RECEIVED_BYTES] = [const { AtomicU8::new(0) }; RECEIVED_BYTES];
/// What the line sends.
// SAFETY: as above.
#[unsafe(link_section = ".dma")]
pub static SENT: [AtomicU8; SENT_BYTES] = [const { AtomicU8::new(0) }; SENT_BYTES];

/// The stream of the line's receiver.
pub type Receiver = Stream<1>;
/// The stream of its transmitter.
pub type Transmitter = Stream<2>;

/// A stream, 0 to 3.
#[derive(Debug)]
pub struct Stream<const INDEX: usize>(pac::DMA1);

/// The streams of converter, receiver and transmitter.
pub(super) fn streams(mux: &pac::DMAMUX1) -> (Stream<0>, Receiver, Transmitter) {
    for (index, request) in [ADC1, USART3_RX, USART3_TX].into_iter().enumerate() {
        // SAFETY: a device's request.
        mux.ccr(index).write(|w| unsafe { w.dmareq_id().bits(request) });
    }
    // SAFETY: each owner uses the registers of its own stream.
    let dma = || unsafe { pac::DMA1::steal() };
    (Stream(dma()), Stream(dma()), Stream(dma()))
}

/// The address of a register or a variable, as the device takes it.
fn address<T>(of: *const T) -> u32 {
    u32::try_from(of.expose_provenance()).unwrap_or_default()
}

impl<const INDEX: usize> Stream<INDEX> {
    /// From now on bytes from `register` go into `ring`; `None` if the stream does not end what it did.
    pub fn fill_with_bytes<R>(&self, ring: &'static [AtomicU8], register: *const R) -> Option<()> {
        for place in ring {
            place.store(0, Ordering::Relaxed);
        }
        let stream = self.prepare(address(ring.as_ptr()), ring.len(), address(register))?;
        stream.cr().write(|w| w.circ().enabled().minc().incremented().trbuff().set_bit().pl().high());
        stream.cr().modify(|_, w| w.en().enabled());
        Some(())
    }

    /// From now on half-words from `register` go into `ring`; `None` as above.
    pub(super) fn fill_with_half_words<R>(
        &self,
        ring: &'static [AtomicU16],
        register: *const R,
    ) -> Option<()> {
        for place in ring {
            place.store(0, Ordering::Relaxed);
        }
        let stream = self.prepare(address(ring.as_ptr()), ring.len(), address(register))?;
        stream.cr().write(|w| {
            w.msize().bits16().psize().bits16();
            w.circ().enabled().minc().incremented().pl().very_high()
        });
        stream.cr().modify(|_, w| w.en().enabled());
        Some(())
    }

    /// Whether bytes are still on their way to the register.
    pub fn is_sending(&self) -> bool {
        self.0.st(INDEX).cr().read().en().is_enabled()
    }

    /// Sends bytes, once the last ones are sent; `None` as above.
    pub fn send<R>(&self, bytes: &'static [AtomicU8], register: *mut R) -> Option<()> {
        let stream = self.prepare(address(bytes.as_ptr()), bytes.len(), address(register))?;
        stream.cr().write(|w| w.dir().memory_to_peripheral().minc().incremented().trbuff().set_bit());
        // The bytes are in memory before the device looks.
        asm::dmb();
        stream.cr().modify(|_, w| w.en().enabled());
        Some(())
    }

    /// Transfers that are left until the ring begins anew.
    #[inline]
    pub fn left(&self) -> usize {
        self.0.st(INDEX).ndtr().read().ndt().bits().into()
    }

    /// The stream, switched off, with its addresses and its number of transfers.
    fn prepare(&self, memory: u32, length: usize, register: u32) -> Option<&pac::dma1::ST> {
        let stream = self.0.st(INDEX);
        stream.cr().modify(|_, w| w.en().disabled());
        wait_until(STOP_MICROS, || stream.cr().read().en().is_disabled())?;
        let begin = FLAGS_BEGIN.get(INDEX).copied()?;
        // SAFETY: the flags of this stream.
        self.0.lifcr().write(|w| unsafe { w.bits(FLAGS << begin) });
        // SAFETY: a variable that lives for ever, and a register.
        stream.m0ar().write(|w| unsafe { w.m0a().bits(memory) });
        // SAFETY: as above.
        stream.par().write(|w| unsafe { w.pa().bits(register) });
        stream.ndtr().write(|w| w.ndt().set(u16::try_from(length).unwrap_or(u16::MAX)));
        Some(stream)
    }
}
