//! Sustained friction: Coulomb friction of up to two contacts over a span of time, with stick and slip.
//!
//! The tangential velocities `w_p` of the contacts change linearly over the span and their normal forces are constant.
//! Between changes of sense the rotor's velocity `v` then changes linearly too:
//!
//! ```text
//! v' = sum L_p sign(w_p - v)                                          where all slip
//! v' = w_q'   as long as |w_q' - sum_(p != q) L_p sign(w_p - v)| <= L_q      where q sticks
//! ```
//!
//! Here `L_p` is the change of velocity that contact `p` can cause over the span. Each piece is followed exactly up
//! to the next change, so the order of the contacts does not matter.

use crate::math::Real;

/// One sustained contact over a span.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact<T> {
    /// Tangential velocity of the tooth at the start of the span, in m/s.
    pub(crate) from: T,
    /// At its end, in m/s.
    pub(crate) to: T,
    /// Largest change of the rotor's tangential velocity that this contact can cause over the span, in m/s; not
    /// negative.
    pub(crate) limit: T,
}

/// Effect of one sustained contact on the rotor's rotation over a span, per tangential mass `J / R_t^2`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SustainedFriction<T> {
    /// Change of the rotor's tangential velocity, in m/s.
    pub push_m_s: T,
    /// Work of the tooth, in m^2/s^2.
    pub work_m2_s2: T,
    /// Part of it lost to slip, in m^2/s^2; not negative.
    pub heat_m2_s2: T,
}

/// Most pieces of a span: the slip of each of two contacts can change its sign, stop and start again.
const PIECES_MAX: usize = 8;

/// Effect of `contacts` on a rotor that enters the span with `rotor_m_s`.
pub(crate) fn sustained_friction<T: Real>(
    contacts: [Contact<T>; 2],
    rotor_m_s: T,
) -> [SustainedFriction<T>; 2] {
    let (zero, half) = (T::zero(), T::from_f64(0.5));
    let mut sliding = contacts.map(|contact| SlidingContact {
        slip: contact.from - rotor_m_s,
        tooth: contact.from,
        slope: contact.to - contact.from,
        limit: contact.limit,
        friction: SustainedFriction::default(),
    });
    let mut left = T::one();
    for _ in 0..PIECES_MAX {
        let forces = forces(&sliding);
        let [first, second] = forces;
        let acceleration = first + second;
        let span = sliding.iter().fold(left, |span, contact| {
            contact.until_turn(acceleration).map_or(span, |turn| if turn < span { turn } else { span })
        });
        for (contact, force) in sliding.iter_mut().zip(forces) {
            let turns = contact.until_turn(acceleration).is_some_and(|turn| turn <= span);
            // Exactly zero: the next piece tests for it.
            let holds = contact.slip == zero && force.abs() < contact.limit;
            let slip =
                if turns || holds { zero } else { contact.slip + (contact.slope - acceleration) * span };
            let push = force * span;
            contact.friction.push_m_s += push;
            contact.friction.work_m2_s2 += push * (contact.tooth + half * contact.slope * span);
            contact.friction.heat_m2_s2 += push * half * (contact.slip + slip);
            contact.tooth += contact.slope * span;
            contact.slip = slip;
        }
        left -= span;
        if left <= zero {
            break;
        }
    }
    sliding.map(|contact| contact.friction)
}

/// A contact in the course of the span; rates are per span.
struct SlidingContact<T> {
    slip: T,
    tooth: T,
    slope: T,
    limit: T,
    friction: SustainedFriction<T>,
}

impl<T: Real> SlidingContact<T> {
    /// When the slip comes to zero, if it moves towards zero.
    fn until_turn(&self, acceleration: T) -> Option<T> {
        let change = self.slope - acceleration;
        (self.limit > T::zero() && self.slip * change < T::zero()).then(|| -self.slip / change)
    }

    /// Force of a contact that slips; zero where it does not.
    fn slipping(&self) -> T {
        if self.slip > T::zero() {
            self.limit
        } else if self.slip < T::zero() {
            -self.limit
        } else {
            T::zero()
        }
    }

    /// Force that keeps the rotor at the tooth's velocity, beside forces that sum to `others`, within the limit of
    /// friction.
    fn holding(&self, others: T) -> T {
        holding(self.slope, self.limit, others)
    }
}

/// The forces of both contacts: the limit where they slip, the force that prevents slip where they stick.
fn forces<T: Real>([first, second]: &[SlidingContact<T>; 2]) -> [T; 2] {
    let (zero, slipping_0, slipping_1) = (T::zero(), first.slipping(), second.slipping());
    match (first.slip == zero, second.slip == zero) {
        (false, false) => [slipping_0, slipping_1],
        (true, false) => [first.holding(slipping_1), slipping_1],
        (false, true) => [slipping_0, second.holding(slipping_0)],
        (true, true) => both([first.slope, second.slope], [first.limit, second.limit]),
    }
}

/// Force that gives the rotor this slope beside forces that sum to `others`, within `limit`.
#[inline]
fn holding<T: Real>(slope: T, limit: T, others: T) -> T {
    (slope - others).clamp_magnitude(limit)
}

