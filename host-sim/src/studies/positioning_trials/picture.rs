//! The picture: for each figure, the share of trials beyond each value.

use super::{PositioningTrial, PositioningTrials, StrategyTrials};
use crate::math::count::real;
use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};

/// Share of the trials that exceed each value, the largest left out.
fn exceedance(trials: &StrategyTrials, of: impl Fn(&PositioningTrial) -> Option<f64>) -> Vec<(f64, f64)> {
    let mut values: Vec<f64> = trials.trials.iter().filter_map(of).collect();
    values.sort_by(f64::total_cmp);
    let count = values.len();
    let share = |above: usize| real(above) / real(count);
    values.into_iter().enumerate().map(|(rank, value)| (value, share(count - rank))).collect()
}

impl PositioningTrials {
    /// The picture as SVG.
    ///
    /// # Errors
    /// When it cannot be laid out.
    pub fn picture(&self) -> Result<String, OutputError> {
        self.figure().svg()
    }

    /// The picture.
    pub(crate) fn figure(&self) -> Figure {
        let panel =
            |title: &str, x: Axis| Panel::new(title, x, Axis::new("share of trials beyond").logarithmic());
        let colours = || Colour::SERIES.into_iter().chain([Colour::Black]);
        let all = || std::iter::once(&self.trials).chain(&self.others).zip(colours());
        let errors = all().fold(
            panel("True final error", Axis::new("error (mdeg)").logarithmic()),
            |panel, (trials, colour)| {
                let points = exceedance(trials, |trial| Some(trial.outcome.final_error_mdeg.abs().max(1e-3)));
                let label = format!("{}, {}", trials.strategy.name(), trials.filter.replace('_', " "));
                panel.series(Series::line(points).colour(colour).width(1.5).label(label))
            },
        );
        let settling = all().fold(
            panel("Time to settle per its bound", Axis::new("times the bound").logarithmic()),
            |panel, (trials, colour)| {
                let points = exceedance(trials, |trial| Some(trial.outcome.settle_time_s? / trial.bound_s));
                panel.series(Series::line(points).colour(colour).width(1.5))
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
            .panel(own("Overshoot", "overshoot (deg)", |trial| trial.outcome.overshoot_deg))
            .panel(own("Changes of the drive", "changes", |trial| f64::from(trial.outcome.drive_switches)))
            .panel(own("Time with the drive on", "time (s)", |trial| trial.outcome.drive_on_s))
    }
}
