//! When a loop decides, and when what it has decided acts.
//!
//! ```text
//! tick k:      measurements up to k -> estimate for k + n -> decision -> command, which acts from tick k + n on
//! tick k + n:  the amplifier applies it, the filter is told, and the report of the tick has the decision
//! every d:     a decision, in whole periods of the loop's time; besides in the first tick, and where a burst ends
//! ```
//!
//! The `n` ticks are the latency. They are the processor's: the work of a tick may take that long, if a tick takes less
//! than its period on average. To a filter with a model of the stator an impact brings the work of ten ticks, and the
//! ticks after it bring little. What the loop does is a function of the measurements alone, however long each tick
//! takes: all commands act after the same time, and the filter is told of each when it acts.
//!
//! From one decision to the next there are `d` ticks, one on a processor that has the time. In the ticks between, the
//! loop does nothing, and measurements wait. A burst is as long as it was planned, whatever `d` is; a cruise is cut up
//! to `d - 1` ticks later than it would be, in which the fastest rotor turns by less than its coasts differ.
//!
//! The filter is told the drive in the first tick, at each period, and where the drive changes: a reader of a log can
//! tell it in the same ticks.

use motor_model::Time;

use crate::tick::TICK_NANOS;

/// Longest latency of a loop in ticks: a period of the slower drive.
pub const LATENCY_TICKS_MAX: usize = 16;

/// Most ticks from one decision to the next: half of the shortest burst.
pub const DECISION_TICKS_MAX: usize = 8;

/// So many ticks, in ns.
fn nanos(ticks: usize) -> u64 {
    TICK_NANOS * ticks as u64
}

/// When a loop decides, and when that acts, in ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoopTiming {
    /// From a decision until its command acts, at most [`LATENCY_TICKS_MAX`].
    pub latency_ticks: u8,
    /// From one decision to the next, 1 to [`DECISION_TICKS_MAX`].
    pub decision_ticks: u8,
}

impl Default for LoopTiming {
    /// Of a processor without bounds.
    fn default() -> Self {
        Self { latency_ticks: 0, decision_ticks: 1 }
    }
}

impl LoopTiming {
    /// The latency in ns.
    pub(crate) fn latency_nanos(self) -> u64 {
        nanos(usize::from(self.latency_ticks).min(LATENCY_TICKS_MAX))
    }

    /// When a command acts that is decided at `now`.
    #[inline]
    pub(crate) fn acts_at(self, now: Time) -> Time {
        now.plus_nanos(self.latency_nanos())
    }

    /// The time from one decision to the next in ns.
    pub(crate) fn decision_nanos(self) -> u64 {
        nanos(usize::from(self.decision_ticks).clamp(1, DECISION_TICKS_MAX))
    }

    /// Whether each tick decides.
    #[inline]
    pub(crate) fn is_of_every_tick(self) -> bool {
        self.decision_ticks <= 1
    }
}
