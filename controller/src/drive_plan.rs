//! What to drive next, from what remains and how well that is known.
//!
//! ```text
//!  remaining, clockwise positive
//!   > 2 deg              cruise B, weaker as it comes near, cut at the coast
//!   > 0                  throw, or nudge: somewhat beyond the target, since the way back is fine and the way on is not
//!   0                    --- the target is reached from above ---
//!   > -0.11 deg          step, or walk
//!   > -0.15 deg          stride
//!   below                cruise C, weaker as it comes near, cut at the coast
//! ```
//!
//! A burst is due when measuring on would no longer improve it: when the angle is known as well as the burst can be foreseen. The last step is due only when the angle is
//! known well enough to call the target reached after it; until then steps stop short of the target by [`SHORT`] standard deviations of what is still to be
//! learnt, so that it asks for another step and not for a nudge, which would spoil the measurement.

use motor_model::{DriveMode, math};

use crate::map_correction::{Forecast, MapCorrection};
use crate::response_map::{Burst, Cruise, Family, cruise_within, strongest_cruise};

/// What remains, how well it is known, and how well it must be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Situation {
    /// Target less angle in rad, clockwise positive.
    pub remaining_rad: f32,
    /// Standard deviation of that in rad.
    pub sigma_rad: f32,
    /// Distance that counts as reached, in rad.
    pub tolerance_rad: f32,
    /// How sure it must be.
    pub confidence: Confidence,
    /// Strongest drive.
    pub amplitude_max: f32,
}

/// How sure it must be that the rotor lies within the tolerance, as quantiles of a normal error.
///
/// With the target `r` away and known to `s`, the error's tails beyond the tolerance `t` on either side weigh together
///
/// ```text
/// risk = Q((t - r) / s) + Q((t + r) / s),      Q(x): weight of the normal tail beyond x
/// ```
///
/// Off target one tail is all of it, on target both are the same. So `risk <= p` where `|r| + z1 s <= t` and `z2 s <= t`, with `Q(z1) = p` and `Q(z2) = p / 2`: where the two meet, a seventh of `t` off target, the risk is a quarter more.
/// A rule for the root mean square error, `r^2 + s^2`, would wait too long off target, where only one side counts, or not long enough on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Confidence {
    /// `z1`.
    pub one_sided: f32,
    /// `z2`.
    pub two_sided: f32,
}

impl Default for Confidence {
    /// A risk of 3.6 %.
    fn default() -> Self {
        Self { one_sided: 1.8, two_sided: 2.1 }
    }
}

/// The next drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DrivePlan {
    /// On until the coast remains.
    Cruise(Cruise),
    /// On for so many ticks.
    Burst(Family, Burst, Forecast),
}

const fn degrees(deg: f32) -> f32 {
    deg * (core::f32::consts::PI / 180.0)
}

/// Clockwise from here on a cruise: the gentlest that is of use coasts for a degree.
const CRUISE_B_RAD: f32 = degrees(2.0);
/// Counter-clockwise from here on a cruise.
const CRUISE_C_RAD: f32 = degrees(0.15);
/// Counter-clockwise from here on strides.
const STRIDE_RAD: f32 = degrees(0.11);
/// A clockwise burst that need not end within the tolerance ends at least this far beyond the target: room for two steps.
const BEYOND_RAD: f32 = degrees(1.5e-3);
/// A step that is not the last stays so many standard deviations short of the target.
const SHORT: f32 = 1.4;
/// Nor is it worth its noise unless it leads over this part of what remains.
const WORTH_IT: f32 = 0.45;
/// Clockwise bursts are not worth their noise unless so many standard deviations ask for them: beyond that the target lies behind for certain enough that
/// measuring on would only put the burst off.
const SURE: f32 = 1.2;

impl Situation {
    /// Whether the target counts as reached: see [`Confidence`].
    pub fn reached(&self) -> bool {
        let Self { remaining_rad, sigma_rad, confidence, tolerance_rad, .. } = *self;
        remaining_rad.abs() + confidence.one_sided * sigma_rad <= tolerance_rad
            && confidence.two_sided * sigma_rad <= tolerance_rad
    }

    /// Standard deviation at which a rotor on target counts as there, in rad, with some to spare for a last step.
    pub(crate) fn sigma_enough_rad(&self) -> f32 {
        0.95 * self.tolerance_rad / self.confidence.two_sided
    }

