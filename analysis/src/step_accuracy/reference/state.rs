//! The state of the reference integrator.
//!
//! | field | symbol | unit | meaning | at the start |
//! |---|---|---|---|---|
//! | `time_s` | `t` | s | time | 0 |
//! | `modes` | `g_n`, `g_n'` | m, m/s | displacements and velocities of modes A, B, C | 0 |
//! | `height_m` | `z` | m | height of the rotor above the teeth at rest | 0 |
//! | `velocity_m_s` | `v_z` | m/s | vertical velocity of the rotor | 0 |
//! | `angle_rad` | `theta` | rad | angle turned, clockwise positive | 0 |
//! | `rate_rad_s` | `theta'` | rad/s | angular rate | 0 |
//! | `phase_turns` | | turns | phase of the drive, in 0..1 | 0 |
//! | `contact` | | | pairs of teeth in sustained contact | none |
//! | `roots_at_start` | | | multiplicity of the root of each gap now | 0 |

use motor_model::ModalState;

use super::system::{Contact, Vertical};

/// The state of the motor in the reference integrator.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceState {
    /// Time since the start.
    pub time_s: f64,
    /// The stator.
    pub modes: ModalState<f64>,
    /// Height of the rotor above the teeth at rest.
    pub height_m: f64,
    /// Vertical velocity of the rotor.
    pub velocity_m_s: f64,
    /// Angle turned, clockwise positive.
    pub angle_rad: f64,
    /// Angular rate.
    pub rate_rad_s: f64,
    /// Phase of the drive, in 0..1.
    pub phase_turns: f64,
    /// Pairs of teeth in sustained contact.
    pub contact: Contact,
    /// Multiplicity of the root of each gap now: 1 after an impact, 2 or 3 after sustained contact, else 0.
    pub(super) roots_at_start: [usize; 2],
}

impl ReferenceState {
    pub(super) fn vertical(&self) -> Vertical {
        Vertical { modes: self.modes, height_m: self.height_m, velocity_m_s: self.velocity_m_s }
    }

    pub(super) fn set_vertical(&mut self, vertical: &Vertical) {
        self.modes = vertical.modes;
        self.height_m = vertical.height_m;
        self.velocity_m_s = vertical.velocity_m_s;
    }
}
