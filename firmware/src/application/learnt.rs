//! What the task has learnt of the motor, for the host to keep: of a rate, where the resonances are.

use controller::map_correction::{LearntFactors, MapCorrection};
use link::{BoardFault, BoardMessage};

use super::Application;
use super::configured_move::{Configured, Move, MoveMemory};

impl<D> Application<'_, D> {
    /// What the task has learnt since it was armed.
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn learnt(&self) -> BoardMessage {
        let MoveMemory { configured, tracker, map, .. } = &*self.memory;
        let correction = match (configured, map.map()) {
            (Some(Configured::Move(Move { positioning, .. })), _) => Some(*positioning.correction()),
            (Some(Configured::Rate(_)), Ok(map)) => Some(MapCorrection::of(map)),
            _ => None,
        };
        match (correction, tracker) {
            (Some(correction), Some(tracker)) => {
                BoardMessage::Learnt(LearntFactors::new(&correction, tracker.offsets()).into())
            }
            _ => BoardMessage::Fault(BoardFault::NoMove),
        }
    }
}
