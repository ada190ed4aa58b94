//! The picture of a log: angle, error and innovations as they were logged, and the truth.

use super::LogBesideTruth;
use super::log_beside_truth::Logged;
use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};

/// The log as an SVG document.
pub(super) fn svg(record: &LogBesideTruth) -> Result<String, OutputError> {
    let entries: u64 = record.counts.values().sum();
    Figure::new("What the firmware logged, beside the truth")
        .caption(format!("{entries} entries in {:.3} s, at the ticks that they bear", record.end_s))
        .panel(angle(record).height(300))
        .panel(error(record).height(260))
        .panel(innovation(record))
        .svg()
}

fn time(record: &LogBesideTruth) -> Axis {
    Axis::new("time (s)").within(0.0..record.end_s)
}

fn line(record: &LogBesideTruth, value: fn(&Logged) -> f64) -> Vec<(f64, f64)> {
    record.estimates.iter().map(|logged| (logged.time_s, value(logged))).collect()
}

/// Intervals during which `mode` was driven.
fn driven(record: &LogBesideTruth, mode: &str) -> Vec<(f64, f64)> {
    let ends = record.drives.iter().skip(1).map(|(at, _)| *at).chain([record.end_s]);
    let spans = record.drives.iter().zip(ends);
    spans.filter(|((_, drive), _)| drive == mode).map(|((from, _), to)| (*from, to)).collect()
}

fn angle(record: &LogBesideTruth) -> Panel {
    let truth = Series::line(line(record, |logged| logged.true_deg)).colour(Colour::Blue).width(2.0);
    let logged =
        Series::line(line(record, |logged| logged.estimated_deg)).colour(Colour::Vermilion).width(1.0);
    Panel::new("Angle", time(record), Axis::new("angle (deg)"))
        .series(Series::spans(driven(record, "B")).colour(Colour::Orange).label("mode B on, as logged"))
        .series(Series::spans(driven(record, "C")).colour(Colour::Green).label("mode C on, as logged"))
        .series(truth.label("truth"))
        .series(logged.label("logged estimate"))
}

fn error(record: &LogBesideTruth) -> Panel {
    let within = |logged: &Logged| (logged.time_s, -2.0 * logged.sigma_mdeg, 2.0 * logged.sigma_mdeg);
    let band = Series::band(record.estimates.iter().map(within).collect()).colour(Colour::Vermilion);
    let error = Series::line(line(record, |logged| logged.error_mdeg)).colour(Colour::Black);
    let largest = record.estimates.iter().map(|logged| logged.error_mdeg.abs()).fold(10.0, f64::max);
    Panel::new(
        "Error of the logged estimate",
        time(record),
        Axis::new("error (mdeg)").within(-largest..largest),
    )
    .series(band.label("two standard deviations, as logged"))
    .series(error.label("logged estimate less truth"))
}

fn innovation(record: &LogBesideTruth) -> Panel {
    let [used, refused] = record.innovations.clone();
    Panel::new("Camera frames", time(record), Axis::new("innovation (mdeg)"))
        .series(Series::points(used).colour(Colour::Blue).label("used"))
        .series(Series::points(refused).colour(Colour::Vermilion).label("refused"))
}
