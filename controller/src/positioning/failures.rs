//! Drives that do not turn the rotor as forecast: stalls, wrong ways, and the burst that probes the other mode.
//!
//! A mode that turns nothing [`FAILURES_MAX`] times in a row ends the move. Before it does, a burst of the other mode,
//! the probe, tells a stuck rotor or a drive without effect from one mode that is lost: in the latter case the rotor
//! can still be turned the other way.
//!
//! A burst is tested against its forecast, with `d` its measured turn in the direction of the mode, `s` the standard
//! deviation of that and `f` the forecast turn:
//!
//! ```text
//! f < 2.5 s                    not measured well enough: no outcome (for a probe: f < 8 s)
//! d < -f / 2 and d < -4 s      wrong way
//! d >= 0.4 f, or d > 4 s       right way
//! else                         no turn
//! ```
//!
//! So is a cruise that was cut, or that ended with the loss of the estimate. A filter that predicts the rotor's motion
//! takes a stuck rotor for one that arrives, or refuses the frames that contradict it, until it is measured at rest.

use estimator::Estimate;
use motor_model::{Angle, DriveMode, Time};

use super::{Positioning, PositioningPhase, StopReason, Wait};
use crate::drive_plan::DrivePlan;
use crate::map_correction::Forecast;
use crate::response_map::{Family, ResponseMap, direction};
use crate::rest_filter::BurstComparison;
use crate::situation::Situation;

/// A drive from rest to rest: where it began, and its forecast turn in rad, in the direction of its mode.
#[derive(Clone, Copy, Debug)]
pub(super) struct Driven {
    from: Angle,
    from_rad2: f32,
    forecast_rad: f32,
}

impl Driven {
    pub(super) fn from(estimate: &Estimate<f32>, forecast_rad: f32) -> Self {
        Self { from: estimate.angle, from_rad2: estimate.angle_rad2, forecast_rad }
    }

    /// The turn in the direction of `mode` by `estimate`, in rad, and its variance in rad^2.
    fn turned(&self, mode: DriveMode, estimate: &Estimate<f32>) -> (f32, f32) {
        let turned_rad = direction(mode) * estimate.angle.radians_since::<f32>(self.from);
        (turned_rad, self.from_rad2 + estimate.angle_rad2)
    }
}

/// A drive that is tested when the rotor is at rest after it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Trial {
    /// A cruise of this mode.
    Cruise(DriveMode, Driven),
    /// A burst that tells a lost mode from a stuck rotor.
    Probe {
        /// The mode that turns nothing.
        lost: DriveMode,
        /// The burst of the other mode; `None` before it.
        burst: Option<Driven>,
    },
}

/// Drives in a row without effect after which the other mode is probed; half of them the wrong way end the move. An
/// assumption.
pub(super) const FAILURES_MAX: u8 = 6;
/// Standard deviations of the measured turn that the forecast must exceed for a burst to have an outcome. An
/// assumption.
const TESTED_SIGMAS: f32 = 2.5;
/// Part of the forecast turn from which a burst counts as a turn. An assumption.
const TURN_PART_MIN: f32 = 0.4;
/// Standard deviations beyond which a measured turn is significant, however small. An assumption.
const SIGNIFICANT_SIGMAS: f32 = 4.0;
/// Bursts in a row without an outcome after which the next waits until it can have one. Far from the target bursts are
/// driven on an angle of large variance, so that a mode that turns nothing would go unnoticed. An assumption.
const UNTESTED_MAX: u8 = 20;
/// As [`TESTED_SIGMAS`], for the probe: it decides alone. An assumption.
const PROBE_SIGMAS: f32 = 8.0;
/// Variance of a measured turn per variance of the angle: the angles before and after the burst, and some to spare.
const PROBE_VARIANCES: f32 = 2.5;
/// Turn in rad of the burst that probes the other mode: 10 milli-degrees. An assumption.
const PROBE_RAD: f32 = 1.75e-4;

impl Positioning {
    /// Whether too many bursts had no outcome, the next would have none either, and measuring on will still improve
    /// the angle.
    pub(super) fn waits_for_test(
        &self,
        plan: &DrivePlan,
        situation: &Situation,
        estimate: &Estimate<f32>,
    ) -> bool {
        let DrivePlan::Burst(_, _, Forecast { turn_rad, .. }) = plan else { return false };
        let testable =
            turn_rad * turn_rad > PROBE_VARIANCES * PROBE_SIGMAS * PROBE_SIGMAS * estimate.angle_rad2;
        self.untested >= UNTESTED_MAX && !testable && situation.sigma_rad > situation.sigma_enough_rad()
    }

    /// Tests the last burst; the phase that follows, if it is not the next drive. A burst that turns far less than
    /// forecast is slow, not stuck, if its turn is significant.
    pub(super) fn test_burst(&mut self, estimate: &Estimate<f32>) -> Option<PositioningPhase> {
        let BurstComparison { mode, forecast_rad, turned_rad, turned_rad2 } = self.rest.compare(estimate)?;
        let outcome = match outcome(forecast_rad, turned_rad, turned_rad2)? {
            Turn::WrongWay => self.wrong_way(),
            Turn::None => self.stall(mode),
            Turn::RightWay => {
                (self.stalls, self.wrong_ways, self.untested) = (0, 0, 0);
                PositioningPhase::Settling(Wait::Rest)
            }
        };
        (matches!(outcome, PositioningPhase::Stopped(_)) || self.probes()).then_some(outcome)
    }

