//! Refinement of the newest kick by the samples after its impact.
//!
//! The mean over the flight after an impact gives its jump better than one sample; the next impact gives the motion
//! before, and with it the tooth's velocity, better. As long as no frame has been fused after the kick, its record is
//! corrected and the propagated track with it.

use motor_model::Real;

use super::TwinFilter;
use super::kick_record::KickRecord;
use super::measured_impact::Uncertain;
use super::states::{Errors, JUMP, TOOTH_VELOCITY};
use super::stator::StatorFilter;

impl<T: Real> StatorFilter<T> {
    /// Updates the stator by the last impact's jump as the flight after it gives it, with that variance; returns the
    /// corrections.
    #[inline(never)]
    fn update_jump(&mut self, jump_m_s: T, variance_m2_s2: T) -> Errors<T> {
        self.predict_covariance();
        let mut errors = Errors::zeros();
        let innovation = jump_m_s - self.jump_m_s;
        let _ = self.covariance.update_state::<JUMP>(variance_m2_s2, innovation, &mut errors);
        self.correct(&errors);
        errors
    }
}

impl<T: Real> TwinFilter<T> {
    /// The newest kick, if it can be refined and no frame has been fused after it.
    fn refinable_kick(&mut self) -> Option<&mut KickRecord<T>> {
        let at = self.tracker.track()?.state.at;
        self.newest_refined = true;
        self.kicks.back_mut().filter(|kick| kick.refinable && kick.at > at)
    }

    /// Corrects the tooth's velocity of the newest kick, if that can be refined.
    pub(super) fn refine_tooth_velocity(&mut self, correction_m_s: Uncertain<T>) {
        let (per_radius_m, inflation) = (self.per_radius_m, self.misfit.variance_inflation());
        if let Some(kick) = self.refinable_kick() {
            kick.tooth_rate_rad_s.value += per_radius_m * correction_m_s.value;
            kick.tooth_rate_rad_s.variance =
                per_radius_m * per_radius_m * correction_m_s.variance * inflation;
        }
    }

    /// Refines the last impact's jump, first measured as `first_m_s`, by the mean of all `samples` since, which is
    /// `drift_m_s` above the first of them.
    #[inline(never)]
    pub(super) fn refine_jump(&mut self, first_m_s: T, drift_m_s: T, samples: T) {
        let others = samples - T::one();
        // The mean of the samples without the first, whose noise the first measurement has in it.
        let jump_m_s = first_m_s + drift_m_s * samples / others;
        let errors = self.stator.update_jump(jump_m_s, self.sample_m2_s2() / others);
        if !self.stator.is_sound() {
            return self.restart_stator();
        }
        let correction = |state: usize| errors.get(state).copied().unwrap_or_default();
        let covariance = &self.stator.covariance;
        let tooth_velocity = Uncertain {
            value: correction(TOOTH_VELOCITY),
            variance: covariance.variance::<TOOTH_VELOCITY>(),
        };
        let jump = Uncertain { value: correction(JUMP), variance: covariance.variance::<JUMP>() };
        self.refine_tooth_velocity(tooth_velocity);
        let c = self.kick_per_jump_rad_m;
        if let Some(kick) = self.refinable_kick() {
            kick.kick_max_rad_s.value += c * jump.value;
            kick.kick_max_rad_s.variance = c * c * jump.variance;
        }
    }

    /// Refines the last impact's jump once `least` samples have come since.
    pub(super) fn refine_jump_after(&mut self, least: T) {
        let (drift_m_s, samples) = self.detector.since_impact();
        if let Some(first_m_s) = self.unrefined_jump_m_s
            && samples >= least
        {
            self.refine_jump(first_m_s, drift_m_s, samples);
            self.unrefined_jump_m_s = None;
        }
    }
}
