//! The serial line to the host: USART3, with a stream of the DMA for either direction.
//!
//! | step | register of RM0433, chapter of the USART |
//! |---|---|
//! | 2,000,000 baud: its clock over the divider | `USART_BRR` |
//! | received bytes go into a ring; one with an error of its frame is left out | `USART_CR3`: `DMAR`, `DDRE` = 0 |
//! | after an overrun it receives on: the frame's CRC tells | `USART_CR3`: `OVRDIS` |
//! | bytes to send come out of a buffer | `USART_CR3`: `DMAT` |

use core::sync::atomic::{AtomicU8, Ordering};

use link::LINE_BAUD;
use stm32h7::stm32h743v as pac;

use super::DEVICE_HZ;
use super::dma::Stream;
use crate::ring::RingReader;

/// Bytes that are received and not read: 5 ms of the line at its full rate.
const RECEIVED_BYTES: usize = 1024;
/// Bytes that are sent at once.
const SENT_BYTES: usize = 128;

#[expect(unsafe_code, reason = "the DMA reaches one section, which memory.x places")]
// SAFETY: what the section has at the start is a value of the type.
#[unsafe(link_section = ".dma")]
static RECEIVED: [AtomicU8; RECEIVED_BYTES] = [const { AtomicU8::new(0) }; RECEIVED_BYTES];
#[expect(unsafe_code, reason = "the DMA reaches one section, which memory.x places")]
// SAFETY: as above.
#[unsafe(link_section = ".dma")]
static SENT: [AtomicU8; SENT_BYTES] = [const { AtomicU8::new(0) }; SENT_BYTES];

/// The serial line to the host.
#[derive(Debug)]
pub struct Line {
    uart: pac::USART3,
    receiver: Stream<1>,
    received: RingReader<RECEIVED_BYTES>,
    transmitter: Stream<2>,
}

impl Line {
    /// `None` if a stream does not start.
    pub(super) fn start(uart: pac::USART3, receiver: Stream<1>, transmitter: Stream<2>) -> Option<Self> {
        const DIVIDER: u16 = (DEVICE_HZ / LINE_BAUD) as u16;
        uart.brr().write(|w| w.brr().set(DIVIDER));
        uart.cr3().write(|w| w.dmar().enabled().dmat().enabled().ovrdis().disabled());
        receiver.fill_with_bytes(&RECEIVED, uart.rdr().as_ptr())?;
        uart.cr1().write(|w| w.fifoen().set_bit().te().set_bit().re().set_bit().ue().set_bit());
        Some(Self { uart, receiver, received: RingReader::new(), transmitter })
    }

    /// The next byte that was received.
    pub fn read(&mut self) -> Option<u8> {
        let place = self.received.oldest(self.receiver.left())?;
        RECEIVED.get(place).map(|byte| byte.load(Ordering::Relaxed))
    }

    /// Begins to send the first of `bytes`, without waiting; how many it took, 0 while it is busy.
    pub fn write(&mut self, bytes: &[u8]) -> usize {
        if self.transmitter.is_sending() {
            return 0;
        }
        for (place, &byte) in SENT.iter().zip(bytes) {
            place.store(byte, Ordering::Relaxed);
        }
        let taken = SENT.get(..bytes.len()).unwrap_or(&SENT);
        if taken.is_empty() || self.transmitter.send(taken, self.uart.tdr().as_ptr()).is_none() {
            return 0;
        }
        taken.len()
    }
}
