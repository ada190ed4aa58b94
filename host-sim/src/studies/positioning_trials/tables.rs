//! Trials in tables: text, JSON and the values of their page.

use std::fmt::Write as _;

use serde_json::{Value, json};

use super::trial::FAILED_MDEG;
use super::{MoveKind, PositioningTrial, PositioningTrials, Strategy, StrategyTrials, TrialSummary};
use crate::report::OutputError;
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use crate::studies::beside::FIRST;
use crate::studies::shard;

/// Failures listed at most.
const LISTED_MAX: usize = 20;

const HEADER: [&str; 10] =
    ["", "trials", "failed", "50 %", "95 %", "99.9 %", "worst", "settle s", "switches", "drive on s"];

fn cells(name: &str, summary: &TrialSummary) -> Vec<String> {
    let mut cells = vec![name.to_owned(), summary.trials.to_string(), summary.failures.to_string()];
    let errors = [summary.p50_mdeg, summary.p95_mdeg, summary.p999_mdeg, summary.max_mdeg];
    cells.extend(errors.map(millidegrees));
    cells.push(format!("{:.2}", summary.median_settle_s));
    cells.push(format!("{:.0}", summary.median_switches));
    cells.push(format!("{:.3}", summary.median_on_s));
    cells
}

pub(crate) fn millidegrees(error: f64) -> String {
    if error < 10.0 { format!("{error:.2}") } else { format!("{error:.0}") }
}

pub(super) fn name_of(trials: &StrategyTrials) -> String {
    match trials.strategy {
        Strategy::Planned => format!("controller, {}", trials.filter.replace('_', " ")),
        other => other.name().to_owned(),
    }
}

/// The command that repeats a trial.
fn command(trial: &PositioningTrial, tolerance_deg: f64) -> String {
    format!("host-sim position --to {} --seed {} --tolerance {tolerance_deg}", trial.target_deg, trial.seed)
}

impl PositioningTrials {
    fn by_kind(&self) -> Table {
        let mut table = Table::new(&HEADER);
        table.push(cells("all", &self.trials.summary()));
        for (kind, name) in [
            (MoveKind::Long, "uniform in +-360 degrees"),
            (MoveKind::QuarterTurn, "90 degrees either way"),
            (MoveKind::Short, "1 milli-degree to 1 degree"),
        ] {
            table.push(cells(name, &self.trials.summary_of(kind)));
        }
        table
    }

    fn by_strategy(&self) -> Table {
        let mut table = Table::new(&HEADER);
        for trials in std::iter::once(&self.trials).chain(&self.others) {
            table.push(cells(&name_of(trials), &trials.summary()));
        }
        table
    }

    fn remarks(&self) -> String {
        let summary = self.trials.summary();
        let moves = if self.trials.settled_quarter_turns() { "quarter turns" } else { "all moves" };
        let mut text = format!(
            "True angle less target, in milli-degrees; medians of time to settle, drive changes and time with the \
             drive on. Settling takes {:.2} times its bound (median over {moves}): the distance at the mean rate \
             of the strongest drive and {:.2} s of measuring at rest. A trial fails if it is given up, or ends more \
             than {FAILED_MDEG} milli-degrees off.",
            summary.settle_over_bound, self.measuring_s
        );
        if summary.failures > 0 {
            let failures: Vec<String> = self
                .trials
                .failures()
                .take(LISTED_MAX)
                .map(|trial| {
                    format!("`{}` ({:+.1} mdeg)", command(trial, self.tolerance_deg), trial.final_error_mdeg)
                })
                .collect();
            let _ = write!(text, " Failed: {}.", failures.join(", "));
        }
        text
    }

    /// For the terminal.
    pub fn document(&self) -> Document {
        let mut blocks = vec![
            Block::Heading(format!(
                "Positioning, {} trials, {}",
                self.trials.trials.len(),
                name_of(&self.trials)
            )),
            Block::Paragraph(self.remarks()),
            Block::Table(self.by_kind()),
        ];
        if !self.others.is_empty() {
            blocks.push(Block::Heading("Beside other strategies and filters".to_owned()));
            blocks.push(Block::Table(self.by_strategy()));
        }
        blocks.extend(self.promises());
        if !self.beside.is_empty() {
            blocks.extend(self.side_by_side(FIRST).blocks());
        }
        Document { blocks }
    }

