//! The state of the tilting motor, and how contacts change it.

use nalgebra::{Vector2, Vector3};

use super::clearance::Place;
use super::contact::{ContactPlaces, Velocities};
use super::rigid_body::{ShiftState, TiltState, Twist};
use super::stator_tilt::StatorTiltState;
use crate::math::Real;
use crate::modes::{Forcing, ModalState, Mode};
use crate::phase::Phase;
use crate::rotor::RotorState;

/// Everything that changes from step to step. A plain value: copy it to branch a run.
///
/// The mechanical state, all zero at the start:
///
/// | index | quantity | symbol | unit | meaning |
/// |---|---|---|---|---|
/// | 0-2 | `modes.displacement_m` | `g_A, g_B, g_C` | m | modal displacements |
/// | 3-5 | `modes.velocity_m_s` | `g_A', g_B', g_C'` | m/s | their rates |
/// | 6, 7 | `stator_tilt.displacement_m` | `g_T1, g_T2` | m | displacements of the stator's tilting modes |
/// | 8, 9 | `stator_tilt.velocity_m_s` | `g_T1', g_T2'` | m/s | their rates |
/// | 10 | `rotor.height_m` | `z` | m | height of the middle of the rotor's underside above the teeth at rest |
/// | 11 | `rotor.velocity_m_s` | `v_z` | m/s | its rate, upward |
/// | 12 | `rotor.angle` | `theta` | 2^-32 turn | angle of the rotor about its own axis, clockwise |
/// | 13 | `rotor.rate_rad_s` | `omega = -W` | rad/s | its rate |
/// | 14, 15 | `tilt.slope` | `eta_x, eta_y` | 1 | slopes of the rotor's plane |
/// | 16, 17 | `tilt.rate_rad_s` | `eta_x', eta_y'` | rad/s | their rates |
/// | 18, 19 | `shift.displacement_m` | `x, y` | m | shift of the mass centre from the axis |
/// | 20, 21 | `shift.velocity_m_s` | `x', y'` | m/s | its rate |
/// | | `in_contact` | | | where the rotor is in sustained contact |
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TiltingState<T: Real> {
    /// Steps taken.
    pub steps: u64,
    /// Phase of the drive.
    pub phase: Phase,
    /// The stator's modes A, B and C.
    pub modes: ModalState<T>,
    /// The stator's tilting modes.
    pub stator_tilt: StatorTiltState<T>,
    /// Height and spin of the rotor.
    pub rotor: RotorState<T>,
    /// Tilt of the rotor.
    pub tilt: TiltState<T>,
    /// Shift of the rotor.
    pub shift: ShiftState<T>,
    /// The drive now in force.
    pub forcing: Forcing<T>,
    /// Where the rotor is in sustained contact. Always empty with [`crate::ImpactRule::EndOfStep`].
    pub in_contact: ContactPlaces,
}

/// The state without the drive in force and the count of steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct TiltingMotion<T> {
    pub(super) phase: Phase,
    pub(super) modes: ModalState<T>,
    pub(super) stator_tilt: StatorTiltState<T>,
    pub(super) rotor: RotorState<T>,
    pub(super) tilt: TiltState<T>,
    pub(super) shift: ShiftState<T>,
    pub(super) in_contact: ContactPlaces,
}

impl<T: Real> TiltingMotion<T> {
    /// The whole state, for the ledger.
    pub(super) fn under(&self, forcing: &Forcing<T>) -> TiltingState<T> {
        let Self { phase, modes, stator_tilt, rotor, tilt, shift, in_contact } = *self;
        TiltingState {
            steps: 0,
            phase,
            modes,
            stator_tilt,
            rotor,
            tilt,
            shift,
            forcing: *forcing,
            in_contact,
        }
    }

