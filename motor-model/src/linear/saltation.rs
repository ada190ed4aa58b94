//! An impact: the identity and three terms of rank one.

use super::STATES;
use crate::impact::JumpSlope;
use crate::math::Real;
use crate::motor::{Motor, MotorState};
use crate::teeth::ToothPair;

/// `effect row'`: whatever `row . dx` is changes the state along `effect`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RankOne<T> {
    /// Change of the state per unit of `row . dx`.
    pub effect: [T; STATES],
    /// What is taken of the deviation.
    pub row: [T; STATES],
}

/// The saltation matrix of an impact, `I + normal + tangential + timing`; each term acts on the deviation before the impact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saltation<T> {
    /// The normal impulse changes with the speed of approach.
    pub normal: RankOne<T>,
    /// The tangential impulse changes with the normal one where the teeth slip, with tooth and rotor where they stick.
    pub tangential: RankOne<T>,
    /// The instant of the impact changes with the gap.
    pub timing: RankOne<T>,
}

impl<T: Real> Saltation<T> {
    /// `Xi dx`: three products and three sums of vectors.
    #[must_use]
    pub fn carry(&self, deviation: &[T; STATES]) -> [T; STATES] {
        let mut carried = *deviation;
        for RankOne { effect, row } in [&self.normal, &self.tangential, &self.timing] {
            let amount = dot(row, deviation);
            for (entry, &e) in carried.iter_mut().zip(effect) {
                *entry += e * amount;
            }
        }
        carried
    }

    /// Xi in full, by rows.
    pub fn matrix(&self) -> [[T; STATES]; STATES] {
        let mut rows = [[T::zero(); STATES]; STATES];
        for (i, row) in rows.iter_mut().enumerate() {
            if let Some(diagonal) = row.get_mut(i) {
                *diagonal = T::one();
            }
        }
        for term in [&self.normal, &self.tangential, &self.timing] {
            for (row, &effect) in rows.iter_mut().zip(&term.effect) {
                for (entry, &r) in row.iter_mut().zip(&term.row) {
                    *entry += effect * r;
                }
            }
        }
        rows
    }
}

impl<T: Real> Motor<T> {
    /// The saltation matrix of an impact of `pair` (0 or 1) that meets the motor in `before`; `None` when they do not approach.
    ///
    /// `before` is the state at the instant of the impact, the drive's phase included; its gap is taken to be zero.
    pub fn saltation(&self, pair: u8, before: &MotorState<T>) -> Option<Saltation<T>> {
        let [first, second] = self.teeth();
        let tooth = if pair == 0 { first } else { second };
        let approach_m_s = tooth.vertical_velocity(&before.modes) - before.rotor.velocity_m_s;
        let approaches = approach_m_s > T::zero();
        if !approaches {
            return None;
        }
        let slope = self.impact_law().slope(tooth, approach_m_s, &before.modes, &before.rotor);
        let mut after = *before;
        self.impact_law().strike(tooth, approach_m_s, &mut after.modes, &mut after.rotor);
        let (field, field_after) = (self.field(before), self.field(&after));

        let (normal, tangential) = (normal(tooth, &slope), tangential(tooth, &slope));
        let (by_normal, by_tangential) = (dot(&normal.row, &field), dot(&tangential.row, &field));
        let mut effect = [T::zero(); STATES];
        for (i, entry) in effect.iter_mut().enumerate() {
            let of = |x: &[T; STATES]| x.get(i).copied().unwrap_or_default();
            *entry = of(&field_after)
                - of(&field)
                - of(&normal.effect) * by_normal
                - of(&tangential.effect) * by_tangential;
        }
        let per_closing = -T::one() / approach_m_s;
        let (zero, shape) = (T::zero(), tooth.shape * -per_closing);
        let row = [shape.x, zero, shape.y, zero, shape.z, zero, per_closing, zero, zero, zero];
        Some(Saltation { normal, tangential, timing: RankOne { effect, row } })
    }

    /// `x'` of free motion.
    fn field(&self, state: &MotorState<T>) -> [T; STATES] {
        let (v, rotor) = (&state.modes.velocity_m_s, &state.rotor);
        let phasor = state.forcing.phasor(state.phase);
        let modal = self.modes().acceleration(&state.modes, &state.forcing, &phasor);
        let (fall, slowing) = (self.flight().acceleration(rotor), self.flight().angular_acceleration(rotor));
        [v.x, modal.x, v.y, modal.y, v.z, modal.z, rotor.velocity_m_s, fall, rotor.rate_rad_s, slowing]
    }
}

/// `j alpha'`.
fn normal<T: Real>(tooth: &ToothPair<T>, slope: &JumpSlope<T>) -> RankOne<T> {
    let (zero, c) = (T::zero(), slope.velocity_per_approach);
    let recoil = tooth.recoil * -c;
    let shape = &tooth.shape;
    RankOne {
        effect: [zero, recoil.x, zero, recoil.y, zero, recoil.z, zero, c, zero, zero],
        row: [zero, shape.x, zero, shape.y, zero, shape.z, zero, -T::one(), zero, zero],
    }
}

/// `e_rate rho'`.
fn tangential<T: Real>(tooth: &ToothPair<T>, slope: &JumpSlope<T>) -> RankOne<T> {
    let zero = T::zero();
    let (g, per_approach) = (&slope.rate_per_displacement, slope.rate_per_approach);
    let v = slope.rate_per_velocity + tooth.shape * per_approach;
    let mut effect = [zero; STATES];
    let [.., rate] = &mut effect;
    *rate = T::one();
    RankOne { effect, row: [g.x, v.x, g.y, v.y, g.z, v.z, zero, -per_approach, zero, slope.rate_per_rate] }
}

fn dot<T: Real>(a: &[T; STATES], b: &[T; STATES]) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (&a, &b)| sum + a * b)
}
