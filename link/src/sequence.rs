//! Whether a frame is new.

/// How a frame stands to those before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrival {
    /// The next one, after so many that never came.
    New {
        /// Frames lost before it.
        lost: u32,
    },
    /// The last one again.
    Duplicate,
    /// One that should have come before.
    Late,
}

/// The number that the next frame should bear. Numbers wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence {
    next: u32,
}

impl Sequence {
    /// After a frame of number `sequence`.
    pub fn after(sequence: u32) -> Self {
        Self { next: sequence.wrapping_add(1) }
    }

    /// Judges a frame of number `sequence`; from a new one on, the count goes on.
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
