//! What the samples after a strike still tell of it: its jump, as well as the flight's, and with that the tooth's velocity.

use motor_model::Real;

use super::contact::Known;
use super::driven::Strike;
use super::{TwinFilter, stator};

impl<T: Real> TwinFilter<T> {
    /// The newest strike, if it still waits for its frame.
    fn waiting(&mut self) -> Option<&mut Strike<T>> {
        let at = self.tracker.track()?.state.at;
        self.stale = true;
        self.strikes.back_mut().filter(|strike| strike.amendable && strike.at > at)
    }

    /// Corrects the tooth's velocity at the newest strike, if that still waits for its frame.
    pub(super) fn amend(&mut self, tooth_m_s: Known<T>) {
        let (per_radius_m, scale) = (self.per_radius_m, self.trust.scale());
        if let Some(strike) = self.waiting() {
            strike.tooth_rad_s.value += per_radius_m * tooth_m_s.value;
            strike.tooth_rad_s.variance = per_radius_m * per_radius_m * tooth_m_s.variance * scale;
        }
    }

    /// The last impact's jump as `samples` since tell it, whose mean is `moved_m_s` above the first.
    #[inline(never)]
    pub(super) fn refine(&mut self, raw_m_s: T, moved_m_s: T, samples: T) {
        let others = samples - T::one();
        let jump_m_s = raw_m_s + moved_m_s * samples / others;
        let errors = self.stator.refine(jump_m_s, self.sample_m2_s2() / others);
        if !self.stator.is_sound() {
            return self.lose_stator();
        }
        let of = |state: usize| errors.get(state).copied().unwrap_or_default();
        let covariance = &self.stator.covariance;
        let tooth = Known { value: of(stator::TOOTH), variance: covariance.variance::<{ stator::TOOTH }>() };
        let jump = Known { value: of(stator::JUMP), variance: covariance.variance::<{ stator::JUMP }>() };
        self.amend(tooth);
        let c = self.limit_per_jump_rad_m;
        if let Some(strike) = self.waiting() {
            strike.limit_rad_s.value += c * jump.value;
            strike.limit_rad_s.variance = c * c * jump.variance;
        }
    }

    /// The last impact's jump is as well known as it will be: `least` samples have come since, if any.
    pub(super) fn refine_after(&mut self, least: T) {
        let (moved_m_s, samples) = self.detector.since_impact();
        if let Some(raw_m_s) = self.raw_jump_m_s
            && samples >= least
        {
            self.refine(raw_m_s, moved_m_s, samples);
            self.raw_jump_m_s = None;
        }
    }
}
