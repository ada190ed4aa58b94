//! A cheap test that no impact can happen in this step. Most steps have none.
//!
//! Both pairs move by `+-(phi_B g_B + phi_C g_C)` about `g_A`, so one bound serves both. The cubic through a gap and
//! its rate at both ends of a step lies in the hull of its control points. The motion lies within a margin of the
//! cubic.

use nalgebra::Vector3;

use super::Motor;
use crate::math::Real;
use crate::modes::ModalState;
use crate::rotor::RotorState;

/// Bound of the error of a cubic through value and slope at both ends of a step, per step and change of slope: four
/// times `(w h)^2 / 384`, the error for a pure oscillation at `w`.
pub(crate) fn cubic_margin(fastest_rad: f64) -> f64 {
    4.0 / 384.0 * fastest_rad * fastest_rad
}

/// The rotor over the teeth: its height above the stator's mean, and the deviation of the first pair from that mean.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance<T> {
    height_m: T,
    deviation_m: T,
    velocity_m_s: T,
    deviation_m_s: T,
}

impl<T: Real> Motor<T> {
    /// What [`Self::surely_clear`] needs of one end of a step.
    #[inline]
    pub(super) fn clearance(&self, modes: &ModalState<T>, rotor: &RotorState<T>) -> Clearance<T> {
        let [tooth, _] = &self.teeth;
        let deviation = |x: &Vector3<T>| tooth.shape.y * x.y + tooth.shape.z * x.z;
        Clearance {
            height_m: rotor.height_m - modes.displacement_m.x,
            deviation_m: deviation(&modes.displacement_m),
            velocity_m_s: rotor.velocity_m_s - modes.velocity_m_s.x,
            deviation_m_s: deviation(&modes.velocity_m_s),
        }
    }

    /// Whether neither gap can vanish between two states a step of free motion apart.
    ///
    /// The first control point, the start, is not tested: the step before ended above the teeth, and a rotor that
    /// starts inside a tooth and leaves it has no impact.
    #[inline]
    pub(super) fn surely_clear(&self, start: &Clearance<T>, end: &Clearance<T>) -> bool {
        let third_s = self.step * T::from_f64(1.0 / 3.0);
        let turned =
            (end.velocity_m_s - start.velocity_m_s).abs() + (end.deviation_m_s - start.deviation_m_s).abs();
        let margin_m = self.curve_margin_s * turned;
        let above = |height_m: T, deviation_m: T| height_m - self.widest_ratio * deviation_m.abs() > margin_m;
        above(end.height_m, end.deviation_m)
            && above(
                start.height_m + third_s * start.velocity_m_s,
                start.deviation_m + third_s * start.deviation_m_s,
            )
            && above(end.height_m - third_s * end.velocity_m_s, end.deviation_m - third_s * end.deviation_m_s)
    }
}
