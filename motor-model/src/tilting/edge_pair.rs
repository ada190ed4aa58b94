//! Both edges of the hole at the pin at once: their normal impulses and their friction.
//!
//! Two opposite edges share nearly one line of action, so that sweeps over single contacts would converge slowly. The
//! normal impulses are solved exactly, by trying which edges carry. Friction round the pin and along it hardly couple:
//!
//! ```text
//! q_0 + d_00 T_0 + d_01 T_1 = 0,   q_1 + d_01 T_0 + d_11 T_1 = 0        in each of both directions, where both stick
//! ```
//!
//! and sweeps over the two circles where they do not.

use super::contact::{Mobility, Velocities};
use super::contact_set::Solved;
use super::friction_circle::within_circle;
use crate::math::Real;

/// Most sweeps over the friction of both edges.
const SWEEPS: u8 = 12;
/// The sweeps end when no impulse changes by more than this share of the largest.
const SETTLED: f64 = 1e-3;
/// Below this ratio of the determinant to the product of compliances two lines of action are one.
const ONE_LINE: f64 = 1e-3;

/// Corrects the normal impulses of both edges of the hole, exactly; returns the largest change.
///
/// Without shift both act along one line: `as_one` then gives each half.
pub(super) fn push_edges<T: Real>(
    upper: &mut Solved<T>,
    lower: &mut Solved<T>,
    mobility: &Mobility<T>,
    velocities: &mut Velocities<T>,
    as_one: bool,
) -> T {
    let (d_00, d_11) = (upper.contact.normal.compliance, lower.contact.normal.compliance);
    let d_01 = upper.contact.normal.coupling_on_rotor(&lower.contact.normal, mobility);
    if d_00 <= T::zero() || d_11 <= T::zero() {
        return T::zero();
    }
    let (p_0, p_1) = (upper.normal_n_s, lower.normal_n_s);
    let c_0 = upper.contact.normal.speed(velocities) + upper.bias - d_00 * p_0 - d_01 * p_1;
    let c_1 = lower.contact.normal.speed(velocities) + lower.bias - d_01 * p_0 - d_11 * p_1;
    let [to_0, to_1] = edge_pushes([c_0, c_1], [d_00, d_11, d_01], as_one);
    let change_0 = upper.set_normal(to_0, mobility, velocities);
    let change_1 = lower.set_normal(to_1, mobility, velocities);
    larger(change_0, change_1)
}

/// The normal impulses of both edges, which part with `c` less the bias where nothing pushes. `d_00`, `d_11` and `d_01`
/// are the compliances, of which the first two are above 0.
#[inline]
pub(super) fn edge_pushes<T: Real>([c_0, c_1]: [T; 2], [d_00, d_11, d_01]: [T; 3], as_one: bool) -> [T; 2] {
    let zero = T::zero();
    if as_one {
        let both = larger(larger(-c_0 / d_00, -c_1 / d_11), zero) * T::from_f64(0.5);
        return [both, both];
    }
    if c_0 >= zero && c_1 >= zero {
        return [zero, zero];
    }
    // Without division: which edges carry.
    if c_0 < zero && c_1 * d_00 >= d_01 * c_0 {
        return [-c_0 / d_00, zero];
    }
    if c_1 < zero && c_0 * d_11 >= d_01 * c_1 {
        return [zero, -c_1 / d_11];
    }
    let per_determinant = T::one() / (d_00 * d_11 - d_01 * d_01);
    [
        larger((d_01 * c_1 - d_11 * c_0) * per_determinant, zero),
        larger((d_01 * c_0 - d_00 * c_1) * per_determinant, zero),
    ]
}

/// Friction of both edges, from their slips.
pub(super) fn rub_edges<T: Real>(
    upper: &mut Solved<T>,
    lower: &mut Solved<T>,
    mobility: &Mobility<T>,
    velocities: &mut Velocities<T>,
) {
    let ([round_0, up_0], [round_1, up_1]) = (&upper.contact.along, &lower.contact.along);
    let compliances = [[round_0.compliance, up_0.compliance], [round_1.compliance, up_1.compliance]];
    let between = [round_0.coupling_on_rotor(round_1, mobility), up_0.coupling(up_1, mobility)];
    let limits = [upper.contact.friction * upper.normal_n_s, lower.contact.friction * lower.normal_n_s];
    let impulses = edge_friction([upper.slip, lower.slip], compliances, between, limits);
    for (solved, impulses) in [upper, lower].into_iter().zip(impulses) {
        for (way, impulse) in solved.contact.along.iter().zip(impulses) {
            way.push(impulse, mobility, velocities);
        }
        solved.along_n_s = impulses;
    }
}

