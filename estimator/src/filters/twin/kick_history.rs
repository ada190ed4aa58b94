//! The kicks since the oldest frame kept, and the track propagated through them.
//!
//! A late frame is fused at its exposure, so the kicks since the oldest frame kept are kept too, up to
//! [`crate::IMPACTS_KEPT_MAX`], as in [`crate::ImpactAided`].

use motor_model::{DriveMode, Real, Time};

use super::TwinFilter;
use super::kick_record::KickRecord;
use super::process::TwinProcess;
use super::rotor::FactorKnowledge;

impl<T: Real> TwinFilter<T> {
    /// The process up to `now`, that goes on from the propagated track.
    pub(super) fn process(&self, now: Time) -> TwinProcess<'_, T> {
        TwinProcess {
            tuning: &self.tuning,
            kicks: &self.kicks,
            motions: self.watch.motions(now),
            strength: &self.walk,
            taken_since: self.kick_use.since,
            detecting_until: self.detecting_until(),
            propagated: self.propagated.as_ref(),
        }
    }

    /// Predicts the track through the kicks since the last frame again, after the track has moved.
    #[inline(never)]
    pub(super) fn propagate(&mut self) {
        (self.propagated, self.newest_refined) = (None, false);
        let process = self.process(self.watch.clock());
        let propagated =
            self.tracker.track().and_then(|track| process.propagate(&track.state, track.resting));
        self.propagated = propagated;
    }

    /// Applies the newest kick again, if it has been refined.
    pub(super) fn reapply_newest_kick(&mut self) {
        if core::mem::take(&mut self.newest_refined)
            && let Some(propagated) = self.propagated
        {
            if self.kicks.back().is_some_and(|kick| kick.told.is_small()) {
                return self.propagate();
            }
            let process = self.process(self.watch.clock());
            self.propagated = Some(process.with_newest(&propagated));
        }
    }

    /// Until when impacts would have been detected: time zero while the vibrometer is at fault, or kicks are not taken.
    pub(super) fn detecting_until(&self) -> Time {
        let newest = self.detector.newest().filter(|_| self.kick_use.taken && !self.detector.has_fault());
        newest.map_or(Time::ZERO, |newest| newest.plus_nanos(self.tuning.detector.gap_nanos))
    }

    /// Keeps a kick. One that becomes known only after its frame has been fused acts right after that frame.
    #[inline(never)]
    pub(super) fn record_kick(&mut self, mut kick: KickRecord<T>) {
        self.reapply_newest_kick();
        self.told.improve(&mut kick, self.kick_per_jump_rad_m, self.undetected_rad2_s2());
        if !self.kick_use.taken {
            return;
        }
        let Some(track) = self.tracker.track() else { return };
        kick.at = kick.at.max(track.state.at.plus_nanos(1));
        if let Some(mode) = self.drive.mode() {
            let before: Option<DriveMode> = self.last_kick_mode.replace(mode);
            if before.is_some_and(|before| before != mode) {
                kick.factors = FactorKnowledge::OfAnotherMode;
            }
        }
        if self.kick_use.take_doubt() {
            kick.factors = FactorKnowledge::Prior;
        }
        if let Some(oldest) = self.kicks.front().map(|kick| kick.at)
            && self.kicks.is_full()
        {
            // Written out, since the process borrows the kicks while the tracker changes.
            let process = TwinProcess {
                tuning: &self.tuning,
                kicks: &self.kicks,
                motions: self.watch.motions(self.watch.clock()),
                strength: &self.walk,
                taken_since: self.kick_use.since,
                detecting_until: self.detecting_until(),
                propagated: None,
            };
            self.tracker.advance_to(oldest, &process);
            self.drop_old_kicks();
            if let (Some(propagated), Some(track)) = (&mut self.propagated, self.tracker.track()) {
                propagated.from = track.state.at;
            }
        }
        // There is room now.
        let _ = self.kicks.push_back(kick);
        let Some(propagated) = self.propagated else { return self.propagate() };
        let process = self.process(self.watch.clock());
        self.propagated = Some(process.extend(&propagated));
    }

    /// Drops the kicks before the oldest frame kept.
    pub(super) fn drop_old_kicks(&mut self) {
        let Some(at) = self.tracker.horizon() else { return };
        while self.kicks.front().is_some_and(|kick| kick.at <= at) {
            self.kicks.pop_front();
        }
    }
}
