//! The posterior and the fit as pictures.

use super::outcome::{Identification, MeasuredStatistic};
use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::math::count::real;

/// Bins of a marginal.
const BINS: usize = 40;
/// Most pairs of parameters that are drawn: those that are correlated most.
const PAIRS_MAX: usize = 6;
/// Most points of a cloud.
const POINTS_MAX: usize = 500;
/// Most statistics that are drawn: those furthest off.
const STATISTICS_MAX: usize = 24;

impl Identification {
    /// The posterior: each parameter with what was known before behind it, and pairs.
    ///
    /// # Errors
    /// When the picture cannot be laid out.
    pub fn posterior_svg(&self) -> Result<String, OutputError> {
        let figure = Figure::new("What the recordings tell of each parameter")
            .caption("Grey: what was known before. Blue: after. Below: pairs that are told together.");
        self.posterior_panels().into_iter().fold(figure, Figure::panel).svg()
    }

    /// The fit: statistics of the recordings beside those of motors of the posterior.
    ///
    /// # Errors
    /// When the picture cannot be laid out.
    pub fn fit_svg(&self) -> Result<String, OutputError> {
        Figure::new("The recordings beside motors of the posterior").panel(self.fit_panel()).svg()
    }

    pub(super) fn posterior_panels(&self) -> Vec<Panel> {
        let marginals = (0..self.told.len()).map(|place| self.marginal(place));
        marginals.chain(self.pairs().into_iter().map(|(one, other)| self.pair(one, other))).collect()
    }

    /// The sample of a parameter, in the unit of its axis.
    fn values(&self, place: usize) -> Vec<f64> {
        let unit = self.axis_unit(place);
        self.sample.iter().filter_map(|told| told.get(place).map(|value| value / unit)).collect()
    }

    /// Unit of a parameter's axis: a power of a thousand, so that its ticks are short.
    fn axis_unit(&self, place: usize) -> f64 {
        let size = self.parameters[self.told[place]].prior_mean.abs();
        let units = [1e-12, 1e-9, 1e-6, 1e-3];
        if size >= 0.1 { 1.0 } else { units.into_iter().rfind(|unit| size >= *unit).unwrap_or(1.0) }
    }

    /// Label of an axis.
    fn label(&self, place: usize) -> String {
        let parameter = &self.parameters[self.told[place]];
        let name = parameter.key.trim_start_matches("motor.");
        let unit = self.axis_unit(place);
        let power = if unit < 1.0 { format!("{unit:e} ") } else { String::new() };
        match format!("{power}{}", parameter.unit).trim() {
            "" => format!("{name} (1)"),
            unit => format!("{name} ({unit})"),
        }
    }

    fn marginal(&self, place: usize) -> Panel {
        let parameter = &self.parameters[self.told[place]];
        let values = self.values(place);
        let (low, high) = bounds(&values);
        let density = histogram(&values, low, high);
        let top = density.iter().map(|point| point.1).fold(0.0, f64::max);
        let unit = self.axis_unit(place);
        let before = (0..=BINS).map(|step| {
            let x = low + (high - low) * real(step) / real(BINS);
            (x, 0.0, unit * parameter.prior.density(unit * x))
        });
        let before: Vec<(f64, f64, f64)> = before.collect();
        Panel::new(
            parameter.meaning,
            Axis::new(self.label(place)).within(low..high),
            Axis::new("density (per unit of the axis)").within(0.0..1.1 * top),
        )
        .height(190)
        .series(Series::band(before).colour(Colour::Grey).opacity(0.5).label("before"))
        .series(Series::steps(density).colour(Colour::Blue).label("after"))
    }

    /// Pairs of parameters by the magnitude of their correlation.
    fn pairs(&self) -> Vec<(usize, usize)> {
        let count = self.told.len();
        let mut pairs: Vec<(f64, (usize, usize))> = (0..count)
            .flat_map(|one| (0..one).map(move |other| (other, one)))
            .map(|(one, other)| {
                let points: Vec<(f64, f64)> = self.cloud(one, other);
                let line = simulation::math::statistics::Line::through(&points);
                (line.map_or(0.0, |line| line.correlation.abs()), (one, other))
            })
            .collect();
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        pairs.into_iter().take(PAIRS_MAX).filter(|pair| pair.0 > 0.3).map(|pair| pair.1).collect()
    }

    fn cloud(&self, one: usize, other: usize) -> Vec<(f64, f64)> {
        let step = (self.sample.len() / POINTS_MAX).max(1);
        let (one, other) = (self.values(one), self.values(other));
        one.into_iter().zip(other).step_by(step).collect()
    }

    fn pair(&self, one: usize, other: usize) -> Panel {
        let cloud = self.cloud(one, other);
        Panel::new("Told together", Axis::new(self.label(one)), Axis::new(self.label(other)))
            .height(260)
            .series(Series::points(cloud).colour(Colour::Blue).opacity(0.25))
    }

    pub(super) fn fit_panel(&self) -> Panel {
        let furthest = self.drawn_statistics();
        let rows = furthest.len();
        // The first at the top.
        let points = furthest.iter().enumerate().map(|(row, one)| (one.deviation(), real(rows - row)));
        let points: Vec<(f64, f64)> = points.collect();
        let most = points.iter().map(|point| point.0.abs()).fold(3.0, f64::max);
        let from_below = furthest.iter().rev().map(|one| one.name.clone()).collect();
        Panel::new(
            "Measured less predicted, of the statistics that are furthest off",
            Axis::new("deviation (standard deviations)").within(-1.1 * most..1.1 * most),
            Axis::of_names("statistic", from_below),
        )
        .height(100 + 18 * u32::try_from(rows).unwrap_or(100))
        .series(
            Series::spans(vec![(-2.0, 2.0)]).colour(Colour::Grey).opacity(0.45).label("95 % of right fits"),
        )
        .series(Series::points(points).colour(Colour::Vermilion).width(2.5).label("measured"))
    }

    /// The statistics of [`Self::fit_panel`], in its order.
    pub(super) fn drawn_statistics(&self) -> Vec<&MeasuredStatistic> {
        self.furthest(STATISTICS_MAX)
    }
}

/// Smallest and largest value, a little apart.
fn bounds(values: &[f64]) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let margin = 0.05 * (high - low).max(1e-12 * high.abs()).max(f64::MIN_POSITIVE);
    (low - margin, high + margin)
}

/// Density of values between two bounds, bin by bin.
fn histogram(values: &[f64], low: f64, high: f64) -> Vec<(f64, f64)> {
    let width = (high - low) / real(BINS);
    let mut counts = [0_u32; BINS];
    for value in values {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most the number of bins"
        )]
        let bin = (((value - low) / width) as usize).min(BINS - 1);
        counts[bin] += 1;
    }
    let scale = 1.0 / (real(values.len()) * width);
    counts
        .iter()
        .enumerate()
        .map(|(bin, count)| (low + width * real(bin), f64::from(*count) * scale))
        .collect()
}
