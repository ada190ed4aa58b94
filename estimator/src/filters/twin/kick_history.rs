//! The kicks since the oldest frame kept, and the track propagated through them.
//!
//! A late frame is fused at its exposure, so the kicks since the oldest frame kept are kept too, as many as the camera
//! needs ([`crate::filters::kicks_kept`]). Where a frame is followed by many, the track passes a few of them with each
//! sample ([`crate::filters::checkpoints`]).

use motor_model::{Real, Time};

use super::process::{PropagatedTrack, TwinProcess, twin_process};
use super::rotor::FactorKnowledge;
use super::{KickRecord, TwinFilter};
use crate::filters::kicks_kept::kicks_kept;

impl<T: Real> TwinFilter<T> {
    /// The process up to `now`, that goes on from the propagated track.
    pub(super) fn process(&self, now: Time) -> TwinProcess<'_, T> {
        twin_process!(self, now, self.propagated.as_ref())
    }

    /// Predicts the track through the kicks since the last frame again, after the track has moved.
    #[inline(never)]
    pub(super) fn propagate(&mut self) {
        (self.newest_refined, self.renewed) = (false, None);
        if self.tuning.without_stator.slow_camera {
            self.checkpoints.begin(self.tracker.place());
        }
        let (process, track) = (self.process(self.watch.clock()), self.tracker.track());
        self.propagated = track.and_then(|track| process.propagate(&track.state, track.resting));
    }

    /// Predicts the track, which a frame has moved, through the kicks since. With a slow camera they may be many: then
    /// some now, the others with the next samples.
    pub(super) fn renew(&mut self) {
        let slow_camera = self.tuning.without_stator.slow_camera;
        let propagated = self.propagated.as_mut().filter(|_| slow_camera);
        let Some((track, propagated)) = self.tracker.track().zip(propagated) else { return self.propagate() };
        // Until then it serves for the track that it does not know yet.
        (propagated.from, propagated.resting) = (track.state.at, track.resting);
        self.renewed = Some(track.state.copied());
        self.checkpoints.begin(self.tracker.place());
        self.go_on();
    }

    /// Predicts the track that a frame has moved through the next kicks.
    #[cold]
    #[inline(never)]
    pub(super) fn go_on(&mut self) {
        let Some((mut state, track)) = self.renewed.take().zip(self.tracker.track()) else { return };
        let (process, from, resting) = (self.process(self.watch.clock()), track.state.at, track.resting);
        if process.go_on(&mut state, resting) {
            let kicked = self.kicks.back().is_some_and(|newest| newest.at > from);
            self.propagated = kicked.then(|| process.with_newest(from, resting, &state));
            self.newest_refined = false;
        } else {
            self.checkpoints.keep(&state);
            self.renewed = Some(state);
        }
    }

    /// Applies the newest kick again, if it has been refined.
    pub(super) fn reapply_newest_kick(&mut self) {
        if core::mem::take(&mut self.newest_refined)
            && let Some(propagated) = self.propagated
        {
            if self.kicks.back().is_some_and(|kick| kick.told.is_small()) {
                return self.propagate();
            }
            let PropagatedTrack { from, resting, before_newest, .. } = &propagated;
            self.propagated =
                Some(self.process(self.watch.clock()).with_newest(*from, *resting, before_newest));
        }
    }

    /// Keeps a kick. One that becomes known only after its frame has been fused acts right after that frame.
    #[inline(never)]
    pub(super) fn record_kick(&mut self, mut kick: KickRecord<T>) {
        self.reapply_newest_kick();
        #[cfg(feature = "tell")]
        self.improve_as_told(&mut kick);
        if !self.kick_use.taken {
            return;
        }
        let Some(track) = self.tracker.track() else {
            self.kick_use.since = kick.at;
            return;
        };
        kick.at = kick.at.max(track.state.at.plus_nanos(1));
        if let Some(mode) = self.drive.mode()
            && self.last_kick_mode.replace(mode).is_some_and(|before| before != mode)
        {
            kick.factors = FactorKnowledge::OfAnotherMode;
        }
        if core::mem::take(&mut self.kick_use.doubted) {
            kick.factors = FactorKnowledge::Prior;
        }
        if let Some(oldest) = self.kicks.front().map(|kick| kick.at)
            && self.kicks.len() >= kicks_kept(self.tuning.without_stator.slow_camera)
        {
            let process = twin_process!(self, self.watch.clock(), None);
            self.tracker.advance_to(oldest, &process);
            self.checkpoints.follow(self.tracker.place());
            self.drop_old_kicks();
            if let (Some(propagated), Some(track)) = (&mut self.propagated, self.tracker.track()) {
                propagated.from = track.state.at;
            }
        }
        // There is room now.
        let _ = self.kicks.push_back(kick);
        let Some(propagated) = self.propagated else { return self.propagate() };
        let PropagatedTrack { from, resting, state, .. } = &propagated;
        if self.tuning.without_stator.slow_camera && self.renewed.is_none() {
            self.checkpoints.pass(state);
        }
        self.propagated = Some(self.process(self.watch.clock()).with_newest(*from, *resting, state));
    }

    /// Drops the kicks before the oldest frame kept.
    pub(super) fn drop_old_kicks(&mut self) {
        let Some(at) = self.tracker.horizon() else { return };
        while self.kicks.pop_front_if(|kick| kick.at <= at).is_some() {}
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, DriveCommand, DriveMode};

    use super::*;
    use crate::filter::AngleFilter as _;
    use crate::filters::checkpoints::Checkpoints;
    use crate::filters::twin::tests::filter;
    use crate::measurement::CameraFrame;

    fn unknown(micros: u64) -> KickRecord<f64> {
        KickRecord::of_unknown_sign(Time::from_micros(micros), 1.0)
    }

    /// A filter with one frame at a millisecond.
    fn seen() -> TwinFilter<f64> {
        let mut filter = filter();
        filter.drive(Time::from_micros(1000), DriveCommand::OFF);
        filter.update_camera(&CameraFrame::new(Time::from_micros(1000), Angle::ZERO));
        filter
    }

    /// The kick of an impact before the frame, which is told after it, acts at once after the frame.
    #[test]
    fn exact_a_kick_before_the_frame_acts_after_it() {
        let mut filter = seen();
        let now = Time::from_micros(1001);
        let before = filter.estimate(now).unwrap().rate_rad2_s2;
        filter.record_kick(unknown(990));
        assert_eq!(filter.kicks.back().unwrap().at, Time::from_nanos(1_000_001));
        let wider = filter.estimate(now).unwrap().rate_rad2_s2 - before;
        assert!((wider - 1.0).abs() < 1e-9, "{wider}");
    }

    /// The factors are doubted at the first kick of another mode, and all of them at the first one after a
    /// contradiction.
    #[test]
    fn exact_kicks_that_doubt_the_factors() {
        let mut filter = seen();
        let factors = |filter: &mut TwinFilter<f64>, micros: u64, mode: Option<DriveMode>| {
            filter.drive = mode.map_or(DriveCommand::OFF, DriveCommand::full);
            filter.record_kick(unknown(micros));
            filter.kicks.back().unwrap().factors
        };
        let (b, c) = (Some(DriveMode::B), Some(DriveMode::C));
        let told = [b, b, c, None, c, b].map(|mode| factors(&mut filter, 2000, mode));
        let (same, other) = (FactorKnowledge::AsBefore, FactorKnowledge::OfAnotherMode);
        assert_eq!(told, [same, same, other, same, same, other]);
        filter.drive = DriveCommand::OFF;
        filter.contradict(Time::from_micros(2100));
        let told = [None, None].map(|mode| factors(&mut filter, 2200, mode));
        assert_eq!(told, [FactorKnowledge::Prior, same]);
    }

    /// 80 kicks every 10 us from 1.1 ms on, and then a frame that was exposed at 1.5 ms: from the checkpoint at 1.41 ms
    /// it is fused as from the frame before it. Of the 39 kicks since, 32 are passed at once. The estimate is as it was
    /// before the frame until a sample brings the others, and then that of all kicks at once.
    #[test]
    fn exact_a_late_frame_is_fused_a_few_kicks_at_a_time() {
        let mut filter = seen();
        filter.tuning.without_stator.slow_camera = true;
        for n in 0..80 {
            filter.record_kick(KickRecord::of_unknown_sign(Time::from_micros(1100 + 10 * n), 1e-3));
        }
        filter.drive(Time::from_micros(1900), DriveCommand::OFF);
        let mut passed = *filter.tracker.track().unwrap();
        let resting = passed.resting;
        filter.checkpoints.go_on(&mut passed.state, resting, Time::from_micros(1500));
        assert_eq!(passed.state.at, Time::from_micros(1410));
        let (now, before) = (Time::from_micros(1901), filter.clone());
        let mut without_checkpoints = TwinFilter { checkpoints: Checkpoints::none(), ..filter.clone() };
        let frame = CameraFrame::new(Time::from_micros(1500), Angle::from_degrees(0.01));
        assert_eq!(filter.update_camera(&frame), without_checkpoints.update_camera(&frame));
        assert_eq!(filter.tracker.place(), without_checkpoints.tracker.place());
        assert_eq!(filter.estimate(now), before.estimate(now));
        filter.go_on();
        let fused = filter.estimate(now);
        assert_ne!(fused, before.estimate(now));
        without_checkpoints.propagate();
        assert_eq!(fused, without_checkpoints.estimate(now));
    }

    /// When the samples' times run back, kicks from then on never were.
    #[test]
    fn exact_kicks_of_times_that_were_wrong_are_dropped() {
        let mut filter = seen();
        for micros in [2000, 3000, 4000] {
            filter.record_kick(unknown(micros));
        }
        filter.resume_at(Time::from_micros(3000));
        assert_eq!(filter.kicks.back().unwrap().at, Time::from_micros(2000));
        let again = {
            let mut filter = seen();
            filter.record_kick(unknown(2000));
            filter
        };
        let now = Time::from_micros(5000);
        assert_eq!(filter.estimate(now), again.estimate(now));
    }
}
