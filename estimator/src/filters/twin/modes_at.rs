//! The modes at an instant within the last sample period, as functions of the states at its end.
//!
//! ```text
//! g(-t) = C(-t) g + S(-t) g' + a t^2 / 2,    g'(-t) = C'(-t) g + S'(-t) g' - a t          a: acceleration by the drive
//! ```
//!
//! C and S are the responses of [`super::oscillator`]; they are also the Jacobian by `g` and `g'`. The drive counts as
//! constant within the period.

use motor_model::Real;
use nalgebra::Vector3;

use super::oscillator::Response;
use super::states::{MotionErrors, Row};
use super::stator::StatorFilter;

/// The motion of each mode at an instant, and its responses to the states at the end of the period.
pub(super) struct ModesAt<T> {
    pub(super) displacement_m: Vector3<T>,
    pub(super) velocity_m_s: Vector3<T>,
    pub(super) acceleration_m_s2: Vector3<T>,
    pub(super) responses: [Response<T>; 3],
}

impl<T: Real> StatorFilter<T> {
    /// The modes `back_s` before the end of the period, were they corrected by `errors`.
    pub(super) fn modes_at(&self, back_s: T, errors: &Row<T>) -> ModesAt<T> {
        let [_, g_a, v_a, g_b, v_b, g_c, v_c, ..] = errors.lead;
        let g = self.state.modes.displacement_m + Vector3::new(g_a, g_b, g_c);
        let v = self.state.modes.velocity_m_s + Vector3::new(v_a, v_b, v_c);
        let [sin, _] = self.phasor;
        let drive = self.drive_amplitude_m_s2() * sin;
        let responses = self.oscillators.each_ref().map(|oscillator| oscillator.after(-back_s));
        let [a, b, c] = &responses;
        let each = |of: fn(&Response<T>) -> T| Vector3::new(of(a), of(b), of(c));
        let stiffness = Vector3::from(self.oscillators.map(|o| o.stiffness_per_s2));
        let damping = Vector3::from(self.oscillators.map(|o| o.damping_per_s));
        let displacement_m = each(|r| r.c).component_mul(&g)
            + each(|r| r.s).component_mul(&v)
            + drive * (T::from_f64(0.5) * back_s * back_s);
        let velocity_m_s =
            each(|r| r.c_rate).component_mul(&g) + each(|r| r.s_rate).component_mul(&v) - drive * back_s;
        let acceleration_m_s2 =
            drive - stiffness.component_mul(&displacement_m) - damping.component_mul(&velocity_m_s);
        ModesAt { displacement_m, velocity_m_s, acceleration_m_s2, responses }
    }
}

/// A row or column of the states 1 to 7: `part` of each mode's response, times the mode's weight; `height` of the
/// height.
#[inline]
pub(super) fn entries<T: Real>(
    [a, b, c]: &[Response<T>; 3],
    height: T,
    weights: &Vector3<T>,
    part: impl Fn(&Response<T>) -> [T; 2],
) -> MotionErrors<T> {
    let weighted = |response: &Response<T>, weight: T| part(response).map(|entry| weight * entry);
    let ([g_a, v_a], [g_b, v_b], [g_c, v_c]) =
        (weighted(a, weights.x), weighted(b, weights.y), weighted(c, weights.z));
    [height, g_a, v_a, g_b, v_b, g_c, v_c]
}
