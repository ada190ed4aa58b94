//! Friction of one contact: the impulse of least energy within Coulomb's circle.
//!
//! With the slip `q`, the compliances `d` of both directions and the largest impulse `mu P`:
//!
//! ```text
//! T_i = -q_i / (d_i + m),     m = 0 if |T| <= mu P,     or else so large that |T| = mu P
//! ```
//!
//! Where all slip stops this is sticking. Where little of it does, T is along the slip: sliding. A rigid direction,
//! `d_i` = 0, takes its share of the circle and does not change.

use crate::math::Real;

/// Most iterations for the friction of one contact.
const CIRCLE_ITERATIONS: u8 = 4;
/// A direction whose compliance is below this share of the other one's is rigid: friction does not change the slip.
const IMMOBILE: f64 = 1e-9;
/// Below this ratio of what friction can take up to the slip, friction is along the slip.
const ALL_SLIP: f64 = 1e-6;

/// `T_i = -q_i / (d_i + m)` of magnitude at most `limit`.
pub(super) fn within_circle<T: Real>([q_0, q_1]: [T; 2], [d_0, d_1]: [T; 2], limit: T) -> (T, T) {
    let zero = T::zero();
    let stiffest = larger(d_0, d_1);
    let least = T::from_f64(IMMOBILE) * stiffest;
    let stop = |q: T, d: T| if d > least { -q / d } else { zero };
    let (t_0, t_1) = (stop(q_0, d_0), stop(q_1, d_1));
    // Nothing slips along a rigid direction, or friction stops all slip.
    let held_0 = d_0 <= least && q_0 != zero;
    let held_1 = d_1 <= least && q_1 != zero;
    if !held_0 && !held_1 && t_0.abs() + t_1.abs() <= limit {
        return (t_0, t_1);
    }
    // In units of the larger slip, so that no square is too small.
    let unit = larger(q_0.abs(), q_1.abs());
    let (q_0, q_1, radius) = (q_0 / unit, q_1 / unit, limit / unit);
    let slip = (q_0 * q_0 + q_1 * q_1).sqrt();
    if radius * stiffest < T::from_f64(ALL_SLIP) {
        let scale = -limit / slip;
        return (q_0 * scale, q_1 * scale);
    }
    let (mut t_0, mut t_1) = (t_0 / unit, t_1 / unit);
    let mut size = (t_0 * t_0 + t_1 * t_1).sqrt();
    if !held_0 && !held_1 && size <= radius {
        return (t_0 * unit, t_1 * unit);
    }
    // Newton's method on 1/|T| = 1/radius, which is nearly straight in m, from a lower bound of m.
    let alone = larger(q_0.abs() / radius - d_0, q_1.abs() / radius - d_1);
    let mut m = larger(larger(slip / radius - stiffest, alone), zero);
    for _ in 0..CIRCLE_ITERATIONS {
        (t_0, t_1) = (-q_0 / (d_0 + m), -q_1 / (d_1 + m));
        size = (t_0 * t_0 + t_1 * t_1).sqrt();
        let over = size - radius;
        if over <= radius * T::from_f64(1e-7) {
            break;
        }
        m += over * size * size / (radius * (t_0 * t_0 / (d_0 + m) + t_1 * t_1 / (d_1 + m)));
    }
    let scale = limit / size;
    (t_0 * scale, t_1 * scale)
}

#[inline]
fn larger<T: Real>(a: T, b: T) -> T {
    if b > a { b } else { a }
}
