//! A rotor with the drive off: it comes to rest and is measured, turns on and is braked, or the move ends with a
//! reason.
//!
//! The filter says when the rotor is at rest. Where it does not, because the vibrometer is too noisy for it or wrong,
//! the camera's frames decide after the time that a coast can take ([`crate::settling_watch`]), and the move goes on by
//! them.

use estimator::{Estimate, Health};
use motor_model::{DriveMode, Time};

use super::failures::Trial;
use super::{Positioning, PositioningPhase, PositioningTuning, StopReason, Wait, is_at_most};
use crate::drive_plan::DrivePlan;
use crate::map_correction::MotorResponse;
use crate::response_map::{ResponseMap, direction};
use crate::rest_filter::Resting;
use crate::settling_watch::{SettlingWatch, Shown};

/// Decisions from one plan to the next, while the rotor is measured: a plan is much work for a tick, and one frame of
/// the default camera changes it little.
const DECISIONS_TO_PLAN: u8 = 10;
/// Longest brake in ns: a hundred times what mode C takes to spin a rotor up.
const BRAKE_NANOS: u64 = 500_000_000;
/// Longest wait for a frame, in ns, at which a brake is ended by the estimate.
const BRAKE_FRAME_NANOS: u64 = 5_000_000;
/// Longest brake in ns where frames come more slowly: less than either mode takes to spin a rotor up the other way.
const BRAKE_BLIND_NANOS: u64 = 10_000_000;
/// Least part of the angle's variance that counts as removable, where the filter knows a lower floor than assumed.
const REMOVABLE_PART: f32 = 0.01;
/// Brakes of one move, after which a rotor that turns on ends it. An assumption: one that stops by friction needs none.
const BRAKES_MAX: u8 = 3;

impl Positioning {
    /// No usable estimate: drive off, for a bounded time.
    pub(super) fn wait(&mut self, now: Time, health: Health) -> PositioningPhase {
        if matches!(self.phase, PositioningPhase::Holding) {
            // As after a jolt, the move begins anew.
            self.retarget(self.target, now);
        }
        // The last burst; where the rotor is found again tells whether a cruise turned it.
        self.rest.forget();
        let since = *self.blind_since.get_or_insert(now);
        if now.nanos_since(since) > self.tuning.blind_max_nanos {
            PositioningPhase::Stopped(StopReason::NoEstimate)
        } else {
            PositioningPhase::Waiting(health)
        }
    }

    /// Drive off: measures on, holds, or begins the next drive, unless the estimate is too `wide` for one.
    pub(super) fn settle(
        &mut self,
        map: &ResponseMap,
        now: Time,
        estimate: &Estimate<f32>,
        wide: bool,
    ) -> PositioningPhase {
        if !estimate.resting {
            match self.look(now, estimate) {
                Shown::Nothing => return PositioningPhase::Settling(Wait::Rest),
                Shown::Turns { clockwise } => return self.stop_the_rotor(clockwise, now),
                Shown::Still => (),
            }
        }
        if wide {
            return self.measure(now, estimate);
        }
        if let Some(Trial::Probe { lost, burst }) = self.trial {
            return self.probe(map, (lost, burst), now, estimate);
        }
        if self.decisions_to_plan > 0 {
            return self.measure(now, estimate);
        }
        self.decisions_to_plan = DECISIONS_TO_PLAN;
        let situation = self.situation(estimate);
        let corrected = self.corrected(estimate);
        if situation.reached() {
            self.correction = corrected;
            self.rest.compare(estimate);
            return PositioningPhase::Holding;
        }
        let motor = MotorResponse { map, correction: &corrected, amplitudes: &self.amplitudes };
        let Some(plan) = situation.plan(motor, self.ring_down.is_over(now)) else {
            return self.measure(now, estimate);
        };
        if self.waits_for_test(&plan, &situation, estimate) {
            return self.measure(now, estimate);
        }
        // Only when the next drive is due, since the last burst has then been measured as well as it will be.
        if let Some(phase) = self.test_burst(estimate) {
            return phase;
        }
        self.correction = corrected;
        if let Some(phase) = self.test_cruise(now, estimate) {
            return phase;
        }
        // A burst that is driven again on its forecast alone is never measured well enough for a test.
        if let DrivePlan::Burst(family, ..) = plan
            && corrected.is_without_effect(family)
        {
            self.stall(family.mode());
            if self.probes() {
                return self.measure(now, estimate);
            }
        }
        self.begin(plan, now, estimate)
    }

