//! The serial line of real boards to the host: a UART, with the DMA for either direction.
//!
//! | step | register of RM0440, chapter of the LPUART, and of RM0433, chapter of the USART |
//! |---|---|
//! | 2,000,000 baud, by the part's divider | `BRR` |
//! | received bytes go into a ring; one with an error of its frame is left out | `CR3`: `DMAR`, `DDRE` = 0 |
//! | after an overrun it receives on: the frame's CRC tells | `CR3`: `OVRDIS` |
//! | bytes to send come out of a buffer | `CR3`: `DMAT` |

use core::sync::atomic::Ordering;

use super::hardware::{BAUD_DIVIDER, RECEIVED, Receiver, SENT, Transmitter, Uart};
use crate::main_loop::SerialLine;
use crate::ring::RingReader;

/// Bytes that are received and not read: 5 ms of the line at its full rate.
pub(super) const RECEIVED_BYTES: usize = 1024;
/// Bytes that are sent at once.
pub(super) const SENT_BYTES: usize = 128;

/// The serial line to the host.
#[derive(Debug)]
pub struct Line {
    uart: Uart,
    receiver: Receiver,
    received: RingReader<RECEIVED_BYTES>,
    transmitter: Transmitter,
}

impl Line {
    /// `None` if the DMA does not start.
    pub(super) fn start(uart: Uart, receiver: Receiver, transmitter: Transmitter) -> Option<Self> {
        uart.brr().write(|w| w.brr().set(BAUD_DIVIDER));
        uart.cr3().write(|w| w.dmar().enabled().dmat().enabled().ovrdis().disabled());
        receiver.fill_with_bytes(&RECEIVED, uart.rdr().as_ptr())?;
        uart.cr1().write(|w| w.fifoen().set_bit().te().set_bit().re().set_bit().ue().set_bit());
        Some(Self { uart, receiver, received: RingReader::new(), transmitter })
    }
}

impl SerialLine for Line {
    fn read(&mut self) -> Option<u8> {
        let place = self.received.oldest(self.receiver.left())?;
        RECEIVED.get(place).map(|byte| byte.load(Ordering::Relaxed))
    }

    /// Takes nothing while it is busy.
    fn write(&mut self, bytes: &[u8]) -> usize {
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
