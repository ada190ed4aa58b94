//! The picture of a held rate: rate, angle and drive over time.

use super::RateOutcome;
use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};

/// A point of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RatePoint {
    /// Time in s.
    pub time_s: f64,
    /// Rate asked for in deg/s.
    pub asked_deg_s: f64,
    /// True rate, over the time since the last point, in deg/s.
    pub rate_deg_s: f64,
    /// True angle less reference in degrees.
    pub off_deg: f64,
    /// Amplitude, negative in mode C.
    pub drive: f64,
}

/// The run as an SVG document.
///
/// # Errors
/// When the picture cannot be laid out.
pub fn svg(outcome: &RateOutcome, points: &[RatePoint]) -> Result<String, OutputError> {
    let time = || Axis::new("time (s)");
    let line = |of: fn(&RatePoint) -> f64| points.iter().map(|m| (m.time_s, of(m))).collect::<Vec<_>>();
    Figure::new(format!("Rate of {} degrees a second in closed loop", outcome.rate_deg_s))
        .caption(format!(
            "plant drawn by seed {}: mean rate {:+.3} % off, ripple {:.0} deg/s rms",
            outcome.seed, outcome.mean_error_percent, outcome.ripple_rms_deg_s
        ))
        .panel(
            Panel::new("Rate, means of 5 ms", time(), Axis::new("rate (deg/s)"))
                .series(Series::line(line(|m| m.rate_deg_s)).colour(Colour::Blue).label("truth"))
                .series(Series::dashes(line(|m| m.asked_deg_s)).colour(Colour::Black).label("asked for")),
        )
        .panel(
            Panel::new("Angle less reference", time(), Axis::new("angle (deg)"))
                .series(Series::line(line(|m| m.off_deg)).colour(Colour::Blue)),
        )
        .panel(
            Panel::new("Drive: mode B up, mode C down", time(), Axis::new("amplitude").within(-1.1..1.1))
                .series(Series::line(line(|m| m.drive)).colour(Colour::Purple))
                .height(210),
        )
        .svg()
}
