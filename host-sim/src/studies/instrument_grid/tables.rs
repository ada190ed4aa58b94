//! The grid in tables: text, JSON, and rows to be written and read again.

use serde_json::json;

use super::benches::is_assumed_wrongly;
use super::{BenchSummary, CHOSEN, InstrumentGrid};
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use simulation::runs::filter::FILTERS;

/// What is counted and measured of some moves. The tolerance is in milli-degrees, the median time in seconds.
const HEADER: [&str; 9] =
    ["refused", "reached", "wrong", "gave up", "still", "mdeg", "within", "in time", "s"];

fn cells(summary: &BenchSummary) -> Vec<String> {
    let percent =
        |share: Option<f64>| share.map_or("-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
    vec![
        summary.refused.to_string(),
        summary.reached.to_string(),
        summary.wrong.to_string(),
        summary.gave_up.to_string(),
        summary.sat_still.to_string(),
        if summary.tolerance_deg > 0.0 { format!("{}", 1e3 * summary.tolerance_deg) } else { "-".to_owned() },
        percent(summary.within_promise),
        percent(summary.in_time),
        summary.median_s.map_or("-".to_owned(), |s| format!("{s:.2}")),
    ]
}

/// A table whose rows begin with the columns `first`.
fn table(first: &[&str]) -> Table {
    Table::new(&[first, &HEADER].concat())
}

/// A row of it.
fn row(first: &[String], summary: &BenchSummary) -> Vec<String> {
    [first, &cells(summary)].concat()
}

impl InstrumentGrid {
    fn by_filter(&self) -> Table {
        let mut table = table(&["filter", "moves"]);
        for filter in std::iter::once(&CHOSEN).chain(FILTERS) {
            let total = self.total(filter);
            if total.moves > 0 {
                table.push(row(&[filter.replace('_', " "), total.moves.to_string()], &total));
            }
        }
        table
    }

    /// The benches that are described rightly, or those where a filter assumes something wrongly. Without the number of
    /// moves, which is the same for every bench.
    fn by_bench(&self, assumed_wrongly: bool) -> Table {
        let mut table = table(&["bench"]);
        let chosen = self.of_filter(CHOSEN);
        for summary in chosen.iter().filter(|summary| is_assumed_wrongly(&summary.bench) == assumed_wrongly) {
            table.push(row(std::slice::from_ref(&summary.bench), summary));
        }
        table
    }

    /// What to look at first.
    pub(super) fn verdict(&self) -> String {
        let total = self.total(CHOSEN);
        format!(
            "With the filter that the instruments allow best, of {} moves {} reached the target, {} were refused \
             beforehand, {} gave up with a reason, {} were ended by the deadline alone, and {} were held as on target \
             more than three tolerances off it.",
            total.moves, total.reached, total.refused, total.gave_up, total.sat_still, total.wrong
        )
    }

    /// For the terminal.
    pub fn document(&self) -> Document {
        let mut blocks = vec![
            Block::Heading("Moves under other instruments".to_owned()),
            Block::Paragraph(self.verdict()),
            Block::Table(self.by_filter()),
        ];
        for (assumed_wrongly, heading) in [
            (false, "Each bench, with the filter that it allows best"),
            (true, "The default instruments, assumed to be others"),
        ] {
            if self.benches().iter().any(|(name, _)| is_assumed_wrongly(name) == assumed_wrongly) {
                blocks.push(Block::Heading(heading.to_owned()));
                blocks.push(Block::Table(self.by_bench(assumed_wrongly)));
            }
        }
        Document { blocks }
    }

    /// The values of its page.
    pub fn page_values(&self) -> Vec<PlacedValue> {
        vec![
            ("verdict", self.verdict()),
            ("table_filters", self.by_filter().markdown()),
            ("table_benches", self.by_bench(false).markdown()),
            ("table_assumed", self.by_bench(true).markdown()),
        ]
    }

    /// The counts of every bench and filter, as one JSON object on one line.
    pub fn json(&self) -> String {
        let filters: Vec<&str> = std::iter::once(CHOSEN).chain(FILTERS.iter().copied()).collect();
        let totals: Vec<BenchSummary> = filters.iter().map(|filter| self.total(filter)).collect();
        let benches: Vec<BenchSummary> = filters.iter().flat_map(|filter| self.of_filter(filter)).collect();
        format!("{}\n", json!({"totals": totals, "benches": benches}))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::instrument_grid::{GridMove, GridOutcome, benches};

    /// A page's lines have at most 120 characters, whatever the bench: here each has all its moves wrong, to the
    /// largest tolerance and at the deadline.
    #[test]
    fn law_rows_fit_a_line() {
        let move_on = |bench: String| GridMove {
            number: 0,
            bench,
            filter: CHOSEN.to_owned(),
            seed: 1,
            target_deg: 90.0,
            tolerance_deg: 1.0,
            promised_s: 30.0,
            outcome: GridOutcome::Wrong,
            reason: String::new(),
            error_mdeg: 0.0,
            time_s: 29.99,
        };
        let moves = benches().into_iter().flat_map(|bench| vec![move_on(bench.name); 80]).collect();
        for (name, value) in (InstrumentGrid { moves }).page_values() {
            let lines = value.lines().filter(|line| line.starts_with('|'));
            let longest = lines.map(|line| line.chars().count()).max().unwrap_or(0);
            assert!(longest <= 120, "{name}: {longest}");
        }
    }
}
