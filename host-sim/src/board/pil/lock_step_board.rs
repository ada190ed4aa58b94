//! A board in lock step: the program `pil` in QEMU, at the other end of two pipes.

use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout};

use controller::{MoveForecast, PositionLoop, Unreachable};
use link::{
    BoardIdentity, BoardMessage, Counters, Deframer, FRAME_BYTES_MAX, Header, HostMessage, LdvRecords,
    TickRecord, decode,
};

use super::frames::{camera_frame, frame, unexpected};
use super::{Processor, acknowledgement, configuration, description};
use crate::board::BoardError;
use crate::board::qemu::{Board, OneProcessor, Transport, Watchdog, WatchedProcess, Wiring};
use simulation::runs::tick_driver::TickMeasurements;
use simulation::scene::Scene;

/// Session of every message to the board. A board to which no host has sent a message uses session 0.
const SESSION: u32 = 1;

/// A board that computes each tick when the host asks for it, and waits for the next.
#[derive(Debug)]
pub struct LockStepBoard {
    to_board: Option<ChildStdin>,
    from_board: ChildStdout,
    deframer: Deframer,
    /// Bytes received, and how many of them are used up.
    block: Vec<u8>,
    used: usize,
    sequence: u32,
    ticks: u64,
    watchdog: Watchdog,
    transport: Transport,
    _one_processor: Option<OneProcessor>,
}

impl LockStepBoard {
    /// Starts the program `pil` in `elf` on `board`.
    ///
    /// # Errors
    /// When the program cannot be read, or the emulator cannot be started.
    pub fn start(elf: &Path, board: Board, wiring: Wiring<'_>) -> Result<Self, BoardError> {
        // Another thread of the emulator than its processor serves the serial line: there they do not take turns.
        let takes_turns = wiring.transport == Transport::Semihosting;
        let one_processor = if takes_turns { OneProcessor::hold() } else { None };
        let WatchedProcess { to_board, from_board, watchdog } =
            WatchedProcess::start(elf, board, wiring, &[])?;
        Ok(Self {
            to_board: Some(to_board),
            from_board,
            deframer: Deframer::default(),
            block: Vec::new(),
            used: 0,
            sequence: 0,
            ticks: 0,
            watchdog,
            transport: wiring.transport,
            _one_processor: one_processor,
        })
    }

    /// The board's counters of frames, ticks and stack.
    ///
    /// # Errors
    /// When the board does not answer with them.
    pub fn counters(&mut self) -> Result<Counters, BoardError> {
        match self.answer(&HostMessage::Count)? {
            BoardMessage::Counters(counters) => Ok(counters),
            other => Err(unexpected(&other)),
        }
    }

