//! Whether the rotor's track takes the kicks of the stator filter, or wanders as by the camera alone.
//!
//! The twin may be wrong in structure: a rotor that tilts is struck by single teeth and rubs on its pin, of which the
//! stator filter knows nothing. Two kinds of evidence show it: the impacts misfit ([`super::misfit_monitor`]), or the
//! frames pull the estimate one way ([`crate::camera::innovation_correlation`]).
//!
//! ```text
//!        mean misfit > 15, stator not sound, or innovations coloured
//!   kicks taken ----------------------------------------> camera alone: the rate wanders as in `ConstantRate`
//!        ^                                                         |
//!        +---------------------------------------------------------+
//!          probation over, and the time since coloured innovations
//! ```
//!
//! That time is 50 ms at first, and twice the last one for each time that the innovations were coloured again: the
//! structure of a motor does not change. It is halved again after kicks have been taken for four times as long, and is
//! 50 ms again after a fault of the vibrometer, to which the contradictions belonged. The estimate itself does not
//! jump: only the noise of its prediction changes.
//!
//! Kicks that were contradicted have taught a wrong friction and a wrong tooth factor, and both as if they were sure.
//! So the next kick that is taken begins with the variances of their prior.
//!
//! Without drive no stator is needed: friction brakes a sliding rotor whatever strikes it
//! ([`super::unexplained_kick`]).

use motor_model::{Real, Time};

use super::TwinFilter;

/// Time without kicks after the first contradiction by the frames, in ns.
const FIRST_NANOS: u64 = 50_000_000;
/// How often it doubles: up to 6.4 s.
const DOUBLINGS_MAX: u8 = 7;
/// Kicks taken for so many times the last time without them halve the next one.
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
    fn contradict(&mut self, now: Time) {
        self.until = now.plus_nanos(self.span_nanos());
        self.doublings = (self.doublings + 1).min(DOUBLINGS_MAX);
        self.doubted = true;
    }

    /// The contradictions so far were those of a fault that has ended.
    pub(super) fn forgive(&mut self) {
        (self.until, self.doublings) = (Time::ZERO, 0);
    }

    /// Whether the frames allow kicks at `now`.
    fn allows(&mut self, now: Time) -> bool {
        if self.doublings > 0 && now >= self.until.plus_nanos(PROVEN * self.span_nanos()) {
            (self.until, self.doublings) = (now, self.doublings - 1);
        }
        now >= self.until
    }
}

impl<T: Real> TwinFilter<T> {
    /// Impacts or frames contradict the kicks at `now`: the stator filter starts anew, and its kicks have to wait.
    pub(super) fn contradict(&mut self, now: Time) {
        self.kick_use.contradict(now);
        self.restart_stator();
    }

    /// Decides whether kicks are taken from `now` on. Those of a twin that is told parts of the truth always are.
    pub(super) fn review_kick_use(&mut self, now: Time) {
        let driven = self.drive.mode().is_some() && !self.told.is_told();
        if self.kick_use.taken && driven && self.tracker.take_contradiction() {
            self.contradict(now);
        }
        let taken = !driven || (self.misfit.is_trusted() && self.kick_use.allows(now));
        let before = core::mem::replace(&mut self.kick_use.taken, taken);
        if taken && !before {
            self.kick_use.since = now;
            self.propagate();
        }
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{DriveCommand, DriveMode};

    use super::*;
    use crate::filter::AngleFilter as _;
    use crate::filters::twin::misfit_monitor::MisfitMonitor;

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

    /// Kicks that are not taken under the drive, because the misfit is on probation, are taken from when it goes off.
    #[test]
    fn exact_kicks_are_taken_since_the_drive_is_off() {
        let mut filter = crate::filters::twin::tests::filter::<f64>();
        filter.misfit = MisfitMonitor::on_probation();
        filter.drive(Time::from_micros(1000), DriveCommand::full(DriveMode::B));
        assert!(!filter.kick_use.taken);
        filter.drive(Time::from_micros(3000), DriveCommand::OFF);
        assert!(filter.kick_use.taken);
        assert_eq!(filter.kick_use.since, Time::from_micros(3000));
    }
}
