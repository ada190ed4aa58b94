//! The whole program of a board in QEMU, on its own timer, at the other end of its serial line.

use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout};
use std::sync::mpsc::{Receiver, Sender, channel};

use link::{BoardMessage, Counters, Deframer, FRAME_BYTES_MAX, Header, HostMessage, decode, encode};

use super::process::{self, Guard, Link, SILENCE_MAX, Wiring};
use crate::board::BoardError;
use crate::board::instructions::Board;

/// Reports that are waited through for an answer: three seconds of the board's time.
const REPORTS_MAX: u32 = 3000;

/// A board at work, and what it has said.
#[derive(Debug)]
pub struct Live {
    line: ChildStdin,
    said: Receiver<(Header, BoardMessage)>,
    sequence: u32,
    guard: Guard,
}

impl Live {
    /// The session of everything that it is told.
    pub const SESSION: u32 = 9;

    /// Starts the program `board` in `elf`, which logs into `log`. An instruction takes a nanosecond, and time in which the board waits passes at once.
    ///
    /// # Errors
    /// When the program cannot be read, or the emulator not be started.
    pub fn start(elf: &Path, log: Option<&Path>) -> Result<Self, BoardError> {
        Self::start_slower(elf, log, 0)
    }

    /// The same on a processor that is 2^`halvings` times slower.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_slower(elf: &Path, log: Option<&Path>, halvings: u32) -> Result<Self, BoardError> {
        let wiring = Wiring { link: Link::Uart, log };
        let clock = format!("shift={halvings},sleep=off");
        let (line, from_board, guard) = process::start(elf, Board::M4, wiring, &["-icount", &clock])?;
        let (to_us, said) = channel();
        std::thread::spawn(move || listen(from_board, &to_us));
        Ok(Self { line, said, sequence: 0, guard })
    }

    /// Puts bytes on the line.
    ///
    /// # Errors
    /// When the board has gone.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), BoardError> {
        self.line.write_all(bytes).and_then(|()| self.line.flush()).map_err(|_| self.guard.lost())
    }

    /// Says `message`.
    ///
    /// # Errors
    /// When the board has gone.
    pub fn say(&mut self, message: &HostMessage) -> Result<(), BoardError> {
        let frame = self.frame(message)?;
        self.send(&frame)
    }

    /// The next frame of the session.
    ///
    /// # Errors
    /// When the message does not fit one: none does not.
    pub fn frame(&mut self, message: &HostMessage) -> Result<Vec<u8>, BoardError> {
        let mut frame = [0; FRAME_BYTES_MAX];
        let header = Header { session: Self::SESSION, sequence: self.sequence, ticks: 0 };
        self.sequence = self.sequence.wrapping_add(1);
        let length =
            encode(header, message, &mut frame).map_err(|error| BoardError::Board(error.to_string()))?;
        Ok(frame[..length].to_vec())
    }

    /// The next thing said.
    ///
    /// # Errors
    /// When the board falls silent.
    pub fn hear(&mut self) -> Result<(Header, BoardMessage), BoardError> {
        let said = self.said.recv_timeout(SILENCE_MAX).map_err(|_| self.guard.lost())?;
        self.guard.alive();
        Ok(said)
    }

    /// The next thing said that is no report.
    ///
    /// # Errors
    /// When the board falls silent, or reports on and on.
    pub fn hear_answer(&mut self) -> Result<BoardMessage, BoardError> {
        for _ in 0..REPORTS_MAX {
            match self.hear()?.1 {
                BoardMessage::Report(_) => (),
                message => return Ok(message),
            }
        }
        Err(BoardError::Board("reports on and on instead of an answer".to_owned()))
    }

    /// How the board fares.
    ///
    /// # Errors
    /// When it does not say.
    pub fn counters(&mut self) -> Result<Counters, BoardError> {
        self.say(&HostMessage::Count)?;
        match self.hear_answer()? {
            BoardMessage::Counters(counters) => Ok(counters),
            other => Err(BoardError::Board(format!("answers something else than was asked: {other:?}"))),
        }
    }
}

/// Hands on every message until the line or the listener has gone.
fn listen(mut from_board: ChildStdout, to_us: &Sender<(Header, BoardMessage)>) {
    let (mut deframer, mut block) = (Deframer::default(), [0; 4096]);
    while let Ok(length @ 1..) = from_board.read(&mut block) {
        for &byte in &block[..length] {
            // A board that was started anew may have been cut short.
            let Some(Ok(said)) = deframer.push(byte).map(decode::<BoardMessage>) else { continue };
            if to_us.send(said).is_err() {
                return;
            }
        }
    }
}
