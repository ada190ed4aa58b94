//! The commissioned map with its intervals, over the map that it began with, and the sweeps.

use controller::response_map::{Family, direction};
use motor_model::DriveMode;
use simulation::runs::commission::CommissionedMotor;

use super::rows::{self, BurstRow, CruiseRow};
use crate::report::chart::{Axis, Colour, Figure, Panel, Series};

/// Standard deviations of a 95 % interval.
const SIGMAS_95: f64 = 1.96;

/// Least value that a logarithmic axis shows of an interval that reaches zero, per mean.
const LEAST_PART: f64 = 0.05;

/// The band of `(x, mean, sd)`, cut off above zero.
fn band(rows: impl Iterator<Item = (f64, f64, f64)>) -> Vec<(f64, f64, f64)> {
    rows.map(|(x, mean, sd)| (x, (mean - SIGMAS_95 * sd).max(LEAST_PART * mean), mean + SIGMAS_95 * sd))
        .collect()
}

/// Both maps on a panel: the prior as a band, this motor as bars, and what was measured as larger dots.
fn both(
    panel: Panel,
    prior: &[(f64, f64, f64)],
    own: &[(f64, f64, f64)],
    measured: Vec<(f64, f64)>,
) -> Panel {
    let bars = own.iter().map(|(x, mean, sd)| (*x, *mean, SIGMAS_95 * sd)).collect();
    panel
        .series(
            Series::band(band(prior.iter().copied()))
                .colour(Colour::Grey)
                .label("map that it began with, 95 %"),
        )
        .series(Series::line(prior.iter().map(|(x, mean, _)| (*x, *mean)).collect()).colour(Colour::Grey))
        .series(Series::error_bars(bars).colour(Colour::Blue).label("this motor, 95 %"))
        .series(Series::points(measured).colour(Colour::Vermilion).label("measured"))
}

fn cruise_panel(mode: DriveMode, all: &[CruiseRow]) -> Panel {
    let along = f64::from(direction(mode));
    let of_mode: Vec<&CruiseRow> = all.iter().filter(|row| row.mode == format!("{mode:?}")).collect();
    let prior: Vec<(f64, f64, f64)> = of_mode
        .iter()
        .map(|row| {
            (row.amplitude.into(), along * f64::from(row.prior_rate_rad_s), row.prior_rate_sd_rad_s.into())
        })
        .collect();
    let own: Vec<(f64, f64, f64)> = of_mode
        .iter()
        .filter_map(|row| {
            Some((row.amplitude.into(), along * f64::from(row.rate_rad_s?), row.rate_sd_rad_s?.into()))
        })
        .collect();
    let measured = of_mode
        .iter()
        .filter_map(|row| Some((row.amplitude.into(), along * f64::from(row.measured_rad_s?))))
        .collect();
    let title = format!("Cruises of mode {mode:?}");
    both(Panel::new(title, Axis::new("amplitude (1)"), Axis::new("rate (rad/s)")), &prior, &own, measured)
}

fn burst_panel(family: Family, all: &[BurstRow]) -> Panel {
    let by_amplitude = matches!(family, Family::Step | Family::Nudge);
    let of_family: Vec<&BurstRow> = all.iter().filter(|row| row.family == family.name()).collect();
    let x = |row: &BurstRow| if by_amplitude { row.amplitude.into() } else { 1e-2 * f64::from(row.ticks) };
    let prior: Vec<(f64, f64, f64)> =
        of_family.iter().map(|row| (x(row), row.prior_turn_mdeg, row.prior_motors_mdeg)).collect();
    let own: Vec<(f64, f64, f64)> =
        of_family.iter().filter_map(|row| Some((x(row), row.turn_mdeg?, row.turn_sd_mdeg?))).collect();
    let measured = of_family.iter().filter_map(|row| Some((x(row), row.measured_mdeg?))).collect();
    let axis = Axis::new(if by_amplitude { "amplitude (1)" } else { "time on (ms)" }).logarithmic();
    let mut name = family.name().to_owned();
    name[..1].make_ascii_uppercase();
    let panel = Panel::new(format!("{name}s"), axis, Axis::new("turn (mdeg)").logarithmic());
    both(panel, &prior, &own, measured)
}

fn sweep_panel(motor: &CommissionedMotor) -> Panel {
    let modes = [(DriveMode::B, Colour::Blue), (DriveMode::C, Colour::Vermilion)];
    let panel = Panel::new(
        "Sweeps of the drive's frequency",
        Axis::new("drive less design (Hz)"),
        Axis::new("vertical power (mm2/s2)").logarithmic(),
    );
    let swept = motor.swept.iter().zip(&motor.commissioned.resonances);
    modes.into_iter().zip(swept).fold(panel, |panel, ((mode, colour), (points, resonance))| {
        let bars: Vec<(f64, f64, f64)> = points
            .iter()
            .map(|point| {
                let power = 1e6 * f64::from(point.power_m2_s2);
                let sd = power * motor_model::math::sqrt(f64::from(point.relative_variance));
                (f64::from(point.offset_hz), power, sd)
            })
            .collect();
        let spans = resonance
            .iter()
            .map(|found| (found.offset_hz - found.offset_sd_hz, found.offset_hz + found.offset_sd_hz));
        panel
            .series(Series::spans(spans.collect()).colour(colour))
            .series(Series::error_bars(bars).colour(colour).label(format!("mode {mode:?}, resonance shaded")))
    })
}

/// The picture.
pub(crate) fn figure(motor: &CommissionedMotor) -> Figure {
    let (cruises, bursts) = (rows::cruises(motor), rows::bursts(motor));
    let modes = [DriveMode::B, DriveMode::C];
    let figure = Figure::new("Commissioned map")
        .caption(format!(
            "{}, {:.1} s of motor time. Bars: intervals of 95 %.",
            super::name(motor),
            motor.commissioned.time_s
        ))
        .panel(sweep_panel(motor));
    let figure = modes.into_iter().fold(figure, |figure, mode| figure.panel(cruise_panel(mode, &cruises)));
    Family::ALL.into_iter().fold(figure, |figure, family| figure.panel(burst_panel(family, &bursts)))
}
