//! The track through many kicks, a few of them at a time.
//!
//! A frame of a slow or late camera was exposed some hundred kicks ago. To fuse it the track is carried to its
//! exposure, and then through all kicks since. A microcontroller has no time for so many in one tick:
//!
//! ```text
//!     last frame         exposure            now
//!   ------+-----------------+-----------------+------> kicks
//!         |....c.....c.....c|                    checkpoints c, from when the kicks came: at most 63 kicks to go
//!                           |=====|=====|=====|  KICKS_PER_SAMPLE with each sample, until the track is at now
//! ```
//!
//! Until then the estimate is that of the track before the frame, which does not know it yet. The work is ordered by
//! the samples alone, so that any two programs do the same.

use heapless::Deque;
use motor_model::{Real, Time};

use super::kicks_kept::IMPACTS_KEPT_MAX;
use crate::camera::track::{Place, State};
use crate::camera::track_covariance::TrackCovariance;

/// Most kicks through which a track that a frame has moved is carried with one sample of the vibrometer.
pub(super) const KICKS_PER_SAMPLE: usize = 32;

/// Most checkpoints: one for each [`KICKS_PER_SAMPLE`] of the kicks kept.
const KEPT: usize = IMPACTS_KEPT_MAX / KICKS_PER_SAMPLE;

/// The track on its way through the kicks since the last frame, every [`KICKS_PER_SAMPLE`] kicks.
#[derive(Clone, Debug)]
pub(super) struct Checkpoints<T, B> {
    /// The track that they were carried from.
    from: Option<Place<T>>,
    states: Deque<State<T, B>, KEPT>,
    /// Kicks since the newest.
    kicks: usize,
}

impl<T: Real, B: TrackCovariance<T>> Checkpoints<T, B> {
    pub(super) const fn none() -> Self {
        Self { from: None, states: Deque::new(), kicks: 0 }
    }

    /// There are none of the track that a frame has moved to this place.
    pub(super) fn begin(&mut self, from: Place<T>) {
        self.from = Some(from);
        self.states.clear();
        self.kicks = 0;
    }

    /// The track itself has been carried to this place, through kicks that are kept no longer.
    pub(super) fn follow(&mut self, from: Place<T>) {
        self.from = Some(from);
    }

    /// The track is `state` after a kick more.
    pub(super) fn pass(&mut self, state: &State<T, B>) {
        self.kicks += 1;
        if self.kicks >= KICKS_PER_SAMPLE {
            self.keep(state);
        }
    }

    /// Keeps `state`; the oldest goes where there is no room.
    pub(super) fn keep(&mut self, state: &State<T, B>) {
        if self.states.is_full() {
            self.states.pop_front();
        }
        // There is room now.
        let _ = self.states.push_back(state.copied());
        self.kicks = 0;
    }

    /// Carries the track `state` to the last checkpoint until `until`, if there is one after it.
    pub(super) fn go_on(&self, state: &mut State<T, B>, resting: bool, until: Time) {
        if self.states.is_empty() || self.from != Some(Place::new(state, resting)) {
            return;
        }
        let passed = self.states.iter().rev().find(|passed| passed.at <= until);
        if let Some(passed) = passed.filter(|passed| passed.at > state.at) {
            *state = passed.copied();
        }
    }
}
