//! What to drive next, from what remains and how well that is known.
//!
//! ```text
//!  remaining, clockwise positive
//!   > 2 deg              cruise B, weaker near the target, cut when the coast remains
//!   > 0                  throw or nudge, aimed a little beyond the target
//!   0                    --- the target ---
//!   > -0.11 deg          step, or walk
//!   > -0.15 deg          stride
//!   below                cruise C, weaker near the target, cut when the coast remains
//! ```
//!
//! The distances are those of Table 1's map; another map has its own ([`crate::ResponseMap::cruise_from_rad`]).
//!
//! Mode C has bursts that one motor repeats to a percent, mode B has none ([`crate::response_map`]). So the last
//! approach is always counter-clockwise, and clockwise bursts end beyond the target.
//!
//! A cruise is cut by prediction from the last frame. Where the frames come too slowly, or too late, for that, the
//! rotor goes by throws and strides instead, from rest to rest, with a look after each: their turn is known beforehand,
//! whatever the frames show meanwhile, and far below half a turn, so that no turn is lost
//! ([`frames_follow`]).
//!
//! A burst is due when measuring on would not improve it: when the angle is known as well as the burst can be
//! forecast, or when even the longest burst ends short of the target. The last step is due only when the angle is known
//! well enough to call the target reached after it. Steps before it stop short of the target by some standard
//! deviations of what is still to be measured, so that the next correction is again a step and not a nudge, whose
//! spread would spoil the measurement.
//!
//! # A tolerance below the shortest step
//!
//! The shortest step of Table 1's motors turns by 0.14 milli-degrees. A rotor that is nearer to the target than this
//! cannot be brought there by a step, and within a fine tolerance not by measuring on. So steps before the last leave
//! room for one. Where less is left, `r`, than the shortest step `u`, and more than measuring on could leave:
//!
//! ```text
//! r > u / 2      the shortest step: what is left beyond the target is less
//! else           a clockwise burst, and the approach begins again
//! ```
//!
//! # Where the constants come from
//!
//! `map`: from the distances in [`crate::response_map`]. `trials`: chosen, together and not one by one, for small
//! final errors and short settling of `host-sim positioning-trials` over 1000 motors drawn like those of the map.
//! `assumption`: a rule of thumb whose effect was not measured on its own. Motors that differ from the drawn ones may
//! want others.

use motor_model::{DriveMode, math};

use crate::map_correction::{Forecast, MotorResponse};
use crate::response_map::{Burst, Cruise, Family};
use crate::situation::Situation;

/// The next drive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DrivePlan {
    /// On until the coast remains.
    Cruise(Cruise),
    /// On for the burst's ticks, with its forecast.
    Burst(Family, Burst, Forecast),
}

const fn degrees(deg: f32) -> f32 {
    deg * (core::f32::consts::PI / 180.0)
}

/// Part of its rate by which the rate of a cruise fluctuates: 4.4 of 15 rad/s in mode B, 0.54 of 1.5 in mode C.
/// From the model, see [`estimator::ConstantRate`].
const RATE_FLUCTUATION: f32 = 0.3;
/// An angle at the cut that is known to this standard deviation in rad is known well enough. Assumption.
const CUT_RAD: f32 = degrees(0.5);

/// Standard deviation, per tolerance, between which so little has been measured that a nudge spoils nothing. Trials.
const EARLY_TOLERANCES: core::ops::Range<f32> = 1.2..4.0;
/// Standard deviations by which the target may seem to lie behind, early on, and still be approached clockwise. Trials.
const EARLY_BEHIND_SIGMAS: f32 = 0.5;

