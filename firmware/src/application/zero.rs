//! The angle from which targets and limits are counted, and all angles that the board tells.
//!
//! It lies between the link and the loop: filters and controller keep the camera's angle, so that they compute the bits
//! that the host simulates. What comes in is counted from it when a move or a rate begins, and what goes out in the
//! report of each tick.

use link::{BoardFault, BoardMessage};
use motor_model::{Angle, OutOfBounds};

use super::description::refused;
use super::retarget::usable_angle;
use super::{Application, State, time};
use crate::design::DesignedDrive;

/// The greatest zero to either side in degrees, as of a target: a thousand turns.
const ZERO_MAX_DEG: f64 = 360_000.0;

impl<D: DesignedDrive> Application<'_, D> {
    /// Sets the zero to the camera's angle `units`, before arming, or where there is none to the angle at which the
    /// rotor is now, while armed. Any refusal leaves it as it is.
    // Never inlined: the stack that it takes is then not part of every tick's.
    #[inline(never)]
    pub(super) fn set_zero(&mut self, units: Option<i64>) -> BoardMessage {
        let angle = match (units, &self.state) {
            (Some(_), State::Armed | State::Jogging(_)) => return self.refused_while_driving(),
            (Some(units), State::Safe | State::Latched(_)) => {
                let (angle, max) = (Angle::from_units(units), ZERO_MAX_DEG);
                let checked = OutOfBounds::check("position.zero_deg", angle.degrees(), -max, max, "deg");
                if let Err(error) = checked {
                    return refused(&error);
                }
                angle
            }
            (None, State::Armed) => {
                let filter = self.memory.filter.as_ref();
                match filter.and_then(|filter| usable_angle(filter, time(self.elapsed_ticks))) {
                    Some(angle) => angle,
                    None => return BoardMessage::Fault(BoardFault::NoEstimate),
                }
            }
            (None, _) => return BoardMessage::Fault(self.fault()),
        };
        self.zero = angle;
        BoardMessage::Zeroed { angle_units: angle.units() }
    }
}
