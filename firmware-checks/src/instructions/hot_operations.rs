//! The most frequent operations, each some hundred times. `host-sim instructions --cycles` follows every instruction.

use super::{constant_rate, filter_core, loop_tick, twin_step};
use crate::parity::LoopMemory;
use motor_model::OutOfBounds;

/// Runs them. The loop is the last and the longest: the run may be stopped in it.
///
/// # Errors
/// When the model refuses the nominal motor: never.
pub fn run_hot_operations(memory: &mut LoopMemory) -> Result<(), OutOfBounds> {
    twin_step::run_hot_operations()?;
    filter_core::run_hot_operations();
    constant_rate::run_hot_operations();
    loop_tick::run_hot_operations(memory)
}
