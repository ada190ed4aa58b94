//! The picture: for each bench, the errors and times of its moves beside what was promised.

use super::{CHOSEN, GridMove, GridOutcome, InstrumentGrid};
use crate::math::count::real;
use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};

impl InstrumentGrid {
    /// The picture as SVG.
    ///
    /// # Errors
    /// When it cannot be laid out.
    pub fn picture(&self) -> Result<String, OutputError> {
        let names: Vec<&str> = self
            .benches()
            .into_iter()
            .filter(|(_, filter)| *filter == CHOSEN)
            .map(|(name, _)| name)
            .collect();
        let place = |made: &GridMove| names.iter().position(|name| *name == made.bench).map(real);
        let held = |made: &&GridMove| {
            made.filter == CHOSEN && matches!(made.outcome, GridOutcome::Reached | GridOutcome::Wrong)
        };
        let points = |of: fn(&GridMove) -> f64| -> Vec<(f64, f64)> {
            let moves = self.moves.iter().filter(held);
            moves.filter_map(|made| Some((place(made)?, of(made).max(1e-3)))).collect()
        };
        let last = real(names.len());
        let level = |y: f64| vec![(-0.5, y), (last, y)];
        let panel = |title: &str, y: &str| {
            Panel::new(title, Axis::new("bench, in the order of the table"), Axis::new(y).logarithmic())
        };
        let errors = panel("True error per tolerance promised", "error (tolerances)")
            .series(
                Series::points(points(|made| 1e-3 * made.error_mdeg.abs() / made.tolerance_deg))
                    .colour(Colour::Blue),
            )
            .series(Series::line(level(1.0)).colour(Colour::Black).label("promised to 95 %"))
            .series(Series::line(level(3.0)).colour(Colour::Vermilion).label("wrong beyond"));
        let times = panel("Time per time promised", "time (times the promise)")
            .series(Series::points(points(|made| made.time_s / made.promised_s)).colour(Colour::Blue))
            .series(Series::line(level(1.5)).colour(Colour::Black).label("promised to 95 %"));
        Figure::new("Moves under other instruments")
            .caption(format!("{} benches, with the filter that each allows best.", names.len()))
            .panel(errors.height(320))
            .panel(times.height(320))
            .svg()
    }
}
