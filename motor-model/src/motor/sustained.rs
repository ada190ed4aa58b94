//! Sustained contact: teeth that stay on the rotor act with a force instead of impacts.
//!
//! A bouncing rotor without drive makes ever more frequent impacts and comes to rest after infinitely many of them in
//! a finite time. A rotor on weakly driven teeth never leaves them. Both are *sustained contacts*. Over a span of
//! time each pair in contact pushes the rotor up with a constant acceleration `a_p >= 0`, and the modes down by its
//! recoil. The accelerations are chosen so that at the end of the span no gap of a pair in contact closes:
//!
//! ```text
//! c_p = gap_p' + k gap_p / span >= 0,   a_p >= 0,   a_p c_p = 0,      c = c_free + R a
//! ```
//!
//! Here `c_free` is the exact free motion and `R` the exact response to unit pushes; `k` makes a gap that is left
//! over vanish (Moreau's velocity constraint, stabilised). A pair with `a_p = 0` leaves the rotor. Friction turns the
//! rotor throughout (see [`crate::friction`]). A step is cut into spans of at most [`SPAN_RAD`] of the fastest mode.
//! The error is of second order in the span.

use super::{Impacts, Motion, Motor};
use crate::energy::Ledger;
use crate::math::Real;
use crate::modes::{Forcing, ModalBank, ModalPush, Phasor, Propagator};
use crate::phase::Phase;
use crate::rotor::{Flight, FlightSpan};
use crate::teeth::ToothPair;

/// Longest span in radians of the fastest mode.
const SPAN_RAD: f64 = 0.25;
/// Most spans of a step.
const SPANS_MAX: u8 = 16;
/// `k`: part of a gap that a sustained contact closes in a span. A small value, because to close a gap is to push: with
/// twice this value, a rotor of a hundredth of the stator's mass moves from pair to pair for ever.
const GAP_RETURN: f64 = 0.05;
/// Shortest flight that is resolved, as a part of a step: after an impact whose rebound would be shorter, the tooth
/// stays on the rotor.
pub(super) const REST_FLIGHT: f64 = 0.125;
/// Shortest rebound, in spans, of a pair that meets the rotor while the other pair is in contact. That impact is
/// found at the end of a span; the velocity gained over one span carries a tooth for two, so shorter flights are not
/// resolved.
const JOIN_SPANS: f64 = 4.0;
/// The same limit as a part of a step; the larger of the two holds.
const JOIN_FLIGHT: f64 = 1.0;

/// Modal displacements (m) and velocities (m/s) are rounded to multiples of about 1e-16 of this. Otherwise the modes
/// of a long rest decay to subnormal numbers, with which some processors take ten times as long.
const MODAL_FLOOR: f64 = 1e-20;

/// What a span of sustained contact needs, for one length of span.
#[derive(Clone, Debug)]
pub(super) struct ContactSpan<T> {
    part: T,
    span_s: T,
    gap_return_per_s: T,
    modes: Propagator<T>,
    flight: FlightSpan<T>,
    /// Response of the modes to a unit push of each pair.
    recoil: [ModalPush<T>; 2],
    response: Response<T>,
}

impl<T: Real> ContactSpan<T> {
    fn new(modes: &ModalBank<T>, flight: &Flight<T>, teeth: &[ToothPair<T>; 2], part: T, step: T) -> Self {
        let (propagator, flown) = (modes.part(part), flight.part(part));
        let push = modes.push(&propagator);
        let recoil = teeth.each_ref().map(|tooth| push.times(&tooth.recoil));
        let span_s = part * step;
        let gap_return_per_s = T::from_f64(GAP_RETURN) / span_s;
        let response = |tooth: &ToothPair<T>, by: &ModalPush<T>| {
            let opening_s = flown.rise_s - tooth.over(&by.velocity_s);
            opening_s + gap_return_per_s * (flown.sweep_s2 - tooth.over(&by.displacement_s2))
        };
        let ([first, second], [by_first, by_second]) = (teeth, &recoil);
        Self {
            part,
            span_s,
            gap_return_per_s,
            response: Response::new([
                [response(first, by_first), response(first, by_second)],
                [response(second, by_first), response(second, by_second)],
            ]),
            modes: propagator,
            flight: flown,
            recoil,
        }
    }
}

/// `R`, and the quotients that the complementarity problem needs.
#[derive(Clone, Debug)]
struct Response<T> {
    r: [[T; 2]; 2],
    /// `-1 / R_pp`.
    alone: [T; 2],
    per_determinant: T,
}

impl<T: Real> Response<T> {
    fn new(r: [[T; 2]; 2]) -> Self {
        let [[r_00, r_01], [r_10, r_11]] = r;
        Self {
            r,
            alone: [-T::one() / r_00, -T::one() / r_11],
            per_determinant: T::one() / (r_00 * r_11 - r_01 * r_10),
        }
    }

