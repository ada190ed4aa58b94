//! What each kind of vibrometer sample does to the filter: flight, an impact, a fall that shows wrong samples, or a
//! gap.

use motor_model::{Real, Time};

use super::{KickRecord, MeasuredImpact, MisfitMonitor, RegimeDetector, TwinFilter};
use crate::filters::impact_aided::RATE_MEMORY_S;
use crate::innovation::ImpactInnovation;
use crate::measurement::LdvSample;
use crate::vibrometer::impact_detector::{Flight, VibrometerEvent};
use crate::vibrometer::motion::Motion;

impl<T: Real> TwinFilter<T> {
    /// Acts on what the detector has made of a sample `since_s` after the last one; `flight` is what came before it.
    /// Returns the innovations of an impact.
    pub(super) fn act_on(
        &mut self,
        sample: &LdvSample,
        event: VibrometerEvent<T>,
        flight: &Flight<T>,
        since_s: T,
    ) -> Option<ImpactInnovation<T>> {
        let sample_m_s = T::from_f32(sample.velocity_m_s);
        if self.watch.motion(sample.taken_at) == Motion::Quiet {
            // What the detector finds now is the rotor's weight on the teeth, not an impact of a moving stator.
            self.stator.set_at_rest();
            (self.misfit, self.regime) = (MisfitMonitor::trusted(), RegimeDetector::new());
            (self.stator_follows, self.unrefined_jump) = (true, None);
            self.last_sample_m_s = sample_m_s;
            return None;
        }
        let mut innovation = None;
        let half_s = T::from_f64(0.5) * since_s;
        match event {
            VibrometerEvent::Rejected => return None,
            VibrometerEvent::Flight => {
                self.stator.height_m += half_s * (self.last_sample_m_s + sample_m_s);
                self.refine_jump_after(self.tuning.refining_samples);
            }
            VibrometerEvent::Impact { before_m_s, jump_m_s, .. } => {
                self.stator.height_m += half_s * (self.last_sample_m_s + before_m_s);
                let jump_m2_s2 = self.sample_m2_s2() * (T::one() + flight.velocity_variance);
                let behind_s = self.stator.behind_s(sample.taken_at);
                let (within_s, drift_m_s) = (since_s, flight.drift_m_s);
                let impact =
                    MeasuredImpact { before_m_s, jump_m_s, jump_m2_s2, within_s, behind_s, drift_m_s };
                #[cfg(feature = "tell")]
                let impact = self.told.measured(sample.taken_at, self.tuning.detector.gravity_m_s2, impact);
                innovation = self.take_impact(sample.taken_at, &impact);
            }
            VibrometerEvent::Fall { drop_m_s } => {
                // A wrong sample, as large as the fall, may have been taken for an impact.
                let kick_rad_s = self.tuning.without_stator.kick_per_jump_rad_m * drop_m_s;
                self.record_unknown_kick(sample.taken_at, kick_rad_s * kick_rad_s);
            }
            VibrometerEvent::Gap(seconds) => {
                let motion = self.watch.motion(sample.taken_at);
                let intensity =
                    self.tuning.without_stator.constant_rate.random_walk.intensity_rad2_s3(motion, false);
                if seconds > T::zero() {
                    self.stator.forget_motion();
                }
                let longest_s = T::from_f64(RATE_MEMORY_S);
                let seconds = if seconds < longest_s { seconds } else { longest_s };
                self.record_unknown_kick(sample.taken_at, intensity * seconds);
            }
        }
        self.last_sample_m_s = sample_m_s;
        innovation
    }

    /// After a fault of the vibrometer the impacts since the last frame are not known: one unknown kick stands for
    /// them, right after that frame, so that later frames correct the rate.
    #[cold]
    pub(super) fn resume_detection(&mut self) {
        let Some(from) = self.tracker.track().map(|track| track.state.at) else { return };
        let at = self.kicks.back().map_or(from, |kick| kick.at.max(from));
        self.record_unknown_kick(at, self.tuning.without_stator.constant_rate.track.kick_rad2_s2);
    }

    /// Keeps a kick of unknown sign with this variance.
    fn record_unknown_kick(&mut self, at: Time, variance_rad2_s2: T) {
        self.unrefined_jump = None;
        self.record_kick(KickRecord::of_unknown_sign(at, variance_rad2_s2));
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, DriveCommand, DriveMode, Time};

    use super::*;
    use crate::filter::AngleFilter as _;
    use crate::filters::twin::tests::filter;
    use crate::measurement::CameraFrame;

    fn sample(micros: u64, velocity_m_s: f32) -> LdvSample {
        LdvSample { taken_at: Time::from_micros(micros), velocity_m_s }
    }

    /// Up to an impact the rotor has the velocity of the flight before it, not that of the sample after it: the mean of
    /// the last sample and of the flight's end over the 5 us between the samples.
    #[test]
    fn exact_the_height_at_an_impact_is_that_of_the_flight_before() {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
        // The weight of a rotor without drive makes it: the stator is not updated by it.
        (filter.last_sample_m_s, filter.drive) = (-0.02, DriveCommand::OFF);
        filter.stator_follows = false;
        let event = VibrometerEvent::Impact { before_m_s: -0.04, jump_m_s: 0.09, height_m: 0.0 };
        let flight = filter.detector.flight;
        filter.act_on(&sample(1000, 0.05), event, &flight, 5e-6);
        let expected = 5e-6 * 0.5 * (-0.02 - 0.04);
        assert!((filter.stator.height_m - expected).abs() < 1e-15, "{:e}", filter.stator.height_m);
    }

    /// A rotor that lies quiet will bounce when it is driven again, and the stator follows and is trusted.
    #[test]
    fn exact_quiet_begins_anew() {
        let mut filter = filter::<f64>();
        filter.drive(Time::ZERO, DriveCommand::full(DriveMode::B));
        filter.drive(Time::from_micros(1000), DriveCommand::OFF);
        let threshold_m_s = filter.detector.threshold_m_s();
        (0..200).for_each(|_| filter.regime.note(threshold_m_s, 0.0, threshold_m_s));
        (filter.stator_follows, filter.misfit) = (false, MisfitMonitor::on_probation());
        assert!(filter.regime.riding);
        let flight = filter.detector.flight;
        filter.act_on(&sample(1_000_000, 0.0), VibrometerEvent::Flight, &flight, 5e-6);
        assert!(filter.stator_follows && filter.misfit == MisfitMonitor::trusted());
        assert!(filter.regime == RegimeDetector::new());
    }

    /// Over a gap the rate wanders as without a vibrometer, for no longer than it remembers, 12 ms.
    #[test]
    fn exact_a_gap_is_a_random_walk_of_bounded_length() {
        for (seconds, counted_s) in [(1e-3, 1e-3), (0.5, 12e-3)] {
            let mut filter = filter::<f64>();
            filter.drive(Time::from_micros(1000), DriveCommand::OFF);
            filter.update_camera(&CameraFrame::new(Time::from_micros(1000), Angle::ZERO));
            filter.drive(Time::from_micros(1001), DriveCommand::full(DriveMode::B));
            let flight = filter.detector.flight;
            filter.act_on(&sample(2000, 0.0), VibrometerEvent::Gap(seconds), &flight, 5e-6);
            let expected =
                counted_s * filter.tuning.without_stator.constant_rate.random_walk.impacted_b_rad2_s3;
            let own = filter.kicks.back().unwrap().unknown_rad2_s2;
            assert!((own / expected - 1.0).abs() < 1e-12, "{seconds}: {own} {expected}");
        }
    }
}
