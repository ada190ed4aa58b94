//! Impacts, found at the end of a step or where they happen.

use nalgebra::Vector3;

use super::press::REST_FLIGHT;
use super::{IMPACTS_PER_STEP_MAX, Impacts, Motor, MotorState};
use crate::contact::{GapCurve, GapState};
use crate::energy::Ledger;
use crate::impact::Impact;
use crate::math::Real;
use crate::modes::ModalState;
use crate::phase::Phase;
use crate::rotor::RotorState;
use crate::teeth::ToothPair;

/// Bound of what a cubic through value and slope at both ends of a step misses, per step and change of slope: `(w h)^2 / 384` for a pure
/// oscillation at `w`, taken four times.
pub(super) fn cubic_margin(fastest_rad: f64) -> f64 {
    4.0 / 384.0 * fastest_rad * fastest_rad
}

/// The rotor over the teeth: its height above the stator's mean, and how far the first pair swings from there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance<T> {
    height_m: T,
    swing_m: T,
    velocity_m_s: T,
    swing_m_s: T,
}

/// A pair of teeth that meets the rotor, and where.
struct Meeting<'a, T> {
    pair: u8,
    tooth: &'a ToothPair<T>,
    /// Fraction of the span searched.
    at: T,
}

impl<T: Real> Motor<T> {
    /// The paper's rule: a contact is noticed at the end of the step, the deeper pair first.
    ///
    /// The rotor is then lifted out of the tooth: without that it would sink, step by step, into teeth that it rests on. The
    /// lift's energy has its own line in the ledger.
    pub(super) fn strike_at_end<L: Ledger<T>>(
        &self,
        state: &mut MotorState<T>,
        [first, second]: [T; 2],
        ledger: &mut L,
    ) -> Impacts<T> {
        let mut impacts = Impacts::new();
        let [tooth_0, tooth_1] = &self.teeth;
        let (zero, one) = ((0, tooth_0, first), (1, tooth_1, second));
        let [deeper, other] = if second < first { [one, zero] } else { [zero, one] };
        for (pair, tooth, gap_m) in [deeper, other] {
            if gap_m <= T::zero() {
                self.strike(pair, tooth, gap_m, T::zero(), state, &mut impacts, ledger);
            }
        }
        let (_, _, deepest_m) = deeper;
        state.rotor.height_m -= deepest_m;
        ledger.lift(-deepest_m);
        impacts
    }

    /// One impact, if tooth and rotor approach; whether they did.
    #[expect(clippy::too_many_arguments, reason = "what an impact is made of")]
    pub(super) fn strike<L: Ledger<T>>(
        &self,
        pair: u8,
        tooth: &ToothPair<T>,
        gap_m: T,
        before_end_s: T,
        state: &mut MotorState<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) -> bool {
        let approach_m_s = tooth.vertical_velocity(&state.modes) - state.rotor.velocity_m_s;
        if approach_m_s <= T::zero() {
            return false;
        }
        let before = *state;
        let impulse = self.impact_law.strike(tooth, approach_m_s, &mut state.modes, &mut state.rotor);
        let impact = Impact {
            pair,
            before_end_s,
            approach_m_s,
            normal_impulse_n_s: impulse.normal_n_s,
            slip_m_s: impulse.slip_m_s,
            tangential_impulse_n_s: impulse.tangential_n_s,
            gap_m,
        };
        ledger.impact(&before, state, &impact);
        // The callers make at most as many impacts as fit.
        let _ = impacts.push(impact);
        true
    }

    /// The rotor over the teeth, as far as [`Self::surely_clear`] needs to know.
    #[inline]
    pub(super) fn clearance(&self, modes: &ModalState<T>, rotor: &RotorState<T>) -> Clearance<T> {
        let [tooth, _] = &self.teeth;
        let swing = |x: &Vector3<T>| tooth.shape.y * x.y + tooth.shape.z * x.z;
        Clearance {
            height_m: rotor.height_m - modes.displacement_m.x,
            swing_m: swing(&modes.displacement_m),
            velocity_m_s: rotor.velocity_m_s - modes.velocity_m_s.x,
            swing_m_s: swing(&modes.velocity_m_s),
        }
    }

    /// Whether neither gap can vanish between two states a step of free motion apart.
    ///
    /// Both pairs swing by `+-(phi_B g_B + phi_C g_C)` about `g_A`, so one look serves for both. The cubic through value and rate at both
    /// ends lies in the hull of its control points; the motion itself lies within a margin of the cubic.
    #[inline]
    pub(super) fn surely_clear(&self, start: &Clearance<T>, end: &Clearance<T>) -> bool {
        let third_s = self.step * T::from_f64(1.0 / 3.0);
        let turned = (end.velocity_m_s - start.velocity_m_s).abs() + (end.swing_m_s - start.swing_m_s).abs();
        let margin_m = self.curve_margin_s * turned;
        let above = |height_m: T, swing_m: T| height_m - self.widest_swing * swing_m.abs() > margin_m;
        above(start.height_m, start.swing_m)
            & above(end.height_m, end.swing_m)
            & above(start.height_m + third_s * start.velocity_m_s, start.swing_m + third_s * start.swing_m_s)
            & above(end.height_m - third_s * end.velocity_m_s, end.swing_m - third_s * end.swing_m_s)
    }

