//! The session with the host: frames in, frames out, and which of them count.

use controller::PositionLoop;
use link::{
    Arrival, BoardFault, BoardMessage, BoardSequence, Expected, FRAME_BYTES_MAX, FrameError, Header,
    HostMessage, SHORT_FRAME_BYTES, VERSION, decode_on_board, encode_on_board,
};

use super::Application;
use crate::design::DesignedDrive;

/// The session with the host.
#[derive(Clone, Copy, Debug)]
pub(super) struct Session {
    number: u32,
    incoming: BoardSequence,
    outgoing: u32,
}

impl<D: DesignedDrive> Application<'_, D> {
    /// Takes bytes from the host, and gives the frame of every answer to `send`.
    pub fn receive(&mut self, bytes: &[u8], send: &mut impl FnMut(&[u8])) {
        for &byte in bytes {
            let Some(frame) = self.deframer.push(byte) else { continue };
            let is_short = frame.len() <= SHORT_FRAME_BYTES;
            let now_nanos = self.elapsed_ticks * PositionLoop::TICK_NANOS;
            let expected = self.session.map(|Session { number, incoming, .. }| Expected {
                session: number,
                sequence: incoming.next(),
                now_nanos,
            });
            let answer = match decode_on_board(frame, expected) {
                Ok((header, message)) => self.accept(header, is_short, &message),
                Err(FrameError::Version { theirs }) => {
                    self.counters.other_version += 1;
                    Some(BoardMessage::Fault(BoardFault::Version { theirs, ours: VERSION }))
                }
                // The host does not know that the board has started anew.
                Err(FrameError::NoSession) => {
                    self.counters.other_session += 1;
                    Some(BoardMessage::Fault(BoardFault::UnknownSession { session: 0 }))
                }
                Err(_) => {
                    self.counters.damaged += 1;
                    None
                }
            };
            if let Some(answer) = answer {
                self.send(&answer, send);
            }
        }
    }

    /// Makes a frame of `message` and gives it to `send`.
    pub fn send(&mut self, message: &BoardMessage, send: &mut impl FnMut(&[u8])) {
        let (session, sequence) = match &mut self.session {
            Some(session) => {
                let sequence = session.outgoing;
                session.outgoing = sequence.wrapping_add(1);
                (session.number, sequence)
            }
            None => (0, 0),
        };
        let mut frame = [0; FRAME_BYTES_MAX];
        let header = Header { session, sequence, ticks: self.elapsed_ticks };
        if let Some(frame) =
            encode_on_board(header, message, &mut frame).ok().and_then(|length| frame.get(..length))
        {
            send(frame);
        }
    }

    /// Checks session and sequence of a frame and executes its message; the answer, if the message has one.
    fn accept(&mut self, header: Header, is_short: bool, message: &HostMessage) -> Option<BoardMessage> {
        let Header { session: number, sequence, .. } = header;
        match &mut self.session {
            Some(Session { number: ours, incoming, .. }) if *ours == number => {
                let arrival =
                    if is_short { incoming.judge_short(sequence) } else { incoming.judge_whole(sequence) };
                match arrival {
                    Arrival::New { lost } => self.counters.lost = self.counters.lost.saturating_add(lost),
                    Arrival::Duplicate => {
                        self.counters.duplicates += 1;
                        return None;
                    }
                    Arrival::Late => {
                        self.counters.late += 1;
                        return None;
                    }
                }
            }
            _ if *message == HostMessage::Hello => {
                let incoming = BoardSequence::after(sequence);
                self.session = Some(Session { number, incoming, outgoing: 0 });
            }
            _ => {
                self.counters.other_session += 1;
                return Some(BoardMessage::Fault(BoardFault::UnknownSession { session: number }));
            }
        }
        self.counters.taken = self.counters.taken.wrapping_add(1);
        self.last_frame_at = self.elapsed_ticks;
        self.execute(message)
    }
}
