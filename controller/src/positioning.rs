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
//!   | Holding |        a rotor that turns on with the drive off: Brake, then Settling again
//!   +---------+        a limit, a stuck or a wrong-way rotor, a cancel, nothing to wait for: Stopped
//! ```
//!
//! The head of the crate has a table of what ends each phase.
//!
//! A rotor at rest is planned for every ten decisions, and a burst waits until the stator is quiet
//! ([`crate::ring_down`]).
//!
//! The drive is on in `Cruise`, `Burst` and `Brake` only, and off within a tick of the loss of the estimate. What to
//! drive is decided in [`crate::drive_plan`]; the angle at rest comes from [`crate::rest_filter`], how this motor
//! differs from the map from [`crate::map_correction`], and whether a cruise turns the rotor from
//! [`crate::progress_window`]. One that turns it slowly, or back, is followed by cruises of other amplitudes
//! ([`crate::amplitude_search`]). A cruise is in [`cruise`], a drive that fails in [`failures`], and a rotor with the
//! drive off in [`settling`].

mod cruise;
mod failures;
mod phase;
mod settling;

use estimator::{Estimate, Health, Reason};
use motor_model::{Angle, DriveCommand, DriveMode, Time, math};

use crate::amplitude_search::AmplitudeSearch;
use crate::drive_plan::DrivePlan;
use crate::map_correction::MapCorrection;
use crate::progress_window::ProgressWindow;
use crate::response_map::{Burst, Family, ResponseMap, direction};
use crate::rest_filter::{RestFilter, Resting};
use crate::ring_down::RingDown;
use crate::settling_watch::{CoastBound, SettlingWatch};
use crate::situation::Situation;
use crate::target::Target;
use failures::{Driven, Trial};
pub use phase::{PositioningPhase, PositioningTuning, StopReason, Wait};

/// Standard deviations by which a coast may be longer than the map says, before the rotor counts as one that does not
/// stop. An assumption: friction differs between motors by up to a factor of two.
const COAST_BOUND_SIGMAS: f32 = 5.0;

/// Standard deviations by which the rotor must be nearer to the target than before to be on its way. An assumption.
const NEARER_SIGMAS: f32 = 3.0;

/// The state machine.
#[derive(Clone, Copy, Debug)]
pub struct Positioning {
    target: Target,
    tuning: PositioningTuning,
    started_at: Time,
    /// That of its limits, in s: a microcontroller converts 64 bits in sixty instructions.
    deadline_s: f32,
    /// When the move is given up.
    deadline_at: Time,
    phase: PositioningPhase,
    rest: RestFilter,
    correction: MapCorrection,
    amplitudes: AmplitudeSearch,
    /// Drives since the rotor was nearest to the target, and how near that was, in rad.
    drives: u32,
    nearest_rad: f32,
    /// Drives in a row without effect, and with the wrong effect.
    stalls: u8,
    wrong_ways: u8,
    /// Bursts since the rotor was last seen to be turned.
    untested: u8,
    trial: Option<Trial>,
    /// When a cruise was last found at rest not to have turned the rotor.
    stalled_at: Time,
    /// Whether the target has changed during the present cruise.
    retargeted: bool,
    /// The stator, and the rotor, since the drive went off.
    ring_down: RingDown,
    /// Decisions in which a rotor at rest is measured before the next drive may be planned.
    decisions_to_plan: u8,
    watch: SettlingWatch,
    /// Brakes of this move.
    brakes: u8,
    /// Since when the camera has shown nothing: no usable estimate, or one of a silent camera.
    blind_since: Option<Time>,
    /// Whether the angle was too uncertain to cut a cruise of this move by: bursts take its place.
    bursts_only: bool,
}

impl Positioning {
    /// Positioning to `target` by `map`, starting at `now` by measuring where the rotor is.
    pub fn new(map: &ResponseMap, target: Target, tuning: PositioningTuning, now: Time) -> Self {
        let mut positioning = Self {
            target,
            tuning,
            started_at: now,
            deadline_s: tuning.limits.deadline_s(),
            deadline_at: now,
            phase: PositioningPhase::Settling(Wait::Rest),
            rest: RestFilter::default(),
            correction: MapCorrection::of(map),
            amplitudes: AmplitudeSearch::default(),
            drives: 0,
            nearest_rad: f32::INFINITY,
            stalls: 0,
            untested: 0,
            wrong_ways: 0,
            trial: None,
            stalled_at: now,
            retargeted: false,
            ring_down: RingDown::new(map.design(), now),
            decisions_to_plan: 0,
            watch: SettlingWatch::new(None),
            brakes: 0,
            blind_since: None,
            bursts_only: false,
        };
        positioning.retarget(target, now);
        positioning
    }

