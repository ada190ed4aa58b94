//! What is printed of a sweep: figures over all rows, and the rows that have failed.

use std::fmt::Write as _;
use std::path::PathBuf;

use serde::Serialize;
use serde_json::Value;

use super::FailureCounts;
use super::indices::{Index, IndexSums, KeyIndices};
use super::responses::{Response, ResponseSums};
use super::row::Failure;
use super::tables::{Cells, Column, FAILURE, REASON};
use crate::report::document::{Block, Document, Table};
use crate::report::parquet_table::Cell;
use crate::studies::study_report::StudyReport;
use simulation::math::statistics::Accumulator;

/// Failed rows that are listed.
const LISTED_MAX: usize = 20;

/// The figures of a sweep, and what failed; JSON by its field names.
#[derive(Clone, Debug, Serialize)]
pub struct SweepSummary {
    /// The folder of the tables.
    pub folder: PathBuf,
    /// Rows.
    pub rows: u64,
    /// Rows that have failed.
    pub failed: u64,
    /// The same by why.
    pub failures: FailureCounts,
    /// The first of them.
    pub first_failures: Vec<FailedRow>,
    /// Rows that have not failed and have no value of a figure, `null`; left out of a sweep without such rows.
    #[serde(skip_serializing_if = "is_zero")]
    pub without_value: u64,
    /// A line a figure.
    pub figures: Vec<FigureSummary>,
    /// How each figure follows each key.
    pub responses: Vec<Response>,
    /// Which key decides; left out of a sweep that is not for indices.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub indices: Vec<KeyIndices>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
fn is_zero(rows: &u64) -> bool {
    *rows == 0
}

/// A row that has failed.
#[derive(Clone, Debug, Serialize)]
pub struct FailedRow {
    /// Its place.
    pub row: u64,
    /// The seed of its run.
    pub seed: u64,
    /// The kind of failure.
    pub failure: String,
    /// Why.
    pub reason: String,
}

/// A figure over the rows that have it.
#[derive(Clone, Debug, Serialize)]
pub struct FigureSummary {
    /// Its path.
    pub figure: String,
    /// Rows that have it.
    pub rows: u64,
    /// Mean; `null` of no row.
    pub mean: Option<f64>,
    /// Sample standard deviation; `null` of fewer than two rows.
    pub sd: Option<f64>,
    /// The least.
    pub min: Option<f64>,
    /// The largest.
    pub max: Option<f64>,
}

/// Sums over rows.
pub(super) struct SummarySums {
    rows: u64,
    failures: FailureCounts,
    first_failures: Vec<FailedRow>,
    without_value: u64,
    /// Columns of failure, reason, and row and seed.
    places: [Option<usize>; 4],
    figures: Vec<FigureSums>,
    responses: ResponseSums,
    indices: Option<IndexSums>,
}

struct FigureSums {
    path: String,
    column: Option<usize>,
    rows: u64,
    sums: Accumulator,
    range: Option<(f64, f64)>,
}

impl SummarySums {
    /// Sums of the tables with these columns of the sweep that `described` is ([`super::SweepPlan::described`]).
    pub(super) fn new(columns: &[Column], described: &Value) -> Self {
        let figures = described["figures"].as_array().into_iter().flatten().filter_map(Value::as_str);
        let place = |name: &str| columns.iter().position(|(column, _)| column == name);
        let of = |path: &str| FigureSums {
            path: path.to_owned(),
            column: place(path),
            rows: 0,
            sums: Accumulator::default(),
            range: None,
        };
        Self {
            rows: 0,
            failures: FailureCounts::default(),
            first_failures: Vec::new(),
            without_value: 0,
            places: [FAILURE, REASON, "row", "seed"].map(place),
            figures: figures.map(of).collect(),
            responses: ResponseSums::new(columns, described),
            indices: IndexSums::of(described),
        }
    }

