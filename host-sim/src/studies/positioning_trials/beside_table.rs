//! The controller on several scenes side by side: errors, what is called reached and is not, and what it costs.

use super::tables::millidegrees;
use super::{PositioningTrials, StrategyTrials};
use crate::report::table::Table;
use crate::studies::beside::{SideBySide, side_by_side, worst_of};

/// What the figures of the table mean.
const ABOUT: &str = "Magnitude of the true angle less target at the end, in milli-degrees, and the median time to \
    settle. Given up: moves that the controller ends without the target. Reached, but off: moves that it calls on \
    target with the rotor further off than three tolerances, and the largest error of these. Estimate: root mean \
    square error on the way. Beyond 3 sigma: share of the estimates on the way whose angle is off by more than three \
    of the standard deviations that the filter states. Good, beyond 5 sigma: moves with an estimate that is called \
    good and is off by more than five, and the largest error of these. Time: seconds of this machine for a second of \
    motor time, filter and controller included.";

impl PositioningTrials {
    /// The controller on every scene, the first under the name `first`.
    pub(super) fn side_by_side(&self, first: &str) -> SideBySide {
        let mut table = Table::new(&[
            "scene",
            "trials",
            "given up",
            "50 %",
            "95 %",
            "worst",
            "reached, but off",
            "worst of these",
            "settle s",
            "estimate rms",
            "beyond 3 sigma",
            "good, beyond 5 sigma",
            "worst of these",
            "time s/s",
        ]);
        for (name, trials) in side_by_side(first, &self.trials, &self.beside) {
            table.push(cells(name, trials));
        }
        SideBySide { tables: table.cut(1, &["estimate rms"]), about: ABOUT.to_owned() }
    }
}

fn cells(scene: &str, trials: &StrategyTrials) -> Vec<String> {
    let summary = trials.summary();
    vec![
        scene.to_owned(),
        summary.trials.to_string(),
        summary.given_up.to_string(),
        millidegrees(summary.p50_mdeg),
        millidegrees(summary.p95_mdeg),
        millidegrees(summary.max_mdeg),
        summary.reached_but_off.to_string(),
        worst_of(summary.reached_but_off > 0, || millidegrees(summary.reached_but_off_worst_mdeg)),
        format!("{:.2}", summary.median_settle_s),
        millidegrees(summary.estimate_rms_mdeg),
        format!("{:.2} %", 100.0 * summary.beyond_3_sigma),
        summary.good_beyond_5_sigma.to_string(),
        worst_of(summary.good_beyond_5_sigma > 0, || millidegrees(summary.good_beyond_5_sigma_worst_mdeg)),
        format!("~{:.2}", trials.s_per_s),
    ]
}