    /// Another target from `now` on, in any phase: a cruise goes on if it still leads to the target, as strong as that
    /// asks for; a burst ends first. What was learnt is kept. Out of the travel the drive goes off at once.
    // One copy of it, for the smallest board's flash.
    #[inline(never)]
    pub fn retarget(&mut self, target: Target, now: Time) {
        self.target = target;
        self.started_at = now;
        self.deadline_at = now.plus_nanos(self.tuning.limits.deadline_nanos);
        (self.drives, self.stalls, self.wrong_ways, self.untested) = (0, 0, 0, 0);
        self.trial = None;
        self.brakes = 0;
        self.decisions_to_plan = 0;
        self.bursts_only = false;
        self.blind_since = None;
        self.nearest_rad = f32::INFINITY;
        self.retargeted = matches!(self.phase, PositioningPhase::Cruise { .. });
        self.phase = if !self.tuning.limits.travel.contains(target.angle()) {
            if matches!(self.phase, PositioningPhase::Burst { .. }) {
                // As at the deadline.
                self.rest.forget();
            }
            PositioningPhase::Stopped(StopReason::OutOfTravel)
        } else if matches!(self.phase, PositioningPhase::Stopped(_) | PositioningPhase::Holding) {
            self.watch = SettlingWatch::new(None);
            PositioningPhase::Settling(Wait::Rest)
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
        self.decisions_to_plan = self.decisions_to_plan.saturating_sub(1);
        // An estimate that is wide but right is not lost.
        let wide = matches!(health, Health::Unusable(Reason::Uncertain));
        let usable = estimate.filter(|_| wide || !matches!(health, Health::Unusable(_)));
        let next = match (&self.phase, usable) {
            (PositioningPhase::Stopped(_), _) => None,
            (_, None) => Some(self.wait(now, health)),
            (_, Some(estimate)) => {
                self.rest.note_variance(estimate, self.tuning.floor_rad2);
                let ended = if wide || matches!(health, Health::Degraded(Reason::CameraSilent)) {
                    self.end_blind(map, now)
                } else {
                    self.blind_since = None;
                    None
                };
                // In one place, so that it is no call.
                ended.or_else(|| self.step(map, now, estimate, wide))
            }
        };
        if let Some(next) = next {
            self.phase = next;
        }
        if !matches!(self.phase, PositioningPhase::Holding | PositioningPhase::Stopped(_))
            && now > self.deadline_at
        {
            if matches!(self.phase, PositioningPhase::Burst { .. }) {
                // What was forecast is the turn of a whole burst.
                self.rest.forget();
            }
            self.phase = PositioningPhase::Stopped(StopReason::TimedOut);
        }
        let command = self.command();
        if let Some(mode) = command.mode() {
            self.ring_down.drive(mode, now);
        }
        command
    }

    fn command(&self) -> DriveCommand {
        match self.phase {
            PositioningPhase::Cruise { cruise, .. } => {
                DriveCommand::saturating(cruise.mode, cruise.amplitude)
            }
            PositioningPhase::Burst { family, burst, .. } => burst.command(family.mode()),
            PositioningPhase::Brake { mode, .. } => {
                DriveCommand::saturating(mode, self.tuning.limits.amplitude_max)
            }
            PositioningPhase::Waiting(_)
            | PositioningPhase::Settling(_)
            | PositioningPhase::Holding
            | PositioningPhase::Stopped(_) => DriveCommand::OFF,
        }
    }

    /// The next phase; `None` if the present one goes on as it is. `wide` is whether the estimate is too uncertain to
    /// begin a drive by.
    fn step(
        &mut self,
        map: &ResponseMap,
        now: Time,
        estimate: &Estimate<f32>,
        wide: bool,
    ) -> Option<PositioningPhase> {
        match self.phase {
            PositioningPhase::Cruise { cruise, since, progress } => {
                self.cruise(map, cruise, since, progress, now, estimate)
            }
            PositioningPhase::Burst { family, burst, since } => {
                self.burst(family, burst, since, now, estimate)
            }
            PositioningPhase::Brake { mode, since } => self.brake(mode, since, now, estimate),
            PositioningPhase::Settling(_) => Some(self.settle(map, now, estimate, wide)),
            PositioningPhase::Holding => {
                self.hold(now, estimate);
                None
            }
            PositioningPhase::Waiting(_) => {
                self.watch = SettlingWatch::new(None);
                Some(PositioningPhase::Settling(Wait::Rest))
            }
            PositioningPhase::Stopped(_) => None,
        }
    }

    /// What a silent camera ends. A cruise goes on for a window, in which nothing shows that the rotor turns; a rotor
    /// with the drive off is not measured meanwhile.
    #[cold]
    #[inline(never)]
    fn end_blind(&mut self, map: &ResponseMap, now: Time) -> Option<PositioningPhase> {
        let blind_nanos = now.nanos_since(*self.blind_since.get_or_insert(now));
        match self.phase {
            PositioningPhase::Cruise { cruise, .. } if blind_nanos > self.tuning.progress_window_nanos => {
                let direction = direction(cruise.mode);
                let coast_rad = map.coast_rad(cruise.mode, direction * cruise.rate_rad_s);
                Some(self.coast(direction, coast_rad, cruise.coast_sd_rad))
            }
            PositioningPhase::Settling(_) if blind_nanos > self.tuning.blind_max_nanos => {
                Some(PositioningPhase::Stopped(StopReason::NoEstimate))
            }
            PositioningPhase::Settling(_) => {
                self.watch.begin_measuring_anew();
                None
            }
            _ => None,
        }
    }

    /// Drive on for the burst's ticks.
    fn burst(
        &mut self,
        family: Family,
        burst: Burst,
        since: Time,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> Option<PositioningPhase> {
        if self.leaves(family.mode(), estimate) {
            self.rest.forget();
            return Some(PositioningPhase::Stopped(StopReason::OutOfTravel));
        }
        if now.nanos_since(since) >= self.burst_nanos(&burst) {
            if self.tuning.limits.on_max_nanos < burst.nanos() {
                // As at the deadline.
                self.rest.forget();
            }
            let spread_rad2 =
                burst.motors_sd_rad * burst.motors_sd_rad + burst.repeat_sd_rad * burst.repeat_sd_rad;
            return Some(self.coast(direction(family.mode()), burst.turn_rad, math::sqrt_f32(spread_rad2)));
        }
        None
    }

    /// Time in ns after which the drive of `burst` ends.
    fn burst_nanos(&self, burst: &Burst) -> u64 {
        burst.nanos().min(self.tuning.limits.on_max_nanos)
    }

    /// When the drive of the burst under way ends.
    pub(crate) fn burst_end(&self) -> Option<Time> {
        match &self.phase {
            PositioningPhase::Burst { burst, since, .. } => Some(since.plus_nanos(self.burst_nanos(burst))),
            _ => None,
        }
    }

    /// The drive goes off; the rotor turns on by `coast_rad` at most, but for `coast_sd_rad`.
    fn coast(&mut self, direction: f32, coast_rad: f32, coast_sd_rad: f32) -> PositioningPhase {
        let rad = coast_rad + COAST_BOUND_SIGMAS * coast_sd_rad;
        self.watch = SettlingWatch::new(Some(CoastBound { direction, rad }));
        PositioningPhase::Settling(Wait::Rest)
    }

    fn begin(&mut self, plan: DrivePlan, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        let Situation { remaining_rad, sigma_rad, .. } = self.situation(estimate);
        if remaining_rad.abs() < self.nearest_rad - NEARER_SIGMAS * sigma_rad {
            // On its way: the mode turns the rotor, though no burst may show it alone.
            (self.nearest_rad, self.drives, self.untested) = (remaining_rad.abs(), 0, 0);
        }
        self.drives += 1;
        if self.drives > self.tuning.limits.drives_max {
            return PositioningPhase::Stopped(StopReason::TooManyDrives);
        }
        match plan {
            DrivePlan::Cruise(cruise) => {
                self.rest.forget();
                self.trial = Some(Trial::Cruise(cruise.mode, Driven::from(estimate, remaining_rad.abs())));
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

    fn tolerance_rad(&self) -> f32 {
        self.target.tolerance().radians_since(Angle::ZERO)
    }

    fn situation(&self, estimate: &Estimate<f32>) -> Situation {
        let Resting { angle, angle_rad2 } = self.rest.resting(estimate);
        Situation {
            remaining_rad: self.target.angle().radians_since(angle),
            sigma_rad: math::sqrt_f32(angle_rad2),
            tolerance_rad: self.tolerance_rad(),
            confidence: self.tuning.confidence,
            amplitude_max: self.tuning.limits.amplitude_max,
            floor_rad2: self.tuning.floor_rad2,
            frame_wait_s: if self.bursts_only { f32::INFINITY } else { self.tuning.frame_wait_s() },
        }
    }
}

/// Whether `x <= sigmas * sqrt(variance)`, by squares: the microcontroller takes a root in fifty instructions.
fn is_at_most(x: f32, sigmas: f32, variance: f32) -> bool {
    let (square, limit) = (x * x, sigmas * sigmas * variance);
    if sigmas < 0.0 { x <= 0.0 && square >= limit } else { x <= 0.0 || square <= limit }
}

#[cfg(test)]
mod tests;
