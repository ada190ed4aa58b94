//! How frequency and rate follow a parameter: the paper's Figs 10 and 11.

use motor_model::DriveMode;
use serde::Serialize;

use super::campaign::{Campaign, Ensemble};
use super::published::{Quantity, TABLE_2_MODE_SHIFT, Trend};
use crate::math::statistics::{Line, Spread};
use crate::studies::StudyError;

/// Values of the parameter in a trend.
const POINTS: u8 = 9;

/// "Roughly linear": the means correlate linearly by at least this much.
pub const LINEAR_CORRELATION: f64 = 0.9;

/// Values that `trend` takes, in SI units.
pub fn values(trend: &Trend) -> impl Iterator<Item = f64> {
    let (low, high) = trend.range;
    (0..POINTS).map(move |index| low + (high - low) * f64::from(index) / f64::from(POINTS - 1))
}

/// Adds the motors of `trend` to a campaign; returns their places in the results.
///
/// # Errors
/// When a value is out of bounds.
pub fn plan(
    trend: &Trend,
    campaign: &mut Campaign,
    step_s: f64,
    seeds: u64,
) -> Result<Vec<usize>, StudyError> {
    values(trend)
        .map(|value| {
            campaign.add(DriveMode::C, &[TABLE_2_MODE_SHIFT, (trend.parameter, value)], step_s, seeds)
        })
        .collect()
}

/// How one quantity follows the parameter.
#[derive(Clone, Debug, Serialize)]
pub struct Course {
    /// The quantity, in words.
    #[serde(serialize_with = "super::as_words")]
    pub quantity: Quantity,
    /// Its unit.
    pub unit: &'static str,
    /// Whether the paper says that it rises.
    pub paper_rises: bool,
    /// Parameter, in the trend's unit, with mean and spread of the quantity.
    pub points: Vec<(f64, Spread)>,
    /// The straight line through the means.
    pub line: Line,
    /// The slope has the paper's sign.
    pub same_direction: bool,
    /// The means lie close to a straight line.
    pub roughly_linear: bool,
}

impl Course {
    /// The course of `quantity` over the ensembles of `trend`; `None` without two values.
    pub fn of(
        trend: &Trend,
        (quantity, paper_rises): (Quantity, bool),
        ensembles: &[&Ensemble],
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

    /// The verdict in words.
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
