//! From where the rotor is to where it should be.
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
//!   +---------+        no usable estimate, from anywhere: Waiting, then Settling again
//!   | Holding |        a limit, a stuck or a wrong-way rotor, cancelled: Stopped
//!   +---------+
//! ```
//!
//! The drive is on in `Cruise` and `Burst` only, and off within a tick of the estimate being lost. What to drive is [`crate::drive_plan`]'s; what is known at rest
//! [`crate::rest_filter`]'s; how this motor differs from the map [`crate::map_correction`]'s; whether a cruise gets on [`crate::progress_window`]'s, and what to make of drives that do
//! not move the rotor as they should [`failures`]'s.

mod failures;

use estimator::{Estimate, Health};
use motor_model::{Angle, DriveCommand, DriveMode, Time, math};

use crate::drive_plan::{Confidence, DrivePlan, Situation};
use crate::map_correction::MapCorrection;
use crate::progress_window::{ProgressWindow, WindowOutcome};
use crate::response_map::{Burst, Cruise, Family, coast_rad, cruise_within, direction};
use crate::rest_filter::{RestFilter, Resting};
use crate::target::{Limits, Target};
use failures::Probe;

/// Choices of the state machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PositioningTuning {
    /// What it may do.
    pub limits: Limits,
    /// How sure it must be that the rotor lies within the tolerance for the target to count as reached.
    pub confidence: Confidence,
    /// Angle variance above which no drive is begun or kept on, in rad^2.
    pub driveable_rad2: f32,
    /// Variance of what averaging at rest does not remove, in rad^2: the camera's quantisation.
    pub floor_rad2: f32,
    /// Whether bursts correct the map.
    pub learning: bool,
}

impl Default for PositioningTuning {
    /// A risk of 3.6 %, half a degree driveable, 0.05 milli-degrees of quantisation.
    fn default() -> Self {
        Self {
            limits: Limits::default(),
            confidence: Confidence::default(),
            driveable_rad2: 7.6e-5,
            floor_rad2: 7.6e-13,
            learning: true,
        }
    }
}

/// What positioning is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PositioningPhase {
    /// No estimate that may be used, and why; the drive is off.
    Waiting(Health),
    /// Drive on until the coast remains.
    Cruise {
        /// The drive in use.
        cruise: Cruise,
        /// When it was switched on.
        since: Time,
        /// How it gets on.
        progress: ProgressWindow,
    },
    /// Drive on for a number of ticks.
    Burst {
        /// The kind of burst.
        family: Family,
        /// The burst.
        burst: Burst,
        /// When it began.
        since: Time,
    },
    /// Drive off, waiting for rest and a good measurement.
    Settling,
    /// At the target, measuring on.
    Holding,
    /// Drive off until there is a new target, and why.
    Stopped(StopReason),
}

/// Why a move was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum StopReason {
    /// It was cancelled.
    Cancelled,
    /// The deadline passed.
    TimedOut,
    /// The rotor does not move although it is driven: it is stuck, or the drive is dead.
    Stalled,
    /// The rotor moves against the direction of the mode that drives it.
    ModeInverted,
    /// The target, or the rotor, is outside the travel allowed.
    OutOfTravel,
    /// As many drives as are allowed did not do.
    TooManyDrives,
    /// Mode B, clockwise, does not move the rotor any more, but mode C does.
    ModeBLost,
    /// Mode C, counter-clockwise, does not move the rotor any more, but mode B does.
    ModeCLost,
}

/// The state machine.
#[derive(Clone, Copy, Debug)]
pub struct Positioning {
    target: Target,
    tuning: PositioningTuning,
    started_at: Time,
    phase: PositioningPhase,
    ledger: RestFilter,
    correction: MapCorrection,
    drives: u32,
    /// Drives in a row without effect, and with the wrong one.
    stalls: u8,
    wrong_ways: u8,
    /// Bursts since one was seen to turn the rotor.
    unjudged: u8,
    probe: Option<Probe>,
}

impl Positioning {
    /// Positioning to `target`, starting at `now` by measuring where the rotor is.
    pub fn new(target: Target, tuning: PositioningTuning, now: Time) -> Self {
        let mut positioning = Self {
            target,
            tuning,
            started_at: now,
            phase: PositioningPhase::Settling,
            ledger: RestFilter::default(),
            correction: MapCorrection::default(),
            drives: 0,
            stalls: 0,
            unjudged: 0,
            wrong_ways: 0,
            probe: None,
        };
        positioning.retarget(target, now);
        positioning
    }

    /// Another target from `now` on, whatever is under way: a cruise goes on if it is still of use, a burst ends first. What was learnt is kept.
    pub fn retarget(&mut self, target: Target, now: Time) {
        self.target = target;
        self.started_at = now;
        (self.drives, self.stalls, self.wrong_ways, self.unjudged) = (0, 0, 0, 0);
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
        self.ledger.close();
    }

    /// What it is doing.
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

    /// Where a rotor at rest lies, by `estimate` and by what was known before the last burst.
    pub fn resting(&self, estimate: &Estimate<f32>) -> Resting {
        self.ledger.resting(estimate)
    }