/// Least distance in rad by which a clockwise burst is aimed beyond the target: room for two steps. Map, and trials.
const BEYOND_RAD: f32 = degrees(1.5e-3);
/// The same in shortest steps, where the approach begins again for want of a step that is short enough. Assumption.
const SHORTEST_BEYOND: f32 = 2.0;
/// The same in spreads of the burst. Trials.
const BEYOND_SPREADS: f32 = 0.5;
/// A clockwise burst whose spread is below this part of the tolerance is aimed at the target itself. Assumption.
const FINE_SPREAD_PART: f32 = 0.5;
/// Standard deviations that must remain clockwise before a burst is driven there. Beyond them the target lies behind
/// for certain enough that measuring on would only put the burst off. Trials.
const NUDGE_SIGMAS: f32 = 1.2;
/// Part of the tolerance that must remain for the same. Trials.
const NUDGE_TOLERANCES: f32 = 0.35;

/// Spreads by which a stride stops short. Trials.
const STRIDE_SHORT_SPREADS: f32 = 1.3;
/// Part of the longest step within which steps are driven, not walks. Assumption.
const STEP_RANGE_PART: f32 = 0.9;
/// Standard deviations, of the angle and of the walk, by which a walk stops short. Trials.
const WALK_SHORT_SIGMAS: f32 = 1.5;
/// Standard deviation per distance below which a walk is due. Trials.
const WALK_KNOWN_PART: f32 = 0.15;
/// Standard deviations of what is still to be measured by which a step that is not the last stops short. Trials.
const STEP_SHORT_SIGMAS: f32 = 1.4;
/// Such a step is driven only if it turns by this part of what remains: else it is not worth its noise. Trials.
const STEP_PART_MIN: f32 = 0.45;
/// Where the shortest step is longer than what measuring on could leave, the same standard deviations that remain
/// beyond it, so that the last step can be as long as what remains. Assumption.
const STEP_ROOM_SIGMAS: f32 = 1.0;
/// A burst is due when its variance is so many times that of the angle: the standard deviation of the angle is at most
/// half of the burst's. Assumption.
const DUE_VARIANCES: f32 = 4.0;
/// Standard deviations, of the angle and of the burst, that remain to the target after a burst that ends short of it
/// for certain. An assumption.
const SHORT_SIGMAS: f32 = 3.0;

/// Whether frames come soon enough to cut `cruise` by: what its rate fluctuates until the next frame is there, after
/// `frame_wait_s`, must not exceed the spread of its coast, or half a degree.
pub fn frames_follow(cruise: &Cruise, frame_wait_s: f32) -> bool {
    RATE_FLUCTUATION * cruise.rate_rad_s.abs() * frame_wait_s <= cruise.coast_sd_rad.max(CUT_RAD)
}

impl Situation {
    /// Whether so little has been measured that it may be spoilt.
    fn early(&self) -> bool {
        EARLY_TOLERANCES.contains(&(self.sigma_rad / self.tolerance_rad))
    }

    /// The next drive for a motor of that response; `None` to measure on. Unless the stator `is_quiet`, no burst is due
    /// ([`crate::ring_down`]), nor is one planned: that is much work for a tick.
    pub fn plan(&self, motor: MotorResponse<'_>, is_quiet: bool) -> Option<DrivePlan> {
        if self.reached() {
            None
        } else if let Some(cruise) = self.cruise(motor) {
            Some(DrivePlan::Cruise(cruise))
        } else if !is_quiet {
            None
        } else if self.remaining_rad > if self.early() { -EARLY_BEHIND_SIGMAS * self.sigma_rad } else { 0.0 }
        {
            self.clockwise(motor)
        } else {
            self.counter_clockwise(motor)
        }
    }

    fn clockwise(&self, motor: MotorResponse<'_>) -> Option<DrivePlan> {
        let remaining_rad = self.remaining_rad;
        // A nudge spoils the measurement. Early on that is no loss. Later the target must lie clockwise for certain, or
        // measuring on must be of no use.
        let certain =
            remaining_rad >= (NUDGE_SIGMAS * self.sigma_rad).max(NUDGE_TOLERANCES * self.tolerance_rad);
        if !certain && !self.measured_out() && !self.early() {
            return None;
        }
        let spread_rad = remaining_rad * motor.spread(Family::Throw);
        let aim_rad = if remaining_rad > BEYOND_RAD && spread_rad < FINE_SPREAD_PART * self.tolerance_rad {
            remaining_rad
        } else {
            remaining_rad + (BEYOND_SPREADS * spread_rad).max(BEYOND_RAD)
        };
        self.due(self.clockwise_burst(motor, aim_rad)?)
    }

