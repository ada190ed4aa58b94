//! A kick that the twin does not explain: what [`crate::ImpactAided`] knows of it, and what friction knows of a rotor that lands.
//!
//! ```text
//! mode B       towards the tooth's rate in pure mode B, at most c dv; the rest is noise
//! mode C       of unknown sign, variance (c dv)^2
//! drive off    clamp(S - rate, -c dv, c dv),   S = 0 +- k sqrt(v^2 + (a dv)^2)
//! ```
//!
//! A stator that is no longer driven moves as little as the blows are small, and so a rotor that slides over it is slowed down, never sped up: the friction of its
//! weight acts a thousand times in the same sense, which a noise of unknown sign would not allow. `k` is the turn per rise of a tooth in mode B, `a` the approach per
//! jump. What the detector has not heard but averaged into the flight, half of a resting rotor's weight, belongs to the jump.

use motor_model::{DriveMode, Real, Time};

use super::TwinFilter;
use super::contact::{Blow, Known, Unfit};
use super::driven::Strike;

/// A jump whose misfit is beyond noise's by this is noise half of the time.
const NOISE_BEYOND: f64 = 600.0;

impl<T: Real> TwinFilter<T> {
    /// The kick of a blow whose tooth is not known.
    pub(super) fn unexplained(&self, at: Time, blow: &Blow<T>) -> Strike<T> {
        let aided = &self.aided;
        let square = |x: T| x * x;
        let known = |value: T, variance: T| Known { value, variance };
        let c = self.limit_per_jump_rad_m;
        let threshold_rad_s = c * self.detector.threshold_m_s();
        let approach_m_s = aided.approach_per_jump * blow.jump_m_s;
        let heard_rad_s = c * blow.jump_m_s;
        let bound_rad2_s2 = square(heard_rad_s) + square(threshold_rad_s);
        let (limit_rad_s, tooth_rad_s, unknown_rad2_s2) = match self.drive.mode() {
            Some(DriveMode::B) => {
                let towards_rad_s = aided.turn_per_rise_rad_m * (blow.before_m_s + approach_m_s);
                (heard_rad_s, known(towards_rad_s, T::zero()), aided.unexplained_b * bound_rad2_s2)
            }
            Some(DriveMode::C) => (T::zero(), known(T::zero(), T::zero()), aided.unexplained * bound_rad2_s2),
            None => {
                let unheard_m_s = if blow.unheard_m_s > T::zero() { blow.unheard_m_s } else { T::zero() };
                let swing_m2_s2 = square(blow.before_m_s) + square(approach_m_s);
                let tooth = known(T::zero(), square(aided.turn_per_rise_rad_m) * swing_m2_s2);
                (heard_rad_s + c * unheard_m_s, tooth, square(threshold_rad_s))
            }
        };
        Strike {
            at,
            at_s2: T::zero(),
            limit_rad_s: known(limit_rad_s, c * c * blow.jump_m2_s2),
            tooth_rad_s,
            unknown_rad2_s2,
            amendable: false,
            in_other_mode: false,
        }
    }

    /// A jump that fits neither pair better than noise: noise if it fits them far worse, a kick of unknown sign else.
    pub(super) fn doubted(&self, at: Time, blow: &Blow<T>, unfit: Unfit<T>) -> Strike<T> {
        let most_rad_s = self.limit_per_jump_rad_m * blow.jump_m_s;
        let far =
            if self.trust.is_given() { unfit.beyond * T::from_f64(1.0 / NOISE_BEYOND) } else { T::zero() };
        Strike::unknown(at, T::from_f64(0.5) * most_rad_s * most_rad_s / (T::one() + far * far))
    }
}
