//! The work of the main loop in a pass: bytes of the line in, a tick of the loop, bytes to the line out.
//!
//! A pass never waits. After one that has received nothing and sent all, a program waits for the timer, unless a tick
//! is due.

use heapless::Vec;
use link::FRAME_BYTES_MAX;

use crate::stack_gauge::{StackGauge, WORDS_PER_TICK};
use crate::tasks::{BYTES_PER_TICK_MAX, LoopTask};

/// Bytes that wait for the line: two frames of any length.
const OUTGOING_BYTES: usize = 2 * FRAME_BYTES_MAX;

/// The serial line to the host.
pub trait SerialLine {
    /// The next byte that was received.
    fn read(&mut self) -> Option<u8>;

    /// Begins to send the first of `bytes`, without waiting; how many it took.
    fn write(&mut self, bytes: &[u8]) -> usize;
}

/// The main loop of a board.
pub struct MainLoop<'q> {
    /// The task of the loop.
    pub task: LoopTask<'q>,
    outgoing: Outgoing,
    stack: StackGauge,
}

impl<'q> MainLoop<'q> {
    /// A main loop that runs `task` on a stack of so many words.
    pub fn new(mut task: LoopTask<'q>, stack_words: usize) -> Self {
        task.record_stack_size(u32::try_from(4 * stack_words).unwrap_or(u32::MAX));
        Self { task, outgoing: Outgoing::default(), stack: StackGauge::new(stack_words) }
    }

    /// Takes what the line has received; whether it was anything.
    #[inline]
    pub fn receive(&mut self, line: &mut impl SerialLine) -> bool {
        let mut bytes = Vec::<u8, BYTES_PER_TICK_MAX>::new();
        while !bytes.is_full() {
            let Some(byte) = line.read() else { break };
            // Never full here.
            let _ = bytes.push(byte);
        }
        if bytes.is_empty() {
            return false;
        }
        let Self { task, outgoing, .. } = self;
        task.receive(&bytes, &mut |frame| outgoing.push(frame));
        true
    }

    /// Does what the host wants of the store ([`LoopTask::use_store`]).
    pub fn use_store<F: embedded_storage_async::nor_flash::NorFlash>(
        &mut self,
        store: &mut crate::store::Store<F>,
    ) {
        let Self { task, outgoing, .. } = self;
        task.use_store(store, &mut |frame| outgoing.push(frame));
    }

    /// Runs one tick, if one is due; whether one was. `is_unused` tells whether the word of the stack at a distance
    /// from its far end has never been used.
    #[inline]
    pub fn run_tick(&mut self, is_unused: impl Fn(usize) -> bool) -> bool {
        let Self { task, outgoing, stack } = self;
        let ran = task.run_tick(&mut |frame| outgoing.push(frame));
        if ran {
            stack.look(WORDS_PER_TICK, is_unused);
            task.record_stack(stack.bytes_max());
        }
        ran
    }

    /// Sends what waits, as far as the line has room; whether nothing waits any more.
    #[inline]
    pub fn send(&mut self, line: &mut impl SerialLine) -> bool {
        let outgoing = &mut self.outgoing;
        while !outgoing.waiting().is_empty() {
            let sent = line.write(outgoing.waiting());
            if sent == 0 {
                return false;
            }
            outgoing.sent(sent);
        }
        true
    }
}

/// Frames that wait for the line.
#[derive(Default)]
struct Outgoing {
    bytes: Vec<u8, OUTGOING_BYTES>,
    /// How many of them are sent.
    sent: usize,
}

impl Outgoing {
    /// Puts a whole frame at the end, or nothing of it: the host finds the gap in the sequence.
    fn push(&mut self, frame: &[u8]) {
        if self.bytes.capacity() - self.bytes.len() < frame.len() {
            self.bytes.drain(..self.sent);
            self.sent = 0;
        }
        let _ = self.bytes.extend_from_slice(frame);
    }

    fn waiting(&self) -> &[u8] {
        self.bytes.get(self.sent..).unwrap_or_default()
    }

    /// The first `count` of those that wait are sent.
    fn sent(&mut self, count: usize) {
        self.sent += count;
        if self.sent >= self.bytes.len() {
            self.bytes.clear();
            self.sent = 0;
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::collections::VecDeque;
    use std::vec;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Against a queue without limit: a frame is lost if there is no room for it, and only then, and the line gets
        /// the bytes of all others in order.
        #[test]
        fn dual_frames_wait_in_order_as_long_as_there_is_room(
            steps in proptest::collection::vec((0..=FRAME_BYTES_MAX, 0..FRAME_BYTES_MAX), 1..100),
        ) {
            let (mut outgoing, mut queue) = (Outgoing::default(), VecDeque::new());
            for (number, (length, taken)) in (0..).zip(steps) {
                let frame = vec![number; length];
                outgoing.push(&frame);
                if queue.len() + length <= OUTGOING_BYTES {
                    queue.extend(frame);
                }
                prop_assert!(outgoing.waiting().iter().eq(&queue));
                let taken = taken.min(queue.len());
                outgoing.sent(taken);
                queue.drain(..taken);
                prop_assert!(outgoing.waiting().iter().eq(&queue));
            }
        }
    }
}