    /// The pushes of both pairs: `a >= 0`, `c + R a >= 0`, and one of them zero, for each pair that takes part.
    fn pushes(&self, [c_0, c_1]: [T; 2], [in_0, in_1]: [bool; 2]) -> [T; 2] {
        let zero = T::zero();
        let ([[r_00, r_01], [r_10, r_11]], [alone_0, alone_1]) = (self.r, self.alone);
        let (closes_0, closes_1) = (in_0 && c_0 < zero, in_1 && c_1 < zero);
        let (alone_0, alone_1) = (alone_0 * c_0, alone_1 * c_1);
        if !closes_0 && !closes_1 {
            [zero, zero]
        } else if closes_0 && (!in_1 || c_1 + r_10 * alone_0 >= zero) {
            [alone_0, zero]
        } else if closes_1 && (!in_0 || c_0 + r_01 * alone_1 >= zero) {
            [zero, alone_1]
        } else {
            let positive = |a: T| if a > zero { a } else { zero };
            [
                positive((r_01 * c_1 - r_11 * c_0) * self.per_determinant),
                positive((r_10 * c_0 - r_00 * c_1) * self.per_determinant),
            ]
        }
    }
}

/// The spans into which a whole step is cut.
#[derive(Clone, Debug)]
pub(super) struct SustainedContact<T> {
    span: ContactSpan<T>,
    spans: u8,
    /// Shortest rebound of a pair that joins, as a part of a step.
    join_flight: T,
}

impl<T: Real> SustainedContact<T> {
    pub(super) fn new(
        modes: &ModalBank<T>,
        flight: &Flight<T>,
        teeth: &[ToothPair<T>; 2],
        fastest_rad: f64,
        step_s: f64,
    ) -> Self {
        let mut spans = 1;
        while f64::from(spans) * SPAN_RAD < fastest_rad && spans < SPANS_MAX {
            spans += 1;
        }
        let part = T::from_f64(1.0 / f64::from(spans));
        let join_flight = T::from_f64((JOIN_SPANS / f64::from(spans)).max(JOIN_FLIGHT));
        Self { span: ContactSpan::new(modes, flight, teeth, part, T::from_f64(step_s)), spans, join_flight }
    }
}

impl<T> Motion<T> {
    fn is_in_contact(&self, pair: u8) -> bool {
        let [first, second] = self.in_contact;
        if pair == 0 { first } else { second }
    }

    /// Starts a sustained contact of `pair`.
    pub(super) fn put_in_contact(&mut self, pair: u8) {
        let [first, second] = &mut self.in_contact;
        *(if pair == 0 { first } else { second }) = true;
    }
}

impl<T: Real> Motor<T> {
    /// A step that begins with teeth in sustained contact.
    #[inline(never)]
    pub(super) fn step_in_contact<L: Ledger<T>>(
        &self,
        forcing: &Forcing<T>,
        motion: &mut Motion<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let (start, end) = (motion.phase, motion.phase.advanced(forcing.increment()));
        let mut phasor = forcing.phasor(start);
        for index in 1..=self.sustained.spans {
            let done = T::from_i32(i32::from(index)) * self.sustained.span.part;
            let last = index == self.sustained.spans;
            let to = if last { end } else { forcing.phase_at(start, done) };
            let before_end_s = (T::one() - done) * self.step;
            let span = &self.sustained.span;
            phasor =
                self.advance_in_contact(span, forcing, &phasor, to, motion, before_end_s, impacts, ledger);
        }
    }

    /// The rest of a step, the fraction `left` of it, from `here` on, where a sustained contact begins. `end` holds the
    /// phase at the end of the step and becomes the state there.
    #[expect(clippy::too_many_arguments, reason = "an instant inside a step, and its end")]
    pub(super) fn stay_in_contact<L: Ledger<T>>(
        &self,
        forcing: &Forcing<T>,
        here: Motion<T>,
        phasor: &Phasor<T>,
        left: T,
        end: &mut Motion<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let to = end.phase;
        *end = here;
        if left > T::zero() {
            let span = ContactSpan::new(&self.modes, &self.flight, &self.teeth, left, self.step);
            self.advance_in_contact(&span, forcing, phasor, to, end, T::zero(), impacts, ledger);
        }
        end.phase = to;
    }

