//! A partial genie: the filter is told the sign of each kick, as if of two hypotheses the true one were always found.
//!
//! At an impact that the vibrometer detects, the sign is that of all that truly changed the rate since the sample
//! before. Where the filter has a rate of the tooth, the slip is cut to that sign. Where it has none, as under mode C,
//! or one of the other sign throughout, the kick has a mean and a variance per the largest kick `c dv`.
//!
//! For studies: without the feature `tell` nothing can be told.

use heapless::Deque;
use motor_model::{Real, Time};

use super::ImpactAided;
use super::process::ImpactKick;
use crate::filters::twin::TrueContact;

/// Contacts between two samples that are kept: those beyond are left out.
const CONTACTS_KEPT_MAX: usize = 64;

/// Rate of a tooth, in rad/s, to which no friction carries a rotor: the kick is the largest.
const FAR_RAD_S: f64 = 1e3;

/// Least half width of the distribution of a tooth's rate, in rad/s.
const HALF_WIDTH_MIN_RAD_S: f64 = 1e-3;

/// Mean and variance of a kick whose sign is told and whose tooth's rate is not known, per the largest kick and its
/// square.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedKick<T> {
    /// Mean of its magnitude.
    pub mean: T,
    /// Variance about it.
    pub variance: T,
}

/// What is told, and what was since the last sample.
#[derive(Clone, Debug, Default)]
pub(super) struct ToldSigns<T> {
    kick: Option<SignedKick<T>>,
    contacts: Deque<(Time, T), CONTACTS_KEPT_MAX>,
    /// Change of the rate between the last two samples, in rad/s.
    pub(super) turned_rad_s: T,
}

impl<T: Real> ToldSigns<T> {
    /// A sample was taken at `at`.
    pub(super) fn pass(&mut self, at: Time) {
        self.turned_rad_s = T::zero();
        while let Some((_, kick_rad_s)) = self.contacts.pop_front_if(|contact| contact.0 <= at) {
            self.turned_rad_s += kick_rad_s;
        }
    }

    /// The kick of an impact with the sign that is told, if any is: of the `largest_rad_s`, on a rotor of `rate_rad_s`.
    pub(super) fn signed(&self, kick: ImpactKick<T>, largest_rad_s: T, rate_rad_s: T) -> ImpactKick<T> {
        let Some(signed) = self.kick.filter(|_| self.turned_rad_s != T::zero()) else { return kick };
        let (forwards, slip_rad_s) = (self.turned_rad_s > T::zero(), kick.tooth_rate_rad_s - rate_rad_s);
        let ends = [slip_rad_s - kick.half_width_rad_s, slip_rad_s + kick.half_width_rad_s];
        let [low, high] =
            ends.map(|end| if forwards { end.at_least(T::zero()) } else { end.at_most(T::zero()) });
        let (half, width_rad_s) = (T::from_f64(0.5), T::from_f64(0.5) * (high - low));
        if kick.kick_max_rad_s > T::zero() && width_rad_s > T::zero() {
            return ImpactKick {
                tooth_rate_rad_s: rate_rad_s + half * (low + high),
                half_width_rad_s: width_rad_s.at_least(T::from_f64(HALF_WIDTH_MIN_RAD_S)),
                ..kick
            };
        }
        let far_rad_s = T::from_f64(if forwards { FAR_RAD_S } else { -FAR_RAD_S });
        ImpactKick {
            at: kick.at,
            tooth_rate_rad_s: rate_rad_s + far_rad_s,
            half_width_rad_s: T::one(),
            kick_max_rad_s: signed.mean * largest_rad_s,
            variance_rad2_s2: signed.variance * largest_rad_s * largest_rad_s,
        }
    }
}

impl<T: Real> ImpactAided<T> {
    /// The same filter before its first measurement, which is told the sign of each kick by [`Self::tell`].
    #[must_use]
    pub fn with_told_signs(mut self, kick: SignedKick<T>) -> Self {
        self.told.kick = Some(kick);
        self
    }

    /// The kick of an impact of `jump_m_s` with the sign that is told.
    pub(super) fn of_told_sign(&self, kick: ImpactKick<T>, jump_m_s: T) -> ImpactKick<T> {
        let state = self.propagated.as_ref().or_else(|| self.tracker.track().map(|track| &track.state));
        let largest_rad_s = self.tuning.kick_per_jump_rad_m * jump_m_s;
        state.map_or(kick, |state| self.told.signed(kick, largest_rad_s, state.rate_rad_s))
    }

    /// Tells what truly happened: in the order of time, and before the first sample after it.
    pub fn tell(&mut self, contact: &TrueContact<T>) {
        if self.told.contacts.is_full() {
            let _ = self.told.contacts.pop_front();
        }
        let _ = self.told.contacts.push_back((contact.at, contact.kick_rad_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(turned_rad_s: f64) -> ToldSigns<f64> {
        let kick = Some(SignedKick { mean: 0.9, variance: 0.06 });
        let mut signs = ToldSigns::<f64> { kick, ..Default::default() };
        signs.contacts.push_back((Time::from_micros(3), turned_rad_s)).unwrap();
        signs.contacts.push_back((Time::from_micros(5), 0.0)).unwrap();
        signs.contacts.push_back((Time::from_micros(6), -100.0)).unwrap();
        signs.pass(Time::from_micros(5));
        signs
    }

    /// A tooth of 2 to 6 rad/s at a rotor of 3: slips of -1 to 3.
    #[test]
    fn exact_a_slip_is_cut_to_the_sign_that_is_told() {
        let kick = ImpactKick {
            at: Time::from_micros(5),
            tooth_rate_rad_s: 4.0,
            half_width_rad_s: 2.0,
            kick_max_rad_s: 5.0,
            variance_rad2_s2: 0.1,
        };
        let cut = |turned, rate| {
            let signed = told(turned).signed(kick, 5.0, rate);
            (signed.tooth_rate_rad_s, signed.half_width_rad_s, signed.kick_max_rad_s, signed.variance_rad2_s2)
        };
        assert_eq!(cut(0.5, 3.0), (4.5, 1.5, 5.0, 0.1));
        assert_eq!(cut(-0.5, 3.0), (2.5, 0.5, 5.0, 0.1));
        assert_eq!(cut(0.0, 3.0), (4.0, 2.0, 5.0, 0.1));
        // No slip of that sign.
        assert_eq!(cut(-0.5, 1.0), (-999.0, 1.0, 4.5, 1.5));
        let of_nothing = ToldSigns { kick: None, ..told(0.5) }.signed(kick, 5.0, 3.0);
        assert_eq!(of_nothing.tooth_rate_rad_s.to_bits(), 4.0_f64.to_bits());
    }

    #[test]
    fn exact_a_kick_without_a_tooth_s_rate_has_mean_and_variance() {
        let kick = ImpactKick::unknown(Time::from_micros(5), 10.0);
        for (turned, tooth_rate_rad_s) in [(0.1, 1002.0), (-0.1, -998.0)] {
            let signed = told(turned).signed(kick, 4.0, 2.0);
            assert_eq!((signed.tooth_rate_rad_s, signed.kick_max_rad_s), (tooth_rate_rad_s, 3.6));
            assert!((signed.variance_rad2_s2 - 0.96).abs() < 1e-12);
        }
    }
}
