//! Sequence numbers: whether a frame is new.

/// The place of a frame among those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// A new one.
    New {
        /// Frames missing before it.
        lost: u32,
    },
    /// The last one again.
    Duplicate,
    /// An earlier one, received after a later one.
    Late,
}

/// The number that is expected of the next frame. Numbers wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence {
    next: u32,
}

impl Sequence {
    /// After a frame of number `sequence`.
    pub fn after(sequence: u32) -> Self {
        Self { next: sequence.wrapping_add(1) }
    }

    /// The number that is expected of the next frame.
    pub fn next(self) -> u32 {
        self.next
    }

    /// Classifies a frame of number `sequence`. After a new one the count goes on from it.
    #[inline]
    pub fn judge(&mut self, sequence: u32) -> Arrival {
        let ahead = sequence.wrapping_sub(self.next);
        if ahead == u32::MAX {
            Arrival::Duplicate
        } else if ahead > u32::MAX / 2 {
            Arrival::Late
        } else {
            *self = Self::after(sequence);
            Arrival::New { lost: ahead }
        }
    }
}

/// The numbers that a board expects of frames, some of which are short ([`crate::camera_frame`]).
///
/// The number of a short frame is completed from four bits, and one in 65,536 of the short frames that are badly
/// damaged passes. It may carry the count on by eleven, from where the next short ones are completed to 16 too many. So
/// a whole frame, which has a CRC-32, is judged by the whole frames before it alone, and sets the count right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoardSequence {
    of_all: Sequence,
    of_whole: Sequence,
}

impl BoardSequence {
    /// After a whole frame of number `sequence`.
    pub fn after(sequence: u32) -> Self {
        Self { of_all: Sequence::after(sequence), of_whole: Sequence::after(sequence) }
    }

    /// The number that is expected of the next frame.
    pub fn next(self) -> u32 {
        self.of_all.next()
    }

    /// Classifies a short frame, whose number is `sequence` as it was completed.
    pub fn judge_short(&mut self, sequence: u32) -> Arrival {
        self.of_all.judge(sequence)
    }

    /// Classifies a whole frame of number `sequence`.
    pub fn judge_whole(&mut self, sequence: u32) -> Arrival {
        let arrival = self.of_whole.judge(sequence);
        if !matches!(arrival, Arrival::New { .. }) {
            return arrival;
        }
        let lost = match self.of_all.judge(sequence) {
            Arrival::New { lost } => lost,
            Arrival::Duplicate | Arrival::Late => 0,
        };
        self.of_all = Sequence::after(sequence);
        Arrival::New { lost }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_new_lost_repeated_and_late() {
        let mut sequence = Sequence::after(u32::MAX - 1);
        for (number, expected) in [
            (u32::MAX, Arrival::New { lost: 0 }),
            (u32::MAX, Arrival::Duplicate),
            (0, Arrival::New { lost: 0 }),
            (3, Arrival::New { lost: 2 }),
            (3, Arrival::Duplicate),
            (2, Arrival::Late),
            (4, Arrival::New { lost: 0 }),
        ] {
            assert_eq!(sequence.judge(number), expected, "{number}");
        }
    }

    /// A short frame that is not one carries the count on by any number that four bits can. Whole frames count all the
    /// same, and after the first the short ones are those that were sent.
    #[test]
    fn law_a_whole_frame_sets_the_count_right() {
        for ahead in 0..12 {
            let mut sequence = BoardSequence::after(99);
            assert_eq!(sequence.judge_short(100 + ahead), Arrival::New { lost: ahead });
            assert_eq!(sequence.judge_whole(101), Arrival::New { lost: 0 }, "{ahead}");
            assert_eq!(sequence.judge_short(102), Arrival::New { lost: 0 }, "{ahead}");
            assert_eq!(sequence.judge_whole(101), Arrival::Duplicate, "{ahead}");
            assert_eq!(sequence.judge_whole(100), Arrival::Late, "{ahead}");
            assert_eq!(sequence.judge_whole(105), Arrival::New { lost: 2 }, "{ahead}");
            assert_eq!(sequence.judge_short(105), Arrival::Duplicate, "{ahead}");
        }
    }
}
