//! The rows of the commissioned map beside those of the map that it began with.

use controller::ResponseMap;
use controller::response_map::{Burst, Cruise, Family};
use motor_model::DriveMode;
use serde::Serialize;
use simulation::runs::commission::CommissionedMotor;

/// A cruise in both maps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct CruiseRow {
    /// "B" or "C".
    pub mode: String,
    /// Drive amplitude.
    pub amplitude: f32,
    /// Rate in the map that it began with, clockwise positive.
    pub prior_rate_rad_s: f32,
    /// Its standard deviation over motors.
    pub prior_rate_sd_rad_s: f32,
    /// Mean of what was measured of it; `null` of nothing.
    pub measured_rad_s: Option<f32>,
    /// Rate of this motor; `null` where the row was left out.
    pub rate_rad_s: Option<f32>,
    /// How well it is known.
    pub rate_sd_rad_s: Option<f32>,
    /// Coast per rate at the cut.
    pub coast_s: Option<f32>,
    /// Its standard deviation.
    pub coast_sd_rad: Option<f32>,
    /// Windows of 50 ms that were measured.
    pub windows: u16,
    /// Those that went backwards.
    pub backward: u16,
    /// Mean time from the end of the drive until rest; `null` where it was not measured.
    pub to_rest_s: Option<f32>,
}

/// A burst in both maps.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct BurstRow {
    /// Its family.
    pub family: &'static str,
    /// Drive amplitude.
    pub amplitude: f32,
    /// Ticks of 10 us with the drive on.
    pub ticks: u32,
    /// Turn in the map that it began with, in the direction of its mode.
    pub prior_turn_mdeg: f64,
    /// Its standard deviation over motors.
    pub prior_motors_mdeg: f64,
    /// Mean of what was measured of it; `null` of nothing.
    pub measured_mdeg: Option<f64>,
    /// Turn of this motor; `null` where the row was left out.
    pub turn_mdeg: Option<f64>,
    /// How well it is known.
    pub turn_sd_mdeg: Option<f64>,
    /// Standard deviation from burst to burst.
    pub repeat_sd_mdeg: Option<f64>,
    /// Trains that were measured.
    pub trains: u16,
    /// Mean time from the end of the drive until rest; `null` where it was not measured.
    pub to_rest_s: Option<f32>,
}

fn millidegrees(rad: f32) -> f64 {
    1e3 * f64::from(rad).to_degrees()
}

/// The cruise of `map` with the drive of `cruise`.
fn same_cruise<'a>(map: &'a ResponseMap, cruise: &Cruise) -> Option<&'a Cruise> {
    let alike =
        |own: &&Cruise| own.mode == cruise.mode && own.amplitude.to_bits() == cruise.amplitude.to_bits();
    map.cruises().iter().find(alike)
}

/// The burst of `map` with the drive of `burst`.
fn same_burst<'a>(map: &'a ResponseMap, family: Family, burst: &Burst) -> Option<&'a Burst> {
    let alike =
        |own: &&Burst| own.ticks == burst.ticks && own.amplitude.to_bits() == burst.amplitude.to_bits();
    map.bursts(family).iter().find(alike)
}

/// The cruises of both maps.
pub(crate) fn cruises(motor: &CommissionedMotor) -> Vec<CruiseRow> {
    let map = motor.commissioned.map.ok();
    let row = |(index, prior): (usize, &Cruise)| {
        let own = map.as_ref().and_then(|map| same_cruise(map, prior));
        let found = motor.commissioned.evidence.cruise(index);
        CruiseRow {
            mode: format!("{:?}", prior.mode),
            amplitude: prior.amplitude,
            prior_rate_rad_s: prior.rate_rad_s,
            prior_rate_sd_rad_s: prior.rate_sd_rad_s,
            measured_rad_s: (found.windows.count() > 0).then(|| prior.rate_rad_s * found.windows.mean()),
            rate_rad_s: own.map(|own| own.rate_rad_s),
            rate_sd_rad_s: own.map(|own| own.rate_sd_rad_s),
            coast_s: own.map(|own| own.coast_s),
            coast_sd_rad: own.map(|own| own.coast_sd_rad),
            windows: found.windows.count(),
            backward: found.backward,
            to_rest_s: (found.to_rest_s.count() > 0).then(|| found.to_rest_s.mean()),
        }
    };
    motor.prior.cruises().iter().enumerate().map(row).collect()
}

