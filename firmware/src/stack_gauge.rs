//! The most bytes that the stack has taken, found a few words at a time.
//!
//! The start-up code fills the stack with one value. The stack grows towards its far end, so the first word from there
//! that has another value is the deepest that was used:
//!
//! ```text
//! far end   unused  unused  unused | used  unused  used  used   start
//!           0       1       2        3
//! ```
//!
//! The stack of a board has some ten thousand words. A look at all of them takes as long as several ticks, so a tick
//! looks at [`WORDS_PER_TICK`]. A pass begins at the far end and is over at the first used word. What a pass has found
//! counts until the next one is over: less than 0.1 s later, for a stack of 35 KiB.

/// Words that a tick looks at: some ten instructions.
pub const WORDS_PER_TICK: usize = 1;

/// A pass over the stack that goes on tick by tick, and what the last one has found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StackGauge {
    words: usize,
    /// Distance of the next word from the far end, in words.
    next: usize,
    words_max: usize,
}

impl StackGauge {
    /// A gauge of a stack of `words` words, of which none is known to be used.
    pub const fn new(words: usize) -> Self {
        Self { words, next: 0, words_max: 0 }
    }

    /// Looks at the next `words` words, or at those that are left of the pass; whether the pass is over. `is_unused`
    /// tells of the word at a distance from the far end, below the number of words of the stack.
    #[inline]
    pub fn look(&mut self, words: usize, is_unused: impl Fn(usize) -> bool) -> bool {
        for _ in 0..words {
            // What was used is used for ever.
            if self.next + self.words_max >= self.words || !is_unused(self.next) {
                self.words_max = self.words - self.next;
                self.next = 0;
                return true;
            }
            self.next += 1;
        }
        false
    }

    /// The most bytes that the stack had taken when the last pass was over; zero before the first.
    pub fn bytes_max(&self) -> u32 {
        u32::try_from(4 * self.words_max).unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Against a look at all words at once, while the stack grows: a pass tells of no more than is used when it
        /// ends, and of no less than was used when it began.
        #[test]
        fn dual_slices_find_what_one_look_finds(
            words in 1..300_usize, per_tick in 1..20_usize,
            depths in proptest::collection::vec(0..300_usize, 1..40),
        ) {
            let mut gauge = StackGauge::new(words);
            let (mut deepest, mut at_begin) = (0, 0);
            let mut used = std::vec![false; words];
            for depth in depths {
                deepest = deepest.max(depth.min(words));
                // A word in three within the used part has the value of an unused one, but not the deepest of a depth.
                let first_used = words - deepest;
                for (word, used) in used.iter_mut().enumerate().skip(first_used) {
                    *used |= word == first_used || !word.is_multiple_of(3);
                }
                let is_unused = |word: usize| !used[word];
                for _ in 0..3 {
                    if gauge.look(per_tick, is_unused) {
                        prop_assert!(gauge.bytes_max() <= u32::try_from(4 * deepest).unwrap());
                        prop_assert!(gauge.bytes_max() >= u32::try_from(4 * at_begin).unwrap());
                        at_begin = deepest;
                    }
                }
            }
            let first_used = words - deepest;
            (0..2).for_each(|_| while !gauge.look(per_tick, |word| word < first_used) {});
            prop_assert_eq!(gauge.bytes_max(), u32::try_from(4 * deepest).unwrap());
        }
    }

    #[test]
    fn exact_a_look_is_at_no_more_words_than_it_may() {
        let looked = core::cell::Cell::new(0);
        let mut gauge = StackGauge::new(10_240);
        for _ in 0..100 {
            looked.set(0);
            gauge.look(WORDS_PER_TICK, |_| {
                looked.set(looked.get() + 1);
                true
            });
            assert!(looked.get() <= WORDS_PER_TICK);
        }
    }
}
