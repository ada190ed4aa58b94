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

use motor_model::{Angle, AngleAccumulator, ModalState, MotorState, Phase, RotorState};

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

/// The state of a fixed-step motor, at time zero.
impl From<&MotorState<f64>> for ReferenceState {
    #[expect(clippy::cast_precision_loss, reason = "rounds to 53 bits: 1e-16 of a turn")]
    fn from(state: &MotorState<f64>) -> Self {
        let angle = &state.rotor.angle;
        let unit_rad = Angle::from_units(1).radians_since::<f64>(Angle::ZERO);
        Self {
            modes: state.modes,
            height_m: state.rotor.height_m,
            velocity_m_s: state.rotor.velocity_m_s,
            angle_rad: angle.angle().radians_since::<f64>(Angle::ZERO) + unit_rad * angle.residual_units(),
            rate_rad_s: state.rotor.rate_rad_s,
            phase_turns: state.phase.units() as f64 / 18_446_744_073_709_551_616.0,
            ..Self::default()
        }
    }
}

/// The state from which a fixed-step motor continues. It counts its steps from zero.
impl From<&ReferenceState> for MotorState<f64> {
    fn from(state: &ReferenceState) -> Self {
        let whole = Angle::from_degrees(state.angle_rad.to_degrees());
        let mut angle = AngleAccumulator::at(whole);
        angle.turn_by_radians(state.angle_rad - whole.radians_since::<f64>(Angle::ZERO));
        Self {
            phase: Phase::from_turns(state.phase_turns),
            modes: state.modes,
            rotor: RotorState {
                height_m: state.height_m,
                velocity_m_s: state.velocity_m_s,
                angle,
                rate_rad_s: state.rate_rad_s,
            },
            ..Self::default()
        }
    }
}