    /// The burst of mode B that turns this motor by `aim_rad`: a nudge, or a throw beyond the longest.
    fn clockwise_burst(&self, motor: MotorResponse<'_>, aim_rad: f32) -> Option<DrivePlan> {
        let nudges = self.longest_rad(motor, Family::Nudge).is_some_and(|longest| aim_rad < longest);
        let [first, other] =
            if nudges { [Family::Nudge, Family::Throw] } else { [Family::Throw, Family::Nudge] };
        // A map, or a limit of the amplitude, may leave no throw: then the longest nudge has to do, again and again.
        self.burst(motor, first, aim_rad).or_else(|| self.burst(motor, other, aim_rad))
    }

    /// The cruise that is due for a motor of that response; `None` near the target, and where bursts take its place.
    fn cruise(&self, motor: MotorResponse<'_>) -> Option<Cruise> {
        let mode = if self.remaining_rad > 0.0 { DriveMode::B } else { DriveMode::C };
        if self.remaining_rad.abs() < motor.map.cruise_from_rad(mode) {
            return None;
        }
        motor
            .cruise_within(mode, self.amplitude_max, self.remaining_rad.abs())
            .or_else(|| motor.map.strongest_cruise(mode, self.amplitude_max))
            .filter(|cruise| frames_follow(cruise, self.frame_wait_s) || !self.has_coarse_bursts(motor, mode))
    }

    /// Whether there are bursts of `mode` that take the place of its cruises.
    fn has_coarse_bursts(&self, motor: MotorResponse<'_>, mode: DriveMode) -> bool {
        let coarse = match mode {
            DriveMode::B => Family::Throw,
            DriveMode::C => Family::Stride,
        };
        motor.map.range_rad(coarse, self.amplitude_max).is_some()
    }

    fn counter_clockwise(&self, motor: MotorResponse<'_>) -> Option<DrivePlan> {
        let remaining_rad = -self.remaining_rad;
        if remaining_rad >= self.stride_from_rad(motor) && self.amplitude_max >= 1.0 {
            let aim_rad = remaining_rad / (1.0 + STRIDE_SHORT_SPREADS * motor.spread(Family::Stride));
            return self.due(self.burst(motor, Family::Stride, aim_rad)?);
        }
        if self
            .longest_rad(motor, Family::Step)
            .is_some_and(|longest| remaining_rad < STEP_RANGE_PART * longest)
        {
            return self.step(motor, remaining_rad);
        }
        let short_rad = WALK_SHORT_SIGMAS * (remaining_rad * motor.spread(Family::Walk) + self.sigma_rad);
        if self.sigma_rad <= WALK_KNOWN_PART * remaining_rad {
            self.burst(motor, Family::Walk, remaining_rad - short_rad)
        } else if self.measured_out() {
            // The tolerance is wide beside the steps: measuring on says no more.
            self.burst(motor, Family::Walk, remaining_rad)
        } else {
            None
        }
    }

    /// Distance in rad from which a stride is driven: in a map without walks from where the steps end.
    fn stride_from_rad(&self, motor: MotorResponse<'_>) -> f32 {
        if motor.map.bursts(Family::Walk).is_empty() {
            self.longest_rad(motor, Family::Step).map_or(0.0, |longest| STEP_RANGE_PART * longest)
        } else {
            motor.map.stride_from_rad()
        }
    }

