//! Channels of DMA 1: which device each serves, and how it moves data.
//!
//! | step | register of RM0440, chapters of DMAMUX and DMA |
//! |---|---|
//! | a channel gets the requests of its device | `DMAMUX_CxCR`: `DMAREQ_ID` |
//! | it goes from a register into a ring, for ever | `DMA_CCRx`: `CIRC`, `MINC`, `DIR` = 0 |
//! | or from memory into a register, once | `DMA_CCRx`: `DIR` = 1; it begins anew after `EN` was cleared |
//! | how many transfers are left | `DMA_CNDTRx` |

#![expect(unsafe_code, reason = "a channel takes an address, and three owners share the device")]

use core::sync::atomic::{AtomicU8, AtomicU16};

use cortex_m::asm;
use stm32g4::stm32g474 as pac;

use crate::board::line::{RECEIVED_BYTES, SENT_BYTES};

/// Requests of the devices.
const ADC1: u8 = 5;
const LPUART1_RX: u8 = 34;
const LPUART1_TX: u8 = 35;

/// What the line receives.
pub static RECEIVED: [AtomicU8; RECEIVED_BYTES] = [const { AtomicU8::new(0) }; RECEIVED_BYTES];
/// What the line sends.
pub static SENT: [AtomicU8; SENT_BYTES] = [const { AtomicU8::new(0) }; SENT_BYTES];

/// The channel of the line's receiver.
pub type Receiver = Channel<1>;
/// The channel of its transmitter.
pub type Transmitter = Channel<2>;

/// A channel; `INDEX` 0 is channel 1 of the manual.
#[derive(Debug)]
pub struct Channel<const INDEX: usize>(pac::DMA1);

/// The channels of converter, receiver and transmitter.
pub(super) fn channels(mux: &pac::DMAMUX) -> (Channel<0>, Receiver, Transmitter) {
    for (index, request) in [ADC1, LPUART1_RX, LPUART1_TX].into_iter().enumerate() {
        // SAFETY: a device's request.
        mux.ccr(index).write(|w| unsafe { w.dmareq_id().bits(request) });
    }
    // SAFETY: each owner uses the registers of its own channel.
    let dma = || unsafe { pac::DMA1::steal() };
    (Channel(dma()), Channel(dma()), Channel(dma()))
}

/// The address of a register or a variable, as the device takes it.
fn address<T>(of: *const T) -> u32 {
    u32::try_from(of.expose_provenance()).unwrap_or_default()
}

impl<const INDEX: usize> Channel<INDEX> {
    /// From now on bytes from `register` go into `ring`; never `None`.
    #[expect(clippy::unnecessary_wraps, reason = "a stream of an STM32H743 may fail")]
    pub fn fill_with_bytes<R>(&self, ring: &'static [AtomicU8], register: *const R) -> Option<()> {
        let channel = self.prepare(address(ring.as_ptr()), ring.len(), address(register));
        channel.cr().write(|w| w.circ().enabled().minc().enabled().pl().high().en().enabled());
        Some(())
    }

    /// From now on half-words from `register` go into `ring`.
    pub(super) fn fill_with_half_words<R>(&self, ring: &'static [AtomicU16], register: *const R) {
        let channel = self.prepare(address(ring.as_ptr()), ring.len(), address(register));
        channel.cr().write(|w| {
            w.msize().bits16().psize().bits16();
            w.circ().enabled().minc().enabled().pl().very_high().en().enabled()
        });
    }

    /// Whether bytes are still on their way to the register.
    pub fn is_sending(&self) -> bool {
        let channel = self.0.ch(INDEX);
        channel.cr().read().en().is_enabled() && channel.ndtr().read().ndt().bits() != 0
    }

    /// Sends bytes, once the last ones are sent; never `None`.
    #[expect(clippy::unnecessary_wraps, reason = "a stream of an STM32H743 may fail")]
    pub fn send<R>(&self, bytes: &'static [AtomicU8], register: *mut R) -> Option<()> {
        let channel = self.prepare(address(bytes.as_ptr()), bytes.len(), address(register));
        // The bytes are in memory before the device looks.
        asm::dmb();
        channel.cr().write(|w| w.dir().from_memory().minc().enabled().en().enabled());
        Some(())
    }

    /// Transfers that are left until the ring begins anew.
    #[inline]
    pub fn left(&self) -> usize {
        self.0.ch(INDEX).ndtr().read().ndt().bits().into()
    }

    /// The channel, switched off, with its addresses and its number of transfers.
    fn prepare(&self, memory: u32, length: usize, register: u32) -> &pac::dma1::CH {
        let channel = self.0.ch(INDEX);
        channel.cr().reset();
        // SAFETY: a variable that lives for ever, and a register.
        channel.mar().write(|w| unsafe { w.ma().bits(memory) });
        // SAFETY: as above.
        channel.par().write(|w| unsafe { w.pa().bits(register) });
        channel.ndtr().write(|w| w.ndt().set(u16::try_from(length).unwrap_or(u16::MAX)));
        channel
    }
}
