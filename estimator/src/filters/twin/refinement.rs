//! Refinement of the newest kick by the samples after its impact.
//!
//! The mean over the flight after an impact gives its jump better than one sample, and with it the tooth's velocity. As
//! long as no frame has been fused after the kick, its record is corrected and the propagated track with it.
//!
//! # Two measurements of one jump
//!
//! The first sample `v1` after an impact and the mean of the other `n - 1` measure the jump against the same mean `m`
//! of the flight before. With the noise `s` of a sample and the variance `p s^2` of `m`, the jump's errors are
//!
//! ```text
//! J0 = v1 - m                  var (J - J0) = s^2 (1 + p)
//! J1 = mean(v2 .. vn) - m      J1 - J0 = (J - J0) / (1 + p) + w,   var w = s^2 (p / (1 + p) + 1 / (n - 1))
//! ```
//!
//! where `w` is independent of `J - J0`: the error of `m` that the first measurement does not show, and the noise of
//! the others. The second measurement of `J` therefore is `J0 + (1 + p) (J1 - J0)`, of variance `(1 + p)^2 var w`.
//! Both together leave `s^2 (p + 1 / n)`: that of the mean of all samples less `m`.

use motor_model::Real;

use super::states::{Errors, JUMP, TOOTH_VELOCITY};
use super::{StatorFilter, TwinFilter, Uncertain};
use crate::vibrometer::impact_detector::Flight;

impl<T: Real> StatorFilter<T> {
    /// Updates the stator by the last impact's jump as the flight after it gives it; returns the corrections.
    ///
    /// The jump stays as it is, so the covariance is updated as of its last prediction.
    #[inline(never)]
    fn update_jump(&mut self, jump: Uncertain<T>) -> Errors<T> {
        let mut errors = Errors::zeros();
        let innovation = jump.value - self.jump_m_s;
        let _ = self.covariance.update_state::<JUMP>(jump.variance, innovation, &mut errors);
        self.carry_errors(&mut errors);
        self.correct(&errors);
        errors
    }
}

impl<T: Real> TwinFilter<T> {
    /// Corrects the newest kick by corrections of tooth's velocity and jump, if it can be refined and no frame has been
    /// fused after it.
    fn refine_kick(&mut self, tooth_velocity: Uncertain<T>, jump: Uncertain<T>) {
        let (s, c) = (self.per_radius_m, self.tuning.without_stator.kick_per_jump_rad_m);
        let inflation = self.misfit.variance_inflation();
        let Some(fused_at) = self.tracker.track().map(|track| track.state.at) else { return };
        self.newest_refined = true;
        let newest = self.kicks.iter_mut().rev().find(|kick| !kick.told.is_small());
        if let Some(kick) = newest.filter(|kick| kick.refinable && kick.at > fused_at) {
            if !kick.told.has_tooth_velocity() {
                kick.tooth_rate_rad_s.value += s * tooth_velocity.value;
                kick.tooth_rate_rad_s.variance = s * s * tooth_velocity.variance * inflation;
            }
            kick.kick_max_rad_s.value += c * jump.value;
            kick.kick_max_rad_s.variance = c * c * jump.variance;
        }
    }

    /// Refines the last impact's jump by the mean of all samples of the flight since.
    #[inline(never)]
    pub(super) fn refine_jump(&mut self, first: Uncertain<T>, flight: &Flight<T>) {
        let again = second_measurement(first, flight, self.sample_m2_s2());
        let errors = self.stator.update_jump(again);
        if !self.stator.has_sound_estimates() {
            return self.restart_stator();
        }
        let [[tooth_velocity, _, _, _, _, _, _, _, _, jump, ..]] = errors.data.0;
        let covariance = &self.stator.covariance;
        self.refine_kick(
            Uncertain { value: tooth_velocity, variance: covariance.variance::<TOOTH_VELOCITY>() },
            Uncertain { value: jump, variance: covariance.variance::<JUMP>() },
        );
    }

    /// Refines the last impact's jump once `least` samples have come since.
    pub(super) fn refine_jump_after(&mut self, least: T) {
        let flight = self.detector.flight;
        if let Some(first) = self.unrefined_jump
            && flight.samples >= least
        {
            self.refine_jump(first, &flight);
            self.unrefined_jump = None;
        }
    }
}

