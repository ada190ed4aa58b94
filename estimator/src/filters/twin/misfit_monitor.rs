//! Whether the stator filter explains the impacts: the running mean of their misfits.
//!
//! An impact's misfit is the sum of two normalised innovations squared, gap and approach ([`super::association`]). Its
//! mean is about two in a consistent filter. A vibrometer that saturates, has a bias or wrong times, or a rotor that
//! lies on the teeth with its weight, leaves tens. A single misfit proves nothing, so each counts at most
//! [`MISFIT_MAX`].
//!
//! ```text
//!             mean misfit > MEAN_LIMIT, or stator not sound
//!   trusted ------------------------------------------------> on probation: stator restarted, kicks not used,
//!      ^                                                          |         health Degraded(ImpactsUnexplained)
//!      |     PROBATION_IMPACTS more, and mean < MEAN_PROVEN;      |
//!      +---- or the rotor comes to rest --------------------------+
//! ```

use motor_model::Real;

/// Impacts over which the misfit is averaged: as many as a probation takes.
const AVERAGED_IMPACTS: f64 = 16.0;
/// Mean misfit up to which variances are taken as they are. That of the impacts used is 2.4 (`host-sim estimate`), and
/// wanders; since no variance is ever made smaller, its upper half alone would make all of them too large. With this
/// value errors and variances agree over motors drawn within the tolerances.
const TYPICAL_MEAN: f64 = 5.0;
/// What a single misfit counts at most, so that four in a row are needed to lose trust. Assumed.
const MISFIT_MAX: f64 = 60.0;
/// Mean misfit beyond which the stator filter is restarted: motors that the model describes stay below, in transients
/// too, and rotors that tilt have tens. Found by simulation of both.
const MEAN_LIMIT: f64 = 15.0;
/// Misfit beyond which a single impact's kick is not used: it is as uncertain as without the stator filter. Assumed. A
/// vibrometer with a bias makes such impacts before their mean tells.
const USABLE_MISFIT_MAX: f64 = 40.0;
/// Mean misfit below which probation can end: what motors that the model describes show soon after a restart.
const MEAN_PROVEN: f64 = 6.0;
/// Impacts of a probation at least: some 60 ms of mode B.
const PROBATION_IMPACTS: u8 = 16;
/// Mean misfit at the start: that of a consistent filter, two measurements of one degree of freedom each.
const CONSISTENT_MEAN: f64 = 2.0;

/// Running mean of the misfits, and whether the stator filter is trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MisfitMonitor<T> {
    mean: T,
    /// Impacts until the end of the probation; 0 when trusted.
    probation: u8,
}

impl<T: Real> MisfitMonitor<T> {
    /// For a stator at rest: trusted.
    pub(super) fn trusted() -> Self {
        Self { mean: T::from_f64(CONSISTENT_MEAN), probation: 0 }
    }

    /// For a stator filter restarted in motion: on probation.
    pub(super) fn on_probation() -> Self {
        Self { mean: T::from_f64(MEAN_PROVEN), probation: PROBATION_IMPACTS }
    }

    /// Takes an impact's misfit in; returns whether the stator filter has to be restarted.
    pub(super) fn note(&mut self, misfit: T) -> bool {
        let most = T::from_f64(MISFIT_MAX);
        // Compared this way round, so that NaN counts as large.
        let misfit = if misfit < most { misfit } else { most };
        self.mean += (misfit - self.mean) * T::from_f64(1.0 / AVERAGED_IMPACTS);
        if self.probation > 1 || self.mean < T::from_f64(MEAN_PROVEN) {
            self.probation = self.probation.saturating_sub(1);
        }
        self.mean > T::from_f64(MEAN_LIMIT)
    }

    /// Whether the stator filter is trusted.
    pub(super) fn is_trusted(&self) -> bool {
        self.probation == 0
    }

    /// Whether the kick of an impact of this misfit may be used.
    pub(super) fn accepts(&self, misfit: T) -> bool {
        self.is_trusted() && misfit < T::from_f64(USABLE_MISFIT_MAX)
    }

    /// Factor on the stator filter's variances: the mean misfit per [`TYPICAL_MEAN`], at least 1.
    pub(super) fn variance_inflation(&self) -> T {
        let ratio = self.mean * T::from_f64(1.0 / TYPICAL_MEAN);
        if ratio > T::one() { ratio } else { T::one() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_trust_is_lost_by_the_mean_and_regained_after_the_probation() {
        let mut monitor = MisfitMonitor::<f64>::trusted();
        for _ in 0..1000 {
            assert!(!monitor.note(2.0) && monitor.is_trusted());
        }
        assert!(!monitor.note(f64::NAN) && monitor.is_trusted());
        // 60 - 54.4 (15/16)^n > 15 from n = 3 on; the mean was 5.6 before.
        let lost_after = (1..100).find(|_| monitor.note(f64::INFINITY));
        assert_eq!(lost_after, Some(3));
        monitor = MisfitMonitor::on_probation();
        let trusted_after = (1..1000).find(|_| !monitor.note(2.0) && monitor.is_trusted());
        assert_eq!(trusted_after, Some(u32::from(PROBATION_IMPACTS)));
        monitor = MisfitMonitor::on_probation();
        assert!((0..1000).all(|_| !monitor.note(15.0) && !monitor.is_trusted()));
    }
}