    /// At the target: stays unless the rotor moves, or lies outside the tolerance for certain.
    pub(super) fn hold(&mut self, now: Time, estimate: &Estimate<f32>) {
        if !estimate.resting && self.look(now, estimate) != Shown::Still {
            // A jolt: the angle before it does not count, and the move begins anew.
            self.rest.forget();
            return self.retarget(self.target, now);
        }
        let Resting { angle, angle_rad2 } = self.rest.resting(estimate);
        let remaining_rad = self.target.angle().radians_since::<f32>(angle).abs();
        let tolerance_rad = self.tolerance_rad();
        let sigmas = self.tuning.confidence.two_sided;
        if remaining_rad > tolerance_rad && !is_at_most(remaining_rad, sigmas, angle_rad2) {
            self.retarget(self.target, now);
        }
    }

    fn look(&mut self, now: Time, estimate: &Estimate<f32>) -> Shown {
        let PositioningTuning { settling_window_nanos, frame_wait_nanos, .. } = self.tuning;
        self.watch.look(settling_window_nanos, frame_wait_nanos, now, estimate)
    }

    /// At rest: measures on, or gives up where that cannot end before the deadline.
    pub(super) fn measure(&mut self, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        let PositioningTuning { confidence, floor_rad2, settling_window_nanos: window_nanos, .. } =
            self.tuning;
        let needed_rad2 = confidence.enough_rad2(self.tolerance_rad(), floor_rad2);
        let left_s = self.deadline_s - now.seconds_since::<f32>(self.started_at);
        let Resting { angle, angle_rad2 } = self.rest.resting(estimate);
        // Frames remove all but the floor. Not `f32::max`, for which the microcontroller calls a function.
        let (above_rad2, least_rad2) = (angle_rad2 - floor_rad2, REMOVABLE_PART * angle_rad2);
        let removable_rad2 = if above_rad2 > least_rad2 { above_rad2 } else { least_rad2 };
        let resting = Resting { angle, angle_rad2: removable_rad2 };
        let (to_go_s, in_vain) = self.watch.measure(needed_rad2, left_s, window_nanos, now, &resting);
        if in_vain {
            PositioningPhase::Stopped(StopReason::NotMeasurable)
        } else if estimate.resting {
            PositioningPhase::Settling(Wait::Measuring { to_go_s })
        } else {
            PositioningPhase::Settling(Wait::MeasuringUnrested { to_go_s })
        }
    }

    /// Brakes a rotor that turns on with the drive off by the other mode, or gives up.
    fn stop_the_rotor(&mut self, clockwise: bool, now: Time) -> PositioningPhase {
        if self.brakes >= BRAKES_MAX {
            return PositioningPhase::Stopped(StopReason::KeepsTurning);
        }
        self.brakes += 1;
        self.rest.forget();
        let mode = if clockwise { DriveMode::C } else { DriveMode::B };
        PositioningPhase::Brake { mode, since: now }
    }

    /// Drive on until the rotor no longer turns against `mode`.
    pub(super) fn brake(
        &mut self,
        mode: DriveMode,
        since: Time,
        now: Time,
        estimate: &Estimate<f32>,
    ) -> Option<PositioningPhase> {
        let seen = self.tuning.frame_wait_nanos <= BRAKE_FRAME_NANOS;
        let limit_nanos =
            if seen { BRAKE_NANOS } else { BRAKE_BLIND_NANOS }.min(self.tuning.limits.on_max_nanos);
        if direction(mode) * estimate.rate_rad_s < 0.0 && now.nanos_since(since) < limit_nanos {
            return None;
        }
        self.watch = SettlingWatch::new(None);
        Some(PositioningPhase::Settling(Wait::Turning))
    }
}