    /// Adds a row.
    pub(super) fn add(&mut self, cells: &Cells) {
        self.rows += 1;
        let cell = |place: Option<usize>| cells.get(place?)?.as_ref();
        let word = |place| match cell(place) {
            Some(Cell::Word(word)) => word.clone().into_owned(),
            _ => String::new(),
        };
        let whole = |place| match cell(place) {
            Some(Cell::Whole(number)) => *number,
            _ => 0,
        };
        let [failure, reason, row, seed] = self.places;
        let kind = Failure::from_word(&word(failure));
        if let Some(kind) = kind {
            kind.count(&mut self.failures);
            if self.first_failures.len() < LISTED_MAX {
                let failed = FailedRow {
                    row: whole(row),
                    seed: whole(seed),
                    failure: word(failure),
                    reason: word(reason),
                };
                self.first_failures.push(failed);
            }
        }
        let number = |column| match cell(column) {
            Some(Cell::Number(number)) => Some(*number),
            _ => None,
        };
        let figures: Vec<Option<f64>> = self.figures.iter().map(|figure| number(figure.column)).collect();
        self.without_value += u64::from(kind.is_none() && figures.contains(&None));
        if let Some(indices) = &mut self.indices {
            indices.add(whole(row), &figures);
        }
        self.responses.add(cells, &figures);
        for figure in &mut self.figures {
            if let Some(Cell::Number(number)) = cell(figure.column) {
                figure.rows += 1;
                figure.sums.add(*number);
                let (min, max) = figure.range.unwrap_or((*number, *number));
                figure.range = Some((min.min(*number), max.max(*number)));
            }
        }
    }

