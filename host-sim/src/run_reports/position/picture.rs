//! The picture of a move: target, truth and estimate, the last stretch, the estimator's error, and the drive.

use motor_model::{Angle, DriveCommand, DriveMode};

use super::PictureTrace;
use crate::report::OutputError;
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};
use simulation::runs::closed_loop::PositioningMoment;
use simulation::runs::position::MoveOutcome;
use simulation::world::pose::RotorTilt;

/// The move as an SVG document.
///
/// # Errors
/// When the picture cannot be laid out.
pub fn svg(outcome: &MoveOutcome, trace: &PictureTrace) -> Result<String, OutputError> {
    let estimator = outcome
        .rms_estimate_error_mdeg
        .map_or_else(String::new, |mdeg| format!(", estimator within {mdeg:.1} milli-degrees rms"));
    let time = match outcome.settle_time_s {
        Some(settle_s) => {
            format!(", reached after {settle_s:.3} s and watched until {:.3} s", outcome.duration_s)
        }
        None => format!(" after {:.3} s", outcome.duration_s),
    };
    let caption = format!(
        "plant drawn by seed {}: ended {:+.2} milli-degrees from the target{time}, {} drive switches{estimator}",
        outcome.seed, outcome.final_error_mdeg, outcome.drive_switches,
    );
    let figure =
        Figure::new(format!("Move to {} degrees in closed loop", outcome.target_deg)).caption(caption);
    panels(outcome, trace).into_iter().fold(figure, Figure::panel).svg()
}

/// The panels of the picture, from top to bottom.
pub(super) fn panels(outcome: &MoveOutcome, trace: &PictureTrace) -> Vec<Panel> {
    let end_s = outcome.duration_s;
    let mut panels = vec![
        angle(outcome, trace).height(330),
        last_stretch("The last degree", 1000.0, outcome, trace).height(230),
        last_stretch("The last milli-degrees", 10e3 * outcome.tolerance_deg, outcome, trace).height(260),
        rate(trace, end_s),
        estimator_error(outcome, trace),
        drive(trace, end_s).height(210),
    ];
    panels.extend(tilt(trace, end_s));
    panels
}

/// Tilt and shift of a rotor that tilts; none of one that does not.
fn tilt(trace: &PictureTrace, end_s: f64) -> Vec<Panel> {
    let tilts = || trace.moments.iter().filter_map(|moment| Some((moment.seconds(), moment.tilt?)));
    if tilts().next().is_none() {
        return Vec::new();
    }
    let line = |of: fn(&RotorTilt) -> f64| tilts().map(|(at, tilt)| (at, of(&tilt))).collect::<Vec<_>>();
    vec![
        Panel::new("Tilt of the rotor", time(end_s), Axis::new("tilt (mrad)"))
            .series(Series::line(line(|tilt| 1e3 * tilt.pose.tilt_rad())).colour(Colour::Blue))
            .height(210),
        Panel::new("Shift of the rotor's centre on the pin", time(end_s), Axis::new("shift (um)"))
            .series(Series::line(line(|tilt| 1e6 * tilt.pose.shift_m[0])).colour(Colour::Blue).label("x"))
            .series(Series::line(line(|tilt| 1e6 * tilt.pose.shift_m[1])).colour(Colour::Orange).label("y"))
            .height(230),
    ]
}

fn time(end_s: f64) -> Axis {
    Axis::new("time (s)").within(0.0..end_s)
}

fn line(trace: &PictureTrace, value: impl Fn(&PositioningMoment) -> Option<f64>) -> Vec<(f64, f64)> {
    trace.moments.iter().filter_map(|moment| Some((moment.seconds(), value(moment)?))).collect()
}

fn truth(points: Vec<(f64, f64)>) -> Series {
    Series::line(points).colour(Colour::Blue).width(2.0).label("truth")
}

fn estimate(points: Vec<(f64, f64)>) -> Series {
    Series::line(points).colour(Colour::Vermilion).width(1.0).label("estimate")
}

/// Intervals during which `mode` was driven.
fn driven(trace: &PictureTrace, mode: DriveMode, end_s: f64) -> Vec<(f64, f64)> {
    let ends = trace.commands.iter().skip(1).map(|(at, _)| *at).chain([end_s]);
    trace
        .commands
        .iter()
        .zip(ends)
        .filter(|((_, c), _)| c.mode() == Some(mode))
        .map(|((at, _), end)| (*at, end))
        .collect()
}