    /// The values of its page, the first scene under the name `first`.
    pub fn page_values(&self, first: &str) -> Vec<PlacedValue> {
        let summary = self.trials.summary();
        let mut values = vec![
            ("trials", summary.trials.to_string()),
            ("failures", summary.failures.to_string()),
            ("p95_mdeg", millidegrees(summary.p95_mdeg)),
            ("p999_mdeg", millidegrees(summary.p999_mdeg)),
            ("worst_mdeg", millidegrees(summary.max_mdeg)),
            ("quarter_turn_over_bound", format!("{:.2}", summary.settle_over_bound)),
            ("table_moves", self.by_kind().markdown()),
            ("remarks", self.remarks()),
            ("table_strategies", self.by_strategy().markdown()),
        ];
        values.extend(self.scene_values(first));
        values
    }

    /// The values of a page that shows the scenes side by side, the first under the name `first`.
    pub fn scene_values(&self, first: &str) -> [PlacedValue; 2] {
        self.side_by_side(first).page_values()
    }

    /// Everything but the single trials, as one JSON object on one line.
    pub fn json(&self) -> String {
        let value = |summary: &TrialSummary| serde_json::to_value(summary).unwrap_or_default();
        let mut object = value(&self.trials.summary());
        let kinds =
            [("long", MoveKind::Long), ("quarter_turn", MoveKind::QuarterTurn), ("short", MoveKind::Short)];
        let failed: Vec<Value> = self
            .trials
            .failures()
            .map(|trial| {
                let PositioningTrial { seed, target_deg, final_error_mdeg, .. } = trial;
                json!({"seed": seed, "target_deg": target_deg, "final_error_mdeg": final_error_mdeg})
            })
            .collect();
        object["measuring_s"] = json!(self.measuring_s);
        object["tolerance_deg"] = json!(self.tolerance_deg);
        object["failed"] = json!(failed);
        for (key, kind) in kinds {
            object[key] = value(&self.trials.summary_of(kind));
        }
        let others = self.others.iter().map(|trials| {
            let mut row = value(&trials.summary());
            row["strategy"] = json!(trials.strategy.name());
            row["filter"] = json!(trials.filter);
            row
        });
        object["others"] = others.collect();
        let beside = self.beside.iter().map(|other| {
            let mut row = value(&other.found.summary());
            row["beside"] = json!(other.name);
            row
        });
        object["beside"] = beside.collect();
        format!("{object}\n")
    }

    /// A row a trial.
    ///
    /// # Errors
    /// When it cannot be laid out: never.
    pub fn csv(&self) -> Result<String, OutputError> {
        shard::csv(&self.trials.trials)
    }
}

#[cfg(test)]
mod tests {
    use simulation::runs::position::MoveEnding;
    use simulation::scene::Scene;

    use super::*;

    /// A move of 2 s whose bound is 1 s.
    fn trial(kind: MoveKind) -> PositioningTrial {
        PositioningTrial {
            seed: 1,
            target_deg: 90.0,
            final_error_mdeg: 0.1,
            settle_s: Some(2.0),
            bound_s: 1.0,
            overshoot_deg: 0.0,
            switches: 4,
            drive_on_s: 0.5,
            number: 0,
            kind,
            ending: MoveEnding::Reached,
            duration_s: 2.0,
            rms_estimate_error_mdeg: None,
            beyond_3_sigma: None,
            good_beyond_5_sigma: 0,
            good_beyond_5_sigma_worst_mdeg: 0.0,
            promised_s: None,
            promised_95_s: None,
        }
    }

    /// The time per its bound is over quarter turns where one settled, and is said to be over all moves otherwise.
    #[test]
    fn exact_the_remarks_name_the_moves_of_their_median() {
        let remarks = |trials: Vec<PositioningTrial>| {
            let strategy = Strategy::Planned;
            let trials = StrategyTrials { strategy, filter: "twin", trials, s_per_s: 1.0 };
            PositioningTrials::alone(&Scene::default(), trials).remarks()
        };
        let late = PositioningTrial { settle_s: None, ..trial(MoveKind::QuarterTurn) };
        for (trials, moves) in [
            (vec![trial(MoveKind::Long), trial(MoveKind::QuarterTurn)], "quarter turns"),
            (vec![trial(MoveKind::Long), late], "all moves"),
            (vec![trial(MoveKind::Short)], "all moves"),
        ] {
            let said = format!("2.00 times its bound (median over {moves})");
            assert!(remarks(trials).contains(&said), "{said}");
        }
    }
}
