//! Whether the kicks that impacts show are taken, or the rate wanders as by the camera alone.
//!
//! A filter may be wrong in structure: a rotor that tilts is struck by single teeth and rubs on its pin, of which the
//! model of a kick knows nothing. The frames show it: they pull the estimate one way
//! ([`crate::camera::innovation_correlation`]).
//!
//! ```text
//!                     innovations coloured
//!   kicks taken ----------------------------------------> camera alone: the rate wanders as in `ConstantRate`
//!        ^                                                         |
//!        +---------------------------------------------------------+
//!                    the time since is over
//! ```
//!
//! That time is 50 ms at first, and twice the last one for each time that the innovations were coloured again: the
//! structure of a motor does not change. It is halved again after kicks have been taken for four times as long, and is
//! 50 ms again after a fault of the vibrometer, to which the contradictions belonged. The estimate itself does not
//! jump: only the noise of its prediction changes.
//!
//! Without drive kicks are always taken: friction brakes a sliding rotor whatever strikes it.

use motor_model::Time;

/// Time without kicks after the first contradiction by the frames, in ns.
const FIRST_NANOS: u64 = 50_000_000;
/// How often it doubles: up to 6.4 s.
const DOUBLINGS_MAX: u8 = 7;
/// Kicks taken for so many times the next time without them halve that time.
const PROVEN: u64 = 4;

/// The contradictions by frames so far.
#[derive(Clone, Copy, Debug)]
pub(super) struct KickUse {
    /// Whether kicks are taken, and since when.
    pub(super) taken: bool,
    pub(super) since: Time,
    /// Until when they are not, by the last contradiction.
    until: Time,
    doublings: u8,
    /// Whether the kicks before the next one were contradicted.
    pub(super) doubted: bool,
}

impl KickUse {
    /// Kicks are taken.
    pub(super) fn new() -> Self {
        Self { taken: true, since: Time::ZERO, until: Time::ZERO, doublings: 0, doubted: false }
    }

    /// The time without kicks that a contradiction brings.
    fn span_nanos(&self) -> u64 {
        FIRST_NANOS << self.doublings
    }

    /// The kicks are contradicted at `now`.
    pub(super) fn contradict(&mut self, now: Time) {
        self.until = now.plus_nanos(self.span_nanos());
        self.doublings = (self.doublings + 1).min(DOUBLINGS_MAX);
        self.doubted = true;
    }

    /// The contradictions so far were those of a fault that has ended.
    pub(super) fn forgive(&mut self) {
        (self.until, self.doublings) = (Time::ZERO, 0);
    }

    /// The times after `at` were wrong, and so were the contradictions until then.
    pub(super) fn rewind(&mut self, at: Time) {
        self.forgive();
        self.since = self.since.min(at);
    }

    /// Whether the frames allow kicks at `now`.
    pub(super) fn allows(&mut self, now: Time) -> bool {
        if self.doublings > 0 && now >= self.until.plus_nanos(PROVEN * self.span_nanos()) {
            (self.until, self.doublings) = (now, self.doublings - 1);
        }
        now >= self.until
    }

    /// Kicks are taken from `now` on, or not; whether they are taken again.
    pub(super) fn set(&mut self, taken: bool, now: Time) -> bool {
        let before = core::mem::replace(&mut self.taken, taken);
        let resumed = taken && !before;
        if resumed {
            self.since = now;
        }
        resumed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// The time without kicks after a contradiction at `at`, in ms.
    fn without_kicks_ms(of: &mut KickUse, at_ms: u64) -> u64 {
        of.contradict(Time::from_nanos(at_ms * MS));
        let allowed = (at_ms..at_ms + 10_000).find(|ms| of.allows(Time::from_nanos(ms * MS))).unwrap_or(0);
        allowed - at_ms
    }

    /// Each contradiction doubles the time without kicks, to 6.4 s. Kicks taken for long enough after it halve it.
    #[test]
    fn exact_times_without_kicks_double_and_halve() {
        let mut kick_use = KickUse::new();
        assert!(kick_use.allows(Time::ZERO));
        let (mut at_ms, mut spans) = (0, [0; 9]);
        for span in &mut spans {
            *span = without_kicks_ms(&mut kick_use, at_ms);
            at_ms += *span + 1;
        }
        assert_eq!(spans, [50, 100, 200, 400, 800, 1600, 3200, 6400, 6400]);
        // Proven for four times the next span of 6.4 s, and a little longer.
        at_ms += 4 * 6400 + 10;
        assert!(kick_use.allows(Time::from_nanos(at_ms * MS)));
        assert_eq!(without_kicks_ms(&mut kick_use, at_ms), 3200);
    }

    /// After a fault of the vibrometer kicks are allowed at once, and the next contradiction is the first one.
    #[test]
    fn exact_contradictions_by_a_fault_are_forgiven() {
        let mut kick_use = KickUse::new();
        (0..5).for_each(|at_ms| kick_use.contradict(Time::from_nanos(at_ms * MS)));
        assert!(!kick_use.allows(Time::from_nanos(100 * MS)));
        kick_use.forgive();
        assert!(kick_use.allows(Time::from_nanos(100 * MS)));
        assert_eq!(without_kicks_ms(&mut kick_use, 101), 50);
    }

    /// A clock that runs back: what was contradicted later is forgiven, and kicks are taken since no later instant.
    #[test]
    fn exact_a_clock_that_runs_back_leaves_nothing_in_the_future() {
        let mut kick_use = KickUse::new();
        kick_use.contradict(Time::from_nanos(1000 * MS));
        kick_use.set(false, Time::from_nanos(1000 * MS));
        kick_use.set(true, Time::from_nanos(1100 * MS));
        kick_use.rewind(Time::from_nanos(10 * MS));
        assert!(kick_use.allows(Time::from_nanos(11 * MS)));
        assert_eq!(kick_use.since, Time::from_nanos(10 * MS));
    }
}