    /// Impacts where they happen: `here` moves from one to the next, `state` is the end of the step as seen from there.
    #[inline(never)]
    pub(super) fn strike_inside<L: Ledger<T>>(
        &self,
        before: &MotorState<T>,
        state: &mut MotorState<T>,
        ledger: &mut L,
    ) -> Impacts<T> {
        let mut impacts = Impacts::new();
        let (mut here, mut done) = (*before, T::zero());
        let end_phase = state.phase;
        while let Some(Meeting { pair, tooth, at }) = self.first_meeting(&here, state, T::one() - done) {
            let part = at * (T::one() - done);
            if part > T::zero() {
                ledger.motion(&here, part, [T::zero(); 2]);
                done += part;
                let phase = here.forcing.phase_at(before.phase, done);
                self.advance_part(&mut here, part, phase);
            }
            let before_end_s = (T::one() - done) * self.step;
            let gap_m = here.rotor.height_m - tooth.height(&here.modes);
            if !self.strike(pair, tooth, gap_m, before_end_s, &mut here, &mut impacts, ledger) {
                // A graze: what is left of it at the end of the step is caught there.
                break;
            }
            if gap_m < T::zero() {
                here.rotor.height_m -= gap_m;
                ledger.lift(-gap_m);
            }
            if self.stays(pair, &here) || impacts.is_full() {
                Self::lay(pair, &mut here);
                self.press_rest(here, done, state, &mut impacts, ledger);
                return impacts;
            }
            let steps = state.steps;
            *state = here;
            self.advance_part(state, T::one() - done, end_phase);
            state.steps = steps;
        }
        if done < T::one() {
            ledger.motion(&here, T::one() - done, [T::zero(); 2]);
        }
        self.catch_at_end(state, &mut impacts, ledger);
        impacts
    }

    /// What the search missed by rounding is caught by the end-of-step rule, as far as there is room for its record.
    fn catch_at_end<L: Ledger<T>>(
        &self,
        state: &mut MotorState<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let gaps_m = self.gaps_m(&state.modes, &state.rotor);
        let [first, second] = gaps_m;
        if (first < T::zero() || second < T::zero()) && impacts.len() + 2 <= IMPACTS_PER_STEP_MAX {
            for impact in self.strike_at_end(state, gaps_m, ledger) {
                let _ = impacts.push(impact);
            }
        }
    }

    /// The first meeting of either pair with the rotor on the way from `here` to `end`, the fraction `part` of a step apart.
    fn first_meeting(&self, here: &MotorState<T>, end: &MotorState<T>, part: T) -> Option<Meeting<'_, T>> {
        let span_s = part * self.step;
        let ([from_0, from_1], [to_0, to_1]) = (self.gap_states(here), self.gap_states(end));
        let first = GapCurve::new(&from_0, &to_0, span_s).first_descent();
        let second = GapCurve::new(&from_1, &to_1, span_s).first_descent();
        let [tooth_0, tooth_1] = &self.teeth;
        match (first, second) {
            (None, None) => None,
            (Some(at), None) => Some(Meeting { pair: 0, tooth: tooth_0, at }),
            (Some(x), Some(y)) if x <= y => Some(Meeting { pair: 0, tooth: tooth_0, at: x }),
            (_, Some(at)) => Some(Meeting { pair: 1, tooth: tooth_1, at }),
        }
    }

    /// Whether the tooth that has just struck will be back at once.
    fn stays(&self, pair: u8, here: &MotorState<T>) -> bool {
        let [first, second] = self.gap_states(here);
        let gap = if pair == 0 { first } else { second };
        self.is_brief(gap.rate_m_s, gap.acceleration_m_s2, T::from_f64(REST_FLIGHT))
    }

    /// Advances `state` by the fraction `part` of a step, to the drive's phase `to`.
    fn advance_part(&self, state: &mut MotorState<T>, part: T, to: Phase) {
        if part > T::zero() {
            self.modes.part(part).advance(&mut state.modes, &state.forcing, (state.phase, to));
            self.flight.part(part).advance(&mut state.rotor);
        }
        state.phase = to;
    }

    /// Rates at which the gaps open.
    #[inline]
    pub(super) fn gap_rates_m_s(&self, state: &MotorState<T>) -> [T; 2] {
        let [first, second] = &self.teeth;
        [first, second].map(|tooth| state.rotor.velocity_m_s - tooth.vertical_velocity(&state.modes))
    }

    pub(super) fn gap_states(&self, state: &MotorState<T>) -> [GapState<T>; 2] {
        let modal = self.modes.acceleration(&state.modes, &state.forcing, state.phase);
        let rotor = self.flight.acceleration(&state.rotor);
        let ([gap_0, gap_1], [rate_0, rate_1]) =
            (self.gaps_m(&state.modes, &state.rotor), self.gap_rates_m_s(state));
        let [first, second] = &self.teeth;
        [(first, gap_0, rate_0), (second, gap_1, rate_1)].map(|(tooth, gap_m, rate_m_s)| GapState {
            gap_m,
            rate_m_s,
            acceleration_m_s2: rotor - tooth.shape.dot(&modal),
        })
    }
}
