//! The errors and the consistency of one filter in one phase.

use serde::Serialize;

use super::consistency::{ConsistencyTest, correlation_bound, mean_square_bounds};
use analysis::filter_errors::error_sums::ErrorSums;
use analysis::filter_errors::timeline::TimelinePhase;
use simulation::math::statistics::OUTSIDE_95;
use simulation::runs::stated_errors::StatedErrors;

/// The errors of one filter in one phase of one drive, over all motors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FilterErrorsRow {
    /// The filter.
    pub filter: &'static str,
    /// The mode that the run is about: b or c.
    pub drive: &'static str,
    /// The phase.
    pub phase: &'static str,
    /// Root mean square error of the angle.
    pub rms_angle_mdeg: f64,
    /// What 99.9 % of the errors' magnitudes do not exceed.
    pub p999_angle_mdeg: f64,
    /// Root mean square error of the rate.
    pub rms_rate_rad_s: f64,
    /// `rms_angle_mdeg` per that of the genie that is given every kick exactly.
    pub times_genie: f64,
    /// Mean normalised squared error of angle and rate together, per degree of freedom.
    pub anees: f64,
    /// Its 95 % bounds.
    pub anees_bounds: (f64, f64),
    /// Mean normalised squared error of the angle.
    pub angle_anees: f64,
    /// Its 95 % bounds.
    pub angle_anees_bounds: (f64, f64),
    /// Mean normalised squared error of the rate.
    pub rate_anees: f64,
    /// Mean normalised squared innovation of the camera; `null` if none was used.
    pub nis: f64,
    /// Its 95 % bounds.
    pub nis_bounds: (f64, f64),
    /// Correlation of neighbouring innovations.
    pub whiteness: f64,
    /// Its 95 % bound, in both directions.
    pub whiteness_bound: f64,
    /// Mean normalised squared innovation of the gap at impacts; `null` for a filter that predicts none.
    pub gap_nis: f64,
    /// Its 95 % bounds.
    pub gap_nis_bounds: (f64, f64),
    /// Correlation of the gap's innovations at neighbouring impacts.
    pub gap_whiteness: f64,
    /// Mean normalised squared innovation of the approach, given the gap.
    pub approach_nis: f64,
    /// Its 95 % bounds.
    pub approach_nis_bounds: (f64, f64),
    /// Correlation of the approach's innovations at neighbouring impacts.
    pub approach_whiteness: f64,
    /// Share of the impacts that the filter's model did not explain.
    pub impacts_refused: f64,
    /// Share of the measurements that were rejected.
    pub rejected: f64,
    /// How often the filter started anew over all runs, the first starts included.
    pub restarts: u64,
    /// Share of the time without an estimate.
    pub missing: f64,
    /// Share of the time in which the health was good.
    pub good: f64,
    /// Share of the time in which it was degraded.
    pub degraded: f64,
    /// Share of the time in which the estimate was not to be used.
    pub unusable: f64,
    /// Share of the time in which the health was good and the angle wrong.
    pub false_valid: f64,
    /// Share of the estimates whose angle is off by more than three of their standard deviations.
    pub beyond_3_sigma: f64,
    /// Estimates of good health whose angle is off by more than five.
    pub good_beyond_5_sigma: u64,
    /// The largest error of these.
    pub good_beyond_5_sigma_worst_mdeg: f64,
    /// Runs.
    pub runs: u64,
    /// The scene beside the first that the row is of, by its name; `null` for the first.
    pub beside: Option<String>,
    /// What the filter was told of the truth, words joined by `+`; `null` for nothing.
    pub told: Option<String>,
    /// Root mean square error of the angle of each run.
    #[serde(skip)]
    pub rms_of_runs_mdeg: Vec<f64>,
    /// The figures of consistency of each run.
    #[serde(skip)]
    pub of_runs: ConsistencyOfRuns,
}

