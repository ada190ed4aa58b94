//! Whether the stator explains the impacts: the running mean of their misfits.
//!
//! An impact's misfit is a sum of two normalised squares, of gap and approach. Where the stator is as good as is believed its mean is about two; one that is
//! saturated, biased, out of phase or pressed by the rotor's weight leaves tens. A single misfit, a chattering blow among others, tells nothing, so each counts at most
//! [`MISFIT_MOST`]. Beyond [`MISFIT_LIMIT`] the stator is begun anew, and kicks nobody until [`PROVING_BLOWS`] later impacts have been explained.

use motor_model::Real;

/// Impacts over which the misfit is averaged.
const BLOWS: f64 = 16.0;
/// Mean misfit of the motors drawn within the tolerances, on which the variances have been tuned.
const MISFIT_USUAL: f64 = 4.0;
/// What a single misfit counts at most.
const MISFIT_MOST: f64 = 60.0;
/// Mean misfit beyond which the stator is no longer believed.
const MISFIT_LIMIT: f64 = 20.0;
/// Misfit beyond which a single blow is not explained: its kick is as uncertain as without the stator.
const BLOW_MISFIT_MOST: f64 = 40.0;
/// Mean misfit below which one begun anew is believed.
const MISFIT_PROVEN: f64 = 10.0;
/// Impacts that it takes at least: some 60 ms of mode B.
const PROVING_BLOWS: u8 = 16;

/// Running mean of the misfits, and what follows from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trust<T> {
    misfit: T,
    /// Impacts still to be explained; 0 for a stator that is believed.
    unproven: u8,
}

impl<T: Real> Trust<T> {
    /// That in a stator at rest.
    pub(super) fn new() -> Self {
        Self { misfit: T::from_f64(2.0), unproven: 0 }
    }

    /// That in a stator begun anew in motion.
    pub(super) fn lost() -> Self {
        Self { misfit: T::from_f64(MISFIT_PROVEN), unproven: PROVING_BLOWS }
    }

    /// Takes an impact's misfit in; whether the stator has to be begun anew.
    pub(super) fn note(&mut self, misfit: T) -> bool {
        let most = T::from_f64(MISFIT_MOST);
        // Asked this way round, so that NaN counts as large.
        let misfit = if misfit < most { misfit } else { most };
        self.misfit += (misfit - self.misfit) * T::from_f64(1.0 / BLOWS);
        if self.unproven > 1 || self.misfit < T::from_f64(MISFIT_PROVEN) {
            self.unproven = self.unproven.saturating_sub(1);
        }
        self.misfit > T::from_f64(MISFIT_LIMIT)
    }

    /// Whether the stator is believed.
    pub(super) fn is_given(&self) -> bool {
        self.unproven == 0
    }

    /// Whether the rate may be kicked as the stator says of a blow of this misfit.
    pub(super) fn explains(&self, misfit: T) -> bool {
        self.is_given() && misfit < T::from_f64(BLOW_MISFIT_MOST)
    }

    /// By how much the stator's variances are too small: the mean misfit per that of a right one, at least 1.
    pub(super) fn scale(&self) -> T {
        let scale = self.misfit * T::from_f64(1.0 / MISFIT_USUAL);
        if scale > T::one() { scale } else { T::one() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_trust_is_lost_by_the_mean_and_regained_after_the_proof() {
        let mut trust = Trust::<f64>::new();
        for _ in 0..1000 {
            assert!(!trust.note(2.0) && trust.is_given());
        }
        assert!(!trust.note(f64::NAN) && trust.is_given());
        // 60 - 54.4 (15/16)^n > 20 from n = 5 on; the mean was 5.6 before.
        let lost_after = (1..100).find(|_| trust.note(f64::INFINITY));
        assert_eq!(lost_after, Some(5));
        trust = Trust::lost();
        let explained = (1..1000).find(|_| !trust.note(2.0) && trust.is_given());
        assert_eq!(explained, Some(u32::from(PROVING_BLOWS)));
        trust = Trust::lost();
        assert!((0..1000).all(|_| !trust.note(15.0) && !trust.is_given()));
    }
}
