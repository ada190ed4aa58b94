//! When a watchdog with a window is fed: once in so many ticks that the loop has run.
//!
//! What holds the loop up, construction of a filter or the store, leaves its queue full of old ticks, which run within
//! some microseconds each, and makes a jump in the numbers of the interrupts. So neither the number of a tick nor its
//! distance from the last tick tells how long ago the watchdog was fed. The count of ticks does: no more of them than
//! the queue holds can be from before the last feed, and the others have come at 10 us or more from each other.

/// Ticks that the loop runs from one feed to the next: 1 ms, and a quarter less where as many waited as the queue
/// holds.
const TICKS_PER_FEED: u32 = 100;

/// Counts the ticks until the watchdog is to be fed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FeedPace {
    /// Ticks since the last feed.
    ticks: u32,
}

impl FeedPace {
    /// The watchdog was fed just now, or started.
    pub const fn new() -> Self {
        Self { ticks: 0 }
    }

    /// To be called once a tick that the loop has run; whether the watchdog is to be fed now.
    #[inline]
    pub fn is_due(&mut self) -> bool {
        self.ticks += 1;
        let is_due = self.ticks >= TICKS_PER_FEED;
        if is_due {
            *self = Self::new();
        }
        is_due
    }
}
