//! A ring in memory that the hardware fills, and the program reads where it has come to.
//!
//! The hardware goes round: it writes place 0 to `N - 1`, and begins anew. Its counter tells how many places are left
//! until then. What the program does not read within a round is overwritten, and not missed.

/// How far the program has read a ring of `N` places.
#[derive(Debug)]
pub struct RingReader<const N: usize> {
    next: usize,
}

impl<const N: usize> Default for RingReader<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> RingReader<N> {
    /// Nothing is read, and nothing written.
    pub const fn new() -> Self {
        Self { next: 0 }
    }

    /// Where the oldest entry is that was not read yet; it counts as read. The hardware has `left` places left, `N` to
    /// 1; 0 is as `N`.
    #[inline]
    pub fn oldest(&mut self, left: usize) -> Option<usize> {
        let place = self.next;
        if place == Self::end(left) {
            return None;
        }
        self.next = (place + 1) % N;
        Some(place)
    }

    /// Where the two newest entries are of those that were not read yet, the older one first; all count as read.
    #[inline]
    pub fn newest_two(&mut self, left: usize) -> [Option<usize>; 2] {
        let end = Self::end(left);
        let count = (end + N - self.next) % N;
        self.next = end;
        [2, 1].map(|back| (count >= back).then_some((end + N - back) % N))
    }

    /// Where the hardware writes next.
    fn end(left: usize) -> usize {
        N.saturating_sub(left) % N
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;

    /// A ring of four places, and the hardware that writes the numbers from 0 on into it.
    #[derive(Default)]
    struct Ring {
        places: [usize; 4],
        written: usize,
        reader: RingReader<4>,
    }

    impl Ring {
        fn write(&mut self, count: usize) {
            for _ in 0..count {
                self.places[self.written % 4] = self.written;
                self.written += 1;
            }
        }

        fn left(&self) -> usize {
            4 - self.written % 4
        }

        fn oldest(&mut self) -> Option<usize> {
            self.reader.oldest(self.left()).map(|place| self.places[place])
        }

        fn newest_two(&mut self) -> [Option<usize>; 2] {
            let places = &self.places;
            self.reader.newest_two(4 - self.written % 4).map(|place| place.map(|place| places[place]))
        }
    }

    /// Every number comes once, in order, whatever is read at once and wherever the ring begins anew.
    #[test]
    fn law_all_that_is_written_is_read_in_order() {
        let mut ring = Ring::default();
        let mut read = Vec::new();
        for count in [0, 1, 3, 2, 0, 3, 3, 1, 1, 2] {
            ring.write(count);
            read.extend(core::iter::from_fn(|| ring.oldest()));
        }
        assert!(read.iter().copied().eq(0..16), "{read:?}");
        assert_eq!(ring.oldest(), None);
    }

    /// Two a call, as the converter has them; then none, one, and three of which the oldest is passed over.
    #[test]
    fn exact_the_newest_two() {
        let mut ring = Ring::default();
        for first in [0, 2, 4, 6, 8] {
            ring.write(2);
            assert_eq!(ring.newest_two(), [Some(first), Some(first + 1)]);
        }
        assert_eq!(ring.newest_two(), [None, None]);
        ring.write(1);
        assert_eq!(ring.newest_two(), [None, Some(10)]);
        ring.write(3);
        assert_eq!(ring.newest_two(), [Some(12), Some(13)]);
        ring.write(2);
        assert_eq!((ring.oldest(), ring.oldest(), ring.oldest()), (Some(14), Some(15), None));
    }

    /// The counter of some hardware is 0 for a moment before it begins anew.
    #[test]
    fn exact_none_left_is_all_left() {
        assert_eq!(RingReader::<4>::new().oldest(0), None);
        assert_eq!(RingReader::<4>::new().newest_two(0), [None, None]);
    }
}
