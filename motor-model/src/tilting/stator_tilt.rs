//! The stator's two tilting modes: a pair that only contacts excite.
//!
//! ```text
//! g_T'' + 2 zeta_T w_T g_T' + w_T^2 g_T = -(jumps at contacts)     shape cos th (T1) and sin th (T2) at the teeth
//! w_T1 = (1 - s/2) w_T,   w_T2 = (1 + s/2) w_T                     s: the split, 0 for four equal springs
//! ```
//!
//! They decide how a single tooth recoils. An impulse P on it drives all five modes. With the modal masses `m_s` in A
//! and `m_s / 2` in the others it jumps by `(1 + 2 + 2) P/m_s = 5 P/m_s`. Two impulses P/2 on a pair cancel in T1 and
//! T2 and leave `3 P/m_s`, the recoil of the height-only motor. Without these modes a blow on one tooth would move the
//! opposite tooth as much as the struck one.

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

/// Modes T1 and T2, of equal damping ratio and modal mass: `m_s / 2` in a rigid ring.
pub(super) fn stator_tilt_modes(params: &MotorParams, tilting: &TiltingParams) -> [Mode; 2] {
    use TiltingParameter::{
        StatorTiltDampingRatio, StatorTiltFrequency, StatorTiltMassFraction, StatorTiltSplit,
    };
    let half_split = 0.5 * tilting.get(StatorTiltSplit);
    [1.0 - half_split, 1.0 + half_split].map(|part| Mode {
        natural_rad_s: TAU * tilting.get(StatorTiltFrequency) * part,
        damping_ratio: tilting.get(StatorTiltDampingRatio),
        mass_kg: params.get(Parameter::StatorMass) * tilting.get(StatorTiltMassFraction),
        antinode_amplitude_m: 0.0,
    })
}

/// `exp(A t) - I` of both modes over some time, entry by entry.
#[derive(Clone, Copy, Debug)]
pub(super) struct StatorTiltSpan<T> {
    gg: Vector2<T>,
    gv: Vector2<T>,
    vg: Vector2<T>,
    vv: Vector2<T>,
}

impl<T: Real> StatorTiltSpan<T> {
    fn new([[[gg_1, gv_1], [vg_1, vv_1]], [[gg_2, gv_2], [vg_2, vv_2]]]: [[[T; 2]; 2]; 2]) -> Self {
        Self {
            gg: Vector2::new(gg_1, gg_2),
            gv: Vector2::new(gv_1, gv_2),
            vg: Vector2::new(vg_1, vg_2),
            vv: Vector2::new(vv_1, vv_2),
        }
    }

    #[inline]
    pub(super) fn advance(&self, state: &mut StatorTiltState<T>) {
        let (g, v) = (state.displacement_m, state.velocity_m_s);
        state.displacement_m += g.component_mul(&self.gg) + v.component_mul(&self.gv);
        state.velocity_m_s += g.component_mul(&self.vg) + v.component_mul(&self.vv);
    }
}

/// Free motion of the pair over one step and over parts of it.
#[derive(Clone, Debug)]
pub(super) struct StatorTiltFlight<T> {
    pub(super) step: StatorTiltSpan<T>,
    first: FreeMode<T>,
    /// Of the second mode, where its frequency is another.
    second: Option<FreeMode<T>>,
}

impl<T: Real> StatorTiltFlight<T> {
    pub(super) fn new(pair: &[Mode; 2], step_s: f64) -> Self {
        let [first, second] = pair;
        let rows = |mode: &Mode| mode.propagator_minus_identity(step_s).map(|row| row.map(T::from_f64));
        Self {
            step: StatorTiltSpan::new(pair.each_ref().map(rows)),
            first: FreeMode::new(first, step_s),
            second: (second.natural_rad_s > first.natural_rad_s).then(|| FreeMode::new(second, step_s)),
        }
    }

    /// Over the fraction `part` of a step; no transcendental call.
    pub(super) fn part(&self, part: T) -> StatorTiltSpan<T> {
        let first = self.first.propagator(part);
        let second = self.second.as_ref().map_or(first, |mode| mode.propagator(part));
        StatorTiltSpan::new([first, second])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each mode rings at its own frequency, over a step and over parts of it: closed form of a free oscillator. With
    /// a split of 0.1 they lie at 2897.5 and 3202.5 Hz.
    #[test]
    fn exact_both_modes_ring_at_their_own_frequencies() {
        let step_s = 10e-6;
        for (split, hertz) in [(0.0, [3050.0, 3050.0]), (0.1, [2897.5, 3202.5])] {
            let tilting = TiltingParams::nominal().with(TiltingParameter::StatorTiltSplit, split).unwrap();
            let modes = stator_tilt_modes(&MotorParams::nominal(), &tilting);
            let flight = StatorTiltFlight::<f64>::new(&modes, step_s);
            for (span, part) in [(flight.step, 1.0), (flight.part(1.0), 1.0), (flight.part(0.3), 0.3)] {
                let mut state = StatorTiltState {
                    displacement_m: Vector2::new(1e-6, 1e-6),
                    velocity_m_s: Vector2::zeros(),
                };
                span.advance(&mut state);
                for (hertz, g) in hertz.into_iter().zip(&state.displacement_m) {
                    let (w, zeta, t) = (TAU * hertz, 0.02_f64, part * step_s);
                    let wd = w * (1.0 - zeta * zeta).sqrt();
                    let wanted =
                        1e-6 * (-zeta * w * t).exp() * ((wd * t).cos() + zeta * w / wd * (wd * t).sin());
                    assert!((g - wanted).abs() < 1e-17, "{split} {part}: {g:e} {wanted:e}");
                }
            }
        }
    }

    /// A rigid ring has the modal mass of half of it; a stator of its own what is set.
    #[test]
    fn exact_modal_mass() {
        let params = MotorParams::nominal();
        for (fraction, mass_kg) in [(None, 5.35e-6), (Some(0.51), 5.457e-6)] {
            let nominal = TiltingParams::nominal();
            let tilting = fraction.map_or(nominal, |fraction| {
                nominal.with(TiltingParameter::StatorTiltMassFraction, fraction).unwrap()
            });
            for mode in stator_tilt_modes(&params, &tilting) {
                assert!((mode.mass_kg / mass_kg - 1.0).abs() < 1e-12, "{}", mode.mass_kg);
            }
        }
    }
}
