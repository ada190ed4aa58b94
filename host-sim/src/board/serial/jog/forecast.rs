//! What a response map says of a jog.
//!
//! A jog as long as a burst of the map at its level, or between two of them, turns as they do. A longer one turns as a
//! cruise: at its mean rate for as long as the drive is on, and the coast after that. Rows at either side of the level
//! are interpolated.

use controller::ResponseMap;
use controller::response_map::{Burst, Cruise, Family};
use motor_model::DriveCommand;
use serde::Serialize;

/// What a response map says of a jog.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct JogForecast {
    /// Mean turn over motors of the map's design in degrees, clockwise positive.
    pub turn_deg: f64,
    /// Its standard deviation from motor to motor, and from jog to jog, in degrees.
    pub sd_deg: f64,
}

impl JogForecast {
    /// Of a drive of `ticks`; `None` where the map has no drive of this level, or at another frequency than that of the
    /// mode.
    pub fn of(map: &ResponseMap, command: DriveCommand, ticks: u32) -> Option<Self> {
        let at_its_frequency = command.frequency_offset_hz().abs() == 0.0;
        command.mode().filter(|_| at_its_frequency)?;
        of_bursts(map, command, ticks).or_else(|| of_cruises(map, command, ticks))
    }
}

/// `part` of the way from one value to the other.
fn between(from: f32, to: f32, part: f64) -> f64 {
    f64::from(from) + part * f64::from(to - from)
}

fn of_bursts(map: &ResponseMap, command: DriveCommand, ticks: u32) -> Option<JogForecast> {
    let level = command.amplitude();
    let near = |burst: &Burst| (burst.amplitude - level).abs() < 1e-6;
    for family in Family::ALL.into_iter().filter(|family| Some(family.mode()) == command.mode()) {
        for pair in map.bursts(family).windows(2) {
            let [from, to] = pair else { continue };
            if near(from) && near(to) && from.ticks < to.ticks && (from.ticks..=to.ticks).contains(&ticks) {
                let part = f64::from(ticks - from.ticks) / f64::from(to.ticks - from.ticks);
                let turn_rad = between(from.turn_rad, to.turn_rad, part);
                let motors_rad = between(from.motors_sd_rad, to.motors_sd_rad, part);
                let repeat_rad = between(from.repeat_sd_rad, to.repeat_sd_rad, part);
                let sign = f64::from(controller::response_map::direction(family.mode()));
                return Some(JogForecast {
                    turn_deg: sign * turn_rad.to_degrees(),
                    sd_deg: motors_rad.hypot(repeat_rad).to_degrees(),
                });
            }
        }
    }
    None
}

fn of_cruises(map: &ResponseMap, command: DriveCommand, ticks: u32) -> Option<JogForecast> {
    let (mode, level) = (command.mode()?, command.amplitude());
    let holds = |pair: &&[Cruise]| pair[0].amplitude <= level && level <= pair[1].amplitude;
    let pair = map.cruises_of(mode).windows(2).find(holds)?;
    let (from, to) = (pair[0], pair[1]);
    let part = f64::from(level - from.amplitude) / f64::from(to.amplitude - from.amplitude);
    let coast_s = between(from.coast_s, to.coast_s, part);
    let time_s = 1e-9 * f64::from(ticks) * simulation::math::count::real(controller::TICK_NANOS) + coast_s;
    let rate_sd_rad = time_s * between(from.rate_sd_rad_s, to.rate_sd_rad_s, part);
    let coast_sd_rad = between(from.coast_sd_rad, to.coast_sd_rad, part);
    Some(JogForecast {
        turn_deg: (time_s * between(from.rate_rad_s, to.rate_rad_s, part)).to_degrees(),
        sd_deg: rate_sd_rad.hypot(coast_sd_rad).to_degrees(),
    })
}

#[cfg(test)]
mod tests {
    use motor_model::DriveMode;

    use super::*;

    fn of(mode: DriveMode, level: f32, ticks: u32) -> Option<JogForecast> {
        JogForecast::of(ResponseMap::table_1(), DriveCommand::try_new(mode, level).unwrap(), ticks)
    }

    /// At a row of the map the forecast is that row, and halfway between two it is halfway.
    #[test]
    fn exact_forecasts_of_rows_and_between_them() {
        let map = ResponseMap::table_1();
        let row = |level: f32| {
            let cruise =
                |cruise: &&Cruise| cruise.mode == DriveMode::B && (cruise.amplitude - level).abs() < 1e-6;
            *map.cruises().iter().find(cruise).unwrap()
        };
        let near = |found: f64, expected: f64| (found - expected).abs() < 1e-6 * expected.abs();
        let turn_deg = |cruise: Cruise, s: f64| {
            (f64::from(cruise.rate_rad_s) * (s + f64::from(cruise.coast_s))).to_degrees()
        };
        assert!(near(of(DriveMode::B, 0.5, 20_000).unwrap().turn_deg, turn_deg(row(0.5), 0.2)));
        let halfway = Cruise {
            rate_rad_s: 0.5 * (row(0.5).rate_rad_s + row(0.6).rate_rad_s),
            coast_s: 0.5 * (row(0.5).coast_s + row(0.6).coast_s),
            ..row(0.5)
        };
        let found = of(DriveMode::B, 0.55, 20_000).unwrap().turn_deg;
        // 0.55 as a single is off by 2e-8, a part in ten million of the way.
        assert!(near(found, turn_deg(halfway, 0.2)), "{found}");
        for burst in map.bursts(Family::Stride) {
            let found = of(DriveMode::C, burst.amplitude, burst.ticks).unwrap();
            assert!(near(found.turn_deg, -f64::from(burst.turn_rad).to_degrees()), "{found:?} {burst:?}");
            let sd_rad = f64::from(burst.motors_sd_rad).hypot(burst.repeat_sd_rad.into());
            assert!(near(found.sd_deg, sd_rad.to_degrees()), "{found:?} {burst:?}");
        }
    }

    /// No forecast of a level below the weakest row, nor off the mode's frequency.
    #[test]
    fn exact_what_the_map_does_not_have() {
        assert_eq!(of(DriveMode::B, 0.1, 20_000), None);
        let off = DriveCommand::full(DriveMode::B).with_frequency_offset(1.0).unwrap();
        assert_eq!(JogForecast::of(ResponseMap::table_1(), off, 20_000), None);
        assert_eq!(JogForecast::of(ResponseMap::table_1(), DriveCommand::OFF, 20_000), None);
    }
}