/// The bursts of both maps.
pub(crate) fn bursts(motor: &CommissionedMotor) -> Vec<BurstRow> {
    let map = motor.commissioned.map.ok();
    let row = |family: Family, index: usize, prior: &Burst| {
        let own = map.as_ref().and_then(|map| same_burst(map, family, prior));
        let found = motor.commissioned.evidence.burst(family, index);
        BurstRow {
            family: family.name(),
            amplitude: prior.amplitude,
            ticks: prior.ticks,
            prior_turn_mdeg: millidegrees(prior.turn_rad),
            prior_motors_mdeg: millidegrees(prior.motors_sd_rad),
            measured_mdeg: (found.turns.count() > 0)
                .then(|| millidegrees(prior.turn_rad * found.turns.mean())),
            turn_mdeg: own.map(|own| millidegrees(own.turn_rad)),
            turn_sd_mdeg: own.map(|own| millidegrees(own.motors_sd_rad)),
            repeat_sd_mdeg: own.map(|own| millidegrees(own.repeat_sd_rad)),
            trains: found.turns.count(),
            to_rest_s: (found.to_rest_s.count() > 0).then(|| found.to_rest_s.mean()),
        }
    };
    let of_family = |family| {
        let bursts = motor.prior.bursts(family).iter().enumerate();
        bursts.map(move |(index, burst)| row(family, index, burst))
    };
    Family::ALL.into_iter().flat_map(of_family).collect()
}

/// What was found of a resonance, beside the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ResonanceRow {
    /// "B" or "C".
    pub mode: String,
    /// Frequency of the design.
    pub design_hz: f64,
    /// Frequency found; `null` where the sweep shows none.
    pub found_hz: Option<f64>,
    /// Its standard deviation: of the fit, and of the pull by the rotor.
    pub sd_hz: Option<f64>,
    /// Frequency at which the map drives the mode: that found, where it is not the design's beyond doubt.
    pub drive_hz: f64,
    /// The part of the fit.
    pub fit_sd_hz: Option<f64>,
    /// Half width of the curve at half power.
    pub half_width_hz: Option<f64>,
    /// Chi-square per degree of freedom of the curve.
    pub reduced_chi_square: Option<f64>,
    /// Whether the curve fits, at a probability of 1 %.
    pub fits: Option<bool>,
    /// The true motor's, which only the simulation knows; `null` without one.
    pub true_hz: Option<f64>,
}

/// The resonances of modes B and C.
pub(crate) fn resonances(motor: &CommissionedMotor) -> Vec<ResonanceRow> {
    let modes = [DriveMode::B, DriveMode::C].into_iter();
    let true_hz = motor.true_resonances_hz.map_or([None; 2], |hz| hz.map(Some));
    let hz = motor.design_resonances_hz.into_iter().zip(true_hz);
    let found = motor.commissioned.resonances.into_iter();
    let row = |((mode, (design_hz, true_hz)), found): ((DriveMode, (f64, Option<f64>)), Option<_>)| {
        let found: Option<controller::commissioning::resonance::Resonance> = found;
        ResonanceRow {
            mode: format!("{mode:?}"),
            design_hz,
            found_hz: found.map(|found| design_hz + found.offset_hz),
            sd_hz: found.map(|found| found.offset_sd_hz),
            drive_hz: design_hz
                + found.and_then(|found| found.beyond_doubt()).map_or(0.0, |found| found.hz.into()),
            fit_sd_hz: found.map(|found| found.fit_sd_hz),
            half_width_hz: found.map(|found| found.half_width_hz),
            reduced_chi_square: found.map(|found| found.reduced_chi_square),
            fits: found.map(|found| found.fits),
            true_hz,
        }
    };
    modes.zip(hz).zip(found).map(row).collect()
}