    /// Tests the last cruise; the phase that follows, if the next drive is to be planned anew.
    // As rare as a cruise.
    #[cold]
    #[inline(never)]
    pub(super) fn test_cruise(&mut self, now: Time, estimate: &Estimate<f32>) -> Option<PositioningPhase> {
        let Some(Trial::Cruise(mode, driven)) = self.trial.take() else { return None };
        let (turned_rad, turned_rad2) = driven.turned(mode, estimate);
        match outcome(driven.forecast_rad, turned_rad, turned_rad2)? {
            Turn::WrongWay => Some(self.wrong_way()),
            Turn::None => {
                // One that sticks under a weak drive gets a stronger one.
                if self.tuning.learning {
                    self.correction.learn_relative_rate(mode, 0.0);
                }
                // Cruises of some milliseconds count as one of a window: a rotor may stick for as long.
                let window_nanos = self.tuning.progress_window_nanos;
                if self.stalls > 0 && now.nanos_since(self.stalled_at) < window_nanos {
                    return Some(PositioningPhase::Settling(Wait::Rest));
                }
                self.stalled_at = now;
                Some(self.stall(mode))
            }
            Turn::RightWay => {
                (self.stalls, self.wrong_ways) = (0, 0);
                None
            }
        }
    }

    /// A drive of `mode` that did not turn the rotor.
    pub(super) fn stall(&mut self, mode: DriveMode) -> PositioningPhase {
        self.stalls = self.stalls.saturating_add(1);
        self.trial = (self.stalls >= FAILURES_MAX).then_some(Trial::Probe { lost: mode, burst: None });
        PositioningPhase::Settling(Wait::Rest)
    }

    /// Whether the other mode is probed.
    pub(super) fn probes(&self) -> bool {
        matches!(self.trial, Some(Trial::Probe { .. }))
    }

    /// At rest, with a mode that is `lost`: drives a burst of the other, or tests that burst.
    pub(super) fn probe(
        &mut self,
        map: &ResponseMap,
        (lost, burst): (DriveMode, Option<Driven>),
        now: Time,
        estimate: &Estimate<f32>,
    ) -> PositioningPhase {
        let other = match lost {
            DriveMode::B => Family::Step,
            DriveMode::C => Family::Nudge,
        };
        let Some(driven) = burst else {
            let Some(burst) = map.burst(other, PROBE_RAD, self.tuning.limits.amplitude_max) else {
                return PositioningPhase::Stopped(StopReason::Stalled);
            };
            // An angle of large variance before the burst would leave the probe without an outcome.
            let known =
                2.0 * PROBE_SIGMAS * PROBE_SIGMAS * estimate.angle_rad2 <= burst.turn_rad * burst.turn_rad;
            if !known || !self.ring_down.is_over(now) {
                return self.measure(now, estimate);
            }
            self.rest.forget();
            self.trial = Some(Trial::Probe { lost, burst: Some(Driven::from(estimate, burst.turn_rad)) });
            return PositioningPhase::Burst { family: other, burst, since: now };
        };
        let forecast_rad = driven.forecast_rad;
        let (turned_rad, turned_rad2) = driven.turned(other.mode(), estimate);
        if forecast_rad * forecast_rad < PROBE_SIGMAS * PROBE_SIGMAS * turned_rad2 {
            return self.measure(now, estimate);
        }
        match (outcome(forecast_rad, turned_rad, turned_rad2), lost) {
            (None, _) => self.measure(now, estimate),
            (Some(Turn::None), _) => PositioningPhase::Stopped(StopReason::Stalled),
            (Some(Turn::WrongWay), _) => PositioningPhase::Stopped(StopReason::ModeInverted),
            (Some(Turn::RightWay), DriveMode::B) => PositioningPhase::Stopped(StopReason::ModeBLost),
            (Some(Turn::RightWay), DriveMode::C) => PositioningPhase::Stopped(StopReason::ModeCLost),
        }
    }

    /// A drive that turned the rotor against the direction of its mode.
    pub(super) fn wrong_way(&mut self) -> PositioningPhase {
        self.wrong_ways = self.wrong_ways.saturating_add(1);
        self.trial = None;
        if self.wrong_ways >= FAILURES_MAX / 2 {
            PositioningPhase::Stopped(StopReason::ModeInverted)
        } else {
            PositioningPhase::Settling(Wait::Rest)
        }
    }
}

/// What a burst did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    RightWay,
    WrongWay,
    None,
}

/// What a burst did that was forecast to turn the rotor by `forecast_rad` and turned it by `turned_rad`, variance
/// `turned_rad2`, both in the direction of its mode; `None` while that is not measured well enough.
fn outcome(forecast_rad: f32, turned_rad: f32, turned_rad2: f32) -> Option<Turn> {
    if forecast_rad * forecast_rad < TESTED_SIGMAS * TESTED_SIGMAS * turned_rad2 {
        return None;
    }
    let significant = turned_rad * turned_rad > SIGNIFICANT_SIGMAS * SIGNIFICANT_SIGMAS * turned_rad2;
    Some(if turned_rad < -0.5 * forecast_rad && significant {
        Turn::WrongWay
    } else if turned_rad >= TURN_PART_MIN * forecast_rad || (significant && turned_rad > 0.0) {
        Turn::RightWay
    } else {
        Turn::None
    })
}
