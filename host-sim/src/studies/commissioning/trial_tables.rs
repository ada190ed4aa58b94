//! Trials of commissioning: text, picture, JSON and key figures.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::json;

use super::trials::{CommissioningTrial, CommissioningTrials};
use crate::math::paired_difference;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use crate::report::document::{Block, Document, Table};
use crate::report::key_figure::KeyFigure;
use crate::report::page::PlacedValue;
use crate::studies::beside::Beside;
use crate::studies::positioning_trials::{PositioningTrial, TrialSummary, millidegrees};
use crate::studies::study_report::StudyReport;
use simulation::math::count::real;
use simulation::math::statistics::{Spread, quantile};

/// Standard deviations of a 95 % interval.
const SIGMAS_95: f64 = 1.96;

/// Errors of the resonance of a mode; `None` where none was found, or no two for their spread.
#[derive(Debug, Serialize)]
struct ResonanceErrors {
    mode: &'static str,
    found: usize,
    off_hz: Option<f64>,
    spread_hz: Option<f64>,
    stated_sd_hz: Option<f64>,
    /// Share of the intervals of 95 % that hold the truth.
    covered_95: Option<f64>,
}

/// Probability of chance from which on a difference counts as not shown.
const CHANCE: f64 = 0.05;

/// The moves by both maps, of the motors of several scenes: for a page.
pub(crate) fn page_value(scenes: &[Beside<CommissioningTrials>]) -> PlacedValue {
    let mut table = Table::new(&[
        "scene",
        "map",
        "motors",
        "refused",
        "moves",
        "failed",
        "50 %",
        "95 %",
        "worst",
        "settle s",
        "per bound",
        "switches",
    ]);
    for Beside { name, found } in scenes {
        let [prior, own] = found.both();
        for (map, summary, refused) in
            [("design", prior, "-".to_owned()), ("motor", own, found.refused().to_string())]
        {
            let TrialSummary { trials, failures, p50_mdeg, p95_mdeg, max_mdeg, .. } = summary;
            let mut cells = vec![name.clone(), map.to_owned(), found.trials.len().to_string(), refused];
            cells.extend([trials, failures].map(|count| count.to_string()));
            cells.extend([p50_mdeg, p95_mdeg, max_mdeg].map(millidegrees));
            cells.extend([summary.median_settle_s, summary.settle_over_bound].map(|of| format!("{of:.2}")));
            cells.push(format!("{:.0}", summary.median_switches));
            table.push(cells);
        }
    }
    ("table_commissioned", table.markdown())
}

impl CommissioningTrials {
    /// Of each pair of moves what `of` gives by the map of its own less what it gives by the other.
    fn differences(&self, of: fn(&PositioningTrial) -> Option<f64>) -> Vec<f64> {
        self.pairs().filter_map(|(prior, own)| Some(of(own)? - of(prior)?)).collect()
    }

    fn resonance_errors(&self) -> Vec<ResonanceErrors> {
        let of = |(index, mode)| {
            let found: Vec<(f64, f64)> =
                self.trials.iter().filter_map(|trial| trial.resonances.get(index).copied()?).collect();
            let within = found.iter().filter(|(off, sd)| off.abs() <= SIGMAS_95 * sd).count();
            let spread: Spread = found.iter().map(|(off, _)| *off).collect();
            let stated: Spread = found.iter().map(|(_, sd)| *sd).collect();
            let of_some = |figure: f64| (!found.is_empty()).then_some(figure);
            ResonanceErrors {
                mode,
                found: found.len(),
                off_hz: of_some(spread.mean),
                spread_hz: (found.len() > 1).then_some(spread.sd),
                stated_sd_hz: of_some(stated.mean),
                covered_95: of_some(real(within) / real(found.len().max(1))),
            }
        };
        [(0, "B"), (1, "C")].map(of).into()
    }

    fn times_s(&self) -> Vec<f64> {
        self.trials.iter().map(|trial| trial.time_s).collect()
    }

