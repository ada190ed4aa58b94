//! The counts of a bench, or of all benches.

use serde::Serialize;

use super::{GridMove, GridOutcome, InstrumentGrid};
use simulation::math::count::real;
use simulation::math::statistics;

/// A move takes longer than promised from so many times the promise on.
const LATE: f64 = 1.5;

/// Counts of some moves.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchSummary {
    /// Name of the bench.
    pub bench: String,
    /// The filter asked for.
    pub filter: String,
    /// Moves.
    pub moves: usize,
    /// For which no tolerance can be promised.
    pub refused: usize,
    /// On target, rightly.
    pub reached: usize,
    /// On target, wrongly.
    pub wrong: usize,
    /// Ended with a reason.
    pub gave_up: usize,
    /// Ended by the deadline.
    pub sat_still: usize,
    /// Median tolerance of those that were promised; 0 where none was.
    pub tolerance_deg: f64,
    /// Share of those on target whose true error is within the tolerance; `null` where there is none.
    pub within_promise: Option<f64>,
    /// Share of those on target that took at most 1.5 times the time promised; `null` where there is none.
    pub in_time: Option<f64>,
    /// Median time until the target was held, in s; `null` where it never was.
    pub median_s: Option<f64>,
    /// The most frequent reason for giving up.
    pub reason: Option<String>,
}

impl BenchSummary {
    /// The counts of `moves`.
    pub fn of(bench: &str, filter: &str, moves: &[&GridMove]) -> Self {
        let count = |outcome| moves.iter().filter(|made| made.outcome == outcome).count();
        let held: Vec<&&GridMove> = moves
            .iter()
            .filter(|made| matches!(made.outcome, GridOutcome::Reached | GridOutcome::Wrong))
            .collect();
        let share = |of: &dyn Fn(&GridMove) -> bool| {
            let part = held.iter().filter(|made| of(made)).count();
            (!held.is_empty()).then(|| real(part) / real(held.len()))
        };
        let median = |mut values: Vec<f64>| statistics::quantile(&mut values, 500);
        let promised = moves.iter().filter(|made| made.outcome != GridOutcome::Refused);
        Self {
            bench: bench.to_owned(),
            filter: filter.to_owned(),
            moves: moves.len(),
            refused: count(GridOutcome::Refused),
            reached: count(GridOutcome::Reached),
            wrong: count(GridOutcome::Wrong),
            gave_up: count(GridOutcome::GaveUp),
            sat_still: count(GridOutcome::SatStill),
            tolerance_deg: median(promised.map(|made| made.tolerance_deg).collect()).unwrap_or(0.0),
            within_promise: share(&|made| 1e-3 * made.error_mdeg.abs() <= made.tolerance_deg),
            in_time: share(&|made| made.time_s <= LATE * made.promised_s),
            median_s: median(held.iter().map(|made| made.time_s).collect()),
            reason: frequent(moves),
        }
    }
}

fn frequent(moves: &[&GridMove]) -> Option<String> {
    let reasons = || moves.iter().map(|made| &made.reason).filter(|reason| !reason.is_empty());
    let times = |reason: &String| reasons().filter(|other| *other == reason).count();
    reasons().max_by_key(|reason| (times(reason), std::cmp::Reverse((*reason).clone()))).cloned()
}

impl InstrumentGrid {
    /// The names of the benches and the filters asked for, in the order of the moves.
    pub fn benches(&self) -> Vec<(&str, &str)> {
        let mut found: Vec<(&str, &str)> = Vec::new();
        for made in &self.moves {
            let place = (made.bench.as_str(), made.filter.as_str());
            if !found.contains(&place) {
                found.push(place);
            }
        }
        found
    }

    /// The counts of every bench under `filter`.
    pub fn of_filter(&self, filter: &str) -> Vec<BenchSummary> {
        let own = self.benches().into_iter().filter(|(_, other)| *other == filter);
        own.map(|(bench, filter)| {
            let moves: Vec<&GridMove> =
                self.moves.iter().filter(|made| made.bench == bench && made.filter == filter).collect();
            BenchSummary::of(bench, filter, &moves)
        })
        .collect()
    }

    /// The counts of all benches under `filter`.
    pub fn total(&self, filter: &str) -> BenchSummary {
        let moves: Vec<&GridMove> = self.moves.iter().filter(|made| made.filter == filter).collect();
        BenchSummary::of("all", filter, &moves)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(outcome: GridOutcome, error_mdeg: f64, time_s: f64, reason: &str) -> GridMove {
        GridMove {
            number: 0,
            bench: "a".to_owned(),
            filter: "best".to_owned(),
            seed: 1,
            target_deg: 1.0,
            tolerance_deg: 0.001,
            promised_s: 1.0,
            outcome,
            reason: reason.to_owned(),
            error_mdeg,
            time_s,
        }
    }

    /// Of three on target two are within the tolerance and two in time.
    #[test]
    fn exact_counts_and_shares() {
        let moves = [
            made(GridOutcome::Reached, 0.9, 1.4, ""),
            made(GridOutcome::Reached, -0.9, 1.6, ""),
            made(GridOutcome::Wrong, 4.0, 1.0, ""),
            made(GridOutcome::GaveUp, 90.0, 3.0, "NoEstimate"),
            made(GridOutcome::SatStill, 90.0, 30.0, "TimedOut"),
            made(GridOutcome::GaveUp, 90.0, 3.0, "NoEstimate"),
            made(GridOutcome::Refused, 0.0, 0.0, ""),
        ];
        let summary = BenchSummary::of("a", "best", &moves.iter().collect::<Vec<_>>());
        let counts = [
            summary.refused,
            summary.reached,
            summary.wrong,
            summary.gave_up,
            summary.sat_still,
            summary.moves,
        ];
        assert_eq!(counts, [1, 2, 1, 2, 1, 7]);
        assert_eq!((summary.within_promise, summary.in_time), (Some(2.0 / 3.0), Some(2.0 / 3.0)));
        assert_eq!(summary.reason.as_deref(), Some("NoEstimate"));
        assert_eq!(summary.median_s, Some(1.4));
    }
}
