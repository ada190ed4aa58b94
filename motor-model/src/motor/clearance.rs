//! Is there room for an impact in this step? Most steps have none, and must know it cheaply.
//!
//! Both pairs swing by `+-(phi_B g_B + phi_C g_C)` about `g_A`, so one look serves for both. The cubic through a gap and its rate at both ends of a
//! step lies in the hull of its control points; the motion itself lies within a margin of the cubic.

use nalgebra::Vector3;

use super::Motor;
use crate::math::Real;
use crate::modes::ModalState;
use crate::rotor::RotorState;

/// Bound of what a cubic through value and slope at both ends of a step misses, per step and change of slope: `(w h)^2 / 384` for a pure
/// oscillation at `w`, taken four times.
pub(super) fn cubic_margin(fastest_rad: f64) -> f64 {
    4.0 / 384.0 * fastest_rad * fastest_rad
}

/// The rotor over the teeth: its height above the stator's mean, and how far the first pair swings from there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance<T> {
    height_m: T,
    swing_m: T,
    velocity_m_s: T,
    swing_m_s: T,
}

impl<T: Real> Motor<T> {
    /// The rotor over the teeth, as far as [`Self::surely_clear`] needs to know.
    #[inline]
    pub(super) fn clearance(&self, modes: &ModalState<T>, rotor: &RotorState<T>) -> Clearance<T> {
        let [tooth, _] = &self.teeth;
        let swing = |x: &Vector3<T>| tooth.shape.y * x.y + tooth.shape.z * x.z;
        Clearance {
            height_m: rotor.height_m - modes.displacement_m.x,
            swing_m: swing(&modes.displacement_m),
            velocity_m_s: rotor.velocity_m_s - modes.velocity_m_s.x,
            swing_m_s: swing(&modes.velocity_m_s),
        }
    }

    /// Whether neither gap can vanish between two states a step of free motion apart.
    ///
    /// The first control point, the start, need not be looked at: the last step ended above the teeth, and a rotor that was put inside one and leaves
    /// it strikes nothing.
    #[inline]
    pub(super) fn surely_clear(&self, start: &Clearance<T>, end: &Clearance<T>) -> bool {
        let third_s = self.step * T::from_f64(1.0 / 3.0);
        let turned = (end.velocity_m_s - start.velocity_m_s).abs() + (end.swing_m_s - start.swing_m_s).abs();
        let margin_m = self.curve_margin_s * turned;
        let above = |height_m: T, swing_m: T| height_m - self.widest_swing * swing_m.abs() > margin_m;
        above(end.height_m, end.swing_m)
            && above(start.height_m + third_s * start.velocity_m_s, start.swing_m + third_s * start.swing_m_s)
            && above(end.height_m - third_s * end.velocity_m_s, end.swing_m - third_s * end.swing_m_s)
    }
}
