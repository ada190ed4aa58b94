//! Attends to a board that does something for a while without reports: a jog, a self-test.
//!
//! The board is asked for its counters again and again, one question at a time. The answers tell its time, set the
//! clocks, and show that it is there; the questions show it that the host is. Where an answer takes long, empty
//! messages do that.

use std::sync::atomic::{AtomicBool, Ordering};

use link::{BoardMessage, Header, HostMessage, LdvRecords};

use super::SerialError;
use super::board_pace::BoardPace;
use super::error::Stopped;
use super::frame_text::HostFrame;
use super::host_clock::{host_nanos, nanos, seconds};
use super::serial_run::{FIRST_QUESTIONS, KEEP_ALIVE, LOOK_EVERY, SILENCE_MAX};
use super::session::{BoardSession, Event};
use super::time_questions::is_time_answer;

/// The board's time between two questions.
const ASK_EVERY: std::time::Duration = std::time::Duration::from_millis(1);

/// What is seen of the board while it is attended.
#[derive(Debug)]
pub(super) enum Seen {
    /// It has counted so many ticks.
    Ticks(u64),
    /// It says something else.
    Message(BoardMessage),
    /// The source has a camera frame.
    Frame(HostFrame),
}

/// What is attended, and until when.
pub(super) struct Attendance<'a> {
    /// What it is, for an error.
    pub what: &'static str,
    /// The board's ticks when it began.
    pub begun_ticks: u64,
    /// Ticks after which it must have been answered.
    pub ticks_max: u64,
    /// Set to end it.
    pub interrupted: &'a AtomicBool,
}

impl Attendance<'_> {
    /// Attends until `take` has an answer. The drive is off at the end, whatever the end is.
    ///
    /// # Errors
    /// When it is interrupted, the board falls silent, switches off with a fault or does not answer in its time, the
    /// line is gone, or a frame of the source is refused.
    pub(super) fn until<T>(
        &self,
        session: &mut BoardSession,
        mut take: impl FnMut(&mut BoardSession, Seen) -> Result<Option<T>, SerialError>,
    ) -> Result<(T, Stopped), SerialError> {
        let begun_at = host_nanos();
        let after_s = || seconds(host_nanos() - begun_at);
        let ended = self.attend(session, begun_at, &mut take);
        if let Err(Early::Lost(SerialError::Disconnected { port, reason, .. })) = ended {
            return Err(SerialError::Disconnected { port, reason, after_s: after_s() });
        }
        let after_s = after_s();
        let stopped = if session.stop() { Stopped::Acknowledged } else { Stopped::Unacknowledged };
        match ended {
            Ok(answer) => Ok((answer, stopped)),
            Err(Early::Interrupted) => Err(SerialError::Interrupted { stopped }),
            Err(Early::Silent) => {
                Err(SerialError::Silent { silent_s: SILENCE_MAX.as_secs_f64(), after_s, stopped })
            }
            Err(Early::Fault(fault)) => Err(SerialError::Fault { fault, after_s, stopped }),
            Err(Early::SourceFailed(error)) => Err(SerialError::Source { error, stopped }),
            Err(Early::Lost(error)) => Err(error),
        }
    }

    fn attend<T>(
        &self,
        session: &mut BoardSession,
        begun_at: i64,
        take: &mut impl FnMut(&mut BoardSession, Seen) -> Result<Option<T>, SerialError>,
    ) -> Result<T, Early> {
        let mut pace = BoardPace::new(begun_at, self.begun_ticks);
        let (mut asked_at, mut is_asked) = (begun_at, false);
        loop {
            if self.interrupted.load(Ordering::Relaxed) {
                return Err(Early::Interrupted);
            }
            let now = host_nanos();
            if now - session.last_heard > nanos(SILENCE_MAX) {
                return Err(Early::Silent);
            }
            // A question without an answer is lost, or late.
            if !is_asked && now - asked_at >= pace.host_nanos(ASK_EVERY) {
                session.ask_time_unarmed()?;
                (asked_at, is_asked) = (now, true);
            } else if now - session.last_sent >= pace.host_nanos(KEEP_ALIVE) {
                session.send(&HostMessage::Ldv(LdvRecords::new()))?;
                is_asked &= now - asked_at < nanos(SILENCE_MAX) / 2;
            }
            let wait = nanos(LOOK_EVERY).min(pace.host_nanos(ASK_EVERY));
            let Some(event) = session.next_event_until(now + wait) else { continue };
            let seen = match event {
                Event::Board { header, message, at_nanos, .. } if is_time_answer(&message) => {
                    is_asked = false;
                    pace.take(header.ticks, at_nanos);
                    self.check_time(header)?;
                    Seen::Ticks(header.ticks)
                }
                Event::Board { message: BoardMessage::Fault(fault), .. } => return Err(Early::Fault(fault)),
                Event::Board { message, .. } => Seen::Message(message),
                Event::Frame(frame) => Seen::Frame(frame),
                Event::OtherVersion { theirs } => return Err(SerialError::OtherVersion { theirs }.into()),
                Event::Closed(reason) => return Err(session.closed(reason, Some(begun_at)).into()),
                // A camera that sends nothing is what a self-test is to find.
                Event::SourceEnded => continue,
                Event::SourceFailed(error) => return Err(Early::SourceFailed(error)),
            };
            if let Some(answer) = take(session, seen)? {
                return Ok(answer);
            }
        }
    }

    /// The answer may be lost on the line: it is not waited for for ever.
    fn check_time(&self, Header { ticks, .. }: Header) -> Result<(), SerialError> {
        let passed = ticks.saturating_sub(self.begun_ticks);
        if passed <= self.ticks_max {
            return Ok(());
        }
        let waited_s = 1e-9 * simulation::math::count::real(passed * controller::TICK_NANOS);
        Err(SerialError::Unanswered { what: self.what, waited_s })
    }
}

/// Why it has ended early.
enum Early {
    Interrupted,
    Silent,
    Fault(link::BoardFault),
    SourceFailed(super::frame_text::FrameTextError),
    /// No stop can be sent, or none is needed.
    Lost(SerialError),
}

impl From<SerialError> for Early {
    fn from(error: SerialError) -> Self {
        Self::Lost(error)
    }
}

/// Asks the time until the clocks are set; the board's ticks then.
///
/// # Errors
/// When the board does not answer.
pub(super) fn set_clocks(session: &mut BoardSession) -> Result<u64, SerialError> {
    let mut ticks = 0;
    for _ in 0..FIRST_QUESTIONS {
        ticks = session.ticks_unarmed()?;
    }
    Ok(ticks)
}
