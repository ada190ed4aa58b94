//! The values of the page on the microcontroller that come from counts: the main operations, in words.

use super::count_report::{CountReport, judged};
use super::cycles::CycleEstimate;
use super::targets::TARGETS;
use crate::report::page::PlacedValue;
use crate::report::table::Table;

/// The words of each row of the table, and its operation.
const ROWS: [(&str, &str); 41] = [
    ("core, two states: prediction and measurement", "core_2_predict_and_update"),
    ("the same by the core of any size", "general_core_2_predict_and_update"),
    ("the same by minikalman", "minikalman_2_predict_and_update"),
    ("the same by adskalman, Joseph's form", "adskalman_joseph_2_predict_and_update"),
    ("the same by adskalman, conventionally", "adskalman_2_predict_and_update"),
    ("camera frame of `constant_rate`, used", "camera_frame_used"),
    ("the same and a prediction", "camera_frame_used_and_prediction"),
    ("vibrometer sample, `constant_rate`, mode B", "constant_rate_b_vibrometer_sample"),
    ("vibrometer sample, `impact_aided`, mode B", "impact_aided_b_vibrometer_sample"),
    ("vibrometer sample, `twin`, mode B", "twin_b_vibrometer_sample"),
    ("vibrometer sample, `twin`, mode C", "twin_c_vibrometer_sample"),
    ("step of 10 us in flight, impacts at its end", "end_of_step_aloft"),
    ("step of 10 us in flight, impacts located", "located_step_aloft"),
    ("located step, mode B", "located_step_b"),
    ("located step, mode C", "located_step_c"),
    ("located step, at rest on the teeth", "located_step_at_rest"),
    ("tilting motor without shift, in flight", "tilting_step_aloft"),
    ("the same, mode B, which rubs on the pin", "tilting_step_b"),
    ("the same, mode C", "tilting_step_c"),
    ("the same, at rest on the teeth", "tilting_step_at_rest"),
    ("tick of the loop, `constant_rate`", "loop_tick"),
    ("tick of the program, `constant_rate`", "program_tick"),
    ("its latency in ticks at 1700 a tick", "program_tick_latency_at_1700"),
    ("the same at 4800 a tick", "program_tick_latency_at_4800"),
    ("tick of the program that decides in one of eight", "program_tick_every_8"),
    ("its latency in ticks at 1500 a tick", "program_tick_every_8_latency_at_1500"),
    ("the same at 1700 a tick", "program_tick_every_8_latency_at_1700"),
    ("tick of the loop, `impact_aided`", "loop_tick_impact_aided"),
    ("the same and a located step", "loop_tick_impact_aided_and_step"),
    ("of these the ticks that drive", "loop_tick_impact_aided_and_driven_step"),
    ("tick of the program, `impact_aided`", "program_tick_impact_aided"),
    ("its latency in ticks at 1700 a tick", "program_tick_impact_aided_latency_at_1700"),
    ("the same at 4800 a tick", "program_tick_impact_aided_latency_at_4800"),
    ("tick of the program that decides in one of eight", "program_tick_impact_aided_every_8"),
    ("its latency in ticks at 1700 a tick", "program_tick_impact_aided_every_8_latency_at_1700"),
    ("tick of the loop, `twin`", "loop_tick_twin"),
    ("the same and a located step", "loop_tick_twin_and_step"),
    ("tick of the program, `twin`", "program_tick_twin"),
    ("its latency in ticks at 4800 a tick", "program_tick_twin_latency_at_4800"),
    ("the same at 8000 a tick", "program_tick_twin_latency_at_8000"),
    ("tick of the program that decides in one of eight", "program_tick_twin_every_8"),
];

/// The values: `report`'s counts, and the cycles that `estimates` has of them.
pub fn page_values(report: &CountReport, estimates: &[CycleEstimate]) -> Vec<PlacedValue> {
    let mean =
        |operation| report.count(operation).map_or_else(String::new, |count| format!("{:.0}", count.mean()));
    let longest = |operation| report.count(operation).map_or_else(String::new, |count| count.max.to_string());
    let missed = TARGETS
        .iter()
        .filter(|target| report.count(target.operation).is_some_and(|count| !target.is_met(count)));
    vec![
        ("counted_on", report.title()),
        ("tick_constant_rate", mean("loop_tick")),
        ("tick_impact_aided", mean("loop_tick_impact_aided")),
        ("tick_twin", mean("loop_tick_twin")),
        ("longest_tick_constant_rate", longest("loop_tick")),
        ("longest_tick_impact_aided", longest("loop_tick_impact_aided")),
        ("longest_tick_twin", longest("loop_tick_twin")),
        ("twin_sample_longest", longest_of(report, ["twin_b_vibrometer_sample", "twin_c_vibrometer_sample"])),
        ("program_constant_rate", mean("program_tick")),
        ("program_constant_rate_every_8", mean("program_tick_every_8")),
        ("program_impact_aided_every_8", mean("program_tick_impact_aided_every_8")),
        ("program_impact_aided", mean("program_tick_impact_aided")),
        ("program_twin", mean("program_tick_twin")),
        ("constant_rate_latency_at_4800", longest("program_tick_latency_at_4800")),
        ("impact_aided_latency_at_4800", longest("program_tick_impact_aided_latency_at_4800")),
        ("twin_latency_at_4800", longest("program_tick_twin_latency_at_4800")),
        ("twin_latency_at_8000", longest("program_tick_twin_latency_at_8000")),
        ("frame_over_core", frame_over_core(report)),
        ("missed_targets", missed.count().to_string()),
        ("table_instructions", table(report, estimates)),
    ]
}

