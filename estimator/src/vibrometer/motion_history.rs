//! What has moved the rotor, piece by piece, over the time that a prediction spans.
//!
//! A prediction begins at the last frame's exposure. Since then the drive may have gone on and off again, and the rotor
//! may have come to lie on the teeth: by a slow camera several times, and by a late one before the frame arrives. Each
//! piece has a motion of its own, and a filter predicts through them one by one:
//!
//! ```text
//!            frame                                                 now
//!   Quiet      |          Impacted(B)    Impacted(B)      Quiet     |
//!   -----------+---------|---------------|---------------|----------+
//!                    drive on        drive off       found quiet
//! ```
//!
//! Pieces end where the drive changes its mode; those of one mode are kept as one. The newest piece lasts until it is
//! known to have ended. A rotor that rests when it is driven has rested until then: that piece is no slide.

use motor_model::{DriveMode, Time};

use crate::vibrometer::motion::Motion;

/// Pieces kept that have ended. A positioning move drives once or twice between two frames of the slowest camera.
const ENDED_KEPT: usize = 6;

/// The end of a piece that has not ended.
pub(crate) const NEVER: Time = Time::from_nanos(u64::MAX);

/// A time with one motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionPiece {
    pub(crate) motion: Motion,
    /// Whether the frames showed in it that the rotor rests. The present piece is not known to be one.
    pub(crate) rested: bool,
    pub(crate) begun: Time,
    /// Its end, which belongs to the next piece.
    pub(crate) until: Time,
}

/// The pieces until the last change of the drive, by time.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionHistory {
    /// The newest last. Those that end at time zero are none.
    ended: [MotionPiece; ENDED_KEPT],
    /// The motion after them, until the present one begins.
    pub(super) before: Motion,
}

impl MotionHistory {
    pub(super) const fn none() -> Self {
        let motion = Motion::Impacted(DriveMode::B);
        let none = MotionPiece { motion, rested: false, begun: Time::ZERO, until: Time::ZERO };
        Self { ended: [none; ENDED_KEPT], before: motion }
    }

    /// Keeps a piece of `motion` that ends at `until`, if there is one between the last end and that.
    pub(super) fn end(&mut self, motion: Motion, until: Time) {
        self.end_piece(motion, false, until);
    }

    /// Keeps a piece in which the rotor rested.
    pub(super) fn end_rest(&mut self, until: Time) {
        self.end_piece(Motion::Quiet, true, until);
    }

    #[cold]
    fn end_piece(&mut self, motion: Motion, rested: bool, until: Time) {
        let [oldest, second, .., newest] = &mut self.ended;
        if until <= newest.until {
            return;
        }
        if (newest.motion, newest.rested) == (motion, rested) {
            newest.until = until;
            return;
        }
        if oldest.until > Time::ZERO {
            // The oldest two become one.
            (second.motion, second.begun) = (oldest.motion.or_faster(second.motion), oldest.begun);
            second.rested &= oldest.rested;
        }
        let ended = MotionPiece { motion, rested, begun: newest.until, until };
        self.ended.copy_within(1.., 0);
        let [.., newest] = &mut self.ended;
        *newest = ended;
    }
}

/// The pieces up to the present.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Motions<'a> {
    pub(super) history: &'a MotionHistory,
    /// The motion at present, and since when.
    pub(super) now: Motion,
    pub(super) since: Time,
}

impl Motions<'_> {
    /// The piece that holds the time right after `at`.
    pub(crate) fn piece(&self, at: Time) -> MotionPiece {
        if at >= self.since {
            MotionPiece { motion: self.now, rested: false, begun: self.since, until: NEVER }
        } else {
            self.earlier_piece(at)
        }
    }

    #[cold]
    fn earlier_piece(&self, at: Time) -> MotionPiece {
        let MotionHistory { ended: ended @ [.., newest], before } = self.history;
        let after = MotionPiece { motion: *before, rested: false, begun: newest.until, until: self.since };
        ended.iter().copied().find(|piece| at < piece.until).unwrap_or(after)
    }

    /// The motion from `from` to the present: quiet only if all of it was quiet.
    pub(crate) fn throughout(&self, from: Time) -> Motion {
        if self.now == Motion::Quiet && from < self.since { self.history.before } else { self.now }
    }
}