/// The impulses of both edges round the pin and along it, from their slips, the compliances of each, those between
/// them, and the largest impulse of each.
#[inline]
pub(super) fn edge_friction<T: Real>(
    slips: [[T; 2]; 2],
    compliances: [[T; 2]; 2],
    between: [T; 2],
    limits: [T; 2],
) -> [[T; 2]; 2] {
    let [slip_0, slip_1] = slips;
    let [d_0, d_1] = compliances;
    let [limit_0, limit_1] = limits;
    if let Some(impulses) = sliding(slips, compliances, between, limits) {
        return impulses;
    }
    let stuck = sticking(slips, compliances, between);
    let [t_0, t_1] = stuck;
    let (holds_0, holds_1) = (is_within(t_0, limit_0), is_within(t_1, limit_1));
    if holds_0 && holds_1 {
        return stuck;
    }
    // The least energy is unique: what fulfils its conditions is the solution.
    if holds_1 && let Some((t_0, t_1)) = one_sticks([slip_0, slip_1], [d_0, d_1], between, [limit_0, limit_1])
    {
        return [t_0, t_1];
    }
    if holds_0 && let Some((t_1, t_0)) = one_sticks([slip_1, slip_0], [d_1, d_0], between, [limit_1, limit_0])
    {
        return [t_0, t_1];
    }
    slipping(stuck, slips, compliances, between, limits)
}

/// The impulses of two edges that slide so fast that friction hardly changes their slips: along the slips as they are
/// after friction along the slips as they were. The error is the square of the change; `None` where it is larger than
/// [`SETTLED`].
#[inline]
fn sliding<T: Real>(
    [q_0, q_1]: [[T; 2]; 2],
    [d_0, d_1]: [[T; 2]; 2],
    [c_0, c_1]: [T; 2],
    [limit_0, limit_1]: [T; 2],
) -> Option<[[T; 2]; 2]> {
    let ([d_00, d_01], [d_10, d_11]) = (d_0, d_1);
    let square = |[a, b]: [T; 2]| a * a + b * b;
    let between = larger(c_0.abs(), c_1.abs());
    let change_0 = larger(d_00, d_01) * limit_0 + between * limit_1;
    let change_1 = larger(d_10, d_11) * limit_1 + between * limit_0;
    let settled = T::from_f64(SETTLED);
    let slides = |change: T, q: [T; 2]| change * change < settled * square(q);
    if !(slides(change_0, q_0) && slides(change_1, q_1)) {
        return None;
    }
    let along = |q: [T; 2], limit: T| {
        let scale = -limit / square(q).sqrt();
        q.map(|q| q * scale)
    };
    let ([t_0, u_0], [t_1, u_1]) = (along(q_0, limit_0), along(q_1, limit_1));
    let ([q_00, q_01], [q_10, q_11]) = (q_0, q_1);
    let after_0 = [q_00 + d_00 * t_0 + c_0 * t_1, q_01 + d_01 * u_0 + c_1 * u_1];
    let after_1 = [q_10 + d_10 * t_1 + c_0 * t_0, q_11 + d_11 * u_1 + c_1 * u_0];
    Some([along(after_0, limit_0), along(after_1, limit_1)])
}

fn is_within<T: Real>([t_0, t_1]: [T; 2], limit: T) -> bool {
    t_0 * t_0 + t_1 * t_1 <= limit * limit
}

/// The impulses of both edges that stop all slip. On one line of action both share it.
#[inline]
fn sticking<T: Real>([q_0, q_1]: [[T; 2]; 2], [d_0, d_1]: [[T; 2]; 2], between: [T; 2]) -> [[T; 2]; 2] {
    let way = |q_0: T, q_1: T, d_00: T, d_11: T, d_01: T| {
        let determinant = d_00 * d_11 - d_01 * d_01;
        if determinant > T::from_f64(ONE_LINE) * (d_00 * d_11) {
            let per_determinant = T::one() / determinant;
            ((d_01 * q_1 - d_11 * q_0) * per_determinant, (d_01 * q_0 - d_00 * q_1) * per_determinant)
        } else {
            let both = d_00 + d_11 + d_01.abs() + d_01.abs();
            let opposed = d_01 < T::zero();
            let q = if opposed { q_0 - q_1 } else { q_0 + q_1 };
            let t = if both > T::zero() { -q / both } else { T::zero() };
            (t, if opposed { -t } else { t })
        }
    };
    let ([q_00, q_01], [q_10, q_11], [d_00, d_01], [d_10, d_11], [c_0, c_1]) = (q_0, q_1, d_0, d_1, between);
    let (round_0, round_1) = way(q_00, q_10, d_00, d_10, c_0);
    let (up_0, up_1) = way(q_01, q_11, d_01, d_11, c_1);
    [[round_0, up_0], [round_1, up_1]]
}

