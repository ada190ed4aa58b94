//! The questions that the board answers with its time at once, and which of them an answer is to.
//!
//! | question | answer |
//! |---|---|
//! | [`HostMessage::Arm`] of an armed board | [`BoardMessage::Armed`] |
//! | [`HostMessage::Count`] | [`BoardMessage::Counters`] |
//! | [`HostMessage::Identify`] | [`BoardMessage::Identity`] |
//!
//! An answer does not say which question it is to, and the line may lose either of them, or keep it for long. But the
//! board answers in order. So the answer to the only open question of its kind is to that one, and what was asked
//! before it gets no answer any more. An answer that may be to one of several questions sets no clock. A clock is asked
//! for by a kind of which no question is open.

use link::{BoardMessage, HostMessage};

/// Time in ns after which no answer comes any more. A line that keeps one for as long keeps everything else too, and
/// the run ends after a second of silence.
const OPEN_MAX_NANOS: i64 = 10_000_000_000;

/// The open questions of a kind, by the host's clock in ns.
#[derive(Clone, Copy, Debug)]
struct Open {
    first_nanos: i64,
    last_nanos: i64,
    count: u32,
}

/// The questions that were not answered yet, by kind.
#[derive(Clone, Debug, Default)]
pub(super) struct TimeQuestions {
    open: [Option<Open>; 3],
}

impl TimeQuestions {
    /// The first of `questions` whose answer would be to it alone, at `now_nanos`; `None` if there is no such one.
    pub(super) fn sure<'q>(&self, questions: &'q [HostMessage], now_nanos: i64) -> Option<&'q HostMessage> {
        questions.iter().find(|question| {
            of_question(question).is_some_and(|kind| still_open(self.open[kind], now_nanos).is_none())
        })
    }

    /// Takes a message that was sent to the board; one that is no question is passed over.
    pub(super) fn sent(&mut self, message: &HostMessage, at_nanos: i64) {
        let Some(kind) = of_question(message) else { return };
        let before = still_open(self.open[kind], at_nanos);
        self.open[kind] = Some(Open {
            first_nanos: before.map_or(at_nanos, |open| open.first_nanos),
            last_nanos: at_nanos,
            count: 1 + before.map_or(0, |open| open.count),
        });
    }

    /// Takes a message of the board. Where it is an answer, and it is sure to which question, when that was sent.
    pub(super) fn answered(&mut self, message: &BoardMessage) -> Option<i64> {
        let kind = of_answer(message)?;
        let answered = self.open[kind].take()?;
        for other in &mut self.open {
            *other = other.filter(|open| open.last_nanos > answered.first_nanos);
        }
        if answered.count > 1 {
            self.open[kind] = Some(Open { count: answered.count - 1, ..answered });
            return None;
        }
        Some(answered.first_nanos)
    }
}

/// Whether a message is an answer to one of these questions.
pub(super) fn is_time_answer(message: &BoardMessage) -> bool {
    of_answer(message).is_some()
}

fn of_question(message: &HostMessage) -> Option<usize> {
    match message {
        HostMessage::Arm => Some(0),
        HostMessage::Count => Some(1),
        HostMessage::Identify => Some(2),
        _ => None,
    }
}

fn of_answer(message: &BoardMessage) -> Option<usize> {
    match message {
        BoardMessage::Armed => Some(0),
        BoardMessage::Counters(_) => Some(1),
        BoardMessage::Identity(_) => Some(2),
        _ => None,
    }
}

fn still_open(open: Option<Open>, now_nanos: i64) -> Option<Open> {
    open.filter(|open| now_nanos - open.last_nanos < OPEN_MAX_NANOS)
}

#[cfg(test)]
mod tests {
    use link::Counters;

    use super::*;

    const S: i64 = 1_000_000_000;
    const ARMED: [HostMessage; 3] = [HostMessage::Arm, HostMessage::Count, HostMessage::Identify];

    fn counters() -> BoardMessage {
        BoardMessage::Counters(Counters::default())
    }

    /// A question whose answer is late is asked again by another kind. Each answer is to its own question.
    #[test]
    fn exact_a_late_answer_is_not_to_the_question_that_was_asked_again() {
        let mut questions = TimeQuestions::default();
        assert_eq!(questions.sure(&ARMED, 0), Some(&HostMessage::Arm));
        questions.sent(&HostMessage::Arm, 0);
        assert_eq!(questions.sure(&ARMED, S), Some(&HostMessage::Count));
        questions.sent(&HostMessage::Count, S);
        assert_eq!(questions.answered(&BoardMessage::Armed), Some(0));
        assert_eq!(questions.answered(&BoardMessage::Stopped), None);
        assert_eq!((questions.answered(&counters()), questions.answered(&counters())), (Some(S), None));
        assert_eq!(questions.sure(&ARMED, S), Some(&HostMessage::Arm));
    }

    /// The answer to a later question shows that an earlier one gets none: its kind is sure again.
    #[test]
    fn exact_what_was_lost_is_seen_by_a_later_answer() {
        let mut questions = TimeQuestions::default();
        questions.sent(&HostMessage::Arm, 0);
        questions.sent(&HostMessage::Count, S);
        assert_eq!(questions.answered(&counters()), Some(S));
        assert_eq!(questions.sure(&ARMED, 2 * S), Some(&HostMessage::Arm));
        assert_eq!(questions.answered(&BoardMessage::Armed), None);
    }

    /// Two questions of a kind: no answer sets a clock, until both were answered, or a later kind was.
    #[test]
    fn exact_an_answer_that_may_be_to_either_sets_no_clock() {
        let count = HostMessage::Count;
        let mut questions = TimeQuestions::default();
        questions.sent(&count, 0);
        questions.sent(&count, 1);
        assert_eq!(questions.answered(&counters()), None);
        assert_eq!(questions.sure(&ARMED[1..], 2), Some(&HostMessage::Identify));
        assert_eq!(questions.clone().answered(&counters()), Some(0), "at least as early as it was sent");
        questions.sent(&HostMessage::Arm, 3);
        assert_eq!(questions.answered(&BoardMessage::Armed), Some(3));
        assert_eq!(questions.sure(&ARMED[1..], 4), Some(&count));
    }

    /// Where a question of every kind is open, none is asked until the oldest gets no answer any more.
    #[test]
    fn exact_no_answer_comes_after_ten_seconds() {
        let mut questions = TimeQuestions::default();
        for (question, at) in ARMED.iter().zip(0..) {
            questions.sent(question, at);
        }
        assert_eq!(questions.sure(&ARMED, 10 * S - 1), None);
        assert_eq!(questions.sure(&ARMED, 10 * S), Some(&HostMessage::Arm));
        questions.sent(&HostMessage::Arm, 10 * S);
        assert_eq!(questions.answered(&BoardMessage::Armed), Some(10 * S));
    }
}
