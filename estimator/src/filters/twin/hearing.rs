//! What each sample of the vibrometer means to the twin: flight, an impact, a fall that tells wrong samples, or a gap.

use motor_model::{Real, Time};

use super::Course;
use super::TwinFilter;
use super::contact::Blow;
use super::driven::Strike;
use super::ride::Ride;
use super::trust::Trust;
use crate::measurement::LdvSample;
use crate::vibrometer::impact_detector::{Heard, ImpactDetector};
use crate::vibrometer::motion::Motion;

impl<T: Real> TwinFilter<T> {
    /// What the vibrometer has heard at a sample, `since_s` after the last one; `before` is the detector before it.
    pub(super) fn hear(
        &mut self,
        sample: &LdvSample,
        heard: Heard<T>,
        before: &ImpactDetector<T>,
        since_s: T,
    ) {
        let seen_m_s = T::from_f32(sample.velocity_m_s);
        if self.watch.motion(sample.taken_at) == Motion::Quiet {
            // What the detector hears now is the rotor's weight on the teeth, not a blow that could teach of the stator.
            self.stator.settle();
            (self.trust, self.ride) = (Trust::new(), Ride::new());
            (self.followed, self.course) = (true, Course::Launching);
            self.raw_jump_m_s = None;
            self.seen_m_s = seen_m_s;
            return;
        }
        let rise_s = T::from_f64(0.5) * since_s;
        match heard {
            Heard::Nothing => return,
            Heard::Flight => {
                self.stator.height_m += rise_s * (self.seen_m_s + seen_m_s);
                self.refine_after(T::from_i32(i32::from(self.tuning.contact.refining_samples)));
            }
            Heard::Impact { before_m_s, jump_m_s } => {
                self.stator.height_m += rise_s * (self.seen_m_s + before_m_s);
                let jump_m2_s2 = self.sample_m2_s2() * (T::one() + before.spread());
                let (unheard_m_s, _) = before.since_impact();
                let behind_s = self.stator.behind_s(sample.taken_at);
                let blow =
                    Blow { before_m_s, jump_m_s, jump_m2_s2, within_s: since_s, behind_s, unheard_m_s };
                self.strike(sample.taken_at, &blow);
            }
            Heard::Fall { drop_m_s } => {
                // A kick that was none, as large as the fall, may have been taken for one.
                let kick_rad_s = self.limit_per_jump_rad_m * drop_m_s;
                self.lose_sight(sample.taken_at, kick_rad_s * kick_rad_s);
            }
            Heard::Gap(seconds) => {
                let motion = self.watch.motion(sample.taken_at);
                let intensity = self.tuning.constant_rate.wander.intensity_rad2_s3(motion, false);
                if seconds > T::zero() {
                    self.stator.forget_motion();
                }
                self.lose_sight(sample.taken_at, intensity * seconds);
            }
        }
        self.seen_m_s = seen_m_s;
    }

    /// The vibrometer is heard again: what has struck the rotor since the last frame is not known.
    #[cold]
    pub(super) fn hear_again(&mut self) {
        let Some(from) = self.tracker.track().map(|track| track.state.at) else { return };
        // Right after that frame, so that one exposed since is not believed too much.
        let begun = self.strikes.back().map_or(from, |strike| strike.at.max(from));
        self.lose_sight(begun, self.tuning.constant_rate.track.kick_rad2_s2);
    }

    /// Before `at` the rate was kicked by nobody knows what, of that variance.
    fn lose_sight(&mut self, at: Time, unknown_rad2_s2: T) {
        self.raw_jump_m_s = None;
        self.keep(Strike::unknown(at, unknown_rad2_s2));
    }
}
