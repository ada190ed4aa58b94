//! What a board is asked, and its answers.
//!
//! The line may lose a question or its answer. What may be asked twice is asked again, once.
//!
//! A board that is armed, or may be, switches off where it hears nothing for 10 ms. While the host waits for its answer
//! it says again and again that it is there, by an empty message.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use controller::map_correction::LearntFactors;
use link::{
    BoardFault, BoardIdentity, BoardMessage, Counters, DescriptionDigests, Header, HostMessage, LdvRecords,
};

use super::{BoardSession, Event};
use crate::board::serial::SerialError;
use crate::board::serial::error::Stopped;
use crate::board::serial::host_clock::{host_nanos, nanos};
use crate::board::serial::serial_run::KEEP_ALIVE;
use crate::board::serial::time_questions::is_time_answer;

/// Time for any other answer. A filter takes some ms to build, on an emulated board up to a second.
const ANSWER_MAX: Duration = Duration::from_secs(3);
/// Time for the answer of a board whose flash works: a board erases for up to 4.4 s to forget a description.
const STORE_ANSWER_MAX: Duration = Duration::from_secs(10);
/// Time after which the board is asked something else, to see whether an answer is late, or was lost.
const LATE_AFTER: Duration = Duration::from_millis(250);
/// Stops that are sent before the host gives up, and the time for the answer to each.
const STOPS_MAX: usize = 3;
const STOP_ANSWER_MAX: Duration = Duration::from_secs(1);
/// To a board that is not armed the host need not say that it is there.
const NOT_KEPT_ALIVE: i64 = i64::MAX;

