//! The figures of a set of trials.

use serde::Serialize;

use super::StrategyTrials;
use super::trial::{MoveKind, PositioningTrial};
use simulation::math::statistics::{self, MeanSquare, Spread};

/// Figures of a set of trials.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrialSummary {
    /// Trials.
    pub trials: usize,
    /// Trials that failed.
    pub failures: usize,
    /// Trials in which the controller gave up.
    pub given_up: usize,
    /// Trials that the controller calls on target although the rotor is further off than three tolerances.
    pub reached_but_off: usize,
    /// The largest error of these; 0 if there is none.
    pub reached_but_off_worst_mdeg: f64,
    /// Share of the estimates on the way whose angle is off by more than three of their standard deviations: mean over
    /// the trials.
    pub beyond_3_sigma: f64,
    /// Trials with estimates on the way that are called good and are off by more than five.
    pub good_beyond_5_sigma: usize,
    /// The largest error of these.
    pub good_beyond_5_sigma_worst_mdeg: f64,
    /// Root mean square, over the trials, of the error of the estimate on the way.
    pub estimate_rms_mdeg: f64,
    /// Median magnitude of the true final error.
    pub p50_mdeg: f64,
    /// What 95 % of the errors do not exceed.
    pub p95_mdeg: f64,
    /// What 99.9 % do not exceed.
    pub p999_mdeg: f64,
    /// The largest error.
    pub max_mdeg: f64,
    /// Median time to settle, of those that did.
    pub median_settle_s: f64,
    /// What 95 % of them take at most.
    pub p95_settle_s: f64,
    /// Trials whose tolerance cannot be met before the deadline, as was said before.
    pub refused: usize,
    /// Median time that was promised to the others.
    pub median_promised_s: f64,
    /// Median of the time within which 95 % of such moves were promised to end.
    pub median_promised_95_s: f64,
    /// Share of the trials that settled which took longer than that.
    pub late: f64,
    /// Median, over quarter turns that settled, of the time per its bound; over all moves if there was no quarter turn.
    pub settle_over_bound: f64,
    /// Median overshoot.
    pub median_overshoot_mdeg: f64,
    /// Median number of changes of the drive.
    pub median_switches: f64,
    /// Median time with the drive on.
    pub median_on_s: f64,
}

impl TrialSummary {
    /// The figures of `trials`.
    pub fn of(trials: &[&PositioningTrial]) -> Self {
        let quantile = |mut values: Vec<f64>, per_mille| {
            statistics::quantile(&mut values, per_mille).unwrap_or(f64::NAN)
        };
        let all =
            |of: fn(&PositioningTrial) -> f64| trials.iter().map(|trial| of(trial)).collect::<Vec<f64>>();
        let error = |per_mille| quantile(all(|trial| trial.final_error_mdeg.abs()), per_mille);
        let settle: Vec<f64> = trials.iter().filter_map(|trial| trial.settle_s).collect();
        let settled = || trials.iter().filter(|trial| trial.settle_s.is_some());
        let ratios = |of_kind: fn(MoveKind) -> bool| -> Vec<f64> {
            let moves = trials.iter().filter(|trial| of_kind(trial.kind));
            moves.filter_map(|trial| Some(trial.settle_s? / trial.bound_s)).collect()
        };
        let off = || trials.iter().filter(|trial| trial.reached_but_off());
        let quarters = ratios(|kind| kind == MoveKind::QuarterTurn);
        let ratios = if quarters.is_empty() { ratios(|_| true) } else { quarters };
        let mut estimates = MeanSquare::default();
        trials.iter().filter_map(|trial| trial.rms_estimate_error_mdeg).for_each(|mdeg| estimates.add(mdeg));
        Self {
            trials: trials.len(),
            failures: trials.iter().filter(|trial| trial.failed()).count(),
            given_up: trials.iter().filter(|trial| trial.settle_s.is_none()).count(),
            reached_but_off: off().count(),
            reached_but_off_worst_mdeg: off().map(|trial| trial.final_error_mdeg.abs()).fold(0.0, f64::max),
            beyond_3_sigma: trials.iter().filter_map(|trial| trial.beyond_3_sigma).collect::<Spread>().mean,
            good_beyond_5_sigma: trials.iter().filter(|trial| trial.good_beyond_5_sigma > 0).count(),
            good_beyond_5_sigma_worst_mdeg: trials
                .iter()
                .map(|trial| trial.good_beyond_5_sigma_worst_mdeg)
                .fold(0.0, f64::max),
            estimate_rms_mdeg: estimates.root_of_some().unwrap_or(f64::NAN),
            p50_mdeg: error(500),
            p95_mdeg: error(950),
            p999_mdeg: error(999),
            max_mdeg: error(1000),
            median_settle_s: quantile(settle.clone(), 500),
            p95_settle_s: quantile(settle, 950),
            refused: trials.iter().filter(|trial| trial.promised_s.is_none()).count(),
            median_promised_s: quantile(trials.iter().filter_map(|trial| trial.promised_s).collect(), 500),
            median_promised_95_s: quantile(
                trials.iter().filter_map(|trial| trial.promised_95_s).collect(),
                500,
            ),
            late: settled().map(|trial| f64::from(u8::from(trial.late()))).collect::<Spread>().mean,
            settle_over_bound: quantile(ratios, 500),
            median_overshoot_mdeg: quantile(all(|trial| 1e3 * trial.overshoot_deg), 500),
            median_switches: quantile(all(|trial| f64::from(trial.switches)), 500),
            median_on_s: quantile(all(|trial| trial.drive_on_s), 500),
        }
    }
}

impl StrategyTrials {
    /// Figures of all trials.
    pub fn summary(&self) -> TrialSummary {
        TrialSummary::of(&self.trials.iter().collect::<Vec<_>>())
    }

    /// Figures of the trials of one kind of move.
    pub fn summary_of(&self, kind: MoveKind) -> TrialSummary {
        TrialSummary::of(&self.trials.iter().filter(|trial| trial.kind == kind).collect::<Vec<_>>())
    }

    /// Whether a quarter turn settled: [`TrialSummary::settle_over_bound`] is then over quarter turns.
    pub fn settled_quarter_turns(&self) -> bool {
        self.trials.iter().any(|trial| trial.kind == MoveKind::QuarterTurn && trial.settle_s.is_some())
    }

    /// The trials that failed.
    pub fn failures(&self) -> impl Iterator<Item = &PositioningTrial> {
        self.trials.iter().filter(|trial| trial.failed())
    }
}
