//! The hot operations, each a few hundred times and nothing else: what `host-sim instructions --cycles` follows instruction by instruction.

use super::{core, estimation, position, twin};
use crate::parity::LoopPlace;
use motor_model::OutOfBounds;

/// Runs them; the loop is the last, and so long that whoever follows may stop.
///
/// # Errors
/// When the model refuses the nominal motor: never.
pub fn rehearse(place: &mut LoopPlace) -> Result<(), OutOfBounds> {
    twin::rehearse()?;
    core::rehearse();
    estimation::rehearse();
    position::rehearse(place)
}