/// The impulses of a first edge that slips and a second one that sticks; `None` where the second one does not.
#[inline(never)]
fn one_sticks<T: Real>(
    [q_0, q_1]: [[T; 2]; 2],
    [d_0, d_1]: [[T; 2]; 2],
    [c_0, c_1]: [T; 2],
    [limit_0, limit_1]: [T; 2],
) -> Option<([T; 2], [T; 2])> {
    let ([q_00, q_01], [q_10, q_11], [d_00, d_01], [d_10, d_11]) = (q_0, q_1, d_0, d_1);
    if d_10 <= T::zero() || d_11 <= T::zero() {
        return None;
    }
    // The second edge's share per impulse of the first.
    let (per_0, per_1) = (T::one() / d_10, T::one() / d_11);
    let (share_0, share_1) = (c_0 * per_0, c_1 * per_1);
    let slips = [q_00 - share_0 * q_10, q_01 - share_1 * q_11];
    let (t_0, t_1) = within_circle(slips, [d_00 - share_0 * c_0, d_01 - share_1 * c_1], limit_0);
    let second = [-(q_10 + c_0 * t_0) * per_0, -(q_11 + c_1 * t_1) * per_1];
    is_within(second, limit_1).then_some(([t_0, t_1], second))
}

/// The impulses of both edges where both slip, from those that would stop all slip.
#[inline(never)]
fn slipping<T: Real>(
    [stuck_0, stuck_1]: [[T; 2]; 2],
    [q_0, q_1]: [[T; 2]; 2],
    [d_0, d_1]: [[T; 2]; 2],
    [c_0, c_1]: [T; 2],
    [limit_0, limit_1]: [T; 2],
) -> [[T; 2]; 2] {
    let zero = T::zero();
    let (mut t_0, mut t_1) = (limited(stuck_0, limit_0), limited(stuck_1, limit_1));
    let pressed = |[q, r]: [T; 2], [t, u]: [T; 2]| [q + c_0 * t, r + c_1 * u];
    let (first, second) = (EdgeFriction::new(d_0, limit_0), EdgeFriction::new(d_1, limit_1));
    for _ in 0..SWEEPS {
        let (before_0, before_1) = (t_0, t_1);
        t_0 = first.next(pressed(q_0, t_1), t_0);
        t_1 = second.next(pressed(q_1, t_0), t_1);
        let moved = |[a, b]: [T; 2], [c, d]: [T; 2]| larger((a - c).abs(), (b - d).abs());
        let size = larger(moved([zero; 2], t_0), moved([zero; 2], t_1));
        if larger(moved(before_0, t_0), moved(before_1, t_1)) <= T::from_f64(SETTLED) * size {
            break;
        }
    }
    [t_0, t_1]
}

/// Friction of one edge in the sweeps.
struct EdgeFriction<T> {
    d: [T; 2],
    /// One over the larger compliance, where both are alike; otherwise 0.
    per_d: T,
    limit: T,
}

impl<T: Real> EdgeFriction<T> {
    fn new(d: [T; 2], limit: T) -> Self {
        let [d_0, d_1] = d;
        let alike = d_0 <= d_1 + d_1 && d_1 <= d_0 + d_0 && d_0 > T::zero();
        Self { d, per_d: if alike { T::one() / larger(d_0, d_1) } else { T::zero() }, limit }
    }

    /// The impulse that follows `t`, for the slip `q` that there is without it.
    #[inline]
    fn next(&self, [q_0, q_1]: [T; 2], [t_0, t_1]: [T; 2]) -> [T; 2] {
        let zero = T::zero();
        if self.limit <= zero {
            return [zero; 2];
        }
        let [d_0, d_1] = self.d;
        if self.per_d <= zero {
            let (round, up) = within_circle([q_0, q_1], self.d, self.limit);
            return [round, up];
        }
        // Down the gradient of the energy, back into the circle: the same solution where directions are alike.
        let (round, up) = (t_0 - (q_0 + d_0 * t_0) * self.per_d, t_1 - (q_1 + d_1 * t_1) * self.per_d);
        limited([round, up], self.limit)
    }
}

/// `t`, shortened to `limit`.
#[inline]
fn limited<T: Real>([t_0, t_1]: [T; 2], limit: T) -> [T; 2] {
    let square = t_0 * t_0 + t_1 * t_1;
    if square <= limit * limit {
        return [t_0, t_1];
    }
    let scale = limit / square.sqrt();
    [t_0 * scale, t_1 * scale]
}

#[inline]
fn larger<T: Real>(a: T, b: T) -> T {
    if b > a { b } else { a }
}
