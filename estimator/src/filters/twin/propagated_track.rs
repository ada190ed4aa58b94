//! The track propagated through all kicks since the last frame, so that an estimate of the present costs no more after
//! many kicks than after one. [`super::process`] propagates it.

use motor_model::{Real, Time};

use super::kick_record::RotorState;

/// The track after all kicks known.
///
/// The newest kick may still be refined, so the track before it is kept too. Each kick is applied under the motion in
/// which it came.
#[derive(Clone, Copy, Debug)]
pub(super) struct PropagatedTrack<T> {
    /// Time of the track from which it was propagated, and whether the rotor rested there.
    pub(super) from: Time,
    pub(super) resting: bool,
    /// Before the newest kick, and after it.
    pub(super) before_newest: RotorState<T>,
    pub(super) state: RotorState<T>,
}

impl<T: Real> PropagatedTrack<T> {
    /// Whether it lies on the prediction of a track from `from` to `until`.
    pub(super) fn serves(&self, from: Time, until: Time, resting: bool) -> bool {
        self.from == from && self.state.at <= until && self.resting == resting
    }
}
