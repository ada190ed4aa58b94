//! What to make of drives that do not move the rotor as they should.
//!
//! A mode that moves nothing [`FAILURES_MAX`] times in a row ends the move. Before it does, a burst of the other mode tells a rotor that is stuck, or a drive that is dead, from one
//! mode that is lost: with the other the rotor can still be moved.

use estimator::Estimate;
use motor_model::{DriveMode, Time};

use super::{Positioning, PositioningPhase, StopReason};
use crate::drive_plan::{DrivePlan, Situation};
use crate::map_correction::Forecast;
use crate::response_map::{Family, direction};
use crate::rest_filter::{BurstComparison, Resting};

/// A burst of the other mode, from rest to rest, that tells a lost mode from a stuck rotor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Probe {
    /// The mode that moves nothing.
    lost: DriveMode,
    /// Where the rotor lay before the burst, and the turn in rad that was foreseen; `None` before it.
    driven: Option<(Resting, f32)>,
}

/// Drives in a row, without effect or with the wrong one, after which a move is given up.
pub(super) const FAILURES_MAX: u8 = 6;
/// A burst's outcome is judged only when it was foreseen to exceed so many standard deviations of its measurement.
const JUDGED: f32 = 2.5;
/// A burst that turns by less than this part of the foreseen turn may not have turned the rotor at all.
const BURST_STALLED: f32 = 0.4;
/// A turn by a burst is one when it exceeds so many standard deviations of its measurement.
const SURELY: f32 = 4.0;
/// Bursts none of which was seen to turn the rotor, after which the next is only driven, and followed, when it can be judged for certain: far from the target,
/// where bursts are driven on what is hardly known, a mode that moves nothing would else go unnoticed.
const UNJUDGED_MAX: u8 = 20;
/// A burst that probes the other mode decides alone: it is judged only when it was foreseen to exceed so many.
const PROBED: f32 = 8.0;
/// Turn in rad of the burst that probes the other mode: 10 milli-degrees.
const PROBE_RAD: f32 = 1.75e-4;

impl Positioning {
    /// Whether too many bursts went unjudged, and the angle is not known well enough yet to judge the next, though more will still be known of it.
    pub(super) fn waits_to_judge(
        &self,
        plan: &DrivePlan,
        situation: &Situation,
        estimate: &Estimate<f32>,
    ) -> bool {
        let DrivePlan::Burst(_, _, Forecast { turn_rad, .. }) = plan else { return false };
        // The angles before and after, with some to spare.
        let told = turn_rad * turn_rad > 2.5 * PROBED * PROBED * estimate.angle_rad2;
        self.unjudged >= UNJUDGED_MAX && !told && situation.sigma_rad > situation.sigma_enough_rad()
    }

    /// Judges the last burst; what that leads to, if it is not the next drive. A burst that turns far less than foreseen is slow, not stuck, if it surely turns the rotor.
    pub(super) fn judge(&mut self, estimate: &Estimate<f32>) -> Option<PositioningPhase> {
        let BurstComparison { mode, foreseen_rad, turned_rad, turned_rad2 } =
            self.ledger.compare(estimate)?;
        let outcome = match outcome(foreseen_rad, turned_rad, turned_rad2)? {
            Turn::WrongWay => self.wrong_way(),
            Turn::None => self.stall(mode),
            Turn::RightWay => {
                (self.stalls, self.wrong_ways, self.unjudged) = (0, 0, 0);
                PositioningPhase::Settling
            }
        };
        (matches!(outcome, PositioningPhase::Stopped(_)) || self.probe.is_some()).then_some(outcome)
    }

    /// A drive of `mode` that did not turn the rotor.
    pub(super) fn stall(&mut self, mode: DriveMode) -> PositioningPhase {
        self.stalls = self.stalls.saturating_add(1);
        if self.stalls >= FAILURES_MAX {
            self.probe = Some(Probe { lost: mode, driven: None });
        }
        PositioningPhase::Settling
    }

    /// At rest, with a mode that moves nothing: drives the other for a burst, or judges that burst.
    pub(super) fn probe(&mut self, probe: Probe, now: Time, estimate: &Estimate<f32>) -> PositioningPhase {
        let other = match probe.lost {
            DriveMode::B => Family::Step,
            DriveMode::C => Family::Nudge,
        };
        let Some((before, foreseen_rad)) = probe.driven else {
            let Some(burst) = other.burst(PROBE_RAD, self.tuning.limits.amplitude_max) else {
                return PositioningPhase::Stopped(StopReason::Stalled);
            };
            // What is not known well before the burst is not judged after it.
            if burst.turn_rad * burst.turn_rad < 2.0 * PROBED * PROBED * estimate.angle_rad2 {
                return PositioningPhase::Settling;
            }
            self.ledger.close();
            let resting = Resting { angle: estimate.angle, angle_rad2: estimate.angle_rad2 };
            self.probe = Some(Probe { driven: Some((resting, burst.turn_rad)), ..probe });
            return PositioningPhase::Burst { family: other, burst, since: now };
        };
        let turned_rad = direction(other.mode()) * estimate.angle.radians_since::<f32>(before.angle);
        let turned_rad2 = before.angle_rad2 + estimate.angle_rad2;
        if foreseen_rad * foreseen_rad < PROBED * PROBED * turned_rad2 {
            return PositioningPhase::Settling;
        }
        match (outcome(foreseen_rad, turned_rad, turned_rad2), probe.lost) {
            (None, _) => PositioningPhase::Settling,
            (Some(Turn::None), _) => PositioningPhase::Stopped(StopReason::Stalled),
            (Some(Turn::WrongWay), _) => PositioningPhase::Stopped(StopReason::ModeInverted),
            (Some(Turn::RightWay), DriveMode::B) => PositioningPhase::Stopped(StopReason::ModeBLost),
            (Some(Turn::RightWay), DriveMode::C) => PositioningPhase::Stopped(StopReason::ModeCLost),
        }
    }

    /// A drive that turned the rotor against the direction of its mode.
    pub(super) fn wrong_way(&mut self) -> PositioningPhase {
        self.wrong_ways = self.wrong_ways.saturating_add(1);
        if self.wrong_ways >= FAILURES_MAX / 2 {
            PositioningPhase::Stopped(StopReason::ModeInverted)
        } else {
            PositioningPhase::Settling
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

/// What a burst did that was foreseen to turn the rotor by `foreseen_rad` and turned it by `turned_rad`, variance `turned_rad2`, in the direction of its mode; `None` while that is not measured well enough.
fn outcome(foreseen_rad: f32, turned_rad: f32, turned_rad2: f32) -> Option<Turn> {
    if foreseen_rad * foreseen_rad < JUDGED * JUDGED * turned_rad2 {
        return None;
    }
    let surely = turned_rad * turned_rad > SURELY * SURELY * turned_rad2;
    Some(if turned_rad < -0.5 * foreseen_rad && surely {
        Turn::WrongWay
    } else if turned_rad >= BURST_STALLED * foreseen_rad || (surely && turned_rad > 0.0) {
        Turn::RightWay
    } else {
        Turn::None
    })
}