/// The jump as the flight after it measures it, given what its `first` sample made of it. See the module's head.
fn second_measurement<T: Real>(
    first: Uncertain<T>,
    &Flight { drift_m_s, samples, .. }: &Flight<T>,
    sample_m2_s2: T,
) -> Uncertain<T> {
    let others = samples - T::one();
    // `1 + p`: at least 1, whatever the noise was at the impact.
    let ratio = first.variance / sample_m2_s2;
    let widened = if ratio > T::one() { ratio } else { T::one() };
    let mean_of_others_above_first_m_s = drift_m_s * samples / others;
    Uncertain {
        value: first.value + widened * mean_of_others_above_first_m_s,
        variance: sample_m2_s2 * widened * (widened - T::one() + widened / others),
    }
}

#[cfg(test)]
mod tests {
    use motor_model::{Angle, DriveCommand, Time};

    use super::*;
    use crate::filter::AngleFilter as _;
    use crate::filters::twin::kick_record::KickRecord;
    use crate::filters::twin::tests::filter;
    use crate::measurement::{CameraFrame, LdvSample};

    /// A flight before of three samples, and `n` after: the minimum variance estimate of the jump is the difference of
    /// the two means, of variance `s^2 (1/3 + 1/n)`. Taken as independent, the measurements would leave a part of it:
    /// 0.27 for n = 20.
    #[test]
    fn exact_two_measurements_of_a_jump_are_the_difference_of_the_means() {
        let (before, sample_m2_s2) = (3.0_f64, 4e-8);
        for samples in [2.0, 4.0, 20.0] {
            let (first_m_s, drift_m_s) = (0.2, 3e-4);
            let first = Uncertain { value: first_m_s, variance: sample_m2_s2 * (1.0 + 1.0 / before) };
            let flight = Flight { drift_m_s, samples, velocity_variance: 1.0 / samples, ..Flight::default() };
            let again = second_measurement(first, &flight, sample_m2_s2);
            let gain = first.variance / (first.variance + again.variance);
            let jump_m_s = first.value + gain * (again.value - first.value);
            let variance = (1.0 - gain) * first.variance;
            assert!((jump_m_s - (first_m_s + drift_m_s)).abs() < 1e-12, "{samples}: {jump_m_s}");
            let expected = sample_m2_s2 * (1.0 / before + 1.0 / samples);
            assert!((variance / expected - 1.0).abs() < 1e-12, "{samples}: {variance:e} {expected:e}");
        }
    }

    /// The flight of an impact refines its jump once: the samples that have done so do not count again.
    #[test]
    fn exact_a_flight_refines_a_jump_once() {
        let mut filter = filter::<f64>();
        for n in 0..30 {
            let taken_at = Time::from_micros(5 * n);
            filter.detector.observe(&LdvSample { taken_at, velocity_m_s: -9.81 * 5e-6 * n as f32 });
        }
        let first = Uncertain { value: 0.05, variance: 5e-8 };
        filter.stator.covariance.replace_state(JUMP, first.variance);
        filter.stator.jump_m_s = first.value;
        filter.unrefined_jump = Some(first);
        let [once, twice] = [0, 1].map(|_| {
            filter.refine_jump_after(20.0);
            filter.stator.covariance.variance::<JUMP>()
        });
        assert!(once < 0.5 * first.variance && once.to_bits() == twice.to_bits(), "{once:e} {twice:e}");
    }

    /// A frame after a kick has been fused with it as it was: its record stays as it is, for frames that come late.
    #[test]
    fn exact_a_kick_before_the_last_frame_is_not_refined() {
        let mut filter = filter::<f64>();
        let see = |filter: &mut TwinFilter<f64>, micros: u64| {
            filter.drive(Time::from_micros(micros), DriveCommand::OFF);
            filter.update_camera(&CameraFrame::new(Time::from_micros(micros), Angle::ZERO));
        };
        see(&mut filter, 1000);
        let kick = KickRecord::of_unknown_sign(Time::from_micros(1500), 1e-6);
        filter.record_kick(KickRecord { refinable: true, ..kick });
        let refined = |filter: &mut TwinFilter<f64>| {
            filter.refine_kick(Uncertain { value: 1e-3, variance: 1e-8 }, Uncertain::default());
            filter.kicks.back().unwrap().tooth_rate_rad_s.value
        };
        let per_radius_m = filter.per_radius_m;
        assert!((refined(&mut filter) - 1e-3 * per_radius_m).abs() < 1e-12);
        see(&mut filter, 2000);
        assert!((refined(&mut filter) - 1e-3 * per_radius_m).abs() < 1e-12);
    }
}
