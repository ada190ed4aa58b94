//! What is told of one kick.

use motor_model::Real;

use crate::camera::track::State;

/// What is told of one kick.
#[derive(Clone, Copy, Debug, Default)]
pub(in super::super) struct ToldKick<T> {
    /// Whether the tooth's velocity is the true one.
    pub(super) tooth_velocity: bool,
    /// Friction per its nominal value; `None` where it is not told.
    pub(super) friction: Option<T>,
    /// The kick itself, of an impact that the vibrometer does not detect.
    pub(super) small_rad_s: Option<T>,
}

impl<T: Real> ToldKick<T> {
    /// Whether the vibrometer has not detected it.
    pub(in super::super) fn is_small(&self) -> bool {
        self.small_rad_s.is_some()
    }

    /// Whether samples to come tell no more of the tooth's velocity.
    pub(in super::super) fn has_tooth_velocity(&self) -> bool {
        self.tooth_velocity
    }

    /// Applies a kick that is known; whether it is.
    pub(in super::super) fn apply<B>(&self, state: &mut State<T, B>) -> bool {
        if let Some(small_rad_s) = self.small_rad_s {
            state.rate_rad_s += small_rad_s;
        }
        self.is_small()
    }

    /// Friction and tooth factor, as told or else as estimated; and the parts of their errors that matter: 0 where they
    /// are told, else 1.
    pub(in super::super) fn factors(&self, [friction, tooth_factor]: [T; 2]) -> ([T; 2], [T; 2]) {
        let tooth_factor = if self.tooth_velocity { T::one() } else { tooth_factor };
        let parts = [self.friction.is_some(), self.tooth_velocity];
        let parts = parts.map(|told| if told { T::zero() } else { T::one() });
        ([self.friction.unwrap_or(friction), tooth_factor], parts)
    }
}
