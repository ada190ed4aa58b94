//! The decisions of a loop whose commands do not act yet, and when the next one is due ([`LoopTiming`]).

use motor_model::{DriveCommand, Time};

use crate::loop_timing::{LATENCY_TICKS_MAX, LoopTiming};

/// What [`InFlight`] holds.
pub trait Decision: Copy {
    /// That of a tick before the first decision acts: drive off.
    const UNDECIDED: Self;

    /// The command that the amplifier applies.
    fn applied(&self) -> DriveCommand;

    /// Takes away what is of the tick of the decision alone. It is reported in the ticks after it as well.
    fn pass(&mut self) {}
}

impl Decision for DriveCommand {
    const UNDECIDED: Self = Self::OFF;

    fn applied(&self) -> DriveCommand {
        *self
    }
}

/// Places of the ring: one for each tick of the longest latency, one for the decision that acts, and one for the next.
const PLACES: usize = LATENCY_TICKS_MAX + 2;
/// The last place.
const LAST: usize = PLACES - 1;

/// A time that does not come.
const NEVER: Time = Time::from_nanos(u64::MAX);

/// A decision, and when it acts.
#[derive(Clone, Copy, Debug)]
struct Placed<R> {
    acts_at: Time,
    decision: R,
}

/// What a loop has to do in a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Due {
    /// To decide.
    Decision,
    /// To tell the filter of a decision that acts from this tick on.
    Telling,
    /// Nothing.
    Nothing,
}

/// The decisions whose commands do not act yet, and when the next is due: a ring. Each decision is written in its place
/// and read there, since a report has more than a hundred bytes.
#[derive(Clone, Debug)]
pub struct InFlight<R> {
    /// `None` before there are any.
    decisions: Option<[Placed<R>; PLACES]>,
    /// Place of the newest.
    newest: usize,
    /// Place of the one that acts.
    acting: usize,
    /// When the next decision is due at the latest; `None` before the first.
    next_at: Option<Time>,
    /// When a decision is due besides: the burst under way ends.
    burst_ends_at: Time,
    /// Before this the loop does nothing.
    wakes_at: Time,
    /// Whether this tick is one of the period, in which the filter is told the drive even if it does not change.
    is_of_period: bool,
    /// The command that acted last.
    told: DriveCommand,
}

impl<R> Default for InFlight<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R> InFlight<R> {
    /// No decision.
    pub const fn new() -> Self {
        Self {
            decisions: None,
            newest: 0,
            acting: 0,
            next_at: None,
            burst_ends_at: NEVER,
            wakes_at: Time::ZERO,
            is_of_period: true,
            told: DriveCommand::OFF,
        }
    }

    /// Forgets all decisions, and makes the places of new ones, which otherwise the next tick does. The next tick
    /// decides.
    #[cold]
    #[inline(never)]
    pub fn clear(&mut self)
    where
        R: Decision,
    {
        *self = Self { decisions: Some(undecided()), ..Self::new() };
    }

    /// Whether the loop has nothing to do at `now`: no decision is due, and none acts from `now` on.
    #[inline]
    pub fn is_waiting(&self, now: Time) -> bool {
        now < self.wakes_at
    }

    /// What is due at `now`.
    #[inline]
    pub(crate) fn due(&mut self, now: Time, timing: LoopTiming) -> Due {
        if timing.is_of_every_tick() { Due::Decision } else { self.due_in_some_ticks(now, timing) }
    }

    // Cold, as all that a loop which decides in each tick does not need: it takes no time there.
    #[cold]
    #[inline(never)]
    fn due_in_some_ticks(&mut self, now: Time, timing: LoopTiming) -> Due {
        if self.is_waiting(now) {
            return Due::Nothing;
        }
        let period_nanos = timing.decision_nanos();
        self.is_of_period = self.next_at.is_none_or(|next_at| now >= next_at);
        if self.is_of_period {
            // The first one, and after ticks that were lost: the next whole period.
            let next_at = self.next_at.map(|at| at.plus_nanos(period_nanos)).filter(|at| *at > now);
            let since_nanos = || now.nanos() % period_nanos;
            self.next_at = Some(next_at.unwrap_or_else(|| now.plus_nanos(period_nanos - since_nanos())));
        } else if now < self.burst_ends_at {
            return Due::Telling;
        }
        self.burst_ends_at = NEVER;
        if following(self.newest) == self.acting {
            // More decisions than the longest latency has ticks: the oldest makes room.
            self.acting = following(self.acting);
        }
        Due::Decision
    }

