//! Teeth that stay on the rotor: contact with a force instead of blows.
//!
//! A bouncing rotor that is left alone strikes ever faster and comes to rest after infinitely many impacts in a finite time; a rotor on weakly
//! driven teeth never leaves them. Both are *pressed* contacts: over a span each pressed pair pushes the rotor up with a constant
//! acceleration `a_p >= 0` (and the modes down by its recoil), chosen so that at the end of the span no pressed gap closes,
//!
//! ```text
//! c_p = gap_p' + k gap_p / span >= 0,   a_p >= 0,   a_p c_p = 0,      c = c_free + R a
//! ```
//!
//! where `c_free` is the exact free motion, `R` the exact response to unit pushes, and `k` takes back what gap there is (Moreau's velocity
//! constraint, stabilised). A pair with `a_p = 0` lets go. Friction drags the rotor round all the while (see [`crate::drag`]). A step
//! is cut into spans of at most [`SPAN_RAD`] of the fastest mode. The error is of second order in the span.

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
/// `k`: part of a gap that a pressed contact takes back in a span. Little: taking back is pushing, and pushed twice as hard a rotor of a hundredth
/// of the stator goes on for ever from pair to pair.
const RETURN: f64 = 0.05;
/// A rebound whose flight would last less than this part of a step is none: the tooth stays on the rotor.
pub(super) const REST_FLIGHT: f64 = 0.125;
/// The same for a pair that comes up while the other lies pressed, whose blow is noticed at the end of a span only: what it has gathered
/// over a span it flies off in two, so below this many spans nothing is resolved...
const JOIN_SPANS: f64 = 4.0;
/// ... nor below this part of a step.
const JOIN_FLIGHT: f64 = 1.0;

/// In a long rest the modes die away; what is below a ten-millionth of this (in m and m/s) is dropped, before it becomes a subnormal number, with which
/// some processors take ten times as long.
const UNFELT: f64 = 1e-20;

/// Everything that a span of pressed contact needs, for one length of it.
#[derive(Clone, Debug)]
pub(super) struct PressSpan<T> {
    part: T,
    span_s: T,
    take_back_per_s: T,
    modes: Propagator<T>,
    flight: FlightSpan<T>,
    /// What a unit push of each pair makes of the modes.
    recoil: [ModalPush<T>; 2],
    response: Response<T>,
}

