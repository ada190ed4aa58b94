//! The track propagated through all kicks since the last frame, so that an estimate of the present costs no more after
//! many kicks than after one.

use motor_model::{Real, Time};

use super::kick_record::RotorState;
use super::process::TwinProcess;

/// The track after all kicks known.
///
/// The newest kick may still be refined, so the track before it is kept too. Each kick is applied under the motion in
/// which it came.
#[derive(Clone, Copy, Debug)]
pub(super) struct PropagatedTrack<T> {
    /// Time of the track from which it was propagated.
    pub(super) from: Time,
    resting: bool,
    /// Before the newest kick, and after it.
    before_newest: RotorState<T>,
    pub(super) state: RotorState<T>,
}

impl<T: Real> PropagatedTrack<T> {
    /// From the track as it is, through all kicks of the `process`; `None` if there are none after it.
    pub(super) fn of(state: &RotorState<T>, resting: bool, process: &TwinProcess<'_, T>) -> Option<Self> {
        let first = process.first_after(state.at);
        let newest = process.kicks.len().checked_sub(1).filter(|&newest| newest >= first)?;
        let mut before_newest = state.copied();
        (first..newest).for_each(|kick| process.predict_through(&mut before_newest, resting, kick));
        let propagated = Self { from: state.at, resting, state: before_newest.copied(), before_newest };
        Some(propagated.with_newest(process))
    }

    /// The same through one kick more.
    pub(super) fn extended(&self, process: &TwinProcess<'_, T>) -> Self {
        let Self { from, resting, state, .. } = self;
        Self { from: *from, resting: *resting, before_newest: state.copied(), state: state.copied() }
            .with_newest(process)
    }

    /// The same with the newest kick applied again, after it was refined.
    pub(super) fn with_newest(&self, process: &TwinProcess<'_, T>) -> Self {
        let mut state = self.before_newest.copied();
        if let Some(newest) = process.kicks.len().checked_sub(1) {
            process.predict_through(&mut state, self.resting, newest);
        }
        Self { from: self.from, resting: self.resting, before_newest: self.before_newest.copied(), state }
    }

    /// Whether it lies on the prediction of a track from `from` to `until`.
    pub(super) fn serves(&self, from: Time, until: Time, resting: bool) -> bool {
        self.from == from && self.state.at <= until && self.resting == resting
    }
}
