//! The firmware in QEMU, at the other end of two pipes.

use std::io::{Read as _, Write as _};
use std::path::Path;
use std::process::{ChildStdin, ChildStdout};

use controller::PositionLoop;
use link::{
    BoardMessage, Configuration, Counters, Deframer, FRAME_BYTES_MAX, Header, HostMessage, LdvRecords,
    TickRecord, decode, encode,
};

use super::Processor;
use super::process::{self, Guard, Link, OneProcessor, Wiring};
use crate::board::BoardError;
use crate::board::instructions::Board;
use crate::runs::tick_driver::TickMeasurements;

/// Any number but 0, which the board bears without a host.
const SESSION: u32 = 1;

/// A board at work.
#[derive(Debug)]
pub struct Emulated {
    to_board: Option<ChildStdin>,
    from_board: ChildStdout,
    deframer: Deframer,
    /// Bytes received, and how many of them are used up.
    block: Vec<u8>,
    used: usize,
    sequence: u32,
    ticks: u64,
    guard: Guard,
    /// Whether what is no frame may come over the link: it is passed over.
    disturbed: bool,
    _one_processor: Option<OneProcessor>,
}

impl Emulated {
    /// Starts the program `pil` in `elf` on `board`.
    ///
    /// # Errors
    /// When the program cannot be read, or the emulator not be started.
    pub fn start(elf: &Path, board: Board, wiring: Wiring<'_>) -> Result<Self, BoardError> {
        // The emulated serial line is served by another thread of the emulator than the processor: they do not take turns.
        let one_processor = if wiring.link == Link::Semihosting { OneProcessor::hold() } else { None };
        let (to_board, from_board, guard) = process::start(elf, board, wiring, &[])?;
        Ok(Self {
            to_board: Some(to_board),
            from_board,
            deframer: Deframer::default(),
            block: Vec::new(),
            used: 0,
            sequence: 0,
            ticks: 0,
            guard,
            disturbed: wiring.link == Link::Uart,
            _one_processor: one_processor,
        })
    }

    /// How the board fares.
    ///
    /// # Errors
    /// When it does not say.
    pub fn counters(&mut self) -> Result<Counters, BoardError> {
        let mut bytes = Vec::new();
        self.put(&mut bytes, &HostMessage::Count)?;
        self.send(&bytes)?;
        match self.receive()? {
            BoardMessage::Counters(counters) => Ok(counters),
            said => Err(unexpected(&said)),
        }
    }

    /// Ends the program.
    ///
    /// # Errors
    /// When it ends in failure.
    pub fn finish(mut self) -> Result<(), BoardError> {
        self.to_board = None;
        // A serial line has no end: the program waits for more.
        if self.disturbed { Ok(()) } else { self.guard.wait() }
    }

    /// Puts bytes on the link that are none of the host's, as a disturbance would.
    ///
    /// # Errors
    /// When the board has gone.
    pub fn disturb(&mut self, bytes: &[u8]) -> Result<(), BoardError> {
        self.send(bytes)
    }

    /// Puts a message at the end of `bytes`.
    fn put(&mut self, bytes: &mut Vec<u8>, message: &HostMessage) -> Result<(), BoardError> {
        let header = Header { session: SESSION, sequence: self.sequence, ticks: self.ticks };
        self.sequence = self.sequence.wrapping_add(1);
        let mut frame = [0; FRAME_BYTES_MAX];
        let length =
            encode(header, message, &mut frame).map_err(|error| BoardError::Board(error.to_string()))?;
        bytes.extend_from_slice(&frame[..length]);
        Ok(())
    }

    fn send(&mut self, bytes: &[u8]) -> Result<(), BoardError> {
        // Ends whatever a disturbance has begun.
        let end: &[u8] = if self.disturbed { &[0] } else { &[] };
        let bytes = &[end, bytes].concat();
        let written = self.to_board.as_mut().map(|pipe| pipe.write_all(bytes).and_then(|()| pipe.flush()));
        match written {
            Some(Ok(())) => Ok(()),
            _ => Err(self.guard.lost()),
        }
    }

    fn receive(&mut self) -> Result<BoardMessage, BoardError> {
        loop {
            while let Some(&byte) = self.block.get(self.used) {
                self.used += 1;
                let Some(frame) = self.deframer.push(byte) else { continue };
                let (header, message) = match decode::<BoardMessage>(frame) {
                    Ok(whole) => whole,
                    Err(_) if self.disturbed => continue,
                    Err(error) => {
                        return Err(BoardError::Board(format!("sends a frame that is none: {error}")));
                    }
                };
                self.guard.alive();
                if header.session != SESSION && !matches!(message, BoardMessage::Fault(_)) {
                    return Err(BoardError::Board("has started anew".to_owned()));
                }
                if header.ticks != self.ticks {
                    let (theirs, ours) = (header.ticks, self.ticks);
                    return Err(BoardError::Board(format!("is at tick {theirs}, the plant at {ours}")));
                }
                return Ok(message);
            }
            self.block.resize(4 * FRAME_BYTES_MAX, 0);
            match self.from_board.read(&mut self.block) {
                Ok(length @ 1..) => {
                    self.block.truncate(length);
                    self.used = 0;
                }
                Ok(0) | Err(_) => return Err(self.guard.lost()),
            }
        }
    }

    /// Says `message` and wants `answer`.
    fn ask(&mut self, message: &HostMessage, answer: &BoardMessage) -> Result<(), BoardError> {
        let mut bytes = Vec::new();
        self.put(&mut bytes, message)?;
        self.send(&bytes)?;
        match self.receive()? {
            said if said == *answer => Ok(()),
            said => Err(unexpected(&said)),
        }
    }
}

fn unexpected(said: &BoardMessage) -> BoardError {
    BoardError::Board(match said {
        BoardMessage::Fault(fault) => format!("reports a fault: {fault}"),
        other => format!("answers something else than was asked: {other:?}"),
    })
}

impl Processor for Emulated {
    fn arm(&mut self, configuration: Configuration) -> Result<(), BoardError> {
        let tick_nanos = PositionLoop::TICK_NANOS;
        self.ask(&HostMessage::Hello, &BoardMessage::Welcome { tick_nanos })?;
        self.ask(&HostMessage::Configure(configuration), &BoardMessage::Configured)?;
        self.ask(&HostMessage::Arm, &BoardMessage::Armed)
    }

    fn tick(&mut self, measurements: &TickMeasurements) -> Result<TickRecord, BoardError> {
        let mut bytes = Vec::with_capacity(2 * FRAME_BYTES_MAX);
        if !measurements.ldv_samples.is_empty() {
            let samples: LdvRecords = measurements.ldv_samples.iter().map(|&sample| sample.into()).collect();
            self.put(&mut bytes, &HostMessage::Ldv(samples))?;
        }
        if let Some(frame) = measurements.camera_frame {
            self.put(&mut bytes, &HostMessage::Camera(frame.into()))?;
        }
        self.put(&mut bytes, &HostMessage::Step)?;
        self.send(&bytes)?;
        self.ticks += 1;
        match self.receive()? {
            BoardMessage::Report(report) => Ok(report),
            said => Err(unexpected(&said)),
        }
    }
}
