//! The page on the filter core: what the benchmark `kalman_table` prints, beside other crates' filters.
//!
//! The benchmark is a program of its own, so that the command is built without those crates.

use std::process::Command;
use std::time::Duration;

use crate::board::BoardError;
use crate::cli::CommandError;
use crate::report::page::PlacedValue;
use crate::tool::{ToolError, run_within};

const CARGO: &str = "cargo";
const BENCHMARK: [&str; 6] = ["bench", "--quiet", "-p", "benches", "--bench", "kalman_table"];

/// A build from nothing is optimised across all crates, and takes minutes.
const LIMIT: Duration = Duration::from_secs(3600);

/// Places that the benchmark fills by a line each, below its table.
const FIGURES: [&str; 6] = ["structured", "dense", "broken", "products", "divisions", "chain"];

pub(super) fn values() -> Result<Vec<PlacedValue>, CommandError> {
    let printed = run_within(Command::new(CARGO).args(BENCHMARK), CARGO, LIMIT).map_err(BoardError::from)?;
    Ok(placed(&printed).map_err(BoardError::from)?)
}

/// The table, and the figures below it.
fn placed(printed: &str) -> Result<Vec<PlacedValue>, ToolError> {
    let missing =
        |what: &str| ToolError::ToolFailed { tool: CARGO, complaint: format!("it printed no {what}") };
    let rows: Vec<&str> = printed.lines().filter(|line| line.starts_with('|')).collect();
    if rows.is_empty() {
        return Err(missing("table"));
    }
    let mut values = vec![("table_core", rows.join("\n"))];
    for name in FIGURES {
        let figure = printed.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(": "));
        values.push((name, figure.ok_or_else(|| missing(name))?.to_owned()));
    }
    Ok(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRINTED: &str = "\
        | a | b |\n| - | - |\n| 1 | 2 |\n\nstructured: ~1 and ~2\ndense: ~3\nbroken: 1 of 2\n\
        products: 4\ndivisions: 5\nchain: 6\n";

    #[test]
    fn exact_what_the_benchmark_prints_is_placed() {
        let values = placed(PRINTED).unwrap();
        let expected = [
            ("table_core", "| a | b |\n| - | - |\n| 1 | 2 |"),
            ("structured", "~1 and ~2"),
            ("dense", "~3"),
            ("broken", "1 of 2"),
            ("products", "4"),
            ("divisions", "5"),
            ("chain", "6"),
        ];
        assert_eq!(values, expected.map(|(name, value)| (name, value.to_owned())));
        for what in ["table"].into_iter().chain(FIGURES) {
            let start = if what == "table" { "|" } else { what };
            let kept: Vec<&str> = PRINTED.lines().filter(|line| !line.starts_with(start)).collect();
            let error = placed(&kept.join("\n")).unwrap_err();
            assert!(error.to_string().contains(&format!("no {what}")), "{error}");
        }
    }
}
