//! The picture of a held rate: rate, angle and drive over time.

use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::runs::rate::{RateOutcome, RatePoint};
use simulation::runs::rotor_tilt::TiltFigures;

/// The run as an SVG document.
///
/// # Errors
/// When the picture cannot be laid out.
pub fn svg(outcome: &RateOutcome, points: &[RatePoint]) -> Result<String, OutputError> {
    let figure = Figure::new(format!("Rate of {} degrees a second in closed loop", outcome.rate_deg_s))
        .caption(format!(
            "plant drawn by seed {}: mean rate {:+.2} deg/s{}, ripple {:.0} deg/s rms",
            outcome.seed,
            outcome.mean_deg_s,
            outcome.off(3),
            outcome.ripple_rms_deg_s
        ));
    panels(points).into_iter().fold(figure, Figure::panel).svg()
}

/// The panels of the picture, from top to bottom.
pub(super) fn panels(points: &[RatePoint]) -> Vec<Panel> {
    let time = || Axis::new("time (s)");
    let line = |of: fn(&RatePoint) -> f64| points.iter().map(|m| (m.time_s, of(m))).collect::<Vec<_>>();
    let mut panels = vec![
        Panel::new("Rate, means of 5 ms", time(), Axis::new("rate (deg/s)"))
            .series(Series::line(line(|m| m.rate_deg_s)).colour(Colour::Blue).label("truth"))
            .series(Series::dashes(line(|m| m.asked_deg_s)).colour(Colour::Black).label("asked for")),
        Panel::new("Angle less reference", time(), Axis::new("angle (deg)"))
            .series(Series::line(line(|m| m.off_deg)).colour(Colour::Blue)),
        Panel::new(
            "Drive: mode B up, mode C down",
            time(),
            Axis::new("amplitude (of full)").within(-1.1..1.1),
        )
        .series(Series::line(line(|m| m.drive)).colour(Colour::Purple))
        .height(210),
    ];
    panels.extend(tilt_panels(points));
    panels
}

/// Tilt and shift of a rotor that tilts; none of one that does not.
fn tilt_panels(points: &[RatePoint]) -> Vec<Panel> {
    let line = |of: fn(&TiltFigures) -> f64| -> Vec<(f64, f64)> {
        points.iter().filter_map(|point| Some((point.time_s, of(point.tilt.as_ref()?)))).collect()
    };
    let panel = |title: &str, unit: &str, [rms, most]: [Vec<(f64, f64)>; 2]| {
        Panel::new(title, Axis::new("time (s)"), Axis::new(unit))
            .series(Series::line(most).colour(Colour::Grey).label("largest"))
            .series(Series::line(rms).colour(Colour::Blue).label("root mean square"))
            .height(210)
    };
    if points.iter().all(|point| point.tilt.is_none()) {
        return Vec::new();
    }
    vec![
        panel(
            "Tilt of the rotor, over 5 ms",
            "tilt (mrad)",
            [line(|tilt| tilt.tilt_rms_mrad), line(|tilt| tilt.tilt_max_mrad)],
        ),
        panel(
            "Distance of the rotor's centre from the pin's axis, over 5 ms",
            "shift (um)",
            [line(|tilt| 1e6 * tilt.shift_rms_m), line(|tilt| 1e6 * tilt.shift_max_m)],
        ),
    ]
}