/// The most that any of `operations` takes at once, of those that are counted.
fn longest_of<const N: usize>(report: &CountReport, operations: [&str; N]) -> String {
    let counts = operations.iter().filter_map(|operation| report.count(operation));
    counts.map(|count| count.max).max().map_or_else(String::new, |longest| longest.to_string())
}

/// What a camera frame of the simplest filter takes, over the bare core.
fn frame_over_core(report: &CountReport) -> String {
    let frame = report.count("camera_frame_used");
    let both = frame.zip(report.count("core_2_predict_and_update"));
    both.map_or_else(String::new, |(frame, core)| format!("{:.1}", frame.mean() / core.mean()))
}

/// The operations of [`ROWS`].
fn table(report: &CountReport, estimates: &[CycleEstimate]) -> String {
    let mut table = Table::new(&["operation", "mean", "longest", "target", "cycles"]);
    for (words, operation) in ROWS {
        let Some(count) = report.count(operation) else { continue };
        let cycles = estimates.iter().find(|estimate| estimate.operation == operation);
        let cycles = cycles.map_or(String::new(), |estimate| estimate.cycles_estimate.to_string());
        let mean = format!("{:.0}", count.mean());
        table.push(vec![words.to_owned(), mean, count.max.to_string(), judged(count), cycles]);
    }
    table.markdown()
}

#[cfg(test)]
mod tests {
    use super::super::listing::{Listing, OperationCount};
    use super::*;
    use crate::board::qemu::Board;

    /// The reviewed counts have the operation of every row, but for those of other crates: they are counted with
    /// --peers only.
    #[test]
    fn exact_every_row_is_counted() {
        let reviewed: serde_json::Value =
            serde_json::from_str(include_str!("../../../../tests/qemu/instructions.m4.json")).unwrap();
        let counted: Vec<&str> =
            reviewed.as_array().unwrap().iter().map(|record| record["operation"].as_str().unwrap()).collect();
        for (words, operation) in ROWS {
            let foreign = operation.starts_with("minikalman") || operation.starts_with("adskalman");
            assert!(foreign || counted.contains(&operation), "{words}: {operation}");
        }
    }

    /// The longest sample of the twin is that of either mode, whichever is counted.
    #[test]
    fn exact_the_longest_of_two_is_taken() {
        let mut listing = super::super::count_report::tests::listing();
        for (operation, max) in [("in_b", 902), ("in_c", 901)] {
            let count = OperationCount { operation: operation.to_owned(), max, ..listing.counts[0].clone() };
            listing.counts.push(count);
        }
        let report = CountReport::new(Board::M4, listing).unwrap();
        assert_eq!(longest_of(&report, ["in_b", "in_c"]), "902");
        assert_eq!(longest_of(&report, ["in_c", "in_b"]), "902");
        assert_eq!(longest_of(&report, ["in_c", "in_neither"]), "901");
        assert_eq!(longest_of(&report, ["in_neither"]), "");
    }

    #[test]
    fn exact_rows_have_counts_targets_and_cycles() {
        let listing = Listing {
            compiler: "rustc 1.95.0".to_owned(),
            counts: super::super::count_report::tests::listing().counts,
        };
        let report = CountReport::new(Board::M4, listing).unwrap();
        let estimate = CycleEstimate {
            board: "m4",
            operation: "located_step_aloft",
            instructions: 200,
            cycles_estimate: 253,
        };
        let text = table(&report, &[estimate]);
        let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let row = "| step of 10 us in flight, impacts located | 300 | 500 | max <= 180 missed | 253 |";
        assert!(text.lines().any(|line| words(line) == row), "{text}");
        assert!(!text.contains("minikalman"), "{text}");
    }
}
