//! A script in the place of the host and the vibrometer: what a board is sent and shows in each tick, and how long a
//! tick is. The emulator puts it into memory before the program starts, so that a run does not depend on the speed of
//! anything.
//!
//! | word of 32 bits, little endian | meaning |
//! |---|---|
//! | 0 | clocks of the timer in a tick |
//! | 1 | ticks of the script, from the first interrupt on |
//! | 2, 3 of the first tick | velocities in m/s, half a tick before its interrupt and at it, `f32`; NaN for none |
//! | 4 of the first tick | bytes that the line has received by its interrupt: the lowest tells how many, 0 to 3 |
//! | 5 and so on | the same of the other ticks |
//!
//! After its end the line is silent, and there are no samples. Only the tick is another one, and with it what the line
//! carries to the host: the watchdog waits for as many clocks as without a script.

use core::sync::atomic::{AtomicUsize, Ordering};

use super::Uart;
use crate::main_loop::SerialLine;
use crate::tasks::{Converter, SAMPLES_PER_TICK};

/// In the 4 MiB that both boards have at the address of the program's variables, above what stands for a flash.
const START: *const u32 = 0x2030_0000 as *const u32;

/// Words before those of the first tick.
const HEAD_WORDS: usize = 2;
/// Words of a tick: its samples, and its bytes of the line.
const TICK_WORDS: usize = SAMPLES_PER_TICK + 1;

/// Interrupts so far. Only the converter writes it.
static INTERRUPTS: AtomicUsize = AtomicUsize::new(0);

fn word(index: usize) -> u32 {
    // SAFETY: within the script, which nothing writes while the program runs.
    unsafe { START.wrapping_add(index).read_volatile() }
}

/// Clocks of the timer in a tick.
pub fn clocks_per_tick() -> u32 {
    word(0)
}

/// The words of tick `number`, from 0; `None` after the last.
#[inline]
fn tick(number: usize) -> Option<[u32; TICK_WORDS]> {
    let first = HEAD_WORDS + TICK_WORDS * number;
    (number < word(1) as usize).then(|| core::array::from_fn(|offset| word(first + offset)))
}

/// The vibrometer of the script.
#[derive(Debug)]
pub struct Vibrometer;

impl Converter for Vibrometer {
    #[inline]
    fn velocities_m_s(&mut self) -> [Option<f32>; SAMPLES_PER_TICK] {
        let number = INTERRUPTS.load(Ordering::Relaxed);
        INTERRUPTS.store(number + 1, Ordering::Release);
        let [samples @ .., _] = tick(number).unwrap_or([f32::NAN.to_bits(); TICK_WORDS]);
        samples.map(f32::from_bits).map(|velocity_m_s| Some(velocity_m_s).filter(|known| !known.is_nan()))
    }
}

/// The serial line: the script is what it receives, and the emulated one sends.
#[derive(Debug)]
pub struct Line {
    uart: Uart,
    /// The next tick whose bytes are received.
    next: usize,
    /// Ticks whose bytes may be read.
    readable: usize,
    /// Bytes that are received and not yet read, the next one lowest, and how many there are.
    bytes: u32,
    waiting: u32,
}

impl Line {
    pub(super) fn start() -> Self {
        Self { uart: Uart::start(), next: 0, readable: 1, bytes: 0, waiting: 0 }
    }

    /// The loop has run the tick of this interrupt. To a loop that is behind, the line brings what was received by its
    /// next tick, as to one that is on time: what a tick takes in does not depend on how long those before it took.
    pub fn loop_is_at(&mut self, interrupt: u64) {
        #[expect(clippy::cast_possible_truncation, reason = "a short script")]
        let next = interrupt as usize + 1;
        self.readable = next;
    }
}

impl SerialLine for Line {
    fn read(&mut self) -> Option<u8> {
        while self.waiting == 0 {
            if self.next >= INTERRUPTS.load(Ordering::Acquire).min(self.readable) {
                return None;
            }
            let [.., line] = tick(self.next)?;
            self.next += 1;
            (self.waiting, self.bytes) = (line & 0xff, line >> 8);
        }
        let [byte, ..] = self.bytes.to_le_bytes();
        self.bytes >>= 8;
        self.waiting -= 1;
        Some(byte)
    }

    fn write(&mut self, bytes: &[u8]) -> usize {
        self.uart.write(bytes)
    }
}