    /// How often each thing was found, and how often each reason refused a motor.
    fn counts(&self) -> [BTreeMap<String, usize>; 2] {
        let mut counts = [BTreeMap::new(), BTreeMap::new()];
        let [findings, refusals] = &mut counts;
        for trial in &self.trials {
            for (mode, word) in &trial.findings {
                *findings.entry(format!("{mode} {}", word.replace('_', " "))).or_insert(0) += 1;
            }
            if let Some(why) = &trial.refused {
                *refusals.entry(why.clone()).or_insert(0) += 1;
            }
        }
        counts
    }

    fn refused(&self) -> usize {
        self.trials.iter().filter(|trial| trial.refused.is_some()).count()
    }

    fn verdict(&self) -> String {
        let [prior, own] = self.both();
        let refused = self.refused();
        let median_s = quantile(&mut self.times_s(), 500).unwrap_or(f64::NAN);
        format!(
            "{} motors, commissioned in {median_s:.1} s each (median), {refused} refused. Of the moves of the others \
             95 % end within {:.2} milli-degrees by the map of the motor, and within {:.2} by the map that it began \
             with; {} and {} failed.",
            self.trials.len(),
            own.p95_mdeg,
            prior.p95_mdeg,
            own.failures,
            prior.failures
        )
    }

    fn moves_table(&self) -> Table {
        let mut table =
            Table::new(&["map", "moves", "failed", "50 %", "95 %", "worst", "settle s", "95 % settle s"]);
        let [prior, own] = self.both();
        let rows = [
            ("that it began with, all motors", self.all_by_prior()),
            ("that it began with, motors of both", prior),
            ("of the motor", own),
        ];
        for (name, summary) in rows {
            let TrialSummary { trials, failures, p50_mdeg, p95_mdeg, max_mdeg, .. } = summary;
            let mut cells = vec![name.to_owned(), trials.to_string(), failures.to_string()];
            cells.extend([p50_mdeg, p95_mdeg, max_mdeg].map(|error| format!("{error:.2}")));
            cells.extend([summary.median_settle_s, summary.p95_settle_s].map(|time| format!("{time:.2}")));
            table.push(cells);
        }
        table
    }

    fn chances(&self) -> String {
        let errors = self.differences(|trial| Some(trial.final_error_mdeg.abs()));
        let times = self.differences(|trial| trial.settle_s);
        let said = |what: &str, differences: &[f64]| {
            let ranks = paired_difference::of_medians(differences);
            let way = if ranks.p >= CHANCE {
                "not shown to differ between the maps"
            } else if ranks.rise > 0.0 {
                "larger by the map of the motor"
            } else {
                "smaller by the map of the motor"
            };
            format!("{what} {way} (p = {:.2}, signed ranks)", ranks.p)
        };
        format!(
            "Run by run, errors are {}; times to settle are {}. Errors in milli-degrees, times in s.",
            said("", &errors).trim(),
            said("", &times).trim()
        )
    }

    fn resonance_table(&self) -> Table {
        let mut table = Table::new(&["mode", "found", "off Hz", "spread Hz", "stated sd Hz", "95 % holds"]);
        let cell = |figure: Option<f64>, said: fn(f64) -> String| figure.map_or_else(|| "-".to_owned(), said);
        for row in self.resonance_errors() {
            table.push(vec![
                row.mode.to_owned(),
                row.found.to_string(),
                cell(row.off_hz, |off_hz| format!("{off_hz:+.1}")),
                cell(row.spread_hz, |spread_hz| format!("{spread_hz:.1}")),
                cell(row.stated_sd_hz, |sd_hz| format!("{sd_hz:.1}")),
                cell(row.covered_95, |covered| format!("{:.0} %", 100.0 * covered)),
            ]);
        }
        table
    }

    fn document(&self) -> Document {
        let heading = |text: &str| Block::Heading(text.to_owned());
        let mut blocks = vec![
            heading("Commissioning, many motors"),
            Block::Paragraph(self.verdict()),
            Block::Table(self.moves_table()),
            Block::Paragraph(self.chances()),
            heading("Resonances found less the true ones"),
            Block::Table(self.resonance_table()),
        ];
        for (title, counts) in ["Found", "Refused"].into_iter().zip(self.counts()) {
            if !counts.is_empty() {
                blocks.push(heading(title));
                let mut table = Table::new(&["what", "motors"]);
                for (what, count) in counts {
                    table.push(vec![what, count.to_string()]);
                }
                blocks.push(Block::Table(table));
            }
        }
        Document { blocks }
    }

