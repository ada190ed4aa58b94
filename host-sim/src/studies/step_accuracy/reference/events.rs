//! What an observer of a run of the reference integrator is told.

use super::state::ReferenceState;
use super::system::Segment;

/// Something that happens at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEvent {
    /// When.
    pub time_s: f64,
    /// Which pair of teeth.
    pub pair: usize,
    /// What.
    pub kind: ContactEventKind,
}

/// What can happen at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactEventKind {
    /// Tooth strikes rotor.
    Impact {
        /// Speed of approach, `u' - v_z`.
        approach_m_s: f64,
        /// Normal impulse on the rotor.
        normal_impulse_n_s: f64,
        /// Slip before the impact.
        slip_m_s: f64,
        /// Tangential impulse on the rotor.
        tangential_impulse_n_s: f64,
    },
    /// Chattering is over and lasting contact begins.
    Capture,
    /// Lasting contact ends: the normal force has fallen to zero.
    Detach,
}

/// Watches a run.
pub trait ReferenceObserver {
    /// The motion until the next event, of which the part from 0 to `end` of the segment happens, starting at `start`.
    fn segment(&mut self, _start: &ReferenceState, _segment: &Segment, _end: f64) {}
    /// An event, as it happens.
    fn event(&mut self, _event: &ContactEvent) {}
}

/// Watches nothing.
impl ReferenceObserver for () {}
