//! The contact events of a run of the reference integrator, and the observer that gets them.

use super::state::ReferenceState;
use super::system::Segment;

/// A contact event of a pair of teeth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEvent {
    /// Its instant.
    pub time_s: f64,
    /// Index of the pair.
    pub pair: usize,
    /// Its kind.
    pub kind: ContactEventKind,
}

/// The kinds of contact events.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactEventKind {
    /// An impact.
    Impact {
        /// Speed of approach, `u' - v_z`.
        approach_m_s: f64,
    },
    /// Chattering ends and sustained contact begins.
    Capture,
    /// Sustained contact ends: the normal force has fallen to zero.
    Detach,
}

/// Gets the motion and the events of a run.
pub trait ReferenceObserver {
    /// The motion from `start` to the next event: `segment` from 0 to `end`.
    fn segment(&mut self, _start: &ReferenceState, _segment: &Segment, _end: f64) {}
    /// An event, as it happens.
    fn event(&mut self, _event: &ContactEvent) {}
}

/// Ignores everything.
impl ReferenceObserver for () {}
