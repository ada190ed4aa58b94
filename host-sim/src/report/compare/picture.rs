//! The picture of a comparison: each change per what chance allows.

use statrs::distribution::{ContinuousCDF as _, Normal};

use super::{ComparedFigure, Comparison, LEVEL, Verdict, full_name};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;

/// Figures drawn at most: those least by chance.
const SHOWN_MAX: usize = 30;
/// Largest change drawn, in standard errors.
const LARGEST: f64 = 12.0;
/// Verdicts with their words and colour.
const DRAWN: [(Verdict, Colour); 4] = [
    (Verdict::WithinNoise, Colour::Blue),
    (Verdict::Worse, Colour::Vermilion),
    (Verdict::Better, Colour::Green),
    (Verdict::Changed, Colour::Purple),
];

/// The change of a figure in standard errors of a normal law with its probability.
fn sigmas(figure: &ComparedFigure) -> Option<f64> {
    let p = figure.p?.max(f64::MIN_POSITIVE);
    let size = -Normal::standard().inverse_cdf(0.5 * p);
    Some((size * figure.change.signum()).clamp(-LARGEST, LARGEST))
}

impl Comparison {
    /// The picture; `None` where no figure was tested.
    pub(crate) fn figure(&self) -> Option<Figure> {
        let tested = self.figures.iter().filter(|figure| figure.verdict != Verdict::Equal);
        let mut tested: Vec<(f64, &ComparedFigure)> =
            tested.filter_map(|figure| Some((sigmas(figure)?, figure))).collect();
        if tested.is_empty() {
            return None;
        }
        tested.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        tested.truncate(SHOWN_MAX);
        let count = tested.len();
        let names = tested.iter().rev().map(|(_, figure)| full_name(&figure.a)).collect();
        // The first of Holm's bounds, which the smallest probability must pass.
        let bound = -Normal::standard().inverse_cdf(0.5 * LEVEL / real(self.tested().max(1)));
        let x = Axis::new("B less A (standard errors)").within(-LARGEST - 0.5..LARGEST + 0.5);
        let panel = Panel::new("Changes per what chance allows", x, Axis::of_names("figure", names))
            .height(110 + 26 * u32::try_from(count).unwrap_or(100))
            .series(Series::spans(vec![(-bound, bound)]).colour(Colour::Grey).label("noise"));
        let panel = DRAWN.into_iter().fold(panel, |panel, (verdict, colour)| {
            let points: Vec<(f64, f64)> = (tested.iter().enumerate())
                .filter(|(_, (_, figure))| figure.verdict == verdict)
                .map(|(row, (sigmas, _))| (*sigmas, real(count - row)))
                .collect();
            if points.is_empty() {
                return panel;
            }
            panel.series(Series::points(points).colour(colour).width(2.5).label(verdict.words()))
        });
        Some(Figure::new("").caption(caption()).panel(panel))
    }
}

fn caption() -> String {
    format!("Each change in standard errors, the largest first; one beyond {LARGEST} stands there.")
}
