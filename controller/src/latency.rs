//! A loop whose commands act some ticks after they were decided.
//!
//! ```text
//! tick k:      measurements of k -> estimate for k + n -> decision -> command, which acts from tick k + n on
//! tick k + n:  the amplifier applies it, the filter is told, and the report of the tick has the decision
//! ```
//!
//! The `n` ticks between are the processor's: the work of a tick may take that long, if a tick takes less than its
//! period on average. To a filter with a model of the stator an impact brings the work of ten ticks, and the ticks
//! after it bring little. What the loop does is a function of the measurements alone, however long each tick takes: all
//! commands act after the same time, and the filter is told of each when it acts.

use heapless::Deque;
use motor_model::Time;

use crate::tick::TICK_NANOS;

/// Longest latency of a loop in ticks: a period of the slower drive.
pub const LATENCY_TICKS_MAX: usize = 16;

/// When a command acts that is decided at `now`.
pub(crate) fn acts_at(now: Time, latency_ticks: usize) -> Time {
    now.plus_nanos(TICK_NANOS * latency_ticks.min(LATENCY_TICKS_MAX) as u64)
}

/// The decisions whose commands do not act yet, oldest first.
#[derive(Clone, Debug)]
pub struct InFlight<R> {
    decisions: Deque<R, LATENCY_TICKS_MAX>,
}

impl<R> Default for InFlight<R> {
    fn default() -> Self {
        Self::new()
    }
}

impl<R> InFlight<R> {
    /// No decision.
    pub const fn new() -> Self {
        Self { decisions: Deque::new() }
    }

    /// Takes the decision of this tick, and gives the one whose command acts from this tick on: that of `latency_ticks`
    /// before, and with a latency of 0 its own. `None` in the first ticks.
    ///
    /// A latency above [`LATENCY_TICKS_MAX`] counts as that.
    // Without a latency nothing is moved in memory.
    #[inline]
    pub fn exchange(&mut self, decided: R, latency_ticks: usize) -> Option<R> {
        if latency_ticks == 0 { Some(decided) } else { self.queue(decided, latency_ticks) }
    }

    #[inline(never)]
    fn queue(&mut self, decided: R, latency_ticks: usize) -> Option<R> {
        let full = self.decisions.len() >= latency_ticks.min(LATENCY_TICKS_MAX);
        let acting = if full { self.decisions.pop_front() } else { None };
        // Never full here.
        let _ = self.decisions.push_back(decided);
        acting
    }

    /// Forgets all decisions, for a run that begins anew.
    pub fn clear(&mut self) {
        self.decisions.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_a_decision_acts_after_its_latency() {
        for latency in [0, 1, 2, 7, LATENCY_TICKS_MAX] {
            let mut in_flight = InFlight::new();
            for tick in 0..100 {
                let acting = in_flight.exchange(tick, latency);
                assert_eq!(acting, (tick >= latency).then(|| tick - latency), "{latency}");
            }
            let acts_at = acts_at(Time::from_nanos(30_000), latency);
            assert_eq!(acts_at.nanos(), 30_000 + 10_000 * latency as u64);
        }
    }
}
