//! The picture: for each bench, the errors and times of its moves beside what was promised.

use super::{CHOSEN, GridMove, GridOutcome, InstrumentGrid};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;

impl InstrumentGrid {
    /// The picture: the benches in the order of the table, from top to bottom.
    pub(crate) fn figure(&self) -> Figure {
        let names: Vec<&str> = self
            .benches()
            .into_iter()
            .filter(|(_, filter)| *filter == CHOSEN)
            .map(|(name, _)| name)
            .collect();
        let count = names.len();
        let place = |made: &GridMove| {
            let row = names.iter().position(|name| *name == made.bench)?;
            Some(real(count - row))
        };
        let held = |made: &&GridMove| {
            made.filter == CHOSEN && matches!(made.outcome, GridOutcome::Reached | GridOutcome::Wrong)
        };
        let points = |of: fn(&GridMove) -> f64| -> Vec<(f64, f64)> {
            let moves = self.moves.iter().filter(held);
            moves.filter_map(|made| Some((of(made).max(1e-3), place(made)?))).collect()
        };
        let upright = |x: f64| vec![(x, 0.5), (x, real(count) + 0.5)];
        let panel = |title: &str, x: &str| {
            let from_below = names.iter().rev().map(|name| (*name).to_owned()).collect();
            Panel::new(title, Axis::new(x).logarithmic(), Axis::of_names("bench", from_below))
                .height(100 + 18 * u32::try_from(count).unwrap_or(100))
        };
        let errors = panel("True error per tolerance promised", "error (tolerances)")
            .series(Series::line(upright(1.0)).colour(Colour::Black).label("promised to 95 %"))
            .series(Series::line(upright(3.0)).colour(Colour::Vermilion).label("wrong beyond"))
            .series(
                Series::points(points(|made| 1e-3 * made.error_mdeg.abs() / made.tolerance_deg))
                    .colour(Colour::Blue)
                    .label("a move"),
            );
        let times = panel("Time per time promised", "time (times the promise)")
            .series(Series::line(upright(1.5)).colour(Colour::Black).label("promised to 95 %"))
            .series(
                Series::points(points(|made| made.time_s / made.promised_s))
                    .colour(Colour::Blue)
                    .label("a move"),
            );
        Figure::new("Moves under other instruments")
            .caption(format!("{} benches, with the filter that each allows best.", names.len()))
            .panel(errors)
            .panel(times)
    }
}