    /// What the test for contacts needs.
    #[inline]
    pub(super) fn place(&self) -> Place<'_, T> {
        let Self { modes, stator_tilt, rotor, tilt, shift, .. } = self;
        Place { modes, stator_tilt, rotor, tilt, shift }
    }

    pub(super) fn velocities(&self) -> Velocities<T> {
        Velocities {
            rotor: Twist {
                rise: self.rotor.velocity_m_s,
                turn: self.rotor.rate_rad_s,
                shift: self.shift.velocity_m_s,
                slope: self.tilt.rate_rad_s,
            },
            modes: self.modes.velocity_m_s,
            stator_tilt: self.stator_tilt.velocity_m_s,
        }
    }

    pub(super) fn set_velocities(&mut self, velocities: &Velocities<T>) {
        let Velocities { rotor, modes, stator_tilt } = velocities;
        self.rotor.velocity_m_s = rotor.rise;
        self.rotor.rate_rad_s = rotor.turn;
        self.shift.velocity_m_s = rotor.shift;
        self.tilt.rate_rad_s = rotor.slope;
        self.modes.velocity_m_s = *modes;
        self.stator_tilt.velocity_m_s = *stator_tilt;
    }

    /// Moves the rotor at once, without a turn.
    pub(super) fn move_rotor(&mut self, by: &Twist<T>) {
        self.rotor.height_m += by.rise;
        self.shift.displacement_m += by.shift;
        self.tilt.slope += by.slope;
    }

    /// The same velocities, which changed evenly over the last `span_s`, the fraction `part` of a step: the positions
    /// follow by half of the change, those of the modes by what leaves them at rest under a constant force.
    pub(super) fn set_velocities_evenly(
        &mut self,
        velocities: &Velocities<T>,
        follow: &Follow<T>,
        part: T,
        span_s: T,
    ) {
        let Velocities { rotor, modes, stator_tilt } = velocities;
        self.set_rotor_evenly(rotor, span_s);
        self.modes.displacement_m += (modes - self.modes.velocity_m_s).component_mul(&follow.modes_s) * part;
        self.stator_tilt.displacement_m +=
            (stator_tilt - self.stator_tilt.velocity_m_s).component_mul(&(follow.stator_tilt_s * part));
        self.modes.velocity_m_s = *modes;
        self.stator_tilt.velocity_m_s = *stator_tilt;
    }

    /// The rotor's part of [`Self::set_velocities_evenly`].
    #[inline]
    pub(super) fn set_rotor_evenly(&mut self, to: &Twist<T>, span_s: T) {
        let half_s = T::from_f64(0.5) * span_s;
        self.rotor.height_m += half_s * (to.rise - self.rotor.velocity_m_s);
        self.rotor.angle.turn_by_radians(half_s * (to.turn - self.rotor.rate_rad_s));
        self.shift.displacement_m += (to.shift - self.shift.velocity_m_s) * half_s;
        self.tilt.slope += (to.slope - self.tilt.rate_rad_s) * half_s;
        self.rotor.velocity_m_s = to.rise;
        self.rotor.rate_rad_s = to.turn;
        self.shift.velocity_m_s = to.shift;
        self.tilt.rate_rad_s = to.slope;
    }
}

impl<T: Real> TiltingState<T> {
    #[inline]
    pub(super) fn motion(&self) -> TiltingMotion<T> {
        let Self { phase, modes, stator_tilt, rotor, tilt, shift, in_contact, .. } = *self;
        TiltingMotion { phase, modes, stator_tilt, rotor, tilt, shift, in_contact }
    }

    #[inline]
    pub(super) fn move_to(&mut self, motion: &TiltingMotion<T>) {
        let TiltingMotion { phase, modes, stator_tilt, rotor, tilt, shift, in_contact } = *motion;
        self.steps += 1;
        (self.phase, self.modes, self.stator_tilt) = (phase, modes, stator_tilt);
        (self.rotor, self.tilt, self.shift, self.in_contact) = (rotor, tilt, shift, in_contact);
    }
}

/// How far the modes move per change of velocity by a constant force over a step: half a step and a little more.
///
/// A mode at rest under a force has moved by `(P - I)_gg g` at the end of a free step and has the velocity
/// `(P - I)_vg g`. The force takes both back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Follow<T> {
    modes_s: Vector3<T>,
    stator_tilt_s: Vector2<T>,
}

impl<T: Real> Follow<T> {
    pub(super) fn new(modes: &[Mode; 3], pair: &[Mode; 2], step_s: f64) -> Self {
        let follow = |mode: &Mode| {
            let [[gg, _], [vg, _]] = mode.propagator_minus_identity(step_s);
            // Steps of half a period and more are not resolved.
            T::from_f64(if mode.natural_rad_s * step_s < 2.0 { gg / vg } else { 0.5 * step_s })
        };
        let ([a, b, c], [first, second]) = (modes.each_ref().map(follow), pair.each_ref().map(follow));
        Self { modes_s: Vector3::new(a, b, c), stator_tilt_s: Vector2::new(first, second) }
    }
}
