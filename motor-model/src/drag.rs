//! Teeth pressed on the rotor drag it round: Coulomb friction of up to two contacts through a span of time, stick and slip.
//!
//! The tangential velocities `w_p` of the contacts change in straight lines over the span and their normal forces are constant, so
//! between changes of sense the rotor's velocity `v` does too:
//!
//! ```text
//! v' = sum L_p sign(w_p - v)                                          where all slip
//! v' = w_q'   as long as |w_q' - sum_(p != q) L_p sign(w_p - v)| <= L_q      where q sticks
//! ```
//!
//! with `L_p` the change of velocity that contact `p` can bring about over the span. The pieces are followed exactly from one change to the
//! next, so the order of the contacts does not matter.

use crate::math::Real;

/// One pressed contact through a span.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Contact<T> {
    /// Tangential velocity of the tooth at the start of the span, in m/s.
    pub(crate) from: T,
    /// At its end, in m/s.
    pub(crate) to: T,
    /// Largest change of the rotor's tangential velocity that this contact can bring about over the span, in m/s; not negative.
    pub(crate) limit: T,
}

/// What a pressed tooth did to the rotor's rotation over a span, per tangential mass `J / R_t^2`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dragged<T> {
    /// Change of velocity that it brought about, in m/s.
    pub push_m_s: T,
    /// Work of the tooth, in m^2/s^2.
    pub work_m2_s2: T,
    /// Part of it lost to slip, in m^2/s^2; not negative.
    pub heat_m2_s2: T,
}

/// Most pieces of a span: two contacts can each turn and stick, and be torn off again.
const PIECES_MAX: usize = 8;

/// What `contacts` do to a rotor that enters the span with `rotor_m_s`.
pub(crate) fn drag<T: Real>(contacts: [Contact<T>; 2], rotor_m_s: T) -> [Dragged<T>; 2] {
    let (zero, half) = (T::zero(), T::from_f64(0.5));
    let mut rubbing = contacts.map(|contact| Rubbing {
        slip: contact.from - rotor_m_s,
        tooth: contact.from,
        slope: contact.to - contact.from,
        limit: contact.limit,
        dragged: Dragged::default(),
    });
    let mut left = T::one();
    for _ in 0..PIECES_MAX {
        let forces = forces(&rubbing);
        let [first, second] = forces;
        let acceleration = first + second;
        let span = rubbing.iter().fold(left, |span, contact| {
            contact.until_turn(acceleration).map_or(span, |turn| if turn < span { turn } else { span })
        });
        for (contact, force) in rubbing.iter_mut().zip(forces) {
            let turns = contact.until_turn(acceleration).is_some_and(|turn| turn <= span);
            // Zero exactly, so that the next piece knows.
            let holds = contact.slip == zero && force.abs() < contact.limit;
            let slip =
                if turns || holds { zero } else { contact.slip + (contact.slope - acceleration) * span };
            let push = force * span;
            contact.dragged.push_m_s += push;
            contact.dragged.work_m2_s2 += push * (contact.tooth + half * contact.slope * span);
            contact.dragged.heat_m2_s2 += push * half * (contact.slip + slip);
            contact.tooth += contact.slope * span;
            contact.slip = slip;
        }
        left -= span;
        if left <= zero {
            break;
        }
    }
    rubbing.map(|contact| contact.dragged)
}

/// A contact on its way through the span; rates are per span.
struct Rubbing<T> {
    slip: T,
    tooth: T,
    slope: T,
    limit: T,
    dragged: Dragged<T>,
}

impl<T: Real> Rubbing<T> {
    /// When the slip comes to zero, if it heads there.
    fn until_turn(&self, acceleration: T) -> Option<T> {
        let change = self.slope - acceleration;
        (self.limit > T::zero() && self.slip * change < T::zero()).then(|| -self.slip / change)
    }

    /// Force of a contact that slips; none where it does not.
    fn slipping(&self) -> T {
        if self.slip > T::zero() {
            self.limit
        } else if self.slip < T::zero() {
            -self.limit
        } else {
            T::zero()
        }
    }

    /// Force that keeps the tooth's pace beside forces that sum to `others`, as far as friction goes.
    fn holding(&self, others: T) -> T {
        holding(self.slope, self.limit, others)
    }
}

/// The forces of both contacts: those that slip push at their limit, those that do not hold if they can.
fn forces<T: Real>([first, second]: &[Rubbing<T>; 2]) -> [T; 2] {
    let (zero, slipping_0, slipping_1) = (T::zero(), first.slipping(), second.slipping());
    match (first.slip == zero, second.slip == zero) {
        (false, false) => [slipping_0, slipping_1],
        (true, false) => [first.holding(slipping_1), slipping_1],
        (false, true) => [slipping_0, second.holding(slipping_0)],
        (true, true) => both([first.slope, second.slope], [first.limit, second.limit]),
    }
}

/// Force that keeps a tooth of this slope, beside forces that sum to `others`, as far as `limit` goes.
#[inline]
fn holding<T: Real>(slope: T, limit: T, others: T) -> T {
    (slope - others).clamp_magnitude(limit)
}

/// Neither slips: the rotor keeps the pace of the tooth that gains speed more slowly, or else at most the other one's. A call, since few pieces need it and a
/// compiler would work it out for all.
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
        drag(contacts, rotor_m_s).iter().map(|dragged| dragged.push_m_s).sum()
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
            // Stuck, then torn off is impossible under constant slope: too steep from the start.
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
            // Regularised: proportional within a hair's breadth of zero slip.
            v += dt * (0..2).map(|p| contacts[p].limit * (slips[p] / 1e-4).clamp(-1.0, 1.0)).sum::<f64>();
        }
        v - rotor_m_s
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn dual_pieces_equal_small_steps(
            w in prop::array::uniform4(-1.0..1.0_f64), limits in prop::array::uniform2(0.01..3.0_f64), rotor in -1.0..1.0_f64
        ) {
            let contacts = [contact(w[0], w[1], limits[0]), contact(w[2], w[3], limits[1])];
            let (exact, stepped) = (push(contacts, rotor), by_small_steps(contacts, rotor));
            prop_assert!((exact - stepped).abs() < 1e-3, "{exact} {stepped}");
        }

        /// Kinetic energy gained is work of the teeth less heat, and heat is never negative; the order does not matter.
        #[test]
        fn law_energy_and_symmetry(
            w in prop::array::uniform4(-1.0..1.0_f64), limits in prop::array::uniform2(0.0..3.0_f64), rotor in -1.0..1.0_f64
        ) {
            let contacts = [contact(w[0], w[1], limits[0]), contact(w[2], w[3], limits[1])];
            let dragged = drag(contacts, rotor);
            let end = rotor + dragged[0].push_m_s + dragged[1].push_m_s;
            let gained = 0.5 * (end * end - rotor * rotor);
            let work = dragged[0].work_m2_s2 + dragged[1].work_m2_s2;
            let heat = dragged[0].heat_m2_s2 + dragged[1].heat_m2_s2;
            prop_assert!((gained - (work - heat)).abs() < 1e-12);
            prop_assert!(dragged.iter().all(|d| d.heat_m2_s2 >= -1e-15));
            prop_assert!((push([contacts[1], contacts[0]], rotor) - push(contacts, rotor)).abs() < 1e-9);
        }
    }
}
