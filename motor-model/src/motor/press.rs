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

use super::{Impacts, Motor, MotorState};
use crate::energy::Ledger;
use crate::math::Real;
use crate::modes::{ModalBank, ModalPush, Propagator};
use crate::rotor::{Flight, FlightSpan};
use crate::teeth::ToothPair;

/// Longest span in radians of the fastest mode.
const SPAN_RAD: f64 = 0.25;
/// Most spans of a step.
const SPANS_MAX: u8 = 16;
/// `k`: part of a gap that a pressed contact takes back in a span.
const RETURN: f64 = 0.3;
/// A rebound whose flight would last less than this part of a step is none: the tooth stays on the rotor.
pub(super) const REST_FLIGHT: f64 = 0.125;
/// The same for a pair that comes up while the other lies pressed, whose blow is noticed at the end of a span only: what it has gathered
/// over a span it flies off in two, so below this many spans nothing is resolved...
const JOIN_SPANS: f64 = 4.0;
/// ... nor below this part of a step.
const JOIN_FLIGHT: f64 = 1.0;

/// Everything that a span of pressed contact needs, for one length of it.
#[derive(Clone, Debug)]
pub(super) struct PressSpan<T> {
    part: T,
    span_s: T,
    modes: Propagator<T>,
    flight: FlightSpan<T>,
    push: ModalPush<T>,
    /// `R`.
    response: [[T; 2]; 2],
}

