//! The serial line to the host: LPUART1, with a channel of the DMA for either direction.
//!
//! | step | register of RM0440, chapter of the LPUART |
//! |---|---|
//! | 2,000,000 baud: 256 clocks over the divider | `LPUART_BRR` |
//! | received bytes go into a ring; one with an error of its frame is left out | `LPUART_CR3`: `DMAR`, `DDRE` = 0 |
//! | after an overrun it receives on: the frame's CRC tells | `LPUART_CR3`: `OVRDIS` |
//! | bytes to send come out of a buffer | `LPUART_CR3`: `DMAT` |

use core::sync::atomic::{AtomicU8, Ordering};

use link::LINE_BAUD;
use stm32g4::stm32g474 as pac;

use super::CLOCK_HZ;
use super::dma::Channel;
use crate::ring::RingReader;

/// Bytes that are received and not read: 5 ms of the line at its full rate.
const RECEIVED_BYTES: usize = 1024;
/// Bytes that are sent at once.
const SENT_BYTES: usize = 128;

static RECEIVED: [AtomicU8; RECEIVED_BYTES] = [const { AtomicU8::new(0) }; RECEIVED_BYTES];
static SENT: [AtomicU8; SENT_BYTES] = [const { AtomicU8::new(0) }; SENT_BYTES];

/// The serial line to the host.
#[derive(Debug)]
pub struct Line {
    uart: pac::LPUART1,
    receiver: Channel<1>,
    received: RingReader<RECEIVED_BYTES>,
    transmitter: Channel<2>,
}

impl Line {
    pub(super) fn start(uart: pac::LPUART1, receiver: Channel<1>, transmitter: Channel<2>) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "21,760")]
        const DIVIDER: u32 = (CLOCK_HZ as u64 * 256 / LINE_BAUD as u64) as u32;
        uart.brr().write(|w| w.brr().set(DIVIDER));
        uart.cr3().write(|w| w.dmar().enabled().dmat().enabled().ovrdis().disabled());
        receiver.fill_with_bytes(&RECEIVED, uart.rdr().as_ptr());
        uart.cr1().write(|w| w.fifoen().set_bit().te().set_bit().re().set_bit().ue().set_bit());
        Self { uart, receiver, received: RingReader::new(), transmitter }
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
        if !taken.is_empty() {
            self.transmitter.send(taken, self.uart.tdr().as_ptr());
        }
        taken.len()
    }
}
