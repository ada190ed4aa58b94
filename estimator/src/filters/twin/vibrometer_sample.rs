//! What each kind of vibrometer sample does to the filter: flight, an impact, a fall that shows wrong samples, or a
//! gap.

use motor_model::{Real, Time};

use super::TwinFilter;
use super::kick_record::KickRecord;
use super::measured_impact::MeasuredImpact;
use super::misfit_monitor::MisfitMonitor;
use super::regime::RegimeDetector;
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
            self.stator_follows = true;
            self.unrefined_jump = None;
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
            VibrometerEvent::Impact { before_m_s, jump_m_s } => {
                self.stator.height_m += half_s * (self.last_sample_m_s + before_m_s);
                let jump_m2_s2 = self.sample_m2_s2() * (T::one() + flight.velocity_variance);
                let behind_s = self.stator.behind_s(sample.taken_at);
                let within_s = since_s;
                let impact = MeasuredImpact {
                    before_m_s,
                    jump_m_s,
                    jump_m2_s2,
                    within_s,
                    behind_s,
                    drift_m_s: flight.drift_m_s,
                };
                let impact = self.told.measured(sample.taken_at, self.tuning.detector.gravity_m_s2, impact);
                innovation = self.take_impact(sample.taken_at, &impact);
            }
            VibrometerEvent::Fall { drop_m_s } => {
                // A wrong sample, as large as the fall, may have been taken for an impact.
                let kick_rad_s = self.kick_per_jump_rad_m * drop_m_s;
                self.record_unknown_kick(sample.taken_at, kick_rad_s * kick_rad_s);
            }
            VibrometerEvent::Gap(seconds) => {
                let motion = self.watch.motion(sample.taken_at);
                let intensity = self.tuning.constant_rate.random_walk.intensity_rad2_s3(motion, false);
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
        self.record_unknown_kick(at, self.tuning.constant_rate.track.kick_rad2_s2);
    }

    /// Keeps a kick of unknown sign with this variance.
    fn record_unknown_kick(&mut self, at: Time, variance_rad2_s2: T) {
        self.unrefined_jump = None;
        self.record_kick(KickRecord::of_unknown_sign(at, variance_rad2_s2));
    }
}