impl<T: Real> PressSpan<T> {
    fn new(modes: &ModalBank<T>, flight: &Flight<T>, teeth: &[ToothPair<T>; 2], part: T, step: T) -> Self {
        let (propagator, flown) = (modes.part(part), flight.part(part));
        let push = modes.push(&propagator);
        let span_s = part * step;
        let take_back_per_s = T::from_f64(RETURN) / span_s;
        let response = |tooth: &ToothPair<T>, by: &ToothPair<T>| {
            let opening_s = flown.rise_s + tooth.shape.dot(&by.recoil.component_mul(&push.velocity_s));
            let opened_s2 = flown.sweep_s2 + tooth.shape.dot(&by.recoil.component_mul(&push.displacement_s2));
            opening_s + take_back_per_s * opened_s2
        };
        let [first, second] = teeth;
        Self {
            part,
            span_s,
            response: [
                [response(first, first), response(first, second)],
                [response(second, first), response(second, second)],
            ],
            modes: propagator,
            flight: flown,
            push,
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

/// The pushes of both pairs: `a >= 0`, `c + R a >= 0`, and one of them zero, for each pair that takes part.
fn pushes<T: Real>(
    [c_0, c_1]: [T; 2],
    [[r_00, r_01], [r_10, r_11]]: [[T; 2]; 2],
    [in_0, in_1]: [bool; 2],
) -> [T; 2] {
    let zero = T::zero();
    let (closes_0, closes_1) = (in_0 && c_0 < zero, in_1 && c_1 < zero);
    let (alone_0, alone_1) = (-c_0 / r_00, -c_1 / r_11);
    if !closes_0 && !closes_1 {
        [zero, zero]
    } else if closes_0 && (!in_1 || c_1 + r_10 * alone_0 >= zero) {
        [alone_0, zero]
    } else if closes_1 && (!in_0 || c_0 + r_01 * alone_1 >= zero) {
        [zero, alone_1]
    } else {
        let determinant = r_00 * r_11 - r_01 * r_10;
        let positive = |a: T| if a > zero { a } else { zero };
        [positive((r_01 * c_1 - r_11 * c_0) / determinant), positive((r_10 * c_0 - r_00 * c_1) / determinant)]
    }
}

impl<T: Real> Motor<T> {
    /// A step that begins with teeth pressed on the rotor.
    #[inline(never)]
    pub(super) fn press_through<L: Ledger<T>>(
        &self,
        state: &mut MotorState<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let (start, end_phase) = (state.phase, state.phase.advanced(state.forcing.increment()));
        for index in 1..=self.press.spans {
            let last = index == self.press.spans;
            let here = *state;
            let done = T::from_i32(i32::from(index)) * self.press.span.part;
            state.phase = if last { end_phase } else { state.forcing.phase_at(start, done) };
            self.press_span(&self.press.span, &here, state, (T::one() - done) * self.step, impacts, ledger);
        }
        state.steps += 1;
    }

    /// The rest of a step from `here` on, the fraction `left` of it, after a tooth has come to stay; `state` is the end of the step as far as
    /// time and phase go.
    pub(super) fn press_rest<L: Ledger<T>>(
        &self,
        here: &MotorState<T>,
        left: T,
        state: &mut MotorState<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        (state.modes, state.rotor, state.pressed) = (here.modes, here.rotor, here.pressed);
        if left > T::zero() {
            let span = PressSpan::new(&self.modes, &self.flight, &self.teeth, left, self.step);
            self.press_span(&span, here, state, T::zero(), impacts, ledger);
        }
    }

    /// One span from `here`; `state` comes with the phase of its end.
    fn press_span<L: Ledger<T>>(
        &self,
        span: &PressSpan<T>,
        here: &MotorState<T>,
        state: &mut MotorState<T>,
        before_end_s: T,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let [first, second] = &self.teeth;
        let from_m_s = [first, second].map(|tooth| tooth.tangential_velocity(&here.modes));
        let phasors = [&here.forcing.phasor(here.phase), &here.forcing.phasor(state.phase)];
        span.modes.advance(&mut state.modes, &state.forcing, phasors);
        span.flight.advance(&mut state.rotor);

        let take_back_per_s = T::from_f64(RETURN) / span.span_s;
        let ([gap_0, gap_1], [rate_0, rate_1]) =
            (self.gaps_m(&state.modes, &state.rotor), self.gap_rates_m_s(state));
        let closing = [rate_0 + take_back_per_s * gap_0, rate_1 + take_back_per_s * gap_1];
        let push_m_s2 = pushes(closing, span.response, here.pressed);
        let [push_0, push_1] = push_m_s2;
        for (tooth, push) in [(first, push_0), (second, push_1)] {
            state.modes.displacement_m -= tooth.recoil.component_mul(&span.push.displacement_s2) * push;
            state.modes.velocity_m_s -= tooth.recoil.component_mul(&span.push.velocity_s) * push;
        }
        state.rotor.height_m += span.flight.sweep_s2 * (push_0 + push_1);
        state.rotor.velocity_m_s += span.flight.rise_s * (push_0 + push_1);

        let rate = state.rotor.rate_rad_s;
        let dv_m_s = push_m_s2.map(|push| push * span.span_s);
        let dragged = self.impact_law.drag(&self.teeth, dv_m_s, from_m_s, &state.modes, &mut state.rotor);
        // The change of rate comes evenly over the span.
        let half_span_s = T::from_f64(0.5) * span.span_s;
        state.rotor.angle.turn_by_radians(half_span_s * (state.rotor.rate_rad_s - rate));
        state.pressed = push_m_s2.map(|push| push > T::zero());
        ledger.motion(here, span.part, push_m_s2);
        ledger.pressed(
            self.gaps_m(&here.modes, &here.rotor),
            self.gaps_m(&state.modes, &state.rotor),
            push_m_s2,
            &dragged,
        );
        self.join(state, push_m_s2, before_end_s, impacts, ledger);
    }

    /// A pair that has come up while the other lies pressed stays if it would be back at once; otherwise it strikes, and both let go.
    fn join<L: Ledger<T>>(
        &self,
        state: &mut MotorState<T>,
        push_m_s2: [T; 2],
        before_end_s: T,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let ([first, second], [push_0, push_1]) = (&self.teeth, push_m_s2);
        let pushed = first.recoil * push_0 + second.recoil * push_1;
        let phasor = state.forcing.phasor(state.phase);
        let [gap_0, gap_1] = self.gap_states(state, &phasor);
        for (pair, tooth, gap) in [(0, first, gap_0), (1, second, gap_1)] {
            let lies = Self::lies(pair, state);
            let meets = gap.gap_m <= T::zero() && gap.rate_m_s < T::zero();
            if lies || !meets || impacts.is_full() {
                continue;
            }
            let rebound_m_s = -gap.rate_m_s * self.impact_law.restitution();
            let acceleration_m_s2 = gap.acceleration_m_s2 + push_0 + push_1 + tooth.shape.dot(&pushed);
            // Under the push of the pair that lies, or once that has let go.
            let brief =
                |acceleration_m_s2| self.is_brief(rebound_m_s, acceleration_m_s2, self.press.join_flight);
            if brief(acceleration_m_s2) || brief(gap.acceleration_m_s2) {
                Self::lay(pair, state);
            } else {
                self.strike(pair, tooth, gap.gap_m, before_end_s, state, impacts, ledger);
                state.pressed = [false; 2];
                state.rotor.height_m -= gap.gap_m;
                ledger.lift(-gap.gap_m);
                return;
            }
        }
    }

    fn lies(pair: u8, state: &MotorState<T>) -> bool {
        let [first, second] = state.pressed;
        if pair == 0 { first } else { second }
    }

    /// From now on `pair` lies pressed.
    pub(super) fn lay(pair: u8, state: &mut MotorState<T>) {
        let [first, second] = &mut state.pressed;
        *(if pair == 0 { first } else { second }) = true;
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
            let a = pushes(c, response, takes_part);
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
