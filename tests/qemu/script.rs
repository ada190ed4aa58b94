//! What a scripted board is sent and shown: `firmware/src/board/mps2/script.rs` has the format.

use std::collections::VecDeque;
use std::ops::RangeInclusive;

use controller::PositionLoop;
use estimator::{CameraFrame, LdvSample};
use firmware::tasks::SAMPLES_PER_TICK;
use host_sim::board::pil::FreeRunningBoard;
use link::{FRAME_BYTES_MAX, Header, HostMessage, LINE_BAUD, encode, encode_camera};

/// Bytes that the line carries in a tick.
pub const LINE_BYTES_PER_TICK: usize = (LINE_BAUD / BITS_PER_BYTE / TICKS_PER_S) as usize;

/// Bits of a byte on the line: start, eight of data, stop.
const BITS_PER_BYTE: u32 = 10;

/// Ticks of the loop in a second.
const TICKS_PER_S: u32 = 100_000;

/// A tick of a script.
#[derive(Clone, Copy)]
struct ScriptedTick {
    velocities_m_s: [f32; SAMPLES_PER_TICK],
    received: [u8; LINE_BYTES_PER_TICK],
    received_count: usize,
}

/// A script, tick by tick. Tick 1 ends with the first interrupt.
#[derive(Clone, Default)]
pub struct Script {
    ticks: Vec<ScriptedTick>,
    /// Bytes on their way to the board.
    on_line: VecDeque<u8>,
    sequence: u32,
}

impl Script {
    /// Ticks so far.
    pub fn ticks(&self) -> u64 {
        self.ticks.len() as u64
    }

    /// Bytes that the board receives in `ticks`.
    pub fn received(&self, ticks: RangeInclusive<u64>) -> u64 {
        let numbered = (1..).zip(&self.ticks).filter(|(number, _)| ticks.contains(number));
        numbered.map(|(_, tick)| tick.received_count as u64).sum()
    }

    /// The host sends `message` from now on.
    pub fn send(&mut self, message: &HostMessage) {
        let mut frame = [0; FRAME_BYTES_MAX];
        let length = encode(self.header(), message, &mut frame).expect("it fits");
        self.on_line.extend(&frame[..length]);
    }

    /// The camera has sent `frame`, whose last byte comes with the last tick so far: the loop takes it in at its end.
    pub fn show(&mut self, frame: CameraFrame) {
        let mut bytes = [0; FRAME_BYTES_MAX];
        let length = encode_camera(self.header(), frame.into(), &mut bytes).expect("it fits");
        let ticks = length.div_ceil(LINE_BYTES_PER_TICK);
        let first = self.ticks.len() - ticks;
        for (tick, bytes) in self.ticks[first..].iter_mut().zip(bytes[..length].chunks(LINE_BYTES_PER_TICK)) {
            assert_eq!(tick.received_count, 0, "the line is free for {ticks} ticks");
            tick.received[..bytes.len()].copy_from_slice(bytes);
            tick.received_count = bytes.len();
        }
    }

    /// A tick passes, at whose end the vibrometer has taken `samples`, at half of it and now.
    pub fn pass(&mut self, samples: &[LdvSample]) {
        let mut velocities_m_s = [f32::NAN; SAMPLES_PER_TICK];
        for sample in samples {
            let since = sample.taken_at.nanos() % PositionLoop::TICK_NANOS;
            velocities_m_s[if since == 0 { SAMPLES_PER_TICK - 1 } else { 0 }] = sample.velocity_m_s;
        }
        let mut received = [0; LINE_BYTES_PER_TICK];
        let received_count = LINE_BYTES_PER_TICK.min(self.on_line.len());
        received.iter_mut().zip(self.on_line.drain(..received_count)).for_each(|(to, from)| *to = from);
        self.ticks.push(ScriptedTick { velocities_m_s, received, received_count });
    }

    /// Ticks pass, without samples, until the board has received all that was sent.
    pub fn pass_until_received(&mut self) {
        while !self.on_line.is_empty() {
            self.pass(&[]);
        }
    }

    fn header(&mut self) -> Header {
        let header =
            Header { session: FreeRunningBoard::SESSION, sequence: self.sequence, ticks: self.ticks() };
        self.sequence += 1;
        header
    }

    /// The script of a board with ticks of so many clocks.
    pub fn bytes(&self, clocks_per_tick: u32) -> Vec<u8> {
        let head = [clocks_per_tick, u32::try_from(self.ticks.len()).expect("a short script")];
        let words = |tick: &ScriptedTick| {
            let [first, second] = tick.received;
            let count = u8::try_from(tick.received_count).expect("two at most");
            let [half, end] = tick.velocities_m_s.map(f32::to_bits);
            [half, end, u32::from_le_bytes([count, first, second, 0])]
        };
        head.into_iter().chain(self.ticks.iter().flat_map(words)).flat_map(u32::to_le_bytes).collect()
    }
}