    fn figure(&self) -> Figure {
        let share = |of: fn(&CommissioningTrial) -> &[PositioningTrial]| {
            let trials = self.trials.iter().flat_map(of);
            let mut errors: Vec<f64> = trials.map(|trial| trial.final_error_mdeg.abs().max(1e-3)).collect();
            errors.sort_by(f64::total_cmp);
            let count = errors.len();
            let beyond = |(rank, error)| (error, 100.0 * real(count - rank) / real(count));
            errors.into_iter().enumerate().map(beyond).collect::<Vec<(f64, f64)>>()
        };
        let prior = share(|trial| &trial.by_prior);
        let own = share(|trial| &trial.by_own);
        let panel = Panel::new(
            "True final error",
            Axis::new("error (mdeg)").logarithmic(),
            Axis::new("share of moves beyond (%)").logarithmic(),
        )
        .series(Series::line(prior).colour(Colour::Grey).width(1.5).label("map that it began with"))
        .series(Series::line(own).colour(Colour::Blue).width(1.5).label("map of the motor"));
        Figure::new("Commissioning trials")
            .caption(format!("{} motors, each commissioned, and moved by either map.", self.trials.len()))
            .panel(panel.height(360))
    }

    /// The report on the study.
    pub(crate) fn report(&self) -> StudyReport {
        let refused = self.trials.iter().map(|trial| trial.refused.is_some());
        let found = self.trials.iter().map(|trial| !trial.findings.is_empty());
        let prior: Vec<&PositioningTrial> = self.trials.iter().flat_map(|trial| &trial.by_prior).collect();
        let own: Vec<&PositioningTrial> = self.trials.iter().flat_map(|trial| &trial.by_own).collect();
        let moves = |of: &str, trials: &[&PositioningTrial]| {
            let errors = trials.iter().map(|trial| trial.final_error_mdeg.abs());
            let settled = trials.iter().map(|trial| trial.settle_s);
            [
                KeyFigure::quantile("final error, 95 % within", "mdeg", errors, 950),
                KeyFigure::quantile("time to settle, median", "s", settled, 500),
                KeyFigure::count("moves that failed", trials.iter().map(|trial| trial.failed())),
            ]
            .map(|figure| figure.of(of).lower_is_better())
        };
        let mut key_figures = vec![
            KeyFigure::quantile("motor time, median", "s", self.times_s(), 500).lower_is_better(),
            KeyFigure::count("motors refused", refused),
            KeyFigure::count("motors of which something was found", found),
        ];
        key_figures.extend(moves("map of the motor", &own));
        key_figures.extend(moves("map that it began with", &prior));
        let moving_s = prior.iter().chain(&own).map(|trial| trial.duration_s);
        let motor_s = self.times_s().into_iter().chain(moving_s).sum();
        StudyReport {
            title: "Commissioning trials".to_owned(),
            verdict: self.verdict(),
            asked: vec![
                ("motors", format!("{}, each with targets of its own", self.trials.len())),
                ("moves", format!("{} by the map that each began with", prior.len())),
            ],
            pictures: vec![("commissioning-trials.svg".to_owned(), self.figure())],
            document: self.document(),
            key_figures,
            sure: vec![
                "The truth is known because this is a simulation. The intervals are of the motors that might have been \
                 drawn; several moves of one motor count as if each had a motor of its own."
                    .to_owned(),
            ],
            motor_s: Some(motor_s),
        }
    }

    /// Everything but the single trials, as one JSON object on one line.
    pub(crate) fn json(&self) -> String {
        let [prior, own] = self.both();
        let [findings, refusals] = self.counts();
        let object = json!({
            "motors": self.trials.len(),
            "by_map_of_motor": own,
            "by_map_it_began_with": prior,
            "all_by_map_it_began_with": self.all_by_prior(),
            "resonances": self.resonance_errors(),
            "findings": findings,
            "refused": refusals,
        });
        format!("{object}\n")
    }
}