/// Forces when neither slips: the rotor follows the tooth that gains speed more slowly, or else at most the other one.
///
/// Not inlined: few pieces need it, and a compiler would evaluate it for all.
#[inline(never)]
fn both<T: Real>([first, second]: [T; 2], [first_limit, second_limit]: [T; 2]) -> [T; 2] {
    let in_turn = |slower: T, limit: T, faster: T, faster_limit: T| {
        let hold = holding(slower, limit, faster_limit);
        if hold > -limit { [hold, faster_limit] } else { [hold, holding(faster, faster_limit, hold)] }
    };
    if first <= second {
        in_turn(first, first_limit, second, second_limit)
    } else {
        let [slower, faster] = in_turn(second, second_limit, first, first_limit);
        [faster, slower]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn contact(from: f64, to: f64, limit: f64) -> Contact<f64> {
        Contact { from, to, limit }
    }

    const NONE: Contact<f64> = Contact { from: 3.0, to: -5.0, limit: 0.0 };

    fn push(contacts: [Contact<f64>; 2], rotor_m_s: f64) -> f64 {
        sustained_friction(contacts, rotor_m_s).iter().map(|friction| friction.push_m_s).sum()
    }

    #[test]
    fn exact_one_contact() {
        for (tooth, rotor, expected) in [
            (contact(5.0, 6.0, 1.0), 0.0, 1.0),
            (contact(-5.0, -6.0, 1.0), 0.0, -1.0),
            // Caught after 1/4 of the span, then carried along.
            (contact(0.5, 0.5, 2.0), 0.0, 0.5),
            (contact(0.0, 0.5, 2.0), 0.0, 0.5),
            // Slip turns at 1/(1+3-...): from 1 with slope -4 and push +1 it closes in 1/5, then -1 for 4/5.
            (contact(1.0, -3.0, 1.0), 0.0, 0.2 - 0.8),
            // Too steep to stick from the start.
            (contact(0.0, 3.0, 1.0), 0.0, 1.0),
        ] {
            for contacts in [[tooth, NONE], [NONE, tooth]] {
                assert!(
                    (push(contacts, rotor) - expected).abs() < 1e-12,
                    "{tooth:?} {}",
                    push(contacts, rotor)
                );
            }
        }
    }

    /// Two equal contacts that pull apart leave the rotor where it is; a stronger one wins by the difference.
    #[test]
    fn exact_two_contacts() {
        assert!(push([contact(1.0, 1.0, 0.1), contact(-1.0, -1.0, 0.1)], 0.0).abs() < 1e-15);
        assert!((push([contact(1.0, 1.0, 0.3), contact(-1.0, -1.0, 0.1)], 0.0) - 0.2).abs() < 1e-15);
        // Both carry it to the same speed.
        assert!((push([contact(0.2, 0.2, 1.0), contact(0.2, 0.2, 1.0)], 0.0) - 0.2).abs() < 1e-12);
    }

    /// The same by many small explicit steps of the differential inclusion.
    fn by_small_steps(contacts: [Contact<f64>; 2], rotor_m_s: f64) -> f64 {
        let n = 400_000;
        let dt = 1.0 / f64::from(n);
        let mut v = rotor_m_s;
        for i in 0..n {
            let t = (f64::from(i) + 0.5) * dt;
            let slips = contacts.map(|c| c.from + (c.to - c.from) * t - v);
            // Regularised: proportional to the slip near zero.
            v += dt * (0..2).map(|p| contacts[p].limit * (slips[p] / 1e-4).clamp(-1.0, 1.0)).sum::<f64>();
        }
        v - rotor_m_s
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn dual_pieces_equal_small_steps(
            w in prop::array::uniform4(-1.0..1.0_f64),
            limits in prop::array::uniform2(0.01..3.0_f64), rotor in -1.0..1.0_f64
        ) {
            let contacts = [contact(w[0], w[1], limits[0]), contact(w[2], w[3], limits[1])];
            let (exact, stepped) = (push(contacts, rotor), by_small_steps(contacts, rotor));
            prop_assert!((exact - stepped).abs() < 1e-3, "{exact} {stepped}");
        }

        /// Kinetic energy gained is work of the teeth less heat, and heat is never negative; the order does not matter.
        #[test]
        fn law_energy_and_symmetry(
            w in prop::array::uniform4(-1.0..1.0_f64),
            limits in prop::array::uniform2(0.0..3.0_f64), rotor in -1.0..1.0_f64
        ) {
            let contacts = [contact(w[0], w[1], limits[0]), contact(w[2], w[3], limits[1])];
            let friction = sustained_friction(contacts, rotor);
            let end = rotor + friction[0].push_m_s + friction[1].push_m_s;
            let gained = 0.5 * (end * end - rotor * rotor);
            let work = friction[0].work_m2_s2 + friction[1].work_m2_s2;
            let heat = friction[0].heat_m2_s2 + friction[1].heat_m2_s2;
            prop_assert!((gained - (work - heat)).abs() < 1e-12);
            prop_assert!(friction.iter().all(|d| d.heat_m2_s2 >= -1e-15));
            prop_assert!((push([contacts[1], contacts[0]], rotor) - push(contacts, rotor)).abs() < 1e-9);
        }
    }
}
