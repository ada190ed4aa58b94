//! Collision frequency and rate against a parameter: the paper's Figs 10 and 11.

use motor_model::DriveMode;
use serde::Serialize;

use super::published::{PublishedTrend, Quantity, SHIFT};
use super::runs::{Ensemble, PaperRuns};
use simulation::math::statistics::{Line, Spread};
use simulation::runs::RunError;

/// Number of values of the parameter in a trend.
const POINTS: u8 = 9;

/// Least magnitude of the linear correlation of the means for "roughly linear".
pub const LINEAR_CORRELATION: f64 = 0.9;

/// The values of the parameter of `trend`, in SI units.
pub fn values(trend: &PublishedTrend) -> impl Iterator<Item = f64> {
    let (low, high) = trend.range;
    (0..POINTS).map(move |index| low + (high - low) * f64::from(index) / f64::from(POINTS - 1))
}

/// Adds the motors of `trend` to `runs`.
///
/// # Errors
/// When a value is out of bounds.
pub fn add_runs(
    trend: &PublishedTrend,
    runs: &mut PaperRuns,
    step_s: f64,
    seeds: u64,
) -> Result<(), RunError> {
    values(trend)
        .try_for_each(|value| runs.add(DriveMode::C, &[SHIFT, (trend.parameter, value)], step_s, seeds))
}

/// One quantity against the parameter, and the straight line through it.
#[derive(Clone, Debug, Serialize)]
pub struct TrendLine {
    /// The quantity, in words.
    #[serde(serialize_with = "super::published::as_words")]
    pub quantity: Quantity,
    /// Its unit.
    pub unit: &'static str,
    /// Whether the paper says that it rises.
    pub paper_rises: bool,
    /// The parameter in the trend's unit, with mean and spread of the quantity.
    pub points: Vec<(f64, Spread)>,
    /// The straight line through the means.
    pub line: Line,
    /// Whether the slope has the paper's sign.
    pub same_direction: bool,
    /// Whether the means lie close to a straight line.
    pub roughly_linear: bool,
}

impl TrendLine {
    /// `quantity` over the runs of `trend`. `None` unless the parameter takes two values.
    pub fn of(
        trend: &PublishedTrend,
        (quantity, paper_rises): (Quantity, bool),
        ensembles: &[Ensemble],
    ) -> Option<Self> {
        let (_, per_si) = trend.unit;
        let spreads = ensembles.iter().map(|ensemble| ensemble.spread(quantity));
        let points: Vec<(f64, Spread)> = values(trend).map(|value| value * per_si).zip(spreads).collect();
        let means: Vec<(f64, f64)> = points.iter().map(|(x, spread)| (*x, spread.mean)).collect();
        let line = Line::through(&means)?;
        Some(Self {
            quantity,
            unit: quantity.unit(),
            paper_rises,
            points,
            line,
            same_direction: (line.slope > 0.0) == paper_rises && line.slope != 0.0,
            roughly_linear: line.correlation.abs() >= LINEAR_CORRELATION,
        })
    }

    /// The result in words.
    pub fn verdict(&self) -> &'static str {
        match (self.same_direction, self.roughly_linear) {
            (true, true) => "as in the paper",
            (true, false) => "same direction, not linear",
            (false, _) => "OPPOSITE",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::studies::paper::published::TRENDS;
    use motor_model::MotorParams;

    #[test]
    fn exact_values_span_the_range_about_the_nominal() {
        for trend in TRENDS {
            let values: Vec<f64> = values(&trend).collect();
            let nominal = MotorParams::nominal().get(trend.parameter);
            assert_eq!(values.len(), 9);
            assert!((values[4] / nominal - 1.0).abs() < 1e-9);
            assert!((values[8] / trend.range.1 - 1.0).abs() < 1e-12);
        }
    }
}
