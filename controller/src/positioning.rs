//! The state machine that moves the rotor to its target.
//!
//! ```text
//!              planned: far                     coast remains, or too long
//!   +----------+ ----------> +--------+ ----------------------------+
//!   | Settling |             | Cruise |                             |
//!   |          | <---------- +--------+                             |
//!   |  at rest:| planned: near             its ticks are over       |
//!   |  measure,| ----------> +--------+ ----------------------------+
//!   |  plan    |             | Burst  |                             |
//!   +----------+             +--------+                             |
//!     ^   | reached  ^-----------------------------------------------+
//!     |   v
//!   +---------+        no usable estimate, in any phase: Waiting, then Settling again
//!   | Holding |        a limit, a stuck or a wrong-way rotor, a cancel: Stopped
//!   +---------+
//! ```
//!
//! The head of the crate has a table of what ends each phase.
//!
//! The drive is on in `Cruise` and `Burst` only, and off within a tick of the loss of the estimate. What to drive is
//! decided in [`crate::drive_plan`]; the angle at rest comes from [`crate::rest_filter`], how this motor differs from
//! the map from [`crate::map_correction`], and whether a cruise turns the rotor from [`crate::progress_window`].
//! Drives that fail are handled in [`failures`].

mod failures;
mod phase;

use estimator::{Estimate, Health};
use motor_model::{Angle, DriveCommand, DriveMode, Time, math};

use crate::drive_plan::DrivePlan;
use crate::map_correction::{MapCorrection, MotorResponse};
use crate::progress_window::{ProgressWindow, WindowOutcome};
use crate::response_map::{Burst, Cruise, Family, ResponseMap, direction};
use crate::rest_filter::{RestFilter, Resting};
use crate::situation::Situation;
use crate::target::Target;
use failures::Probe;
pub use phase::{PositioningPhase, PositioningTuning, StopReason};

/// Part of the standard deviation of the coast by which a cruise is cut early in mode C and late in mode B, so that the
/// rotor tends to come to rest clockwise of the target, from where the fine bursts lead back. Scored by
/// `host-sim positioning-trials`.
const CLOCKWISE_COAST_SIGMAS: f32 = 0.5;

/// The state machine.
#[derive(Clone, Copy, Debug)]
pub struct Positioning {
    target: Target,
    tuning: PositioningTuning,
    started_at: Time,
    phase: PositioningPhase,
    rest: RestFilter,
    correction: MapCorrection,
    drives: u32,
    /// Drives in a row without effect, and with the wrong effect.
    stalls: u8,
    wrong_ways: u8,
    /// Bursts since the last that was seen to turn the rotor.
    untested: u8,
    probe: Option<Probe>,
}

impl Positioning {
    /// Positioning to `target` by `map`, starting at `now` by measuring where the rotor is.
    pub fn new(map: &ResponseMap, target: Target, tuning: PositioningTuning, now: Time) -> Self {
        let mut positioning = Self {
            target,
            tuning,
            started_at: now,
            phase: PositioningPhase::Settling,
            rest: RestFilter::default(),
            correction: MapCorrection::of(map),
            drives: 0,
            stalls: 0,
            untested: 0,
            wrong_ways: 0,
            probe: None,
        };
        positioning.retarget(target, now);
        positioning
    }

    /// Another target from `now` on, in any phase: a cruise goes on if it still leads to the target, a burst ends
    /// first. What was learnt is kept.
    pub fn retarget(&mut self, target: Target, now: Time) {
        self.target = target;
        self.started_at = now;
        (self.drives, self.stalls, self.wrong_ways, self.untested) = (0, 0, 0, 0);
        self.probe = None;
        self.phase = if !self.tuning.limits.travel.contains(target.angle()) {
            PositioningPhase::Stopped(StopReason::OutOfTravel)
        } else if matches!(self.phase, PositioningPhase::Stopped(_) | PositioningPhase::Holding) {
            PositioningPhase::Settling
        } else {
            self.phase
        };
    }

    /// Ends the move, drive off.
    pub fn cancel(&mut self) {
        self.phase = PositioningPhase::Stopped(StopReason::Cancelled);
        self.rest.forget();
    }

    /// The phase.
    pub fn phase(&self) -> PositioningPhase {
        self.phase
    }

    /// The target.
    pub fn target(&self) -> Target {
        self.target
    }

    /// What has been learnt of this motor.
    pub fn correction(&self) -> &MapCorrection {
        &self.correction
    }

    /// The angle of a rotor at rest, by `estimate` and by the prediction across the last burst.
    pub fn resting(&self, estimate: &Estimate<f32>) -> Resting {
        self.rest.resting(estimate)
    }