fn angle(outcome: &MoveOutcome, trace: &PictureTrace) -> Panel {
    let end_s = outcome.duration_s;
    Panel::new("Angle", time(end_s), Axis::new("angle (deg)"))
        .series(Series::spans(driven(trace, DriveMode::B, end_s)).colour(Colour::Orange).label("mode B on"))
        .series(Series::spans(driven(trace, DriveMode::C, end_s)).colour(Colour::Green).label("mode C on"))
        .series(
            Series::dashes(vec![(0.0, outcome.target_deg), (end_s, outcome.target_deg)])
                .colour(Colour::Black)
                .label("target"),
        )
        .series(truth(line(trace, |moment| Some(moment.angle.degrees()))))
        .series(estimate(line(trace, |moment| Some(moment.report.estimate?.angle.degrees()))))
}

/// From the moment at which the rotor last came within `range_mdeg` of the target, in milli-degrees from it.
fn last_stretch(title: &str, range_mdeg: f64, outcome: &MoveOutcome, trace: &PictureTrace) -> Panel {
    let tolerance_mdeg = 1e3 * outcome.tolerance_deg;
    let end_s = outcome.duration_s;
    let target = Angle::from_degrees(outcome.target_deg);
    let off = |angle: Angle| 1e3 * angle.minus(target).degrees();
    let outside = trace.moments.iter().rev().find(|moment| off(moment.angle).abs() > range_mdeg);
    let start_s = outside.map_or(0.0, |moment| (moment.seconds() - 0.02 * end_s).max(0.0)).min(0.9 * end_s);
    let tolerance =
        vec![(start_s, -tolerance_mdeg, tolerance_mdeg), (end_s, -tolerance_mdeg, tolerance_mdeg)];
    let axis = Axis::new("off target (mdeg)").within(-range_mdeg..range_mdeg);
    Panel::new(title, Axis::new("time (s)").within(start_s..end_s), axis)
        .series(Series::spans(driven(trace, DriveMode::B, end_s)).colour(Colour::Orange))
        .series(Series::spans(driven(trace, DriveMode::C, end_s)).colour(Colour::Green))
        .series(Series::band(tolerance).colour(Colour::Black).label("tolerance"))
        .series(truth(line(trace, |moment| Some(off(moment.angle)))))
        .series(estimate(line(trace, |moment| Some(off(moment.report.estimate?.angle)))))
}

fn rate(trace: &PictureTrace, end_s: f64) -> Panel {
    Panel::new("Rate", time(end_s), Axis::new("rate (rad/s)"))
        .series(truth(line(trace, |moment| Some(moment.rate_rad_s))))
        .series(estimate(line(trace, |moment| Some(f64::from(moment.report.estimate?.rate_rad_s)))))
}

/// Estimated less true angle within the two standard deviations that the filter reports.
fn estimator_error(outcome: &MoveOutcome, trace: &PictureTrace) -> Panel {
    let end_s = outcome.duration_s;
    // The band of the first frames is left out: it is far wider than the rest.
    let range_mdeg = (6.0 * outcome.rms_estimate_error_moving_mdeg.unwrap_or(0.0)).max(10.0);
    let two_sigma = |moment: &PositioningMoment| {
        let variance = f64::from(moment.report.estimate?.angle_rad2);
        Some(2e3 * motor_model::math::sqrt(variance).to_degrees())
    };
    let band = line(trace, two_sigma).into_iter().map(|(at, width)| (at, -width, width)).collect();
    Panel::new(
        "Error of the estimate",
        time(end_s),
        Axis::new("error (mdeg)").within(-range_mdeg..range_mdeg),
    )
    .series(Series::band(band).colour(Colour::Vermilion).label("two standard deviations, as reported"))
    .series(
        Series::line(line(trace, PositioningMoment::estimate_error_mdeg))
            .colour(Colour::Black)
            .label("estimate less truth"),
    )
}

/// Amplitude, upwards for mode B and downwards for mode C.
fn drive(trace: &PictureTrace, end_s: f64) -> Panel {
    let signed = |command: &DriveCommand| match command.mode() {
        Some(DriveMode::B) => f64::from(command.amplitude()),
        Some(DriveMode::C) => -f64::from(command.amplitude()),
        None => 0.0,
    };
    let mut steps: Vec<(f64, f64)> =
        trace.commands.iter().map(|(at, command)| (*at, signed(command))).collect();
    steps.extend(steps.last().map(|(_, last)| (end_s, *last)));
    Panel::new(
        "Drive: mode B up, mode C down",
        time(end_s),
        Axis::new("amplitude (of full)").within(-1.1..1.1),
    )
    .series(Series::steps(steps).colour(Colour::Purple).width(1.5))
}
