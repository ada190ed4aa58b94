//! Frames of one session, both ways.
//!
//! A thread reads the port and sends what it decodes, with the time of its arrival ([`super::port_reader`]). Frames to
//! the board are written at most at the line's rate.

mod questions;

use std::io::{ErrorKind, Write as _};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::Duration;

use controller::PositionLoop;
use estimator::CameraFrame;
use link::camera_frame::UNIT_NANOS;
use link::{
    Arrival, BoardFault, BoardMessage, FRAME_BYTES_MAX, Header, HostMessage, Sequence, encode, encode_camera,
};
use motor_model::Time;
use serialport::SerialPort;
use simulation::math::clock_sync::{BoardClock, ClockSync, Exchange};

use super::frame_text::{FrameTextError, HostFrame};
use super::host_clock::{day_nanos, host_nanos, nanos, seconds};
use super::line_rate::{LineLoad, LinePace};
use super::port_reader::PortReader;
use super::time_questions::TimeQuestions;
use super::{SerialError, port};

/// Time for the first answer.
const FIRST_ANSWER_MAX: Duration = Duration::from_secs(2);
/// Time after which an unanswered Hello is sent again.
const HELLO_EVERY: Duration = Duration::from_millis(250);

/// What the host waits for.
#[derive(Debug)]
pub(super) enum Event {
    /// A message of the board, and when it had arrived.
    Board { header: Header, message: BoardMessage, at_nanos: i64, bytes: usize },
    /// A frame of another version of the protocol.
    OtherVersion { theirs: u8 },
    /// The port cannot be read any more.
    Closed(String),
    /// A camera frame of the source, by the host's clock.
    Frame(HostFrame),
    /// The source has no more.
    SourceEnded,
    /// The source is refused.
    SourceFailed(FrameTextError),
}

/// A session with a board.
pub(super) struct BoardSession {
    port: Box<dyn SerialPort>,
    _reader: PortReader,
    name: String,
    baud: u32,
    events: Receiver<Event>,
    to_events: Sender<Event>,
    number: u32,
    sequence: u32,
    pace: LinePace,
    /// When the last frame was written.
    pub(super) last_sent: i64,
    /// When the last message of this session arrived.
    pub(super) last_heard: i64,
    /// The questions whose answers tell the board's time, and when the last of them was sent that is to set the clocks.
    /// What the board does in between may hold its time.
    questions: TimeQuestions,
    asked: Option<i64>,
    sync: ClockSync,
    /// The number that is expected of the board's next frame.
    incoming: Sequence,
    /// Frames of the board that the line has lost or damaged.
    pub(super) lost: u64,
    /// Load of the line to the board, and from it.
    pub(super) load: [LineLoad; 2],
}

