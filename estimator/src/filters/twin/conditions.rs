//! Gap and approach, the two conditions that an impact meets ([`super::contact`]), linear about some errors.

use motor_model::Real;

use super::contact::Blow;
use super::shape::{Row, of, set, swinging, turned};
use super::stator::{ANGLE, APPROACH, HEIGHT, INSTANT, JUMP, RECOIL, StatorBelief};
use super::tuning::ContactTuning;

/// A scalar that is to be zero, linear about some errors.
pub(super) struct Condition<T> {
    pub(super) row: Row<T>,
    /// What `row . errors` is to be.
    pub(super) innovation: T,
    pub(super) noise: T,
}

impl<T: Real> StatorBelief<T> {
    /// Gap and approach about `errors`.
    #[inline(never)]
    pub(super) fn conditions(
        &self,
        blow: &Blow<T>,
        pair: usize,
        errors: &Row<T>,
        contact: &ContactTuning<T>,
    ) -> [Condition<T>; 2] {
        let one = T::one();
        let back_s = blow.back_s(of(errors, INSTANT));
        let there = self.carried_back(back_s - blow.behind_s, errors);
        let tooth = self.tooth(pair, errors);
        let (phi, [across, aslant]) = (&tooth.shape, [swinging(&tooth.shape), turned(&tooth.shape)]);
        let found = |state: usize| self.found(state, errors);
        let speed = phi.dot(&there.velocity_m_s);
        let jump_m_s = blow.jump_m_s + of(errors, JUMP);
        // `r` grows with the square of the shape, of which A is a third.
        let per_scale = self.recoil_share * T::from_f64(4.0 / 3.0);
        let per_jump = self.approach_per_jump
            * (one + self.recoil_share * found(RECOIL) + per_scale * found(tooth.scale) + found(APPROACH));
        let swing = (phi.y * there.displacement_m.y).abs() + (phi.z * there.displacement_m.z).abs();
        let square = |x: T| x * x;

        let mut gap_row = there.row(phi, |r| [-r.c, -r.s]);
        set(&mut gap_row, HEIGHT, one);
        set(&mut gap_row, INSTANT, blow.before_m_s - speed);
        set(&mut gap_row, tooth.scale, -across.dot(&there.displacement_m));
        set(&mut gap_row, ANGLE, -aslant.dot(&there.displacement_m));
        let gap_m =
            self.height_m + of(errors, HEIGHT) - blow.before_m_s * back_s - phi.dot(&there.displacement_m);
        let gap = Condition {
            innovation: gap_row.dot(errors) - gap_m,
            row: gap_row,
            noise: square(contact.gap_m) + square(contact.shape_part * swing),
        };
        let mut approach_row = there.row(phi, |r| [r.c_rate, r.s_rate]);
        set(&mut approach_row, INSTANT, phi.dot(&there.acceleration_m_s2));
        set(&mut approach_row, JUMP, -per_jump);
        set(&mut approach_row, RECOIL, -self.recoil_share * self.approach_per_jump * jump_m_s);
        set(&mut approach_row, APPROACH, -self.approach_per_jump * jump_m_s);
        let by_share = per_scale * self.approach_per_jump * jump_m_s;
        set(&mut approach_row, tooth.scale, across.dot(&there.velocity_m_s) - by_share);
        set(&mut approach_row, ANGLE, aslant.dot(&there.velocity_m_s));
        let too_fast_m_s = speed - blow.before_m_s - per_jump * jump_m_s;
        let approach = Condition {
            innovation: approach_row.dot(errors) - too_fast_m_s,
            row: approach_row,
            noise: T::from_f64(1e-8) + square(contact.approach_part * per_jump * jump_m_s),
        };
        [gap, approach]
    }
}
