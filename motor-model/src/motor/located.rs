//! Impacts where they happen inside a step.
//!
//! The free motion of the whole step is known before any impact is sought: `start` and `end` of the step. An impact
//! at `t` makes the velocities jump. The motion is linear, so the end of the step changes by the response to that
//! jump over the time that is left:
//!
//! ```text
//! x(t) = P(t) x(0) + drive        exact, at the instant that the gap's curve gives
//! x(h) <- x(h) + P(h - t) jump    instead of a second flight with the drive
//! ```
//!
//! and so on from impact to impact. A tooth whose rebound would be too short stays (see [`super::sustained`]).

use super::sustained::REST_FLIGHT;
use super::{Impacts, Motion, Motor};
use crate::contact::{GapCurve, GapState};
use crate::energy::Ledger;
use crate::math::Real;
use crate::modes::{Forcing, Phasor};
use crate::rotor::RotorJump;
use crate::teeth::ToothPair;

/// Which pair of teeth meets the rotor next, and when.
struct NextImpact<'a, T> {
    pair: u8,
    tooth: &'a ToothPair<T>,
    /// Fraction of the span searched.
    at: T,
}

impl<T: Real> Motor<T> {
    /// Finds and applies the impacts of a step: `here` moves from one to the next, `end` is the end of the step as it
    /// follows from there.
    #[inline(never)]
    pub(super) fn locate_impacts<L: Ledger<T>>(
        &self,
        forcing: &Forcing<T>,
        start: &Motion<T>,
        end: &mut Motion<T>,
        impacts: &mut Impacts<T>,
        ledger: &mut L,
    ) {
        let (mut here, mut done) = (*start, T::zero());
        let (mut phasor, end_phasor) = (forcing.phasor(start.phase), forcing.phasor(end.phase));
        let mut from = self.gap_states(&here, forcing, &phasor);
        loop {
            let to = self.gap_states(end, forcing, &end_phasor);
            let Some(NextImpact { pair, tooth, at }) = self.next_impact(&from, &to, T::one() - done) else {
                break;
            };
            let part = at * (T::one() - done);
            if part > T::zero() {
                ledger.motion(&here.under(forcing), part, [T::zero(); 2]);
                done += part;
                here.phase = forcing.phase_at(start.phase, done);
                let there = forcing.phasor(here.phase);
                self.modes.part(part).advance(&mut here.modes, forcing, [&phasor, &there]);
                self.flight.part(part).advance(&mut here.rotor);
                phasor = there;
            }
            let left = T::one() - done;
            let gap_m = here.rotor.height_m - tooth.height(&here.modes);
            let before_end_s = left * self.step;
            let jump = self.impact(pair, tooth, gap_m, before_end_s, forcing, &mut here, impacts, ledger);
            let Some(mut jump) = jump else {
                // A graze. If it leaves the rotor inside a tooth at the end of the step, the rule of the end applies
                // there.
                break;
            };
            if gap_m < T::zero() {
                here.rotor.height_m -= gap_m;
                jump.height_m = -gap_m;
                ledger.lift(-gap_m);
            }
            from = self.gap_states(&here, forcing, &phasor);
            if self.stays(pair, &from) || impacts.is_full() {
                here.put_in_contact(pair);
                self.stay_in_contact(forcing, here, &phasor, left, end, impacts, ledger);
                return;
            }
            self.carry_to_end(left, tooth, &jump, end);
        }
        if done < T::one() {
            ledger.motion(&here.under(forcing), T::one() - done, [T::zero(); 2]);
        }
        self.missed_impact_at_end(forcing, end, impacts, ledger);
    }

    /// Adds to `end` the response to an impact of `tooth` the fraction `left` of a step before.
    fn carry_to_end(&self, left: T, tooth: &ToothPair<T>, jump: &RotorJump<T>, end: &mut Motion<T>) {
        self.modes.add_jump(&mut end.modes, &(tooth.recoil * -jump.velocity_m_s), left);
        self.flight.part(left).add_jump(&mut end.rotor, jump);
    }

    /// The first impact of either pair between two instants the fraction `part` of a step apart.
    fn next_impact(
        &self,
        from: &[GapState<T>; 2],
        to: &[GapState<T>; 2],
        part: T,
    ) -> Option<NextImpact<'_, T>> {
        let span_s = part * self.step;
        let ([from_0, from_1], [to_0, to_1], [tooth_0, tooth_1]) = (from, to, &self.teeth);
        let first = GapCurve::new(from_0, to_0, span_s).first_descent();
        let second = GapCurve::new(from_1, to_1, span_s).first_descent();
        match (first, second) {
            (None, None) => None,
            (Some(at), None) => Some(NextImpact { pair: 0, tooth: tooth_0, at }),
            (Some(x), Some(y)) if x <= y => Some(NextImpact { pair: 0, tooth: tooth_0, at: x }),
            (_, Some(at)) => Some(NextImpact { pair: 1, tooth: tooth_1, at }),
        }
    }

    /// Whether the rebound from an impact of `pair` is shorter than what is resolved.
    fn stays(&self, pair: u8, [first, second]: &[GapState<T>; 2]) -> bool {
        let gap = if pair == 0 { first } else { second };
        self.is_brief(gap.rate_m_s, gap.acceleration_m_s2, T::from_f64(REST_FLIGHT))
    }

    /// The gaps of both pairs, their rates and accelerations.
    #[inline]
    pub(super) fn gap_states(
        &self,
        motion: &Motion<T>,
        forcing: &Forcing<T>,
        phasor: &Phasor<T>,
    ) -> [GapState<T>; 2] {
        let modal = self.modes.acceleration(&motion.modes, forcing, phasor);
        let fall_m_s2 = self.flight.acceleration(&motion.rotor);
        let ([gap_0, gap_1], [rate_0, rate_1]) =
            (self.gaps_m(&motion.modes, &motion.rotor), self.gap_rates_m_s(motion));
        let [first, second] = &self.teeth;
        [(first, gap_0, rate_0), (second, gap_1, rate_1)].map(|(tooth, gap_m, rate_m_s)| GapState {
            gap_m,
            rate_m_s,
            acceleration_m_s2: fall_m_s2 - tooth.over(&modal),
        })
    }

    /// Rates at which the gaps open.
    #[inline]
    pub(super) fn gap_rates_m_s(&self, motion: &Motion<T>) -> [T; 2] {
        let [first, second] = &self.teeth;
        [first, second].map(|tooth| motion.rotor.velocity_m_s - tooth.vertical_velocity(&motion.modes))
    }
}
