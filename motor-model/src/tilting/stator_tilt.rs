//! The stator's two tilting modes: an equal pair that only contacts excite.
//!
//! ```text
//! g_T'' + 2 zeta_T w_T g_T' + w_T^2 g_T = -(jumps at contacts)     shape cos th (T1) and sin th (T2) at the teeth
//! ```
//!
//! They decide how a single tooth recoils. An impulse P on it drives all five modes, and it jumps by
//! `(1 + 2 + 2) P/m_s = 5 P/m_s`. Two impulses P/2 on a pair cancel in T1 and T2 and leave `3 P/m_s`, the recoil of the
//! height-only motor. Without these modes a blow on one tooth would move the opposite tooth as much as the struck one.

use core::f64::consts::TAU;

use nalgebra::Vector2;

use crate::math::Real;
use crate::modes::{FreeMode, Mode};
use crate::params::{MotorParams, Parameter, TiltingParameter, TiltingParams};

/// Displacement and velocity of both tilting modes at the tooth radius: the stator tilt rows of
/// [`super::TiltingState`]'s table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatorTiltState<T> {
    /// `g_T1, g_T2` in m.
    pub displacement_m: Vector2<T>,
    /// Their rates in m/s.
    pub velocity_m_s: Vector2<T>,
}

impl<T: Real> Default for StatorTiltState<T> {
    fn default() -> Self {
        Self { displacement_m: Vector2::zeros(), velocity_m_s: Vector2::zeros() }
    }
}

/// The mode that both are, with the modal mass `m_s / 2` of a rigid ring that tilts.
pub(super) fn stator_tilt_mode(params: &MotorParams, tilting: &TiltingParams) -> Mode {
    Mode {
        natural_rad_s: TAU * tilting.get(TiltingParameter::StatorTiltFrequency),
        damping_ratio: tilting.get(TiltingParameter::StatorTiltDampingRatio),
        mass_kg: params.get(Parameter::StatorMass) / 2.0,
        antinode_amplitude_m: 0.0,
    }
}

/// `exp(A t) - I` of the pair over some time.
#[derive(Clone, Copy, Debug)]
pub(super) struct StatorTiltSpan<T> {
    rows: [[T; 2]; 2],
}

impl<T: Real> StatorTiltSpan<T> {
    #[inline]
    pub(super) fn advance(&self, state: &mut StatorTiltState<T>) {
        let [[gg, gv], [vg, vv]] = self.rows;
        let (g, v) = (state.displacement_m, state.velocity_m_s);
        state.displacement_m += g * gg + v * gv;
        state.velocity_m_s += g * vg + v * vv;
    }
}

/// Free motion of the pair over one step and over parts of it.
#[derive(Clone, Debug)]
pub(super) struct StatorTiltFlight<T> {
    pub(super) step: StatorTiltSpan<T>,
    mode: FreeMode<T>,
}

impl<T: Real> StatorTiltFlight<T> {
    pub(super) fn new(mode: &Mode, step_s: f64) -> Self {
        Self {
            step: StatorTiltSpan {
                rows: mode.propagator_minus_identity(step_s).map(|row| row.map(T::from_f64)),
            },
            mode: FreeMode::new(mode, step_s),
        }
    }

    /// Over the fraction `part` of a step; no transcendental call.
    pub(super) fn part(&self, part: T) -> StatorTiltSpan<T> {
        StatorTiltSpan { rows: self.mode.propagator(part) }
    }
}