    /// Whether so little has been measured that it may be spoilt.
    fn early(&self) -> bool {
        (1.2..4.0).contains(&(self.sigma_rad / self.tolerance_rad))
    }

    /// The next drive; `None` to measure on.
    pub fn plan(&self, correction: &MapCorrection) -> Option<DrivePlan> {
        if self.reached() {
            None
        } else if self.remaining_rad > if self.early() { -0.5 * self.sigma_rad } else { 0.0 } {
            self.clockwise(correction)
        } else {
            self.counter_clockwise(correction)
        }
    }

    fn clockwise(&self, correction: &MapCorrection) -> Option<DrivePlan> {
        let remaining_rad = self.remaining_rad;
        if remaining_rad >= CRUISE_B_RAD
            && let Some(cruise) = self.cruise(correction, DriveMode::B)
        {
            return Some(DrivePlan::Cruise(cruise));
        }
        // A nudge spoils the measurement: early on that is no loss, later it must be for certain, or because measuring on could not end well.
        let hopeless = self.sigma_rad <= 0.7 * self.sigma_enough_rad();
        let likely = remaining_rad >= (SURE * self.sigma_rad).max(0.35 * self.tolerance_rad);
        if !likely && !hopeless && !self.early() {
            return None;
        }
        let spread_rad = remaining_rad * correction.spread(Family::Throw);
        let aim_rad = if remaining_rad > BEYOND_RAD && spread_rad < 0.5 * self.tolerance_rad {
            remaining_rad
        } else {
            remaining_rad + (0.5 * spread_rad).max(BEYOND_RAD)
        };
        let nudges = self.longest_rad(correction, Family::Nudge).is_some_and(|longest| aim_rad < longest);
        let plan = self.burst(correction, if nudges { Family::Nudge } else { Family::Throw }, aim_rad)?;
        self.due(plan)
    }

    fn cruise(&self, correction: &MapCorrection, mode: DriveMode) -> Option<Cruise> {
        // A motor of half the rate coasts half as far: to it twice as much remains.
        cruise_within(mode, self.amplitude_max, self.remaining_rad.abs() / correction.rate_scale(mode))
            .or_else(|| strongest_cruise(mode, self.amplitude_max))
    }

    fn counter_clockwise(&self, correction: &MapCorrection) -> Option<DrivePlan> {
        let remaining_rad = -self.remaining_rad;
        if remaining_rad >= CRUISE_C_RAD
            && let Some(cruise) = self.cruise(correction, DriveMode::C)
        {
            return Some(DrivePlan::Cruise(cruise));
        }
        if remaining_rad >= STRIDE_RAD && self.amplitude_max >= 1.0 {
            let aim_rad = remaining_rad / (1.0 + 1.3 * correction.spread(Family::Stride));
            return self.due(self.burst(correction, Family::Stride, aim_rad)?);
        }
        if self.longest_rad(correction, Family::Step).is_some_and(|longest| remaining_rad < 0.9 * longest) {
            return self.step(correction, remaining_rad);
        }
        let short_rad = 1.5 * (remaining_rad * correction.spread(Family::Walk) + self.sigma_rad);
        let plan = self.burst(correction, Family::Walk, remaining_rad - short_rad)?;
        (self.sigma_rad <= 0.15 * remaining_rad).then_some(plan)
    }

    fn step(&self, correction: &MapCorrection, remaining_rad: f32) -> Option<DrivePlan> {
        let last = self.sigma_rad <= self.sigma_enough_rad() || self.ends_with(correction, remaining_rad);
        let aim_rad = if last {
            remaining_rad
        } else {
            let spread_rad = remaining_rad * correction.spread(Family::Step);
            // By how much measuring on will still move the estimate: what it does not know at the end it does not learn.
            let enough_rad = self.sigma_enough_rad();
            let learnt_rad2 = self.sigma_rad * self.sigma_rad - enough_rad * enough_rad;
            remaining_rad - SHORT * math::sqrt_f32(learnt_rad2 + spread_rad * spread_rad)
        };
        let (shortest, _) = Family::Step.range_rad(self.amplitude_max)?;
        // Half the shortest step would still be nearer, but what remains is then within any tolerance.
        if aim_rad < shortest * correction.scale(Family::Step) {
            return None;
        }
        let worth_it = last || aim_rad >= WORTH_IT * remaining_rad;
        worth_it.then(|| self.burst(correction, Family::Step, aim_rad))?
    }