#[cfg(test)]
impl Motions<'static> {
    /// One motion, at all times.
    pub(crate) fn always(motion: Motion) -> Self {
        const NONE: MotionHistory = MotionHistory::none();
        Self { history: &NONE, now: motion, since: Time::ZERO }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    const B: Motion = Motion::Impacted(DriveMode::B);
    const C: Motion = Motion::Impacted(DriveMode::C);

    /// The pieces from `from` on, each with its end; the last one ends at `until`.
    fn pieces(motions: &Motions<'_>, from: u64, until: u64) -> Vec<(Motion, u64)> {
        let (mut at, until) = (Time::from_nanos(from), Time::from_nanos(until));
        let mut seen = Vec::new();
        loop {
            let piece = motions.piece(at);
            seen.push((piece.motion, piece.until.min(until).nanos()));
            assert!(piece.begun <= at && at < piece.until);
            at = piece.until;
            if at >= until {
                return seen;
            }
        }
    }

    fn motions(history: &MotionHistory, now: Motion, since: u64) -> Motions<'_> {
        Motions { history, now, since: Time::from_nanos(since) }
    }

    /// A burst of 5 between 100 and 105, quiet from 110 on: the pieces between any two times, each up to its end.
    #[test]
    fn exact_a_span_is_cut_where_the_motion_changes() {
        let mut history = MotionHistory::none();
        history.end(B, Time::from_nanos(50));
        history.end(Motion::Quiet, Time::from_nanos(100));
        history.end(B, Time::from_nanos(105));
        let motions = motions(&history, Motion::Quiet, 110);
        let quiet = Motion::Quiet;
        assert_eq!(pieces(&motions, 60, 200), [(quiet, 100), (B, 105), (B, 110), (quiet, 200)]);
        assert_eq!(pieces(&motions, 60, 100), [(quiet, 100)]);
        assert_eq!(pieces(&motions, 100, 103), [(B, 103)]);
        assert_eq!(pieces(&motions, 110, 300), [(quiet, 300)]);
        assert_eq!(motions.throughout(Time::from_nanos(109)), B);
        assert_eq!(motions.throughout(Time::from_nanos(110)), quiet);
    }

    /// A rotor found quiet at 10 and at rest at 20 is driven at 30: it rested from 20 on, and from 10 to 20 it may have
    /// slid.
    #[test]
    fn exact_a_rest_is_a_piece_of_its_own() {
        let mut history = MotionHistory::none();
        history.end(B, Time::from_nanos(10));
        history.end(Motion::Quiet, Time::from_nanos(20));
        history.end_rest(Time::from_nanos(30));
        let motions = motions(&history, B, 30);
        assert_eq!(pieces(&motions, 0, 40), [(B, 10), (Motion::Quiet, 20), (Motion::Quiet, 30), (B, 40)]);
        let rested = [5, 15, 25, 35].map(|nanos| motions.piece(Time::from_nanos(nanos)).rested);
        assert_eq!(rested, [false, false, true, false]);
    }

    /// Of more changes than are kept the oldest pieces count as the one that moves the rotor most.
    #[test]
    fn exact_the_oldest_pieces_count_as_the_fastest_of_them() {
        let mut history = MotionHistory::none();
        for change in 1..=7 {
            let motion = if change == 1 {
                C
            } else if change % 2 == 0 {
                Motion::Quiet
            } else {
                B
            };
            history.end(motion, Time::from_nanos(10 * change));
        }
        let motions = motions(&history, Motion::Quiet, 70);
        assert_eq!(pieces(&motions, 0, 35), [(C, 20), (B, 30), (Motion::Quiet, 35)]);
    }

    /// A piece that would end before the last one ends is none.
    #[test]
    fn exact_no_piece_is_negative() {
        let mut history = MotionHistory::none();
        history.end(B, Time::from_nanos(100));
        history.end(Motion::Quiet, Time::from_nanos(100));
        history.end(C, Time::from_nanos(90));
        assert_eq!(pieces(&motions(&history, C, 100), 0, 150), [(B, 100), (C, 150)]);
    }
}
