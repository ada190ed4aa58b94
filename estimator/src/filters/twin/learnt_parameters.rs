//! What the stator filter has learnt of the motor, kept for the time after a fault of the vibrometer.
//!
//! A fault is told only after some of its samples have been taken for impacts. What these have taught is wrong. The
//! parameters as they were before the fault are not, since the motor is the same. So two copies are kept, taken
//! [`APART_NANOS`] apart, and the older one counts after a fault. The drive's phase is not kept: it belongs to a
//! command, not to the motor.

use motor_model::{Real, Time};
use ud_filter::UdCovariance;

use super::states::{DRIVE_PHASE, Errors, MODE_PARAMETERS, STATES};
use super::{StatorFilter, TwinFilter};

/// Time between two copies: a fault is told within it, see the tests of the vibrometer's faults.
const APART_NANOS: u64 = 150_000_000;

/// Number of parameters and the phase, the last states.
const LAST: usize = STATES - MODE_PARAMETERS;

/// Estimates of the parameters and their covariance.
#[derive(Clone, Copy, Debug)]
pub(super) struct LearntParameters<T> {
    parameters: Errors<T>,
    covariance: UdCovariance<T, LAST>,
}

/// Two copies of what was learnt.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LearntCopies<T> {
    older: Option<LearntParameters<T>>,
    newer: Option<(Time, LearntParameters<T>)>,
}

impl<T: Real> TwinFilter<T> {
    /// Keeps what was learnt, if the stator filter explains the impacts and a copy is due.
    pub(super) fn keep_learnt(&mut self, at: Time) {
        let newer = self.learnt.newer.as_ref();
        let is_due = newer.is_none_or(|(taken_at, _)| at >= taken_at.plus_nanos(APART_NANOS));
        if self.misfit.is_trusted() && is_due {
            let StatorFilter { parameters, covariance, .. } = &self.stator;
            let learnt = LearntParameters { parameters: *parameters, covariance: covariance.last_states() };
            let before = self.learnt.newer.replace((at, learnt));
            // The first copy after a fault has none before it: what was learnt before the fault still counts.
            self.learnt.older = before.map(|(_, learnt)| learnt).or(self.learnt.older);
        }
    }

    /// Restarts the stator filter after a fault of the vibrometer, with what was learnt before it.
    #[cold]
    pub(super) fn restart_stator_after_fault(&mut self) {
        self.restart_stator();
        // The newer copy may have been taken during the fault.
        if let Some(learnt) = self.learnt.older {
            self.stator.parameters = learnt.parameters;
            self.stator.covariance.replace_last_states(&learnt.covariance);
            let phase_rad2 =
                self.stator.prior_variances.as_slice().get(DRIVE_PHASE).copied().unwrap_or_default();
            self.stator.covariance.replace_state(DRIVE_PHASE, phase_rad2);
        }
        self.learnt.newer = None;
    }
}

#[cfg(test)]
mod tests {
    use crate::filters::twin::states::{MASS_RATIO, PRIOR};
    use crate::filters::twin::tests::filter;

    use super::*;

    /// A copy taken during a fault is never restarted with, also not after the next fault: the one before the first
    /// still counts.
    #[test]
    fn law_what_a_fault_taught_is_forgotten() {
        let mut filter = filter::<f64>();
        let mut learn = |at_ms: u64, mass_ratio: f64| {
            filter.stator.parameters[MASS_RATIO] = mass_ratio;
            filter.keep_learnt(Time::from_nanos(at_ms * 1_000_000));
        };
        learn(0, 0.01);
        learn(150, 0.5);
        filter.restart_stator_after_fault();
        assert!((filter.stator.parameters[MASS_RATIO] - 0.01).abs() < 1e-12);
        filter.misfit = crate::filters::twin::MisfitMonitor::trusted();
        filter.keep_learnt(Time::from_nanos(400_000_000));
        filter.restart_stator_after_fault();
        let kept = filter.stator.parameters[MASS_RATIO];
        assert!((kept - 0.01).abs() < 1e-12, "{kept}");
    }

    /// The parameters are as well known as they were when they were kept, the drive's phase as at the start.
    #[test]
    fn exact_a_restart_keeps_the_parameters_and_not_the_phase() {
        let mut filter = filter::<f64>();
        for state in MODE_PARAMETERS..STATES {
            filter.stator.covariance.replace_state(state, 1e-8);
        }
        filter.keep_learnt(Time::ZERO);
        filter.keep_learnt(Time::from_nanos(APART_NANOS));
        filter.restart_stator_after_fault();
        let variances = filter.stator.covariance.variances();
        assert!((MODE_PARAMETERS..DRIVE_PHASE).all(|state| (variances[state] / 1e-8 - 1.0).abs() < 1e-9));
        let phase_rad2 = PRIOR[DRIVE_PHASE] * PRIOR[DRIVE_PHASE];
        assert!((variances[DRIVE_PHASE] / phase_rad2 - 1.0).abs() < 1e-9, "{}", variances[DRIVE_PHASE]);
    }
}
