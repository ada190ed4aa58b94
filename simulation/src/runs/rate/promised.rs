//! The range of rates that a response map promises, said before the run.

use std::fmt;

use controller::ResponseMap;
use motor_model::DriveMode;
use serde::Serialize;

use crate::runs::limits;
use crate::scene::{Scene, SceneError};

/// Standard deviations below the mean within which a motor may be too slow: one normal motor in 40 is slower.
const SLOW_SIGMAS: f64 = 2.0;

/// The fastest mean rate of a mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PromisedRate {
    /// Mean in deg/s, clockwise positive; 0 of a mode without cruises.
    pub mean_deg_s: f64,
    /// Its standard deviation: over the motors of the map, or as it is known of the one that was commissioned.
    pub sd_deg_s: f64,
}

/// The fastest mean rates that a map promises, at the rate that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PromisedRange {
    /// In mode B.
    pub clockwise: PromisedRate,
    /// In mode C, negative.
    pub counter_clockwise: PromisedRate,
    /// Whether the map promises what is asked for.
    pub holds: bool,
    /// Whether a motor that is slower than the mean by two standard deviations does it as well.
    pub holds_surely: bool,
}

impl PromisedRate {
    /// By `map`, at most at `amplitude_max`.
    fn of(map: &ResponseMap, mode: DriveMode, amplitude_max: f32) -> Self {
        let degrees = |rad: f32| f64::from(rad).to_degrees();
        map.strongest_cruise(mode, amplitude_max).map_or(Self { mean_deg_s: 0.0, sd_deg_s: 0.0 }, |cruise| {
            Self { mean_deg_s: degrees(cruise.rate_rad_s), sd_deg_s: degrees(cruise.rate_sd_rad_s) }
        })
    }

    /// Whether `magnitude_deg_s` is within it for a motor that is slower by `sigmas`.
    fn reaches(&self, magnitude_deg_s: f64, sigmas: f64) -> bool {
        magnitude_deg_s <= self.mean_deg_s.abs() - sigmas * self.sd_deg_s
    }
}

impl PromisedRange {
    /// What the map of `scene` promises for its rate.
    ///
    /// # Errors
    /// When the map is for another design.
    pub fn of(scene: &Scene) -> Result<Self, SceneError> {
        let both_ways = scene.choice("rate.profile") == "both_ways";
        let amplitude_max = limits::rate_tuning(scene).amplitude_max;
        Ok(Self::by(&*scene.response_map()?, amplitude_max, scene.number("rate.deg_s"), both_ways))
    }

    /// What `map` promises at up to `amplitude_max` for a rate of `rate_deg_s`, or for that and its opposite.
    fn by(map: &ResponseMap, amplitude_max: f32, rate_deg_s: f64, both_ways: bool) -> Self {
        let [clockwise, counter_clockwise] =
            [DriveMode::B, DriveMode::C].map(|mode| PromisedRate::of(map, mode, amplitude_max));
        let reached = |sigmas| {
            let forward = both_ways || rate_deg_s > 0.0;
            let back = both_ways || rate_deg_s < 0.0;
            (!forward || clockwise.reaches(rate_deg_s.abs(), sigmas))
                && (!back || counter_clockwise.reaches(rate_deg_s.abs(), sigmas))
        };
        Self { clockwise, counter_clockwise, holds: reached(0.0), holds_surely: reached(SLOW_SIGMAS) }
    }
}

impl fmt::Display for PromisedRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { clockwise, counter_clockwise, holds, holds_surely } = self;
        let beyond = match (holds, holds_surely) {
            (true, true) => "",
            (true, false) => ": not each motor of it may do what is asked for",
            (false, _) => ": what is asked for is beyond it",
        };
        write!(
            f,
            "{:+.0} +- {:.0} to {:+.0} +- {:.0} deg/s{beyond}",
            counter_clockwise.mean_deg_s,
            counter_clockwise.sd_deg_s,
            clockwise.mean_deg_s,
            clockwise.sd_deg_s
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Full drive of Table 1's map: 15.14 +- 1.183 rad/s in mode B, -1.539 +- 0.330 rad/s in mode C.
    #[test]
    fn exact_the_range_is_that_of_the_strongest_cruises() {
        let by =
            |rate_deg_s, both_ways| PromisedRange::by(ResponseMap::table_1(), 1.0, rate_deg_s, both_ways);
        let said = by(160.0, false);
        assert!((said.clockwise.mean_deg_s - 15.14_f64.to_degrees()).abs() < 0.01, "{said:?}");
        assert!((said.clockwise.sd_deg_s - 1.183_f64.to_degrees()).abs() < 0.01, "{said:?}");
        assert!((said.counter_clockwise.mean_deg_s + 1.539_f64.to_degrees()).abs() < 0.01, "{said:?}");
        assert_eq!(said.to_string(), "-88 +- 19 to +867 +- 68 deg/s");
        for (rate_deg_s, both_ways, holds, holds_surely) in [
            (0.0, false, true, true),
            (730.0, false, true, true),
            (740.0, false, true, false),
            (870.0, false, false, false),
            (-49.0, false, true, true),
            (-52.0, false, true, false),
            (-89.0, false, false, false),
            (49.0, true, true, true),
            (89.0, true, false, false),
        ] {
            let said = by(rate_deg_s, both_ways);
            assert_eq!((said.holds, said.holds_surely), (holds, holds_surely), "{rate_deg_s} {both_ways}");
        }
    }

    /// Where the amplitude is limited the map promises the rate of its second strongest cruise, and no other.
    #[test]
    fn exact_a_limited_amplitude_limits_the_range() {
        let map = ResponseMap::table_1();
        let [.., weaker, strongest] = map.cruises_of(DriveMode::B) else { panic!("cruises") };
        let between = 0.5 * (weaker.amplitude + strongest.amplitude);
        let said = PromisedRange::by(map, between, 1.0, false);
        let expected = f64::from(weaker.rate_rad_s).to_degrees();
        assert!((said.clockwise.mean_deg_s - expected).abs() < 1e-9, "{said:?} {expected}");
        assert!(weaker.rate_rad_s < strongest.rate_rad_s);
    }

    /// A motor whose mode B is dead has no rows of it: no rate clockwise is promised.
    #[test]
    fn exact_a_mode_without_cruises_promises_nothing() {
        let table_1 = ResponseMap::table_1();
        let cruises = table_1.cruises_of(DriveMode::C);
        let none = [&[][..]; controller::response_map::Family::ALL.len()];
        let map = ResponseMap::try_new(*table_1.design(), cruises, none, 0.0).unwrap();
        let said = PromisedRange::by(&map, 1.0, 1.0, false);
        assert!(!said.holds, "{said:?}");
        assert_eq!(said.to_string(), "-88 +- 19 to +0 +- 0 deg/s: what is asked for is beyond it");
    }
}