    /// The command for the tick at `now`, by the present estimate, which counts only if `health` allows, and by the map
    /// with which the state machine was made.
    pub fn decide(
        &mut self,
        map: &ResponseMap,
        now: Time,
        estimate: Option<&Estimate<f32>>,
        health: Health,
    ) -> DriveCommand {
        let usable = estimate.filter(|_| !matches!(health, Health::Unusable(_)));
        self.phase = match (self.phase, usable) {
            (PositioningPhase::Stopped(why), _) => PositioningPhase::Stopped(why),
            (_, None) => {
                self.rest.forget();
                PositioningPhase::Waiting(health)
            }
            (phase, Some(estimate)) => {
                self.rest.note_variance(estimate);
                self.step(map, phase, now, estimate)
            }
        };
        let late = now.nanos_since(self.started_at) > self.tuning.limits.deadline_nanos;
        if late && !matches!(self.phase, PositioningPhase::Holding | PositioningPhase::Stopped(_)) {
            self.phase = PositioningPhase::Stopped(StopReason::TimedOut);
        }
        self.command()
    }

    fn command(&self) -> DriveCommand {
        match self.phase {
            PositioningPhase::Cruise { cruise, .. } => {
                DriveCommand::saturating(cruise.mode, cruise.amplitude)
            }
            PositioningPhase::Burst { family, burst, .. } => burst.command(family.mode()),
            PositioningPhase::Waiting(_)
            | PositioningPhase::Settling
            | PositioningPhase::Holding
            | PositioningPhase::Stopped(_) => DriveCommand::OFF,
        }
    }

