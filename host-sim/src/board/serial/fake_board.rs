//! For tests: a board at the other end of a pseudo-terminal, that says what a test lets it say.

use std::io::{Read as _, Write as _};
use std::thread::JoinHandle;

use controller::PositionLoop;
use link::{
    BoardFault, BoardIdentity, BoardMessage, Counters, Deframer, FRAME_BYTES_MAX, Header, HostMessage,
    LINE_BAUD, LOOP_DIGEST, ResetCause, decode, encode,
};
use serialport::{SerialPort as _, TTYPort};

use super::session::BoardSession;
use crate::board::pil::acknowledgement;

/// The board.
pub(super) struct FakeBoard {
    line: TTYPort,
    /// Held open, so that there is a line before a session opens it.
    _port: TTYPort,
    deframer: Deframer,
    pub(super) session: u32,
    sequence: u32,
}

impl FakeBoard {
    /// A board, and the name of its port.
    fn at_port() -> (String, Self) {
        let (line, port) = TTYPort::pair().unwrap();
        let name = port.name().unwrap();
        (name, Self { line, _port: port, deframer: Deframer::default(), session: 0, sequence: 0 })
    }

    /// Welcomes the host that says hello.
    fn welcomes(&mut self) {
        let mut hello = std::iter::repeat_with(|| self.frame()).flatten().next().unwrap();
        self.session = decode::<HostMessage>(&mut hello).unwrap().0.session;
        self.says(0, &BoardMessage::Welcome { tick_nanos: PositionLoop::TICK_NANOS });
    }

    /// A session that has begun, and its board.
    pub(super) fn with_session() -> (BoardSession, Self) {
        let (name, mut board) = Self::at_port();
        let board = std::thread::spawn(move || {
            board.welcomes();
            board
        });
        let session = BoardSession::open(&name, LINE_BAUD).unwrap();
        (session, board.join().unwrap())
    }

    /// The name of the port of a board that takes whatever it is told, until it is stopped: what it has heard by then.
    pub(super) fn obedient() -> (String, JoinHandle<(Self, Vec<HostMessage>)>) {
        let (name, mut board) = Self::at_port();
        let heard = std::thread::spawn(move || {
            board.welcomes();
            let mut heard = Vec::new();
            while heard.last() != Some(&HostMessage::Stop) {
                let (message, _) = board.hears_question();
                board.says(1, &obedient_answer(&message));
                heard.push(message);
            }
            // The line is open as long as the board is there.
            (board, heard)
        });
        (name, heard)
    }

    /// The next frame of the host, without its zero; `None` if there is none for a tenth of a second.
    pub(super) fn frame(&mut self) -> Option<Vec<u8>> {
        let mut byte = [0];
        while self.line.read_exact(&mut byte).is_ok() {
            if let Some(frame) = self.deframer.push(byte[0]) {
                return Some(frame.to_vec());
            }
        }
        None
    }

    /// The next message of the host that does not begin the session. It waits for one for two seconds.
    pub(super) fn hears(&mut self) -> HostMessage {
        let frames = std::iter::repeat_with(|| self.frame()).take(20).flatten();
        let mut messages = frames.map(|mut frame| decode(&mut frame).unwrap().1);
        messages.find(|message| *message != HostMessage::Hello).unwrap()
    }

    /// The next message of the host that says more than that it is there, and how often it says that before.
    pub(super) fn hears_question(&mut self) -> (HostMessage, u32) {
        let mut alive = 0;
        loop {
            match self.hears() {
                HostMessage::Ldv(samples) if samples.is_empty() => alive += 1,
                question => return (question, alive),
            }
        }
    }

    pub(super) fn says(&mut self, ticks: u64, message: &BoardMessage) {
        let mut frame = [0; FRAME_BYTES_MAX];
        let header = Header { session: self.session, sequence: self.sequence, ticks };
        self.sequence += 1;
        let length = encode(header, message, &mut frame).unwrap();
        self.line.write_all(&frame[..length]).unwrap();
    }

    /// The line loses the next frames.
    pub(super) fn lose(&mut self, frames: u32) {
        self.sequence += frames;
    }

    /// The board begins the session anew, as after a reset.
    pub(super) fn begin_anew(&mut self) {
        self.sequence = 0;
    }
}

/// What a board answers that refuses nothing and keeps no description.
fn obedient_answer(message: &HostMessage) -> BoardMessage {
    match message {
        HostMessage::Identify => BoardMessage::Identity(BoardIdentity {
            loop_digest: LOOP_DIGEST,
            reset_cause: ResetCause::Power.into(),
        }),
        HostMessage::Digest => BoardMessage::Fault(BoardFault::KeepsNothing),
        HostMessage::Count => BoardMessage::Counters(Counters::default()),
        HostMessage::Jog(_) => BoardMessage::Jogging,
        HostMessage::Arm => BoardMessage::Armed,
        HostMessage::Stop => BoardMessage::Stopped,
        description => acknowledgement(description),
    }
}
