//! A board on its own timer: the whole program in QEMU, at the other end of its serial line.

use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout};
use std::sync::mpsc::{Receiver, Sender, channel};

use link::{BoardMessage, Counters, Deframer, Header, HostMessage, decode};

use super::frames::{frame, unexpected};
use crate::board::BoardError;
use crate::board::qemu::{Board, SILENCE_MAX, Transport, Watchdog, WatchedProcess, Wiring};

/// Most reports that may come before an answer: three seconds of the board's time.
const REPORTS_MAX: u32 = 3000;

/// How slow the processor of a scripted board is.
const SCRIPTED_HALVINGS: u32 = 2;

/// Where the script is: `firmware/src/board/mps2/script.rs`.
const SCRIPT_ADDRESS: u32 = 0x2030_0000;

/// A board that runs by its own timer, out of step with the host.
#[derive(Debug)]
pub struct FreeRunningBoard {
    to_board: ChildStdin,
    received: Receiver<(Header, BoardMessage)>,
    sequence: u32,
    watchdog: Watchdog,
}

impl FreeRunningBoard {
    /// The session of every message to the board.
    pub const SESSION: u32 = 9;

    /// Instructions of a scripted board in a clock of its timer: a clock of 25 MHz is 40 ns, and an instruction takes
    /// 4 ns. A tick of so many clocks as the processor of a part has MHz has the instructions that the part has in 10
    /// us, at one a cycle.
    pub const INSTRUCTIONS_PER_CLOCK: u32 = 40 >> SCRIPTED_HALVINGS;

    /// Starts the program `board` in `elf`, which logs into `log`. An instruction takes a nanosecond, and time in which
    /// the board waits passes at once.
    ///
    /// # Errors
    /// When the program cannot be read, or the emulator cannot be started.
    pub fn start(elf: &Path, log: Option<&Path>) -> Result<Self, BoardError> {
        Self::start_slower(elf, log, 0)
    }

    /// The same on a processor that is 2^`halvings` times slower.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_slower(elf: &Path, log: Option<&Path>, halvings: u32) -> Result<Self, BoardError> {
        Self::start_with(elf, log, halvings, &[])
    }

    /// Starts the program `board` in `elf`, which was built with the feature `scripted`: what it receives, what its
    /// vibrometer shows and how long its tick is are in the file `script`, as `firmware/src/board/mps2/script.rs` has
    /// it. A clock of its timer has [`Self::INSTRUCTIONS_PER_CLOCK`] instructions.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub fn start_scripted(elf: &Path, script: &Path) -> Result<Self, BoardError> {
        // A comma in a name is written twice.
        let file = script.to_string_lossy().replace(',', ",,");
        let device = format!("loader,file={file},addr={SCRIPT_ADDRESS:#x},force-raw=on");
        Self::start_with(elf, None, SCRIPTED_HALVINGS, &["-device", &device])
    }

    fn start_with(
        elf: &Path,
        log: Option<&Path>,
        halvings: u32,
        arguments: &[&str],
    ) -> Result<Self, BoardError> {
        let wiring = Wiring { transport: Transport::Uart, log };
        let clock = format!("shift={halvings},sleep=off");
        let arguments = [&["-icount", &clock], arguments].concat();
        let WatchedProcess { to_board, from_board, watchdog } =
            WatchedProcess::start(elf, Board::M4, wiring, &arguments)?;
        let (to_receiver, received) = channel();
        std::thread::spawn(move || forward_messages(from_board, &to_receiver));
        Ok(Self { to_board, received, sequence: 0, watchdog })
    }

    /// Puts bytes on the serial line.
    ///
    /// # Errors
    /// When the board has ended.
    pub fn send_bytes(&mut self, bytes: &[u8]) -> Result<(), BoardError> {
        let written = self.to_board.write_all(bytes).and_then(|()| self.to_board.flush());
        written.map_err(|_| self.watchdog.kill_and_explain())
    }

    /// Sends `message` as the next frame of the session.
    ///
    /// # Errors
    /// When the board has ended.
    pub fn send(&mut self, message: &HostMessage) -> Result<(), BoardError> {
        let frame = self.frame(message)?;
        self.send_bytes(&frame)
    }

    /// The next frame of the session.
    ///
    /// # Errors
    /// When the message does not fit a frame; every message of the host does.
    pub fn frame(&mut self, message: &HostMessage) -> Result<Vec<u8>, BoardError> {
        let header = Header { session: Self::SESSION, sequence: self.sequence, ticks: 0 };
        self.sequence = self.sequence.wrapping_add(1);
        frame(header, message)
    }

    /// The next message of the board.
    ///
    /// # Errors
    /// When the board falls silent.
    pub fn receive(&mut self) -> Result<(Header, BoardMessage), BoardError> {
        let message =
            self.received.recv_timeout(SILENCE_MAX).map_err(|_| self.watchdog.kill_and_explain())?;
        self.watchdog.note_message();
        Ok(message)
    }

    /// The next message of the board that is no report.
    ///
    /// # Errors
    /// When the board falls silent, or sends nothing but reports.
    pub fn receive_answer(&mut self) -> Result<BoardMessage, BoardError> {
        for _ in 0..REPORTS_MAX {
            match self.receive()?.1 {
                BoardMessage::Report(_) => (),
                message => return Ok(message),
            }
        }
        Err(BoardError::Board("sends nothing but reports, and no answer".to_owned()))
    }

    /// The board's counters of frames, ticks and stack.
    ///
    /// # Errors
    /// When the board does not answer with them.
    pub fn counters(&mut self) -> Result<Counters, BoardError> {
        self.send(&HostMessage::Count)?;
        match self.receive_answer()? {
            BoardMessage::Counters(counters) => Ok(counters),
            other => Err(unexpected(&other)),
        }
    }
}

/// Forwards every message until the serial line has ended, or until no receiver is left.
fn forward_messages(mut from_board: ChildStdout, to_receiver: &Sender<(Header, BoardMessage)>) {
    let (mut deframer, mut block) = (Deframer::default(), [0; 4096]);
    while let Ok(length @ 1..) = from_board.read(&mut block) {
        for &byte in &block[..length] {
            // A board that starts anew may cut a frame short.
            let Some(Ok(message)) = deframer.push(byte).map(decode::<BoardMessage>) else { continue };
            if to_receiver.send(message).is_err() {
                return;
            }
        }
    }
}
