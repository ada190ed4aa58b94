//! The picture: for each figure, the share of trials at each value or beyond.

use super::trial::FAILED_MDEG;
use super::{PositioningTrial, PositioningTrials, StrategyTrials};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;

/// Share of the trials in percent that are at each value or beyond.
fn exceedance(trials: &StrategyTrials, of: impl Fn(&PositioningTrial) -> Option<f64>) -> Vec<(f64, f64)> {
    let mut values: Vec<f64> = trials.trials.iter().filter_map(of).collect();
    values.sort_by(f64::total_cmp);
    let count = values.len();
    let share = |above: usize| 100.0 * real(above) / real(count);
    values.into_iter().enumerate().map(|(rank, value)| (value, share(count - rank))).collect()
}

/// The worst trial as a point: the line of a single trial is none.
fn ends(points: &[(f64, f64)]) -> Series {
    Series::points(points.last().copied().into_iter().collect())
}

impl PositioningTrials {
    /// The picture.
    pub(crate) fn figure(&self) -> Figure {
        let panel = |title: &str, x: Axis| {
            Panel::new(title, x, Axis::new("share of trials beyond (%)").logarithmic())
        };
        let all = || std::iter::once(&self.trials).chain(&self.others).zip(Colour::SERIES);
        let least = 100.0 / real(self.trials.trials.len().max(1));
        let upright = |x: f64| Series::dashes(vec![(x, least), (x, 100.0)]);
        let errors = all().fold(
            panel("True final error", Axis::new("error (mdeg)").logarithmic())
                .series(upright(1e3 * self.tolerance_deg).colour(Colour::Black).label("tolerance"))
                .series(upright(FAILED_MDEG).colour(Colour::Grey).label("failed beyond")),
            |panel, (trials, colour)| {
                let points = exceedance(trials, |trial| Some(trial.final_error_mdeg.abs().max(1e-3)));
                let label = format!("{}, {}", trials.strategy.name(), trials.filter.replace('_', " "));
                panel
                    .series(ends(&points).colour(colour))
                    .series(Series::line(points).colour(colour).width(1.5).label(label))
            },
        );
        let settling = all().fold(
            panel("Time to settle per its bound", Axis::new("time (times the bound)").logarithmic())
                .series(upright(1.0).colour(Colour::Black).label("no controller settles earlier")),
            |panel, (trials, colour)| {
                let points = exceedance(trials, |trial| Some(trial.settle_s? / trial.bound_s));
                panel
                    .series(ends(&points).colour(colour))
                    .series(Series::line(points).colour(colour).width(1.5))
            },
        );
        let own = |title: &str, x: &str, of: fn(&PositioningTrial) -> f64| {
            let points = exceedance(&self.trials, |trial| Some(of(trial)));
            panel(title, Axis::new(x))
                .series(Series::line(points).colour(Colour::Blue).width(1.5))
                .height(190)
        };
        Figure::new("Positioning trials")
            .caption(format!(
                "{} motors drawn within their tolerances, each with a target of its own. The last three panels: the \
                 controller.",
                self.trials.trials.len()
            ))
            .panel(errors.height(360))
            .panel(settling.height(260))
            .panel(own("Overshoot", "overshoot (deg)", |trial| trial.overshoot_deg))
            .panel(own("Changes of the drive", "changes (count)", |trial| f64::from(trial.switches)))
            .panel(own("Time with the drive on", "time (s)", |trial| trial.drive_on_s))
    }
}