impl<T: Real> PressSpan<T> {
    fn new(modes: &ModalBank<T>, flight: &Flight<T>, teeth: &[ToothPair<T>; 2], part: T, step: T) -> Self {
        let (propagator, flown) = (modes.part(part), flight.part(part));
        let push = modes.push(&propagator);
        let recoil = teeth.each_ref().map(|tooth| push.times(&tooth.recoil));
        let span_s = part * step;
        let take_back_per_s = T::from_f64(RETURN) / span_s;
        let response = |tooth: &ToothPair<T>, by: &ModalPush<T>| {
            let opening_s = flown.rise_s - tooth.over(&by.velocity_s);
            opening_s + take_back_per_s * (flown.sweep_s2 - tooth.over(&by.displacement_s2))
        };
        let ([first, second], [by_first, by_second]) = (teeth, &recoil);
        Self {
            part,
            span_s,
            take_back_per_s,
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

/// `R`, and what its complementarity problem divides by.
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

/// The spans of a whole step.
#[derive(Clone, Debug)]
pub(super) struct Press<T> {
    span: PressSpan<T>,
    spans: u8,
    /// Part of a step below which the rebound of a pair that joins is none.
    join_flight: T,
}

impl<T: Real> Press<T> {
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
        Self { span: PressSpan::new(modes, flight, teeth, part, T::from_f64(step_s)), spans, join_flight }
    }
}

impl<T> Motion<T> {
    fn lies(&self, pair: u8) -> bool {
        let [first, second] = self.pressed;
        if pair == 0 { first } else { second }
    }

    /// From now on `pair` lies pressed.
    pub(super) fn lay(&mut self, pair: u8) {
        let [first, second] = &mut self.pressed;
        *(if pair == 0 { first } else { second }) = true;
    }
}

impl<T: Real> Motor<T> {
    /// A step that begins with teeth pressed on the rotor.
    #[inline(never)]
    pub(super) fn press_through<L: Ledger<T>>(
        &self,
        forcing: &Forcing<T>,
        motion: &mut Motion<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let (start, end) = (motion.phase, motion.phase.advanced(forcing.increment()));
        let mut phasor = forcing.phasor(start);
        for index in 1..=self.press.spans {
            let done = T::from_i32(i32::from(index)) * self.press.span.part;
            let last = index == self.press.spans;
            let to = if last { end } else { forcing.phase_at(start, done) };
            let before_end_s = (T::one() - done) * self.step;
            let span = &self.press.span;
            phasor = self.press_span(span, forcing, &phasor, to, motion, before_end_s, impacts, ledger);
        }
    }

    /// The rest of a step, the fraction `left` of it, from `here` on, where a tooth has come to stay; `end` is the end of the step as far as the
    /// phase goes.
    #[expect(clippy::too_many_arguments, reason = "an instant inside a step, and its end")]
    pub(super) fn press_rest<L: Ledger<T>>(
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
            let span = PressSpan::new(&self.modes, &self.flight, &self.teeth, left, self.step);
            self.press_span(&span, forcing, phasor, to, end, T::zero(), impacts, ledger);
        }
        end.phase = to;
    }

    /// Takes `motion` through one span, to the drive's phase `to`; returns the phasor there.
    #[expect(clippy::too_many_arguments, reason = "a span, what goes through it and who watches")]
    fn press_span<L: Ledger<T>>(
        &self,
        span: &PressSpan<T>,
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
        motion.modes.drop_below(T::from_f64(UNFELT));
        span.flight.advance(&mut motion.rotor);

        let ([gap_0, gap_1], [rate_0, rate_1]) =
            (self.gaps_m(&motion.modes, &motion.rotor), self.gap_rates_m_s(motion));
        let closing = [rate_0 + span.take_back_per_s * gap_0, rate_1 + span.take_back_per_s * gap_1];
        let push_m_s2 = span.response.pushes(closing, before.pressed);
        let ([push_0, push_1], [by_0, by_1]) = (push_m_s2, &span.recoil);
        motion.modes.displacement_m += by_0.displacement_s2 * push_0 + by_1.displacement_s2 * push_1;
        motion.modes.velocity_m_s += by_0.velocity_s * push_0 + by_1.velocity_s * push_1;
        motion.rotor.height_m += span.flight.sweep_s2 * (push_0 + push_1);
        motion.rotor.velocity_m_s += span.flight.rise_s * (push_0 + push_1);

        let rate = motion.rotor.rate_rad_s;
        let dv_m_s = push_m_s2.map(|push| push * span.span_s);
        let dragged = self.impact_law.drag(&self.teeth, dv_m_s, from_m_s, &motion.modes, &mut motion.rotor);
        // The change of rate comes evenly over the span.
        let half_span_s = T::from_f64(0.5) * span.span_s;
        motion.rotor.angle.turn_by_radians(half_span_s * (motion.rotor.rate_rad_s - rate));
        motion.pressed = push_m_s2.map(|push| push > T::zero());
        ledger.motion(&before.under(forcing), span.part, push_m_s2);
        ledger.pressed(
            self.gaps_m(&before.modes, &before.rotor),
            self.gaps_m(&motion.modes, &motion.rotor),
            push_m_s2,
            &dragged,
        );
        if motion.pressed != [true; 2] {
            self.join(forcing, &to, motion, push_m_s2, before_end_s, impacts, ledger);
        }
        to
    }

    /// A pair that has come up while the other lies pressed stays if it would be back at once; otherwise it strikes, and both let go.
    #[expect(clippy::too_many_arguments, reason = "what an impact is made of, and who watches")]
    fn join<L: Ledger<T>>(
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
            if motion.lies(pair) || !meets || impacts.is_full() {
                continue;
            }
            let rebound_m_s = -rate_m_s * self.impact_law.restitution();
            let [free_0, free_1] = self.gap_states(motion, forcing, phasor);
            let free_m_s2 = (if pair == 0 { free_0 } else { free_1 }).acceleration_m_s2;
            let pushed = first.recoil * push_0 + second.recoil * push_1;
            let pushed_m_s2 = free_m_s2 + push_0 + push_1 + tooth.over(&pushed);
            // Under the push of the pair that lies, or once that has let go.
            let brief =
                |acceleration_m_s2| self.is_brief(rebound_m_s, acceleration_m_s2, self.press.join_flight);
            if brief(pushed_m_s2) || brief(free_m_s2) {
                motion.lay(pair);
            } else {
                self.strike(pair, tooth, gap_m, before_end_s, forcing, motion, impacts, ledger);
                motion.pressed = [false; 2];
                motion.rotor.height_m -= gap_m;
                ledger.lift(-gap_m);
                return;
            }
        }
    }

    /// Whether a flight that begins with `rate_m_s` under `acceleration_m_s2` is over within the fraction `part` of a step.
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
            c in prop::array::uniform2(-1.0..1.0_f64), diagonal in prop::array::uniform2(1.0..3.0_f64), cross in -0.9..0.9_f64,
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
