//! The time that was promised before the moves, beside the time that they took.

use super::tables::millidegrees;
use super::{PositioningTrials, StrategyTrials};
use crate::report::document::{Block, Table};
use crate::studies::beside::{FIRST, side_by_side};

/// What the figures of the table mean.
const ABOUT: &str = "Promised before each move: the expected time and the time within which 95 % of such moves end, \
    medians over the trials. Refused: moves whose tolerance, as was said before, cannot be met before the deadline; \
    they are made all the same. Late: of the moves that settled, the share that took longer than was promised to 95 % \
    of such moves; 5 % are as promised. Errors in milli-degrees, times in s.";

impl PositioningTrials {
    /// The promises to the trials on every scene, for the terminal.
    pub(super) fn promises(&self) -> [Block; 3] {
        let mut table = Table::new(&[
            "scene",
            "trials",
            "refused",
            "given up",
            "promised s",
            "95 % in",
            "settle s",
            "95 % in",
            "late",
            "95 %",
            "worst",
        ]);
        for (name, trials) in side_by_side(FIRST, &self.trials, &self.beside) {
            table.push(cells(name, trials));
        }
        let heading = Block::Heading("Time promised, and time taken".to_owned());
        [heading, Block::Paragraph(ABOUT.to_owned()), Block::Table(table)]
    }
}

fn cells(scene: &str, trials: &StrategyTrials) -> Vec<String> {
    let summary = trials.summary();
    vec![
        scene.to_owned(),
        summary.trials.to_string(),
        summary.refused.to_string(),
        summary.given_up.to_string(),
        format!("{:.2}", summary.median_promised_s),
        format!("{:.2}", summary.median_promised_95_s),
        format!("{:.2}", summary.median_settle_s),
        format!("{:.2}", summary.p95_settle_s),
        format!("{:.1} %", 100.0 * summary.late),
        millidegrees(summary.p95_mdeg),
        millidegrees(summary.max_mdeg),
    ]
}
