//! Another target for the move under way. What the loop has learnt of the motor is kept.

use controller::Target;
use estimator::{AngleFilter as _, Health};
use link::{BoardFault, BoardMessage, TargetRecord};
use motor_model::{Angle, Time};

use super::configured_move::{Configured, Move, MoveMemory};
use super::description::refused;
use super::{Application, State, time};
use crate::design::DesignedDrive;
use crate::filter::SelectedFilter;

/// The angle at which the rotor is at `now`, if it is known well enough to be used.
pub(super) fn usable_angle(filter: &SelectedFilter, now: Time) -> Option<Angle> {
    match filter.assess(now) {
        (Some(estimate), Health::Good | Health::Degraded(_)) => Some(estimate.angle),
        _ => None,
    }
}

impl<D: DesignedDrive> Application<'_, D> {
    /// Moves on to `asked`, or where there is none to the angle at which the rotor is now. Any refusal leaves the move
    /// as it is.
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn retarget(&mut self, asked: Option<TargetRecord>) -> BoardMessage {
        let (now, zero) = (time(self.elapsed_ticks), self.zero);
        let MoveMemory { configured, filter, .. } = &mut *self.memory;
        let (State::Armed, Some(configured), Some(filter)) = (&self.state, configured, filter) else {
            return BoardMessage::Fault(self.fault());
        };
        let Configured::Move(Move { positioning, .. }) = configured else {
            return BoardMessage::Fault(BoardFault::NoMove);
        };
        let target = match asked {
            Some(TargetRecord { target_deg, tolerance_deg }) => {
                Target::try_new(target_deg, tolerance_deg).map(|target| target.from_zero(zero))
            }
            None => match usable_angle(filter, now) {
                Some(angle) => positioning.target().at(angle),
                None => return BoardMessage::Fault(BoardFault::NoEstimate),
            },
        };
        match target {
            Ok(target) => {
                positioning.retarget(target, now);
                BoardMessage::Retargeted { target_units: target.angle().minus(zero).units() }
            }
            Err(error) => refused(&error),
        }
    }
}
