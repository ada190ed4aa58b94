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
}