    /// What they are together.
    pub(super) fn summary(self, folder: PathBuf) -> SweepSummary {
        let FailureCounts { refused, diverged, panicked, no_figure } = self.failures;
        let of = |figure: FigureSums| {
            let spread = figure.sums.spread();
            FigureSummary {
                figure: figure.path,
                rows: figure.rows,
                mean: (figure.rows > 0).then_some(spread.mean),
                sd: (figure.rows > 1).then_some(spread.sd),
                min: figure.range.map(|range| range.0),
                max: figure.range.map(|range| range.1),
            }
        };
        SweepSummary {
            folder,
            rows: self.rows,
            failed: refused + diverged + panicked + no_figure,
            failures: self.failures,
            first_failures: self.first_failures,
            without_value: self.without_value,
            figures: self.figures.into_iter().map(of).collect(),
            responses: self.responses.responses(),
            indices: self.indices.map_or_else(Vec::new, |sums| sums.indices()),
        }
    }
}

impl SweepSummary {
    /// For the terminal.
    pub fn document(&self) -> Document {
        let mut figures = Table::new(&["figure", "rows", "mean", "sd", "least", "largest"]);
        let number = |number: f64| format!("{number:.6}");
        for figure in &self.figures {
            let or_dash = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), number);
            figures.push(vec![
                figure.figure.clone(),
                figure.rows.to_string(),
                or_dash(figure.mean),
                or_dash(figure.sd),
                or_dash(figure.min),
                or_dash(figure.max),
            ]);
        }
        let FailureCounts { refused, diverged, panicked, no_figure } = self.failures;
        let mut indices = Table::new(&["figure", "key", "alone", "95 %", "with others", "95 %"]);
        for KeyIndices { figure, key, first, total, .. } in &self.indices {
            let share = |share: f64| format!("{share:.3}");
            let interval = |index: &Index| format!("{:.3} to {:.3}", index.low, index.high);
            let cells = [share(first.estimate), interval(first), share(total.estimate), interval(total)];
            indices.push([vec![figure.clone(), key.clone()], cells.to_vec()].concat());
        }
        let mut failures = format!(
            "{} rows have failed: {refused} refused, {diverged} diverged, {panicked} panicked, {no_figure} without a \
             figure.",
            self.failed
        );
        if self.without_value > 0 {
            let _ = write!(
                failures,
                " {} rows that have not failed have no value of a figure.",
                self.without_value
            );
        }
        let mut blocks = vec![
            Block::Heading(format!("Sweep, {} rows", self.rows)),
            Block::Table(figures),
            Block::Paragraph(failures),
        ];
        let mut ranges = Table::new(&["figure", "key", "least mean", "largest mean", "difference"]);
        for response in &self.responses {
            if let Some((low, high)) = response.range() {
                let cells = [low, high, high - low].map(number);
                ranges.push([vec![response.figure.clone(), response.key.clone()], cells.to_vec()].concat());
            }
        }
        blocks.push(Block::Heading("Means over slices of each key".to_owned()));
        blocks.push(Block::Table(ranges));
        if !self.indices.is_empty() {
            blocks.push(Block::Heading("Share of the variance by each key".to_owned()));
            blocks.push(Block::Table(indices));
        }
        if !self.first_failures.is_empty() {
            let mut failed = Table::new(&["row", "seed", "failure", "reason"]);
            for row in &self.first_failures {
                failed.push(vec![
                    row.row.to_string(),
                    row.seed.to_string(),
                    row.failure.clone(),
                    row.reason.clone(),
                ]);
            }
            blocks.push(Block::Table(failed));
        }
        Document { blocks }
    }

    /// The report on the sweep of a command.
    pub(crate) fn report(&self, command: &str) -> StudyReport {
        let verdict =
            format!("{} of {} rows have figures.", self.rows - self.failed - self.without_value, self.rows);
        StudyReport {
            title: format!("Sweep of {command}, {} rows", self.rows),
            verdict,
            asked: vec![("command", command.to_owned()), ("rows", self.rows.to_string())],
            pictures: self.pictures(),
            document: self.document(),
            key_figures: Vec::new(),
            sure: vec![
                "Slices hold the rows of all values of the other keys, and all repeats: their standard deviations are \
                 those of the rows, not of the means."
                    .to_owned(),
            ],
            motor_s: None,
        }
    }

    /// The summary as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Sampling, SweepPlan, SweepRequest, SweptCommand};
    use super::*;
    use serde_json::json;
    use simulation::runs::RunError;
    use simulation::scene::Scene;

    /// Of no row there is no mean, of one row no standard deviation: 3 and 5 are 4 with 2 / sqrt 2.
    #[test]
    fn exact_a_figure_has_the_mean_and_spread_that_its_rows_allow() {
        let request = SweepRequest {
            command: SweptCommand::Simulate,
            sample: 1,
            over: vec!["motor.friction=0.1,0.2".to_owned()],
            sampling: Sampling::Grid,
            repeats: 1,
            figures: ["both", "one", "none"].map(str::to_owned).to_vec(),
        };
        let plan = SweepPlan::new(&Scene::default(), request, |_, _| false, &|_| Ok(())).unwrap();
        let run = |scene: &Scene| {
            let is_first = scene.number("motor.friction") < 0.15;
            let (both, one) = if is_first { (3.0, Some(7.0)) } else { (5.0, None) };
            Ok::<_, RunError>(json!({"both": both, "one": one, "none": null}))
        };
        let mut sums = SummarySums::new(&plan.columns(), &plan.described());
        (0..plan.rows()).for_each(|number| sums.add(&plan.cells(&plan.make_with(number, run))));
        let summary = sums.summary(PathBuf::new());
        let json: Value = serde_json::from_str(&summary.json()).unwrap();
        let found = |figure: usize| {
            let of = &json["figures"][figure];
            (of["rows"].clone(), of["mean"].clone(), of["sd"].clone())
        };
        assert_eq!(found(0), (json!(2), json!(4.0), json!(std::f64::consts::SQRT_2)));
        assert_eq!(found(1), (json!(1), json!(7.0), Value::Null));
        assert_eq!(found(2), (json!(0), Value::Null, Value::Null));
        assert_eq!((&json["failed"], &json["without_value"]), (&json!(0), &json!(2)));
        // A paragraph breaks where its line is full.
        let text = summary.document().text().split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(text.contains("2 rows that have not failed have no value"), "{text}");
        assert!(summary.report("simulate").verdict.starts_with("0 of 2 rows"));
    }
}