    /// The command for the tick at `now`, on the present estimate, which counts only if `health` allows.
    pub fn decide(&mut self, now: Time, estimate: Option<&Estimate<f32>>, health: Health) -> DriveCommand {
        let usable = estimate.filter(|_| !matches!(health, Health::Unusable(_)));
        self.phase = match (self.phase, usable) {
            (PositioningPhase::Stopped(why), _) => PositioningPhase::Stopped(why),
            (_, None) => {
                self.ledger.close();
                PositioningPhase::Waiting(health)
            }
            (phase, Some(estimate)) => {
                self.ledger.watch(estimate);
                self.step(phase, now, estimate)
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

    fn step(&mut self, phase: PositioningPhase, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        match phase {
            PositioningPhase::Cruise { cruise, since, progress } => {
                self.cruise(cruise, since, progress, now, estimate)
            }
            PositioningPhase::Burst { family, burst, since } => {
                self.burst(family, burst, since, now, estimate)
            }
            PositioningPhase::Settling => self.settle(now, estimate),
            PositioningPhase::Holding => self.hold(now, estimate),
            PositioningPhase::Waiting(_) => PositioningPhase::Settling,
            PositioningPhase::Stopped(why) => PositioningPhase::Stopped(why),
        }
    }

    /// On: go on, or cut.
    fn cruise(
        &mut self,
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
            WindowOutcome::GetsOn(rate_rad_s) => {
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
        let coast_rad = coast_rad(cruise.mode, (direction * estimate.rate_rad_s).max(0.0));
        // On the clockwise side of it by half a standard deviation: the way back is fine, the way on is not.
        let arrived = remaining_rad <= coast_rad - 0.5 * direction * cruise.coast_sd_rad;
        let too_long = now.nanos_since(since) >= self.tuning.limits.on_max_nanos;
        let uncertain = estimate.angle_rad2 > self.tuning.driveable_rad2;
        if arrived || too_long || uncertain {
            if arrived {
                (self.stalls, self.wrong_ways) = (0, 0);
            }
            return PositioningPhase::Settling;
        }
        PositioningPhase::Cruise { cruise: self.eased(cruise, remaining_rad), since, progress }
    }

    fn learn_rate(&mut self, cruise: &Cruise, rate_rad_s: f32) {
        if self.tuning.learning {
            self.correction.learn_rate(cruise, rate_rad_s);
        }
    }

    /// The cruise for what remains: a weaker one where `cruise` would land too far off.
    fn eased(&self, cruise: Cruise, remaining_rad: f32) -> Cruise {
        // A motor of half the rate coasts half as far: to it twice as much remains.
        let remaining_rad = remaining_rad / self.correction.rate_scale(cruise.mode);
        if remaining_rad >= cruise.room_rad() {
            return cruise;
        }
        cruise_within(cruise.mode, self.tuning.limits.amplitude_max, remaining_rad)
            .filter(|weaker| weaker.amplitude < cruise.amplitude)
            .unwrap_or(cruise)
    }

    /// On for its ticks.
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

    /// Off: wait, stay, or go.
    fn settle(&mut self, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        if !estimate.resting {
            return PositioningPhase::Settling;
        }
        if let Some(probe) = self.probe {
            return self.probe(probe, now, estimate);
        }
        let situation = self.situation(estimate);
        let taught = self.taught(estimate);
        if situation.reached() {
            self.correction = taught;
            self.ledger.compare(estimate);
            return PositioningPhase::Holding;
        }
        let Some(plan) = situation.plan(&taught) else { return PositioningPhase::Settling };
        if self.waits_to_judge(&plan, &situation, estimate) {
            return PositioningPhase::Settling;
        }
        // Only now, when it is about to drive, since by now the last burst has been measured as well as it ever will be.
        if let Some(phase) = self.judge(estimate) {
            return phase;
        }
        self.correction = taught;
        // A burst that is repeated on what is foreseen alone is never measured well enough to be judged.
        if let DrivePlan::Burst(family, ..) = plan
            && taught.is_dead(family)
        {
            self.stall(family.mode());
            if self.probe.is_some() {
                return PositioningPhase::Settling;
            }
        }
        self.begin(plan, now, estimate)
    }

    /// At the target: stay unless the rotor is outside the tolerance for certain.
    fn hold(&mut self, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        if !estimate.resting {
            // Jolted: what was known before no longer counts, and the move begins anew.
            self.ledger.close();
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
                self.ledger.close();
                PositioningPhase::Cruise { cruise, since: now, progress: ProgressWindow::from(now, estimate) }
            }
            DrivePlan::Burst(family, burst, forecast) => {
                self.unjudged = self.unjudged.saturating_add(1);
                self.ledger.enter(family, burst, forecast, estimate, &self.correction);
                PositioningPhase::Burst { family, burst, since: now }
            }
        }
    }

    /// What is known of this motor once the last burst, as it is measured by now, is taken in.
    fn taught(&self, estimate: &Estimate<f32>) -> MapCorrection {
        if self.tuning.learning { self.ledger.taught(estimate, &self.correction) } else { self.correction }
    }

    /// Whether driving `mode` would lead out of the travel allowed.
    fn leaves(&self, mode: DriveMode, estimate: &Estimate<f32>) -> bool {
        self.tuning.limits.travel.forbids(estimate.angle, direction(mode))
    }

    fn situation(&self, estimate: &Estimate<f32>) -> Situation {
        let Resting { angle, angle_rad2 } = self.ledger.resting(estimate);
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