    /// Whether the target would count as reached after a step of `aim_rad`, without another measurement.
    fn ends_with(&self, correction: &MapCorrection, aim_rad: f32) -> bool {
        let Some(DrivePlan::Burst(_, _, forecast)) = self.burst(correction, Family::Step, aim_rad) else {
            return false;
        };
        let after = Self {
            remaining_rad: aim_rad - forecast.turn_rad,
            sigma_rad: math::sqrt_f32(self.sigma_rad * self.sigma_rad + forecast.turn_rad2),
            ..*self
        };
        after.reached()
    }

    /// The burst of `family` that turns this motor by `aim_rad`, as near as may be.
    fn burst(&self, correction: &MapCorrection, family: Family, aim_rad: f32) -> Option<DrivePlan> {
        let burst = family.burst(aim_rad / correction.scale(family), self.amplitude_max)?;
        Some(DrivePlan::Burst(family, burst, correction.forecast(family, &burst)))
    }

    fn longest_rad(&self, correction: &MapCorrection, family: Family) -> Option<f32> {
        family.range_rad(self.amplitude_max).map(|(_, longest)| longest * correction.scale(family))
    }

    /// `plan`, once the angle is known half as well as its burst can be foreseen.
    fn due(&self, plan: DrivePlan) -> Option<DrivePlan> {
        let DrivePlan::Burst(_, _, forecast) = plan else { return Some(plan) };
        let known = 4.0 * self.sigma_rad * self.sigma_rad <= forecast.turn_rad2;
        (known || self.sigma_rad <= self.sigma_enough_rad()).then_some(plan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn situation(remaining_mdeg: f32, sigma_mdeg: f32) -> Situation {
        Situation {
            remaining_rad: degrees(1e-3 * remaining_mdeg),
            sigma_rad: degrees(1e-3 * sigma_mdeg),
            tolerance_rad: degrees(0.5e-3),
            confidence: Confidence { one_sided: 1.7, two_sided: 2.0 },
            amplitude_max: 1.0,
        }
    }

    fn family(remaining_mdeg: f32, sigma_mdeg: f32) -> Option<Family> {
        match situation(remaining_mdeg, sigma_mdeg).plan(&MapCorrection::default()) {
            Some(DrivePlan::Burst(family, ..)) => Some(family),
            _ => None,
        }
    }

    #[test]
    fn exact_what_is_driven_for_which_distance() {
        for (remaining_mdeg, expected) in [
            (1500.0, Family::Throw),
            (8.0, Family::Nudge),
            (-4.0, Family::Step),
            (-40.0, Family::Walk),
            (-130.0, Family::Stride),
        ] {
            assert_eq!(family(remaining_mdeg, 0.2), Some(expected), "{remaining_mdeg}");
        }
        for (remaining_mdeg, mode) in
            [(90e3, DriveMode::B), (2.5e3, DriveMode::B), (-90e3, DriveMode::C), (-500.0, DriveMode::C)]
        {
            let Some(DrivePlan::Cruise(cruise)) =
                situation(remaining_mdeg, 5.0).plan(&MapCorrection::default())
            else {
                panic!("{remaining_mdeg}");
            };
            assert_eq!(cruise.mode, mode);
        }
    }

    #[test]
    fn law_reached_means_error_and_uncertainty_within_the_tolerance() {
        for (remaining_mdeg, sigma_mdeg, reached) in
            [(0.0, 0.249, true), (0.0, 0.251, false), (0.2, 0.176, true), (-0.2, 0.177, false)]
        {
            assert_eq!(situation(remaining_mdeg, sigma_mdeg).reached(), reached);
        }
    }

    /// The rule against the normal law itself, from libm's error function: at its border the risk is the one that is asked for, or up to a quarter
    /// more.
    #[test]
    fn dual_reached_bounds_the_risk() {
        let tail = |x: f64| 0.5 * libm::erfc(x * core::f64::consts::FRAC_1_SQRT_2);
        let confidence = Confidence::default();
        let asked = tail(f64::from(confidence.one_sided));
        assert!((2.0 * tail(f64::from(confidence.two_sided)) / asked - 1.0).abs() < 0.01);
        for percent in 0..100_u16 {
            let off = f64::from(percent) / 100.0;
            let reached = |sigma: f64| {
                let [remaining_mdeg, sigma_mdeg] = [off, sigma].map(|of| 0.5 * of as f32);
                Situation { confidence, ..situation(remaining_mdeg, sigma_mdeg) }.reached()
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..40 {
                let middle = 0.5 * (low + high);
                if reached(middle) { low = middle } else { high = middle }
            }
            let risk = tail((1.0 - off) / low) + tail((1.0 + off) / low);
            assert!((0.99 * asked..1.25 * asked).contains(&risk), "{off}: {risk} for {asked}");
        }
    }

    /// The sure last step goes to the target; one before stays short of it, and an unsure one waits.
    #[test]
    fn law_steps_stay_on_the_fine_side() {
        let correction = MapCorrection::default();
        let turn_mdeg = |sigma_mdeg| match situation(-2.0, sigma_mdeg).plan(&correction) {
            Some(DrivePlan::Burst(Family::Step, _, forecast)) => 1e3 * forecast.turn_rad.to_degrees(),
            _ => 0.0,
        };
        assert!((turn_mdeg(0.2) - 2.0).abs() < 1e-3);
        // Of 0.4 milli-degrees all but 0.2375, 0.95 of the tolerance over z2, are still to be learnt; and the step has a spread of its own.
        let spread_mdeg = 2.0 * correction.spread(Family::Step);
        let expected_mdeg = 2.0 - SHORT * (0.4_f32.powi(2) - 0.2375_f32.powi(2) + spread_mdeg.powi(2)).sqrt();
        assert!((turn_mdeg(0.4) - expected_mdeg).abs() < 1e-3, "{} {expected_mdeg}", turn_mdeg(0.4));
        assert!(turn_mdeg(1.0).abs() < f32::EPSILON);
    }

    /// Clockwise bursts overshoot on purpose; a doubtful little way clockwise is measured, not driven.
    #[test]
    fn law_clockwise_bursts_go_beyond_and_need_certainty() {
        let correction = MapCorrection::default();
        for remaining_mdeg in [0.6, 3.0, 30.0, 300.0, 1900.0] {
            let Some(DrivePlan::Burst(_, _, forecast)) = situation(remaining_mdeg, 0.2).plan(&correction)
            else {
                panic!("{remaining_mdeg}");
            };
            assert!(forecast.turn_rad > degrees(1e-3 * remaining_mdeg), "{remaining_mdeg} {forecast:?}");
        }
        assert_eq!(family(0.4, 0.5), None);
        assert_eq!(family(0.8, 0.5), Some(Family::Nudge));
    }

    /// A motor of a quarter of the map's rate coasts a quarter as far: it is driven as one of the map is four times as far from its target.
    #[test]
    fn law_a_slow_motor_eases_off_later() {
        let mut slow = MapCorrection::default();
        let full = strongest_cruise(DriveMode::B, 1.0).unwrap();
        (0..50).for_each(|_| slow.learn_rate(&full, 0.25 * full.rate_rad_s));
        let amplitude = |remaining_mdeg, correction: &MapCorrection| {
            let plan = situation(remaining_mdeg, 5.0).plan(correction);
            let Some(DrivePlan::Cruise(cruise)) = plan else { panic!("{remaining_mdeg}") };
            cruise.amplitude
        };
        let map = MapCorrection::default();
        let stronger = [3e3, 5e3, 10e3, 20e3].map(|remaining_mdeg| {
            let of_slow = amplitude(remaining_mdeg, &slow);
            assert!((of_slow - amplitude(4.0 * remaining_mdeg, &map)).abs() < 1e-6, "{remaining_mdeg}");
            of_slow > amplitude(remaining_mdeg, &map)
        });
        assert!(stronger.contains(&true));
    }

    /// A weaker amplifier has other bursts, never stronger ones.
    #[test]
    fn law_nothing_exceeds_the_amplitude_allowed() {
        let correction = MapCorrection::default();
        for amplitude_max in [0.02, 0.3, 0.45, 0.9] {
            for exponent in 0..60 {
                let magnitude = 0.1 * 1.3_f32.powi(exponent);
                for remaining_mdeg in [magnitude, -magnitude] {
                    let limited = Situation { amplitude_max, ..situation(remaining_mdeg, 0.01) };
                    let amplitude = match limited.plan(&correction) {
                        Some(DrivePlan::Burst(_, burst, _)) => burst.amplitude,
                        Some(DrivePlan::Cruise(cruise)) => cruise.amplitude,
                        None => 0.0,
                    };
                    assert!(amplitude <= amplitude_max, "{amplitude_max} {remaining_mdeg} {amplitude}");
                }
            }
        }
    }
}
