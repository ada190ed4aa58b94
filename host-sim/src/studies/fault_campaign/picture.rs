//! The picture: how the moves ended by fault, and how wrong an estimate that was called good ever was.

use super::{FaultCampaign, FaultSummary};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;
use simulation::runs::position::MoveEnding;

/// How a move can end, with its words and colour.
const ENDINGS: [(MoveEnding, &str, Colour); 4] = [
    (MoveEnding::Reached, "reached", Colour::Blue),
    (MoveEnding::GaveUp, "gave up with a reason", Colour::Orange),
    (MoveEnding::TimedOut, "ended by the deadline", Colour::Grey),
    (MoveEnding::Wrong, "on target, wrongly", Colour::Vermilion),
];

impl FaultCampaign {
    /// The picture: the faults in the order of the table, from top to bottom.
    pub(crate) fn figure(&self) -> Figure {
        Figure::new("Moves during which something goes wrong")
            .caption(format!(
                "{} moves, each with one or two faults of random kind, time and severity.",
                self.runs.len()
            ))
            .panel(self.endings())
            .panel(self.unaware())
    }

    fn endings(&self) -> Panel {
        let words = self.by_word();
        let panel =
            panel("How the moves ended", Axis::new("share of the runs (%)").within(-2.0..102.0), &words);
        let count = |summary: &FaultSummary, ending| match ending {
            MoveEnding::Reached => summary.reached,
            MoveEnding::GaveUp => summary.gave_up,
            MoveEnding::TimedOut => summary.timed_out,
            MoveEnding::Wrong => summary.wrong,
        };
        ENDINGS.into_iter().fold(panel, |panel, (ending, label, colour)| {
            let shares = places(&words).filter_map(|(place, summary)| {
                let count = count(summary, ending);
                (count > 0).then(|| (100.0 * real(count) / real(summary.runs), place))
            });
            panel.series(Series::points(shares.collect()).colour(colour).width(2.5).label(label))
        })
    }

    /// The time for which an estimate was called good and was wrong, of each run that had one.
    fn unaware(&self) -> Panel {
        let words = self.by_word();
        let x = Axis::new("time in all (ms)").logarithmic().within(10.0..1e4);
        let points = places(&words).flat_map(|(place, summary)| {
            let runs = self.runs.iter().filter(|run| run.has(&summary.of) && run.was_unaware());
            runs.map(move |run| (1e3 * run.unaware_s, place))
        });
        panel("Estimates called good that were wrong", x, &words)
            .series(Series::points(points.collect()).colour(Colour::Vermilion).label("a run"))
    }
}

/// A panel with a line for each fault.
fn panel(title: &str, x: Axis, words: &[FaultSummary]) -> Panel {
    let from_below = words.iter().rev().map(|summary| summary.of.replace('_', " ")).collect();
    Panel::new(title, x, Axis::of_names("fault", from_below))
        .height(100 + 18 * u32::try_from(words.len()).unwrap_or(100))
}

/// The place of each fault on the axis: the first at the top.
fn places(words: &[FaultSummary]) -> impl Iterator<Item = (f64, &FaultSummary)> {
    words.iter().enumerate().map(|(row, summary)| (real(words.len() - row), summary))
}
