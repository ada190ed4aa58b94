//! An order of an experiment, and the question what the last one has shown.

use link::{BoardFault, BoardMessage, ExperimentRecord};

use super::configured_move::Configured;
use super::description::refused;
use super::{Application, State};
use crate::design::DesignedDrive;

impl<D: DesignedDrive> Application<'_, D> {
    /// Orders an experiment, or tells what the last one has shown where there is no `order`.
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn experiment(&mut self, order: Option<&ExperimentRecord>) -> BoardMessage {
        let (State::Armed, Some(Configured::Experiments(experiments))) =
            (&self.state, &mut self.memory.configured)
        else {
            return BoardMessage::Fault(BoardFault::NoExperiments);
        };
        match order {
            Some(order) => experiments.order(order).unwrap_or_else(|error| refused(&error)),
            None => experiments.response(),
        }
    }
}
