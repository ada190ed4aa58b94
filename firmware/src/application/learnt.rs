//! What the move has learnt of the motor, for the host to keep.

use controller::map_correction::LearntFactors;
use link::{BoardFault, BoardMessage};

use super::Application;
use super::configured_move::{Configured, Move};

impl<D> Application<'_, D> {
    /// What the configured move has learnt until now.
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn learnt(&self) -> BoardMessage {
        match &self.memory.configured {
            Some(Configured::Move(Move { positioning, .. })) => {
                BoardMessage::Learnt(LearntFactors::from(positioning.correction()).into())
            }
            _ => BoardMessage::Fault(BoardFault::NoMove),
        }
    }
}
