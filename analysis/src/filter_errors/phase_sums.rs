//! The error sums of one filter, by the phase of the timeline.

use estimator::Innovation;
use motor_model::Real;

use super::error_sums::ErrorSums;
use super::timeline::TimelinePhase;

/// The error sums of one filter, by phase.
pub type PhaseSums = [ErrorSums; TimelinePhase::ALL.len()];

/// Adds an innovation to the sums of `phase`; without a phase it is not judged.
pub fn add_innovation<T: Real>(
    sums: &mut PhaseSums,
    phase: Option<TimelinePhase>,
    innovation: &Innovation<T>,
) {
    if let Some(phase) = phase {
        sums[phase as usize].innovation(innovation);
    }
}