    /// What the board is.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn identity(&mut self) -> Result<BoardIdentity, BoardError> {
        self.describe(&[])?;
        match self.answer(&HostMessage::Identify)? {
            BoardMessage::Identity(identity) => Ok(identity),
            other => Err(unexpected(&other)),
        }
    }

    /// What the board says that the move of `scene` will take.
    ///
    /// # Errors
    /// When the scene's map is for another design, or the board refuses the question.
    pub fn forecast(&mut self, scene: &Scene) -> Result<Result<MoveForecast, Unreachable>, BoardError> {
        self.describe(&description(scene)?)?;
        match self.answer(&HostMessage::Forecast(configuration(scene)))? {
            BoardMessage::Forecast(answer) => Ok(answer.map(Into::into).map_err(Into::into)),
            other => Err(unexpected(&other)),
        }
    }

    /// Begins the session, and sends `messages`.
    fn describe(&mut self, messages: &[HostMessage]) -> Result<(), BoardError> {
        let tick_nanos = PositionLoop::TICK_NANOS;
        self.ask(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos })?;
        for message in messages {
            self.ask(message, &acknowledgement(message))?;
        }
        Ok(())
    }

    /// Ends the program.
    ///
    /// # Errors
    /// When it ends in failure.
    pub fn finish(mut self) -> Result<(), BoardError> {
        self.to_board = None;
        match self.transport {
            Transport::Semihosting => self.watchdog.wait(),
            // A serial line has no end: the program waits for more, and is killed.
            Transport::Uart => Ok(()),
        }
    }

    /// The next frame of the session.
    fn frame(&mut self, message: &HostMessage) -> Result<Vec<u8>, BoardError> {
        frame(self.next_header(), message)
    }

    fn next_header(&mut self) -> Header {
        let header = Header { session: SESSION, sequence: self.sequence, ticks: self.ticks };
        self.sequence = self.sequence.wrapping_add(1);
        header
    }

    /// Puts bytes on the transport, those of frames, or noise on a serial line.
    ///
    /// # Errors
    /// When the board has ended.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), BoardError> {
        // A zero ends whatever noise has begun on the serial line.
        let end: &[u8] = if self.is_noisy() { &[0] } else { &[] };
        let bytes = &[end, bytes].concat();
        let written = self.to_board.as_mut().map(|pipe| pipe.write_all(bytes).and_then(|()| pipe.flush()));
        match written {
            Some(Ok(())) => Ok(()),
            _ => Err(self.watchdog.kill_and_explain()),
        }
    }

    /// Whether the transport may carry bytes that are no frame; they are passed over.
    fn is_noisy(&self) -> bool {
        self.transport == Transport::Uart
    }

    fn receive(&mut self) -> Result<BoardMessage, BoardError> {
        loop {
            while let Some(&byte) = self.block.get(self.used) {
                self.used += 1;
                let Some(frame) = self.deframer.push(byte) else { continue };
                let (header, message) = match decode::<BoardMessage>(frame) {
                    Ok(whole) => whole,
                    Err(_) if self.is_noisy() => continue,
                    Err(error) => {
                        return Err(BoardError::Board(format!("sends a frame that is none: {error}")));
                    }
                };
                self.watchdog.note_message();
                self.check(header, &message)?;
                return Ok(message);
            }
            self.block.resize(4 * FRAME_BYTES_MAX, 0);
            match self.from_board.read(&mut self.block) {
                Ok(length @ 1..) => {
                    self.block.truncate(length);
                    self.used = 0;
                }
                Ok(0) | Err(_) => return Err(self.watchdog.kill_and_explain()),
            }
        }
    }

    /// Whether a message is of this session and of the plant's tick.
    fn check(&self, header: Header, message: &BoardMessage) -> Result<(), BoardError> {
        if header.session != SESSION && !matches!(message, BoardMessage::Fault(_)) {
            return Err(BoardError::Board("has started anew".to_owned()));
        }
        if header.ticks != self.ticks {
            let (theirs, ours) = (header.ticks, self.ticks);
            return Err(BoardError::Board(format!("is at tick {theirs}, the plant at {ours}")));
        }
        Ok(())
    }

    /// Sends `message` and receives the answer.
    fn answer(&mut self, message: &HostMessage) -> Result<BoardMessage, BoardError> {
        let bytes = self.frame(message)?;
        self.send(&bytes)?;
        self.receive()
    }

    /// Sends `message` and expects `answer`.
    fn ask(&mut self, message: &HostMessage, answer: &BoardMessage) -> Result<(), BoardError> {
        match self.answer(message)? {
            received if received == *answer => Ok(()),
            other => Err(unexpected(&other)),
        }
    }
}

impl Processor for LockStepBoard {
    fn arm(&mut self, preparation: &[HostMessage]) -> Result<(), BoardError> {
        self.describe(preparation)?;
        self.ask(&HostMessage::Arm, &BoardMessage::Armed)
    }

    fn tell(&mut self, message: &HostMessage) -> Result<BoardMessage, BoardError> {
        self.answer(message)
    }

    fn tick(&mut self, measurements: &TickMeasurements) -> Result<TickRecord, BoardError> {
        let mut bytes = Vec::with_capacity(2 * FRAME_BYTES_MAX);
        if !measurements.ldv_samples.is_empty() {
            let samples: LdvRecords = measurements.ldv_samples.iter().map(|&sample| sample.into()).collect();
            bytes.extend(self.frame(&HostMessage::Ldv(samples))?);
        }
        if let Some(frame) = measurements.camera_frame {
            bytes.extend(camera_frame(self.next_header(), frame)?);
        }
        bytes.extend(self.frame(&HostMessage::Step)?);
        self.send(&bytes)?;
        self.ticks += 1;
        match self.receive()? {
            BoardMessage::Report(report) => Ok(report),
            other => Err(unexpected(&other)),
        }
    }
}