    fn step(&self, motor: MotorResponse<'_>, remaining_rad: f32) -> Option<DrivePlan> {
        let (shortest, _) = motor.map.range_rad(Family::Step, self.amplitude_max)?;
        let shortest_rad = shortest * motor.correction.scale(Family::Step);
        let is_coarse = shortest_rad > self.reach_rad();
        let last = self.sigma_rad <= self.sigma_enough_rad() || self.reached_after_step(motor, remaining_rad);
        let aim_rad = if last {
            remaining_rad
        } else {
            let spread_rad = remaining_rad * motor.spread(Family::Step);
            // By how much measuring on will still move the estimate: down to the variance that is enough.
            let enough_rad = self.sigma_enough_rad();
            let to_measure_rad2 = self.sigma_rad * self.sigma_rad - enough_rad * enough_rad;
            let left_rad = math::sqrt_f32(to_measure_rad2 + spread_rad * spread_rad);
            let room_rad = if is_coarse { shortest_rad + STEP_ROOM_SIGMAS * left_rad } else { 0.0 };
            remaining_rad - (STEP_SHORT_SIGMAS * left_rad).max(room_rad)
        };
        if aim_rad < shortest_rad {
            // Less than the shortest step is within any other tolerance.
            return if is_coarse && last {
                self.below_the_shortest(motor, remaining_rad, shortest_rad)
            } else {
                None
            };
        }
        let is_worth_it = last || aim_rad >= STEP_PART_MIN * remaining_rad;
        is_worth_it.then(|| self.burst(motor, Family::Step, aim_rad))?
    }

    /// What is driven when less remains than the shortest step turns by: see the head of this module.
    fn below_the_shortest(
        &self,
        motor: MotorResponse<'_>,
        remaining_rad: f32,
        shortest_rad: f32,
    ) -> Option<DrivePlan> {
        if remaining_rad <= self.reach_rad() {
            None
        } else if remaining_rad > 0.5 * shortest_rad {
            self.burst(motor, Family::Step, shortest_rad)
        } else {
            self.clockwise_burst(motor, BEYOND_RAD.max(SHORTEST_BEYOND * shortest_rad))
        }
    }

    /// Whether the target would count as reached after a step of `aim_rad`, without another measurement.
    fn reached_after_step(&self, motor: MotorResponse<'_>, aim_rad: f32) -> bool {
        let Some(DrivePlan::Burst(_, _, forecast)) = self.burst(motor, Family::Step, aim_rad) else {
            return false;
        };
        let after = Self {
            remaining_rad: aim_rad - forecast.turn_rad,
            sigma_rad: math::sqrt_f32(self.sigma_rad * self.sigma_rad + forecast.turn_rad2),
            ..*self
        };
        after.reached()
    }

    /// The burst of `family` that turns this motor by `aim_rad`, as nearly as the table allows.
    fn burst(&self, motor: MotorResponse<'_>, family: Family, aim_rad: f32) -> Option<DrivePlan> {
        let burst = motor.burst(family, aim_rad, self.amplitude_max)?;
        Some(DrivePlan::Burst(family, burst, motor.correction.forecast(family, &burst)))
    }

    fn longest_rad(&self, motor: MotorResponse<'_>, family: Family) -> Option<f32> {
        let (_, longest) = motor.map.range_rad(family, self.amplitude_max)?;
        Some(longest * motor.correction.scale(family))
    }

    /// `plan`, once the standard deviation of the angle is at most half of its burst's, or at once if the burst ends
    /// short of the target wherever the rotor is.
    fn due(&self, plan: DrivePlan) -> Option<DrivePlan> {
        let DrivePlan::Burst(_, _, forecast) = plan else { return Some(plan) };
        let known = DUE_VARIANCES * self.sigma_rad * self.sigma_rad <= forecast.turn_rad2;
        let unsure_rad = SHORT_SIGMAS * (self.sigma_rad + math::sqrt_f32(forecast.turn_rad2));
        let short = self.remaining_rad.abs() > forecast.turn_rad + unsure_rad;
        (known || short || self.sigma_rad <= self.sigma_enough_rad()).then_some(plan)
    }
}

#[cfg(test)]
mod tests;