    /// Lets `decide` write a decision in its place, all of it, whose command acts from `acts_at` on: no earlier than
    /// that of the decision before it.
    #[expect(clippy::indexing_slicing, reason = "at most LAST, which the compiler sees")]
    #[inline]
    pub fn put(&mut self, acts_at: Time, decide: impl FnOnce(&mut R))
    where
        R: Decision,
    {
        self.newest = following(self.newest);
        let place = &mut self.decisions.get_or_insert_with(undecided)[self.newest.min(LAST)];
        place.acts_at = acts_at;
        decide(&mut place.decision);
    }

    /// The decision whose command acts at `now`. In the first ticks it is [`Decision::UNDECIDED`]. One that has acted
    /// before has [passed](Decision::pass).
    #[expect(clippy::indexing_slicing, reason = "at most LAST, which the compiler sees")]
    #[inline]
    pub fn acting(&mut self, now: Time) -> &mut R
    where
        R: Decision,
    {
        let decisions = self.decisions.get_or_insert_with(undecided);
        let before = self.acting;
        while self.acting != self.newest {
            let next = following(self.acting);
            if decisions[next.min(LAST)].acts_at > now {
                break;
            }
            self.acting = next;
        }
        let decision = &mut decisions[self.acting.min(LAST)].decision;
        if self.acting == before {
            decision.pass();
        }
        decision
    }

    /// Lets `decide` write the decision of the tick at `now`, as [`Self::put`] does. Gives the one whose command acts
    /// in it, with a latency of 0 this one, and whether the filter is told of that. A burst under way will end at
    /// `burst_end`.
    #[expect(clippy::indexing_slicing, reason = "at most LAST, which the compiler sees")]
    #[inline]
    pub(crate) fn exchange(
        &mut self,
        now: Time,
        timing: LoopTiming,
        burst_end: impl FnOnce() -> Option<Time>,
        decide: impl FnOnce(&mut R),
    ) -> (&mut R, bool)
    where
        R: Decision,
    {
        self.put(timing.acts_at(now), decide);
        if timing.is_of_every_tick() {
            // The decision of each tick acts after as many ticks.
            let latency_ticks = usize::from(timing.latency_ticks).min(LATENCY_TICKS_MAX);
            let around = if self.newest < latency_ticks { PLACES } else { 0 };
            self.acting = self.newest + around - latency_ticks;
            (&mut self.decisions.get_or_insert_with(undecided)[self.acting.min(LAST)].decision, true)
        } else {
            let decided_at = |instant: Time| instant.nanos().saturating_sub(timing.latency_nanos());
            self.burst_ends_at = burst_end().map_or(NEVER, |instant| Time::from_nanos(decided_at(instant)));
            self.act(now)
        }
    }

    /// The decision that acts in a tick at `now` of a loop that decides in some ticks, and whether the filter is told.
    #[cold]
    #[inline(never)]
    pub(crate) fn act(&mut self, now: Time) -> (&mut R, bool)
    where
        R: Decision,
    {
        let (told, applied) = (self.told, self.acting(now).applied());
        self.told = applied;
        self.wakes_at = self.next_wake();
        let tells = self.is_of_period || applied != told;
        (self.still_acting(), tells)
    }

    /// When the loop has something to do next.
    #[expect(clippy::indexing_slicing, reason = "at most LAST, which the compiler sees")]
    fn next_wake(&self) -> Time {
        let decision_at = self.next_at.unwrap_or(Time::ZERO).min(self.burst_ends_at);
        let pending = self.decisions.as_ref().filter(|_| self.acting != self.newest);
        pending.map_or(decision_at, |decisions| {
            decision_at.min(decisions[following(self.acting).min(LAST)].acts_at)
        })
    }

    /// The decision that acts.
    #[expect(clippy::indexing_slicing, reason = "at most LAST, which the compiler sees")]
    #[inline]
    fn still_acting(&mut self) -> &mut R
    where
        R: Decision,
    {
        &mut self.decisions.get_or_insert_with(undecided)[self.acting.min(LAST)].decision
    }

    /// The decision that acts in a tick in which the loop waits.
    #[cold]
    pub(crate) fn passed(&mut self) -> &mut R
    where
        R: Decision,
    {
        let decision = self.still_acting();
        decision.pass();
        decision
    }
}

/// The place after `place`.
#[inline]
fn following(place: usize) -> usize {
    if place < LAST { place + 1 } else { 0 }
}

#[cold]
#[inline(never)]
fn undecided<R: Decision>() -> [Placed<R>; PLACES] {
    [Placed { acts_at: Time::ZERO, decision: R::UNDECIDED }; PLACES]
}

#[cfg(test)]
mod tests;
