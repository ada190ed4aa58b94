//! Counts with their targets, as a table or as JSON.

use std::fmt;

use serde::Serialize;

use super::listing::{Listing, ListingError, OperationCount};
use super::targets::TARGETS;
use crate::board::qemu::Board;
use crate::report::files::json_lines;
use crate::report::key_figure::KeyFigure;
use crate::report::table::Table;

/// A listing of a board that has passed its checks.
#[derive(Clone, Debug)]
pub struct CountReport {
    board: Board,
    listing: Listing,
}

/// One operation, in JSON by its field names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CountRecord<'a> {
    /// `m4` or `m7`.
    pub board: &'static str,
    /// The compiler that built the program.
    pub rustc: &'a str,
    /// Name of the operation.
    pub operation: &'a str,
    /// How many times it was counted.
    pub count: u32,
    /// Instructions on average, to a hundredth.
    pub mean: f64,
    /// Instructions of the longest.
    pub max: u32,
}

impl CountReport {
    /// The report of what was printed on `board`.
    ///
    /// # Errors
    /// When the listing does not hold the loops of known length, or an operation that has a target.
    pub fn new(board: Board, listing: Listing) -> Result<Self, ListingError> {
        listing.prove()?;
        for target in TARGETS {
            listing.count(target.operation)?;
        }
        Ok(Self { board, listing })
    }

    /// The records, in the order in which they were counted.
    pub fn records(&self) -> impl Iterator<Item = CountRecord<'_>> {
        let Self { board, listing } = self;
        listing.counts.iter().map(|count| CountRecord {
            board: board.key(),
            rustc: &listing.compiler,
            operation: &count.operation,
            count: count.samples,
            mean: (100.0 * count.mean()).round() / 100.0,
            max: count.max,
        })
    }

    /// The processor, its emulator and the compiler.
    pub fn title(&self) -> String {
        let Self { board, listing } = self;
        format!("{} (QEMU {}), {}", board.processor(), board.machine(), listing.compiler)
    }

    /// What an operation took, if it was counted.
    pub fn count(&self, operation: &str) -> Option<&OperationCount> {
        self.listing.find(operation)
    }

    /// The counts that another build's are compared with. The emulator counts exactly.
    pub fn key_figures(&self) -> Vec<KeyFigure> {
        let of_count = |count: &OperationCount| {
            let figure =
                |name, value| KeyFigure::single(name, "", value).of(&count.operation).lower_is_better();
            [figure("instructions, mean", count.mean()), figure("instructions, most", count.max.into())]
        };
        self.listing.counts.iter().flat_map(of_count).collect()
    }

    /// An array of [`CountRecord`]s, one a line.
    pub fn json(&self) -> String {
        json_lines(&self.records().collect::<Vec<_>>())
    }
}

/// The targets of an operation and whether it meets them.
pub(super) fn judged(count: &OperationCount) -> String {
    let judged: Vec<String> = TARGETS
        .iter()
        .filter(|target| target.operation == count.operation)
        .map(|target| format!("{target} {}", if target.is_met(count) { "met" } else { "missed" }))
        .collect();
    judged.join(", ")
}

impl fmt::Display for CountReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.title())?;
        writeln!(f, "instructions of an operation, its call included\n")?;
        let mut table = Table::new(&["operation", "samples", "mean", "max", "target"]);
        for count in &self.listing.counts {
            let OperationCount { operation, samples, total: _, max } = count;
            let mean = format!("{:.2}", count.mean());
            table.push(vec![operation.clone(), samples.to_string(), mean, max.to_string(), judged(count)]);
        }
        f.write_str(&table.text())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Every operation with a target, and the loops.
    pub(in super::super) fn listing() -> Listing {
        let loops = "loop_of_1000_turns 1 2007 2007\nloop_of_10000_turns 1 20007 20007\n";
        let mut operations: Vec<&str> = TARGETS.iter().map(|target| target.operation).collect();
        operations.dedup();
        let lines: Vec<String> =
            operations.iter().map(|operation| format!("{operation} 3 901 500\n")).collect();
        let text = format!("compiler rustc 1.95.0\n{loops}{}", lines.concat());
        Listing::parse(&text).unwrap()
    }

    #[test]
    fn exact_table_and_json() {
        let report = CountReport::new(Board::M7, listing()).unwrap();
        let table = report.to_string();
        assert!(table.starts_with("Cortex-M7 (QEMU mps2-an500), rustc 1.95.0\n"), "{table}");
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let row = "located_step_b 3 300.33 500 mean <= 300 missed, max <= 2000 met";
        assert!(table.lines().any(|line| words(line) == row), "{table}");
        let json: serde_json::Value = serde_json::from_str(&report.json()).unwrap();
        let record = json.as_array().unwrap().iter().find(|r| r["operation"] == "located_step_b").unwrap();
        let expected = serde_json::json!(
            { "board": "m7", "rustc": "rustc 1.95.0", "operation": "located_step_b",
              "count": 3, "mean": 300.33, "max": 500 }
        );
        assert_eq!(*record, expected);
    }

    /// A target without a count would never be missed; a listing without one of them is refused.
    #[test]
    fn exact_every_target_needs_its_count() {
        for target in TARGETS {
            let mut listing = listing();
            listing.counts.retain(|count| count.operation != target.operation);
            let operation = target.operation;
            assert_eq!(
                CountReport::new(Board::M4, listing).err(),
                Some(ListingError::Missing { operation: operation.to_owned() })
            );
        }
    }
}
