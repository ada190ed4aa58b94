//! A pair of teeth with its estimated shape, and the derivatives of the shape.
//!
//! The shape of a pair, its displacement per displacement of each mode, differs from the nominal one by the amplitude
//! of the pair, `s`, and by the teeth's angle, `d` in rad. Both are constant in a run:
//!
//! ```text
//! phi_B = (1 + s) sin 2 (th + d):    dphi_B = s phi_B + 2 d phi_C
//! phi_C = (1 + s) cos 2 (th + d):    dphi_C = s phi_C - 2 d phi_B
//! ```
//!
//! Lever (tangential velocity per modal velocity) and recoil (modal velocity per jump) change in the same way: (B, C)
//! of each is that of the shape, turned by a right angle or not at all, times a constant. So it is for one shift and
//! one modal mass of both modes, as in the paper; the derivatives of a design with two leave the difference out.

use motor_model::Real;
use nalgebra::Vector3;

use super::states::{MotionErrors, PAIR_AMPLITUDES, Row, TOOTH_ANGLE};
use super::stator::StatorFilter;

/// A pair of teeth; each vector has one entry a mode.
pub(super) struct Tooth<T> {
    /// Which one.
    pub(super) pair: usize,
    /// Its amplitude, as the part by which it differs from nominal.
    pub(super) amplitude: T,
    pub(super) shape: Vector3<T>,
    pub(super) lever: Vector3<T>,
    pub(super) recoil: Vector3<T>,
}

impl<T: Real> StatorFilter<T> {
    /// Pair 0 or 1, were the parameters corrected by `errors`.
    #[inline]
    pub(super) fn tooth(&self, pair: usize, errors: &Row<T>) -> Tooth<T> {
        let [first, second] = self.model.teeth();
        let nominal = if pair == 0 { first } else { second };
        let amplitude = self.parameter(PAIR_AMPLITUDES + pair, errors);
        let angle = self.parameter(TOOTH_ANGLE, errors);
        let estimated = |of: &Vector3<T>| of + by_amplitude(of) * amplitude + by_angle(of) * angle;
        Tooth {
            pair,
            amplitude,
            shape: estimated(&nominal.shape),
            lever: estimated(&nominal.lever),
            recoil: estimated(&nominal.recoil),
        }
    }
}

impl<T: Real> Tooth<T> {
    /// A row of these entries: of the modes, of instant and jump, of the mass ratio and the restitution, and by
    /// amplitude and angle of the teeth.
    #[inline]
    pub(super) fn row(
        &self,
        [height, g_a, v_a, g_b, v_b, g_c, v_c]: MotionErrors<T>,
        [instant, jump]: [T; 2],
        [mass_ratio, restitution]: [T; 2],
        [amplitude, angle]: [T; 2],
    ) -> Row<T> {
        let zero = T::zero();
        let [first, second] = if self.pair == 0 { [amplitude, zero] } else { [zero, amplitude] };
        Row {
            lead: [height, g_a, v_a, g_b, v_b, g_c, v_c, instant, jump],
            last: [mass_ratio, restitution, first, second, angle, zero],
        }
    }
}

/// Derivative of shape, lever or recoil by the pair's amplitude: modes B and C alone.
pub(super) fn by_amplitude<T: Real>(of: &Vector3<T>) -> Vector3<T> {
    Vector3::new(T::zero(), of.y, of.z)
}

/// Derivative of shape, lever or recoil by the teeth's angle, per rad.
pub(super) fn by_angle<T: Real>(of: &Vector3<T>) -> Vector3<T> {
    Vector3::new(T::zero(), of.z, -of.y) * T::from_f64(2.0)
}
