//! A tooth as it is believed to be, and where it was a moment ago.
//!
//! A pair's shape differs from the nominal one by the amplitude of its pair, `s`, and by the teeth's angle, `d` (in rad), both constant in a motor's run:
//!
//! ```text
//! phi_B = (1 + s) sin 2 (th + d),  phi_C = (1 + s) cos 2 (th + d):   dphi_B = s phi_B + 2 d phi_C,   dphi_C = s phi_C - 2 d phi_B
//! ```
//!
//! and so do lever and recoil: (B, C) of each is that of the shape, turned by a right angle or not at all, times a constant.

use motor_model::Real;
use nalgebra::Vector3;

use super::oscillator::Response;
use super::stator::{ANGLE, HEIGHT, JUMP, RECOIL, SCALES, STATES, StatorBelief};
use crate::factorised::ud_covariance::SparseRow;

/// A row of gap, approach or a tooth's velocity, and the errors that it reaches: height, modes, instant and jump; recoil, approach and the teeth's shape.
pub(super) type Row<T> = SparseRow<T, HEIGHT, { JUMP + 1 - HEIGHT }, { STATES - RECOIL }>;

/// Errors of the height and of the modes.
pub(super) type Motion<T> = [T; 7];

/// A pair of teeth.
pub(super) struct Shaped<T> {
    /// The state that holds its scale's error.
    pub(super) scale: usize,
    pub(super) shape: Vector3<T>,
    pub(super) lever: Vector3<T>,
    pub(super) recoil: Vector3<T>,
}

/// Height and motion of a tooth, or its motion along the rotor, at an instant; rows per displacement and velocity at the end of the period.
pub(super) struct Carried<T> {
    pub(super) displacement_m: Vector3<T>,
    pub(super) velocity_m_s: Vector3<T>,
    pub(super) acceleration_m_s2: Vector3<T>,
    pub(super) responses: [Response<T>; 3],
}

impl<T: Real> StatorBelief<T> {
    /// Pair 0 or 1, were the stator corrected by `errors`.
    pub(super) fn tooth(&self, pair: usize, errors: &Row<T>) -> Shaped<T> {
        let [first, second] = self.teeth();
        let nominal = if pair == 0 { first } else { second };
        let scale = SCALES + pair;
        let (part, angle) = (self.found(scale, errors), self.found(ANGLE, errors));
        let shaped = |of: &Vector3<T>| of + swinging(of) * part + turned(of) * angle;
        Shaped {
            scale,
            shape: shaped(&nominal.shape),
            lever: shaped(&nominal.lever),
            recoil: shaped(&nominal.recoil),
        }
    }

    /// Error of a parameter so far found, were it corrected by `errors`.
    #[inline]
    pub(super) fn found(&self, state: usize, errors: &Row<T>) -> T {
        self.found.as_slice().get(state).copied().unwrap_or_default() + of(errors, state)
    }

    /// The modes `back_s` before the end of the period, were they corrected by `errors`.
    pub(super) fn carried_back(&self, back_s: T, errors: &Row<T>) -> Carried<T> {
        let [_, g_a, v_a, g_b, v_b, g_c, v_c, ..] = errors.lead;
        let g = self.state.modes.displacement_m + Vector3::new(g_a, g_b, g_c);
        let v = self.state.modes.velocity_m_s + Vector3::new(v_a, v_b, v_c);
        let [sin, _] = self.phasor;
        let drive = self.full_m_s2() * sin;
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
        Carried { displacement_m, velocity_m_s, acceleration_m_s2, responses }
    }
}

impl<T: Real> Carried<T> {
    /// Responses alone.
    pub(super) fn of(responses: [Response<T>; 3]) -> Self {
        let still = Vector3::zeros();
        Self { displacement_m: still, velocity_m_s: still, acceleration_m_s2: still, responses }
    }

    /// A row, or an effect: what `part` makes of each mode's response, times the mode's weight.
    #[inline]
    pub(super) fn row(&self, weights: &Vector3<T>, part: impl Fn(&Response<T>) -> [T; 2]) -> Row<T> {
        let [a, b, c] = &self.responses;
        let weighed = |response: &Response<T>, weight: T| part(response).map(|entry| weight * entry);
        let ([g_a, v_a], [g_b, v_b], [g_c, v_c]) =
            (weighed(a, weights.x), weighed(b, weights.y), weighed(c, weights.z));
        let zero = T::zero();
        Row { lead: [zero, g_a, v_a, g_b, v_b, g_c, v_c, zero, zero], ..Row::zeros() }
    }

    /// The same for height and modes alone, times `factor`.
    #[inline]
    pub(super) fn motion(
        &self,
        weights: &Vector3<T>,
        factor: T,
        part: impl Fn(&Response<T>) -> [T; 2],
    ) -> Motion<T> {
        let [height, g_a, v_a, g_b, v_b, g_c, v_c, ..] = self.row(weights, part).lead;
        [height, g_a, v_a, g_b, v_b, g_c, v_c].map(|entry| entry * factor)
    }
}

/// Per part of the pair's amplitude: modes B and C alone.
pub(super) fn swinging<T: Real>(of: &Vector3<T>) -> Vector3<T> {
    Vector3::new(T::zero(), of.y, of.z)
}

/// Per rad of the teeth's angle.
pub(super) fn turned<T: Real>(of: &Vector3<T>) -> Vector3<T> {
    Vector3::new(T::zero(), of.z, -of.y) * T::from_f64(2.0)
}

/// The entry of a state that `row` reaches.
#[inline]
pub(super) fn of<T: Real>(row: &Row<T>, state: usize) -> T {
    let place = if state < RECOIL { row.lead.get(state - HEIGHT) } else { row.last.get(state - RECOIL) };
    place.copied().unwrap_or_default()
}

/// Sets the entry of a state that `row` reaches.
#[inline]
pub(super) fn set<T: Real>(row: &mut Row<T>, state: usize, value: T) {
    let place =
        if state < RECOIL { row.lead.get_mut(state - HEIGHT) } else { row.last.get_mut(state - RECOIL) };
    if let Some(entry) = place {
        *entry = value;
    }
}