impl BoardSession {
    /// What the board is. The line may lose the question or its answer: it is asked again, once.
    ///
    /// # Errors
    /// When the board does not answer.
    pub(in crate::board::serial) fn identity(&mut self) -> Result<BoardIdentity, SerialError> {
        let what = "the question what it is";
        for _ in 0..2 {
            self.send(&HostMessage::Identify)?;
            match self.answer(what, |answer| matches!(answer, BoardMessage::Identity(_))) {
                Ok((_, BoardMessage::Identity(identity))) => return Ok(identity),
                Ok(_) | Err(SerialError::Unanswered { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Err(SerialError::Unanswered { what, waited_s: 2.0 * ANSWER_MAX.as_secs_f64() })
    }

    /// Which description of the bench is in force on the board, and which it keeps; `None` where it has no place for
    /// one. The line may lose the question or its answer: it is asked again, once.
    ///
    /// # Errors
    /// When the board does not answer.
    pub(in crate::board::serial) fn digests(&mut self) -> Result<Option<DescriptionDigests>, SerialError> {
        let what = "the question which description it has";
        for _ in 0..2 {
            self.send(&HostMessage::Digest)?;
            match self.answer(what, |answer| matches!(answer, BoardMessage::Digests(_))) {
                Ok((_, BoardMessage::Digests(digests))) => return Ok(Some(digests)),
                Err(SerialError::Refused { fault: BoardFault::KeepsNothing, .. }) => return Ok(None),
                Ok(_) | Err(SerialError::Unanswered { .. }) => {}
                Err(error) => return Err(error),
            }
        }
        Err(SerialError::Unanswered { what, waited_s: 2.0 * ANSWER_MAX.as_secs_f64() })
    }

    /// Arms the board; its count of ticks then. The line may lose the question or its answer: it is asked again, once.
    /// A board that is armed says so, and changes nothing.
    ///
    /// # Errors
    /// When the board refuses it, or does not answer.
    pub(in crate::board::serial) fn arm(&mut self) -> Result<u64, SerialError> {
        let (what, alive_nanos) = ("arming", nanos(KEEP_ALIVE));
        let is_answer = |answer: &BoardMessage| *answer == BoardMessage::Armed;
        self.ask_time_by(&[HostMessage::Arm])?;
        let answered = match self.answer_within(LATE_AFTER, alive_nanos, what, is_answer) {
            Err(SerialError::Unanswered { .. }) => {
                self.send(&HostMessage::Arm)?;
                self.answer_within(ANSWER_MAX, alive_nanos, what, is_answer)
            }
            answered => answered,
        };
        answered.map(|(header, _)| header.ticks)
    }

    /// The board's counters; `None` if it does not tell them.
    pub(in crate::board::serial) fn counters(&mut self) -> Option<Counters> {
        let told = |answer: &BoardMessage| matches!(answer, BoardMessage::Counters(_));
        match self.ask_again(&HostMessage::Count, NOT_KEPT_ALIVE, "its counters", told) {
            Ok((_, BoardMessage::Counters(counters))) => Some(counters),
            _ => None,
        }
    }

    /// What the move of the armed board has learnt of its motor; `None` if it does not tell it. Meanwhile the board
    /// hears from the host every `alive_nanos` of the host's clock.
    pub(in crate::board::serial) fn learnt(&mut self, alive_nanos: i64) -> Option<LearntFactors> {
        let told = |answer: &BoardMessage| matches!(answer, BoardMessage::Learnt(_));
        match self.ask_again(&HostMessage::Learnt, alive_nanos, "what it has learnt", told) {
            Ok((_, BoardMessage::Learnt(learnt))) => Some(learnt.into()),
            _ => None,
        }
    }

    /// The answer to `question`. The line may lose either: it is asked again, once.
    fn ask_again(
        &mut self,
        question: &HostMessage,
        alive_nanos: i64,
        what: &'static str,
        is_answer: impl Fn(&BoardMessage) -> bool,
    ) -> Result<(Header, BoardMessage), SerialError> {
        self.send(question)?;
        match self.answer_within(LATE_AFTER, alive_nanos, what, &is_answer) {
            Err(SerialError::Unanswered { .. }) => {}
            answered => return answered,
        }
        self.send(question)?;
        self.answer_within(ANSWER_MAX, alive_nanos, what, is_answer)
    }

    /// Sends `message` and waits for its answer, which is `expected`. The board answers in order: where it answers a
    /// later question, and not this one, the line has lost the frame or its answer.
    ///
    /// # Errors
    /// [`SerialError::Unanswered`] when it was lost, or the board is silent; when the board refuses it.
    pub(in crate::board::serial) fn ask(
        &mut self,
        message: &HostMessage,
        what: &'static str,
        expected: &BoardMessage,
    ) -> Result<(), SerialError> {
        let is_answer = |answer: &BoardMessage| answer == expected;
        let is_later_answer = |answer: &BoardMessage| matches!(answer, BoardMessage::Counters(_));
        self.send(message)?;
        // A board whose flash works hears no questions.
        let works = matches!(message, HostMessage::Keep | HostMessage::Forget);
        let time = if works { STORE_ANSWER_MAX } else { LATE_AFTER };
        match self.answer_within(time, NOT_KEPT_ALIVE, what, is_answer) {
            Err(SerialError::Unanswered { .. }) if !works => {}
            answered => return answered.map(|_| ()),
        }
        self.send(&HostMessage::Count)?;
        let (_, answer) = self.answer(what, |answer| is_answer(answer) || is_later_answer(answer))?;
        if is_later_answer(&answer) {
            return Err(SerialError::Unanswered { what, waited_s: LATE_AFTER.as_secs_f64() });
        }
        // The next message has to find the line without that answer. It may be lost.
        let _ = self.answer_within(LATE_AFTER, NOT_KEPT_ALIVE, what, is_later_answer);
        Ok(())
    }

    /// The count of ticks of a board that is not to be armed; its answer sets the clocks. The line may lose it or the
    /// question: it is asked again, once.
    ///
    /// # Errors
    /// When the board does not answer.
    pub(in crate::board::serial) fn ticks_unarmed(&mut self) -> Result<u64, SerialError> {
        let what = "the question for its time";
        self.ask_time_unarmed()?;
        let answered = match self.answer_within(LATE_AFTER, NOT_KEPT_ALIVE, what, is_time_answer) {
            Err(SerialError::Unanswered { .. }) => {
                self.ask_time_unarmed()?;
                self.answer(what, is_time_answer)
            }
            answered => answered,
        };
        answered.map(|(header, _)| header.ticks)
    }

    fn answer(
        &mut self,
        what: &'static str,
        is_answer: impl Fn(&BoardMessage) -> bool,
    ) -> Result<(Header, BoardMessage), SerialError> {
        self.answer_within(ANSWER_MAX, NOT_KEPT_ALIVE, what, is_answer)
    }

    /// The answer that comes within `time`. Meanwhile the board hears from the host every `alive_nanos`.
    fn answer_within(
        &mut self,
        time: Duration,
        alive_nanos: i64,
        what: &'static str,
        is_answer: impl Fn(&BoardMessage) -> bool,
    ) -> Result<(Header, BoardMessage), SerialError> {
        let deadline = host_nanos() + nanos(time);
        loop {
            let alive_at = self.last_sent.saturating_add(alive_nanos);
            let Some(event) = self.next_event_until(deadline.min(alive_at)) else {
                if host_nanos() >= deadline {
                    return Err(SerialError::Unanswered { what, waited_s: time.as_secs_f64() });
                }
                if host_nanos() >= alive_at {
                    self.send(&HostMessage::Ldv(LdvRecords::new()))?;
                }
                continue;
            };
            match event {
                Event::Board { header, message, .. } if is_answer(&message) => {
                    return Ok((header, message));
                }
                Event::Board { message: BoardMessage::Fault(fault), .. } => {
                    return Err(SerialError::Refused { what, fault });
                }
                Event::Closed(reason) => return Err(self.closed(reason, None)),
                _ => {}
            }
        }
    }

    /// To be asked right before the drive may go on: the board is stopped where `interrupted` is set.
    ///
    /// # Errors
    /// [`SerialError::Interrupted`] where it is set.
    pub(in crate::board::serial) fn check(&mut self, interrupted: &AtomicBool) -> Result<(), SerialError> {
        if !interrupted.load(Ordering::Relaxed) {
            return Ok(());
        }
        let stopped = if self.stop() { Stopped::Acknowledged } else { Stopped::Unacknowledged };
        Err(SerialError::Interrupted { stopped })
    }

    /// Stops the drive; whether the board has acknowledged it. What comes in the meantime is passed over.
    pub(in crate::board::serial) fn stop(&mut self) -> bool {
        for _ in 0..STOPS_MAX {
            if self.send(&HostMessage::Stop).is_err() {
                return false;
            }
            let deadline = host_nanos() + nanos(STOP_ANSWER_MAX);
            while let Some(event) = self.next_event_until(deadline) {
                match event {
                    Event::Board { message: BoardMessage::Stopped, .. } => return true,
                    Event::Closed(_) => return false,
                    _ => {}
                }
            }
        }
        false
    }
}
