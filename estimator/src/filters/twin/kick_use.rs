//! Whether the rotor's track takes the kicks of the stator filter, or wanders as by the camera alone.
//!
//! Two kinds of evidence show that the twin is wrong in structure: the impacts misfit ([`super::misfit_monitor`]), or
//! the frames pull the estimate one way ([`crate::filters::kick_use`]). Kicks are taken where neither does:
//!
//! ```text
//!        mean misfit > 15, stator not sound, or innovations coloured
//!   kicks taken ----------------------------------------> camera alone: the rate wanders as in `ConstantRate`
//!        ^                                                         |
//!        +---------------------------------------------------------+
//!          probation over, and the time since coloured innovations
//! ```
//!
//! Kicks that were contradicted have taught a wrong friction and a wrong tooth factor, and both as if they were sure.
//! So the next kick that is taken begins with the variances of their prior.
//!
//! Without drive no stator is needed: friction brakes a sliding rotor whatever strikes it
//! ([`super::unexplained_kick`]).

use motor_model::{Real, Time};

use super::TwinFilter;

impl<T: Real> TwinFilter<T> {
    /// Impacts or frames contradict the kicks at `now`: the stator filter starts anew, and its kicks have to wait.
    pub(super) fn contradict(&mut self, now: Time) {
        self.kick_use.contradict(now);
        self.restart_stator();
    }

    /// Decides whether kicks are taken from `now` on. Those of a twin that is told parts of the truth always are.
    pub(super) fn review_kick_use(&mut self, now: Time) {
        let driven = self.drive.mode().is_some() && !self.told.is_told();
        let kicked = self.kick_use.taken && driven && !self.detector.has_fault();
        if kicked && self.tracker.take_contradiction() {
            self.contradict(now);
        }
        let taken = !driven || (self.misfit.is_trusted() && self.kick_use.allows(now));
        if self.kick_use.set(taken, now) {
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