/// The figures of consistency of each run, in the order of the runs.
#[derive(Clone, Debug, PartialEq)]
pub struct ConsistencyOfRuns {
    /// Mean normalised squared error of angle and rate together.
    pub anees: Vec<f64>,
    /// Mean normalised squared error of the angle.
    pub angle_anees: Vec<f64>,
    /// Mean normalised squared innovation.
    pub nis: Vec<f64>,
    /// Correlation of neighbouring innovations.
    pub whiteness: Vec<f64>,
}

impl FilterErrorsRow {
    pub(super) fn new(
        (filter, drive, phase): (&'static str, &'static str, &'static str),
        sums: &ErrorSums,
        runs: &[&ErrorSums],
        genie_mdeg: f64,
    ) -> Self {
        let ([good, degraded, unusable], false_valid) = sums.health();
        let ([angle_anees, rate_anees, anees], (nis, whiteness)) = (sums.normalised(), sums.innovations());
        let StatedErrors { beyond_3_sigma, good_beyond_5_sigma, good_beyond_5_sigma_worst_mdeg } =
            sums.stated();
        let each = |value: fn(&ErrorSums) -> f64| runs.iter().map(|run| value(run)).collect::<Vec<f64>>();
        let of_runs = ConsistencyOfRuns {
            anees: each(|run| run.normalised()[2]),
            angle_anees: each(|run| run.normalised()[0]),
            nis: each(|run| run.innovations().0),
            whiteness: each(|run| run.innovations().1),
        };
        let bounds_of = |means: &[f64]| mean_square_bounds(means.iter().copied(), OUTSIDE_95);
        let [(gap_nis, gap_whiteness), (approach_nis, approach_whiteness)] = sums.contact_innovations();
        Self {
            filter,
            drive,
            phase,
            rms_angle_mdeg: sums.rms_angle_mdeg(),
            p999_angle_mdeg: sums.p999_angle_mdeg(),
            rms_rate_rad_s: sums.rms_rate_rad_s(),
            times_genie: sums.rms_angle_mdeg() / genie_mdeg,
            anees,
            anees_bounds: bounds_of(&of_runs.anees),
            angle_anees,
            angle_anees_bounds: bounds_of(&of_runs.angle_anees),
            rate_anees,
            nis,
            nis_bounds: bounds_of(&of_runs.nis),
            whiteness,
            whiteness_bound: correlation_bound(of_runs.whiteness.iter().copied(), OUTSIDE_95),
            gap_nis,
            gap_nis_bounds: bounds_of(&each(|run| run.contact_innovations()[0].0)),
            gap_whiteness,
            approach_nis,
            approach_nis_bounds: bounds_of(&each(|run| run.contact_innovations()[1].0)),
            approach_whiteness,
            impacts_refused: sums.impacts_refused(),
            rejected: sums.rejected(),
            restarts: sums.restarts,
            missing: sums.missing(),
            good,
            degraded,
            unusable,
            false_valid,
            beyond_3_sigma: beyond_3_sigma.unwrap_or(f64::NAN),
            good_beyond_5_sigma,
            good_beyond_5_sigma_worst_mdeg,
            runs: runs.len() as u64,
            beside: None,
            told: None,
            rms_of_runs_mdeg: runs.iter().map(|run| run.rms_angle_mdeg()).collect(),
            of_runs,
        }
    }

    /// Whether the errors are as large as the filter says, by the test of the phase.
    pub fn errors_within(&self, phase: TimelinePhase) -> bool {
        match ConsistencyTest::of(phase) {
            ConsistencyTest::Both => within(self.anees, self.anees_bounds),
            ConsistencyTest::Angle => within(self.angle_anees, self.angle_anees_bounds),
            ConsistencyTest::AtMost => self.anees <= self.anees_bounds.1,
        }
    }

    /// Whether the innovations are as large as the filter says, or there are none.
    pub fn innovations_within(&self) -> bool {
        self.nis.is_nan() || within(self.nis, self.nis_bounds)
    }

    /// Whether neighbouring innovations are uncorrelated, or there are none.
    pub fn innovations_white(&self) -> bool {
        self.whiteness.is_nan() || self.whiteness.abs() <= self.whiteness_bound
    }
}

fn within(value: f64, (low, high): (f64, f64)) -> bool {
    value >= low && value <= high
}