impl BoardSession {
    /// Opens the port and begins a session.
    ///
    /// # Errors
    /// When the port cannot be opened, nothing answers, or the board is of another version.
    pub(super) fn open(name: &str, baud: u32) -> Result<Self, SerialError> {
        let port = port::open(name, baud)?;
        let reader = port
            .try_clone()
            .map_err(|error| SerialError::Unopened { port: name.to_owned(), reason: error.description })?;
        let (to_events, events) = channel();
        let to_receiver = to_events.clone();
        let reader = PortReader::start(reader, to_receiver);
        let now = host_nanos();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "any number does")]
        let number = (day_nanos() / 1_000_000) as u32;
        let mut session = Self {
            port,
            _reader: reader,
            name: name.to_owned(),
            baud,
            events,
            to_events,
            number,
            sequence: 0,
            pace: LinePace::new(baud),
            last_sent: now,
            last_heard: now,
            questions: TimeQuestions::default(),
            asked: None,
            sync: ClockSync::default(),
            incoming: Sequence::default(),
            lost: 0,
            load: [LineLoad::default(); 2],
        };
        session.hello()?;
        Ok(session)
    }

    /// Where other threads put events.
    pub(super) fn sender(&self) -> Sender<Event> {
        self.to_events.clone()
    }

    /// Begins the session, or begins it again: the board forgets what it was told and does not keep, and switches its
    /// drive off.
    ///
    /// # Errors
    /// When nothing answers, or the board is of another version.
    pub(super) fn hello(&mut self) -> Result<(), SerialError> {
        let begun = host_nanos();
        // A zero ends what noise has begun.
        self.write(&[0])?;
        loop {
            self.send(&HostMessage::Hello)?;
            let deadline = host_nanos() + nanos(HELLO_EVERY);
            while let Some(event) = self.next_event_until(deadline) {
                match event {
                    Event::Board { header, message: BoardMessage::Welcome { tick_nanos }, .. }
                        if header.session == self.number =>
                    {
                        let expected = PositionLoop::TICK_NANOS;
                        return if tick_nanos == expected {
                            Ok(())
                        } else {
                            Err(SerialError::OtherTick { found: tick_nanos, expected })
                        };
                    }
                    Event::OtherVersion { theirs } => return Err(SerialError::OtherVersion { theirs }),
                    Event::Board {
                        message: BoardMessage::Fault(BoardFault::Version { ours, .. }), ..
                    } => return Err(SerialError::OtherVersion { theirs: ours }),
                    Event::Closed(reason) => return Err(self.closed(reason, None)),
                    _ => {}
                }
            }
            if host_nanos() - begun >= nanos(FIRST_ANSWER_MAX) {
                let waited_s = FIRST_ANSWER_MAX.as_secs_f64();
                return Err(SerialError::NoAnswer { port: self.name.clone(), baud: self.baud, waited_s });
            }
        }
    }

    /// The error of a port that was closed; `armed_at` is when the board was armed.
    pub(super) fn closed(&self, reason: String, armed_at: Option<i64>) -> SerialError {
        let after_s = armed_at.map_or(0.0, |armed_at| seconds(host_nanos() - armed_at));
        SerialError::Disconnected { port: self.name.clone(), after_s, reason }
    }

    /// Sends `message`, when the line is free.
    ///
    /// # Errors
    /// When the port is closed.
    pub(super) fn send(&mut self, message: &HostMessage) -> Result<(), SerialError> {
        let mut frame = [0; FRAME_BYTES_MAX];
        let length = encode(self.header(0), message, &mut frame)?;
        self.write(&frame[..length])?;
        self.questions.sent(message, self.last_sent);
        Ok(())
    }

    /// A frame of the source by the board's clock; `None` before that is known.
    pub(super) fn on_board(&self, frame: &HostFrame) -> Option<CameraFrame> {
        self.clock().map(|clock| frame.on_board(clock.board_nanos(frame.exposed_nanos)))
    }

    /// Sends a camera frame when the line is free; the frame as it goes over the line, and its bytes. Its instant is
    /// rounded to what the line carries, far below the uncertainty of the clocks.
    ///
    /// # Errors
    /// When the port is closed.
    pub(super) fn send_camera(&mut self, frame: CameraFrame) -> Result<(CameraFrame, usize), SerialError> {
        let units = (frame.exposed_at.nanos() + UNIT_NANOS / 2) / UNIT_NANOS;
        let frame = CameraFrame { exposed_at: Time::from_nanos(units * UNIT_NANOS), ..frame };
        let board_nanos = self.clock().map_or(0, |clock| clock.board_nanos(host_nanos()));
        let ticks = board_nanos / PositionLoop::TICK_NANOS;
        let mut bytes = [0; FRAME_BYTES_MAX];
        let length = encode_camera(self.header(ticks), frame.into(), &mut bytes)?;
        self.write(&bytes[..length]).map(|()| (frame, length))
    }

    /// The header of the next frame.
    fn header(&mut self, ticks: u64) -> Header {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        Header { session: self.number, sequence, ticks }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), SerialError> {
        let wait = self.pace.take(host_nanos(), bytes.len());
        if wait > 0 {
            std::thread::sleep(Duration::from_nanos(wait));
        }
        self.last_sent = host_nanos();
        self.load[0].add(bytes.len());
        self.port.write_all(bytes).map_err(|error| match error.kind() {
            ErrorKind::TimedOut => {
                SerialError::Stuck { port: self.name.clone(), waited_s: port::WAIT_MAX.as_secs_f64() }
            }
            _ => self.closed(error.to_string(), None),
        })
    }

    /// The next event, if one comes until `deadline`. Notes time, load, and exchanges of clocks.
    pub(super) fn next_event_until(&mut self, deadline: i64) -> Option<Event> {
        let wait = Duration::from_nanos(u64::try_from(deadline - host_nanos()).unwrap_or(0));
        let event = match self.events.recv_timeout(wait) {
            Ok(event) => event,
            Err(RecvTimeoutError::Timeout) => return None,
            Err(RecvTimeoutError::Disconnected) => Event::Closed("its reader ended".to_owned()),
        };
        if let Event::Board { header, message, at_nanos, bytes } = &event {
            self.load[1].add(*bytes);
            if header.session == self.number {
                self.note(*header, message, *at_nanos);
            }
        }
        Some(event)
    }

    /// Notes when a message of this session has arrived, what is missing before it, and what it tells of the clocks.
    fn note(&mut self, header: Header, message: &BoardMessage, at_nanos: i64) {
        self.last_heard = at_nanos;
        if let BoardMessage::Welcome { .. } = message {
            // A board that has started anew counts anew.
            self.incoming = Sequence::after(header.sequence);
        } else if let Arrival::New { lost } = self.incoming.judge(header.sequence) {
            self.lost += u64::from(lost);
        }
        let asked = self.asked;
        if let Some(sent_nanos) = self.questions.answered(message).filter(|sent| Some(*sent) == asked) {
            self.sync.add(Exchange { sent_nanos, received_nanos: at_nanos, ticks: header.ticks });
        }
    }

    /// Asks a board that is armed whether it is; the answer sets the clocks. To an armed board this changes nothing.
    /// Where the answer to such a question may still come, it is asked something else, or nothing.
    ///
    /// # Errors
    /// When the port is closed.
    pub(super) fn ask_time(&mut self) -> Result<(), SerialError> {
        self.ask_time_by(&[HostMessage::Arm, HostMessage::Count, HostMessage::Identify])
    }

    /// Asks a board that is not to be armed for its counters, likewise.
    ///
    /// # Errors
    /// When the port is closed.
    pub(super) fn ask_time_unarmed(&mut self) -> Result<(), SerialError> {
        self.ask_time_by(&[HostMessage::Count, HostMessage::Identify])
    }

    fn ask_time_by(&mut self, questions: &[HostMessage]) -> Result<(), SerialError> {
        let Some(question) = self.questions.sure(questions, host_nanos()) else { return Ok(()) };
        self.send(question)?;
        self.asked = Some(self.last_sent);
        Ok(())
    }

    /// Forgets what is known of the board's clock.
    pub(super) fn forget_clock(&mut self) {
        self.sync = ClockSync::default();
    }

    /// The board's clock as it is known now.
    pub(super) fn clock(&self) -> Option<BoardClock> {
        self.sync.at(host_nanos())
    }

    /// The shortest round trip in ns.
    pub(super) fn shortest_nanos(&self) -> Option<i64> {
        self.sync.shortest_nanos()
    }

    /// The line's rate.
    pub(super) fn baud(&self) -> u32 {
        self.baud
    }
}

#[cfg(all(test, unix))]
mod tests;