    /// Takes `motion` through one span, to the drive's phase `to`; returns the phasor there.
    #[expect(clippy::too_many_arguments, reason = "a span, the state that it advances and the records of it")]
    fn advance_in_contact<L: Ledger<T>>(
        &self,
        span: &ContactSpan<T>,
        forcing: &Forcing<T>,
        from: &Phasor<T>,
        to: Phase,
        motion: &mut Motion<T>,
        before_end_s: T,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) -> Phasor<T> {
        let before = *motion;
        let from_m_s = self.teeth.each_ref().map(|tooth| tooth.tangential_velocity(&motion.modes));
        motion.phase = to;
        let to = forcing.phasor(to);
        span.modes.advance(&mut motion.modes, forcing, [from, &to]);
        motion.modes.drop_below(T::from_f64(MODAL_FLOOR));
        span.flight.advance(&mut motion.rotor);

        let ([gap_0, gap_1], [rate_0, rate_1]) =
            (self.gaps_m(&motion.modes, &motion.rotor), self.gap_rates_m_s(motion));
        let closing = [rate_0 + span.gap_return_per_s * gap_0, rate_1 + span.gap_return_per_s * gap_1];
        let push_m_s2 = span.response.pushes(closing, before.in_contact);
        let ([push_0, push_1], [by_0, by_1]) = (push_m_s2, &span.recoil);
        motion.modes.displacement_m += by_0.displacement_s2 * push_0 + by_1.displacement_s2 * push_1;
        motion.modes.velocity_m_s += by_0.velocity_s * push_0 + by_1.velocity_s * push_1;
        motion.rotor.height_m += span.flight.sweep_s2 * (push_0 + push_1);
        motion.rotor.velocity_m_s += span.flight.rise_s * (push_0 + push_1);

        let rate = motion.rotor.rate_rad_s;
        let dv_m_s = push_m_s2.map(|push| push * span.span_s);
        let friction = self.impact_law.apply_sustained_friction(
            &self.teeth,
            dv_m_s,
            from_m_s,
            &motion.modes,
            &mut motion.rotor,
        );
        // The change of rate comes evenly over the span.
        let half_span_s = T::from_f64(0.5) * span.span_s;
        motion.rotor.angle.turn_by_radians(half_span_s * (motion.rotor.rate_rad_s - rate));
        motion.in_contact = push_m_s2.map(|push| push > T::zero());
        ledger.motion(&before.under(forcing), span.part, push_m_s2);
        ledger.sustained_contact(
            self.gaps_m(&before.modes, &before.rotor),
            self.gaps_m(&motion.modes, &motion.rotor),
            push_m_s2,
            &friction,
        );
        if motion.in_contact != [true; 2] {
            self.add_pair(forcing, &to, motion, push_m_s2, before_end_s, impacts, ledger);
        }
        to
    }

    /// A pair that meets the rotor while the other is in contact: it stays if its rebound would be shorter than what is
    /// resolved; otherwise there is an impact, and both sustained contacts end.
    #[expect(clippy::too_many_arguments, reason = "what an impact is made of, and the records of it")]
    fn add_pair<L: Ledger<T>>(
        &self,
        forcing: &Forcing<T>,
        phasor: &Phasor<T>,
        motion: &mut Motion<T>,
        push_m_s2: [T; 2],
        before_end_s: T,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let ([first, second], [push_0, push_1]) = (&self.teeth, push_m_s2);
        let ([gap_0, gap_1], [rate_0, rate_1]) =
            (self.gaps_m(&motion.modes, &motion.rotor), self.gap_rates_m_s(motion));
        for (pair, tooth, gap_m, rate_m_s) in [(0, first, gap_0, rate_0), (1, second, gap_1, rate_1)] {
            let meets = gap_m <= T::zero() && rate_m_s < T::zero();
            if motion.is_in_contact(pair) || !meets || impacts.is_full() {
                continue;
            }
            let rebound_m_s = -rate_m_s * self.impact_law.restitution();
            let [free_0, free_1] = self.gap_states(motion, forcing, phasor);
            let free_m_s2 = (if pair == 0 { free_0 } else { free_1 }).acceleration_m_s2;
            let pushed = first.recoil * push_0 + second.recoil * push_1;
            let pushed_m_s2 = free_m_s2 + push_0 + push_1 + tooth.over(&pushed);
            // Under the push of the pair in contact, or after that push has ended.
            let brief =
                |acceleration_m_s2| self.is_brief(rebound_m_s, acceleration_m_s2, self.sustained.join_flight);
            if brief(pushed_m_s2) || brief(free_m_s2) {
                motion.put_in_contact(pair);
            } else {
                self.impact(pair, tooth, gap_m, before_end_s, forcing, motion, impacts, ledger);
                motion.in_contact = [false; 2];
                motion.rotor.height_m -= gap_m;
                ledger.lift(-gap_m);
                return;
            }
        }
    }

    /// Whether a flight that begins with the opening rate `rate_m_s` under `acceleration_m_s2` is over within the
    /// fraction `part` of a step.
    pub(super) fn is_brief(&self, rate_m_s: T, acceleration_m_s2: T, part: T) -> bool {
        let pull = -acceleration_m_s2;
        pull > T::zero() && rate_m_s + rate_m_s < pull * self.step * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The solution of the complementarity problem is what it says, for any stiff enough response.
        #[test]
        fn law_pushes_are_complementary(
            c in prop::array::uniform2(-1.0..1.0_f64),
            diagonal in prop::array::uniform2(1.0..3.0_f64), cross in -0.9..0.9_f64,
            takes_part in prop::array::uniform2(any::<bool>())
        ) {
            let response = [[diagonal[0], cross], [cross, diagonal[1]]];
            let a = Response::new(response).pushes(c, takes_part);
            for p in 0..2 {
                let left = c[p] + response[p][0] * a[0] + response[p][1] * a[1];
                prop_assert!(a[p] >= 0.0);
                if takes_part[p] {
                    prop_assert!(left >= -1e-12, "{left}");
                    prop_assert!(a[p] * left <= 1e-12);
                } else {
                    prop_assert!(a[p] <= 0.0);
                }
            }
        }
    }
}