    fn step(
        &mut self,
        map: &ResponseMap,
        phase: PositioningPhase,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> PositioningPhase {
        match phase {
            PositioningPhase::Cruise { cruise, since, progress } => {
                self.cruise(map, cruise, since, progress, now, estimate)
            }
            PositioningPhase::Burst { family, burst, since } => {
                self.burst(family, burst, since, now, estimate)
            }
            PositioningPhase::Settling => self.settle(map, now, estimate),
            PositioningPhase::Holding => self.hold(now, estimate),
            PositioningPhase::Waiting(_) => PositioningPhase::Settling,
            PositioningPhase::Stopped(why) => PositioningPhase::Stopped(why),
        }
    }

    /// Drive on: goes on, or is cut.
    fn cruise(
        &mut self,
        map: &ResponseMap,
        cruise: Cruise,
        since: Time,
        progress: ProgressWindow,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> PositioningPhase {
        if self.leaves(cruise.mode, estimate) {
            return PositioningPhase::Stopped(StopReason::OutOfTravel);
        }
        let direction = direction(cruise.mode);
        let progress = match progress.outcome(direction, now, estimate) {
            WindowOutcome::Open => progress,
            WindowOutcome::Turns(rate_rad_s) => {
                (self.stalls, self.wrong_ways) = (0, 0);
                self.learn_rate(&cruise, rate_rad_s);
                ProgressWindow::from(now, estimate)
            }
            WindowOutcome::Stuck => {
                self.learn_rate(&cruise, 0.0);
                return self.stall(cruise.mode);
            }
            WindowOutcome::WrongWay => return self.wrong_way(),
        };
        let remaining_rad = direction * self.target.angle().radians_since::<f32>(estimate.angle);
        let coast_rad = map.coast_rad(cruise.mode, (direction * estimate.rate_rad_s).max(0.0));
        let arrived = remaining_rad <= coast_rad - CLOCKWISE_COAST_SIGMAS * direction * cruise.coast_sd_rad;
        let too_long = now.nanos_since(since) >= self.tuning.limits.on_max_nanos;
        let uncertain = estimate.angle_rad2 > self.tuning.cruise_variance_max_rad2;
        if arrived || too_long || uncertain {
            if arrived {
                (self.stalls, self.wrong_ways) = (0, 0);
            }
            return PositioningPhase::Settling;
        }
        PositioningPhase::Cruise { cruise: self.weakened(map, cruise, remaining_rad), since, progress }
    }

    fn learn_rate(&mut self, cruise: &Cruise, rate_rad_s: f32) {
        if self.tuning.learning {
            self.correction.learn_rate(cruise, rate_rad_s);
        }
    }

    /// The cruise for what remains: a weaker one where the coast of `cruise` is too uncertain.
    fn weakened(&self, map: &ResponseMap, cruise: Cruise, remaining_rad: f32) -> Cruise {
        // A motor of half the rate coasts half as far: it is driven as if twice as much remained.
        let remaining_rad = remaining_rad / self.correction.rate_scale(cruise.mode);
        if remaining_rad >= cruise.room_rad() {
            return cruise;
        }
        map.cruise_within(cruise.mode, self.tuning.limits.amplitude_max, remaining_rad)
            .filter(|weaker| weaker.amplitude < cruise.amplitude)
            .unwrap_or(cruise)
    }

    /// Drive on for the burst's ticks.
    fn burst(
        &mut self,
        family: Family,
        burst: Burst,
        since: Time,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> PositioningPhase {
        if self.leaves(family.mode(), estimate) {
            return PositioningPhase::Stopped(StopReason::OutOfTravel);
        }
        let wanted_nanos = u64::from(burst.ticks) * crate::TICK_NANOS;
        let over = now.nanos_since(since) >= wanted_nanos.min(self.tuning.limits.on_max_nanos);
        if over { PositioningPhase::Settling } else { PositioningPhase::Burst { family, burst, since } }
    }

    /// Drive off: measures on, holds, or begins the next drive.
    fn settle(&mut self, map: &ResponseMap, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        if !estimate.resting {
            return PositioningPhase::Settling;
        }
        if let Some(probe) = self.probe {
            return self.probe(map, probe, now, estimate);
        }
        let situation = self.situation(estimate);
        let corrected = self.corrected(estimate);
        if situation.reached() {
            self.correction = corrected;
            self.rest.compare(estimate);
            return PositioningPhase::Holding;
        }
        let Some(plan) = situation.plan(MotorResponse { map, correction: &corrected }) else {
            return PositioningPhase::Settling;
        };
        if self.waits_for_test(&plan, &situation, estimate) {
            return PositioningPhase::Settling;
        }
        // Only when the next drive is due, since the last burst has then been measured as well as it will be.
        if let Some(phase) = self.test_burst(estimate) {
            return phase;
        }
        self.correction = corrected;
        // A burst that is driven again on its forecast alone is never measured well enough for a test.
        if let DrivePlan::Burst(family, ..) = plan
            && corrected.is_without_effect(family)
        {
            self.stall(family.mode());
            if self.probe.is_some() {
                return PositioningPhase::Settling;
            }
        }
        self.begin(plan, now, estimate)
    }

    /// At the target: stays unless the rotor moves, or lies outside the tolerance for certain.
    fn hold(&mut self, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        if !estimate.resting {
            // A jolt: the angle before it does not count, and the move begins anew.
            self.rest.forget();
            self.retarget(self.target, now);
            return self.phase;
        }
        let Situation { remaining_rad, sigma_rad, tolerance_rad, confidence, .. } = self.situation(estimate);
        if remaining_rad.abs() > tolerance_rad.max(confidence.two_sided * sigma_rad) {
            self.retarget(self.target, now);
        }
        self.phase
    }

    fn begin(&mut self, plan: DrivePlan, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        self.drives += 1;
        if self.drives > self.tuning.limits.drives_max {
            return PositioningPhase::Stopped(StopReason::TooManyDrives);
        }
        match plan {
            DrivePlan::Cruise(cruise) => {
                self.rest.forget();
                PositioningPhase::Cruise { cruise, since: now, progress: ProgressWindow::from(now, estimate) }
            }
            DrivePlan::Burst(family, burst, forecast) => {
                self.untested = self.untested.saturating_add(1);
                self.rest.predict(family, burst, forecast, estimate, &self.correction);
                PositioningPhase::Burst { family, burst, since: now }
            }
        }
    }

    /// The correction after the update by the last burst, as it is measured by now.
    fn corrected(&self, estimate: &Estimate<f32>) -> MapCorrection {
        if self.tuning.learning { self.rest.corrected(estimate, &self.correction) } else { self.correction }
    }

    /// Whether driving `mode` leads out of the travel.
    fn leaves(&self, mode: DriveMode, estimate: &Estimate<f32>) -> bool {
        self.tuning.limits.travel.forbids(estimate.angle, direction(mode))
    }

    fn situation(&self, estimate: &Estimate<f32>) -> Situation {
        let Resting { angle, angle_rad2 } = self.rest.resting(estimate);
        Situation {
            remaining_rad: self.target.angle().radians_since(angle),
            sigma_rad: math::sqrt_f32(angle_rad2 + self.tuning.floor_rad2),
            tolerance_rad: self.target.tolerance().radians_since(Angle::ZERO),
            confidence: self.tuning.confidence,
            amplitude_max: self.tuning.limits.amplitude_max,
        }
    }
}

#[cfg(test)]
mod tests;
