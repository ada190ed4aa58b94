//! An impact as the twin explains it: which pair, when within the sample's period, and how fast along the rotor.
//!
//! The twin is never asked for the impulse. The vibrometer gives the velocity before, `v`, and the jump, `dv`; the pair p that struck `t` before the end of the period then
//! satisfies
//!
//! ```text
//! gap        z - v t - phi . g(-t) = 0                                    z, g at the end of the period, were there no impact
//! approach   phi . g'(-t) - v - a = 0,    a = dv (1 + r) / (1 + e)
//! ```
//!
//! Both are measurements of the stator's errors, the instant, the jump and the parameters. The tooth accelerates at 3e4 m/s^2, so the gap is curved within the period by 0.1 um:
//! the two are linearised about the prediction, anew about what that means for the pair that fits better, and once more for the update (iterated Kalman update, Gauss-Newton steps
//! to the posterior's maximum; Bell and Cathey 1993). What stays bent, an error of the instant times one of speed or acceleration, is noise: nothing in a stator that is
//! known, and all that counts in one that is not. Then
//!
//! ```text
//! g(end) -= rho dv S(t),   g'(end) -= rho dv S'(t),   z(end) += dv t        rho: recoil
//! ```
//!
//! The sum of both normalised squares at the second linearisation is the impact's misfit: about two whether the stator is known well or badly. A jump that is noise has none,
//! but its own square over its variance is above the detector's threshold; of the two the likelier is believed.
//!
//! # Why not through the saltation matrix
//!
//! [`motor_model::Saltation`] is the same impact for a twin that runs by itself, `dv = (1 + e) (u' - v) / (1 + r)` and t from the gap's zero. There
//! an error of the gap moves the instant by its quotient with the speed of approach, and so the velocities by the tooth's acceleration over that speed: 3e4 m/s^2 / 0.3 m/s is
//! 1e5 per second, which within a mode's 1e-5 to 1e-4 s is a factor of one to ten each way, some hundred in all for gentle impacts. Measured, `dv` no longer depends on the state: what remains of the map is
//! the identity and three columns, for instant, jump and mass ratio ([`crate::UdCovariance`] takes them without a rotation). The same matrix
//! times the update by a measured `dv` gives the same posterior to first order, but from differences of large numbers, and about a point that may lie
//! outside the period.

use motor_model::Real;
use nalgebra::Vector3;

use super::shape::{Carried, Shaped, set, swinging, turned};
use super::stator::{ANGLE, APPROACH, Errors, HEIGHT, INSTANT, JUMP, RECOIL, StatorBelief, TOOTH};
use super::tuning::{ContactTuning, TwinTuning};

/// A blow is noise when its first misfit, linearised about the prediction, is beyond so many times the limit: what it means is then nowhere near.
const FAR: f64 = 40.0;

/// An impact as the vibrometer saw it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blow<T> {
    /// Vertical velocity before, as at the end of the period, in m/s.
    pub(super) before_m_s: T,
    pub(super) jump_m_s: T,
    /// Variance of the jump.
    pub(super) jump_m2_s2: T,
    /// Time since the sample before, within which the rotor was struck: a period, or more where samples were lost.
    pub(super) within_s: T,
    /// How far samples below the threshold have moved the flight since the impact before, in m/s.
    pub(super) unheard_m_s: T,
}

impl<T: Real> Blow<T> {
    /// From the instant, counted later from the middle of the period, how long before its end.
    fn back_s(&self, errors: &Errors<T>) -> T {
        T::from_f64(0.5) * self.within_s - errors.get(INSTANT).copied().unwrap_or_default()
    }

    /// The instant is within the period.
    fn keep_in_period(&self, errors: &mut Errors<T>) {
        if let Some(late) = errors.get_mut(INSTANT) {
            *late = late.clamp_magnitude(T::from_f64(0.5) * self.within_s);
        }
    }
}

/// A value and its variance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known<T> {
    pub(super) value: T,
    pub(super) variance: T,
}

/// An impact explained.
#[derive(Clone, Copy, Debug)]
pub(super) struct Struck<T> {
    /// Before the end of the period, in s.
    pub(super) back: Known<T>,
    /// Jump of the rotor's vertical velocity, in m/s.
    pub(super) jump: Known<T>,
    /// Tangential velocity of the tooth, in m/s.
    pub(super) tooth: Known<T>,
    /// Correction of the tangential velocity at the impact before, and the variance left, in m/s.
    pub(super) earlier: Known<T>,
    /// Sum of the two normalised squares.
    pub(super) misfit: T,
}

/// One pair as the one that struck.
#[derive(Clone, Copy, Debug)]
struct Candidate<T> {
    pair: usize,
    errors: Errors<T>,
    /// Sum of two normalised squares.
    misfit: T,
    /// Variances beside the noise of gap and approach, by what their linearisation leaves out.
    bent: [T; 2],
}

impl<T: Real> Candidate<T> {
    /// A pair of which nothing has been found yet.
    fn of(pair: usize) -> Self {
        Self { pair, errors: Errors::zeros(), misfit: T::zero(), bent: [T::zero(); 2] }
    }
}

/// A scalar that is to be zero.
struct Condition<T> {
    value: T,
    row: Errors<T>,
    noise: T,
}

impl<T: Real> Condition<T> {
    /// Linear about `about`, `value + row . (x - about) = 0`: what `row . x` is to be.
    fn innovation(&self, about: &Errors<T>) -> T {
        self.row.dot(about) - self.value
    }
}

impl<T: Real> StatorBelief<T> {
    /// Takes an impact within the last period in; `None` when a small blow fits neither pair: it is the vibrometer's noise.
    #[inline(never)]
    pub(super) fn strike(&mut self, blow: &Blow<T>, tuning: &TwinTuning<T>) -> Option<Struck<T>> {
        let contact = &tuning.contact;
        self.carry();
        self.unsettle();
        self.covariance.renew(JUMP, blow.jump_m2_s2);
        self.covariance.renew(INSTANT, blow.within_s * blow.within_s * T::from_f64(1.0 / 12.0));
        let [zero, one] = [0, 1].map(|pair| self.linearised(blow, &Candidate::of(pair), contact));
        let better = if zero.misfit <= one.misfit { zero } else { one };
        let mut best = self.linearised(blow, &better, contact);
        let alarm = blow.jump_m_s * blow.jump_m_s / blow.jump_m2_s2 + contact.alarm;
        if best.misfit > alarm || better.misfit > T::from_f64(FAR) * alarm {
            return None;
        }
        let misfit = best.misfit;
        if misfit > contact.surprise {
            self.covariance.doubt::<INSTANT>(T::from_f64(3.0) * misfit / contact.surprise);
            best = self.linearised(blow, &Candidate::of(best.pair), contact);
        }
        let errors = self.settle_on(blow, &best, contact);
        self.jump_m_s = blow.jump_m_s;
        self.correct(&errors);
        let earlier_m_s = Known {
            value: errors.get(TOOTH).copied().unwrap_or_default(),
            variance: self.covariance.variance::<TOOTH>(),
        };
        let back_s = Known { value: blow.back_s(&errors), variance: self.covariance.variance::<INSTANT>() };
        let tooth = self.tooth(best.pair, &Errors::zeros());
        let tooth_m_s = self.along(&tooth, back_s.value, tuning.tooth_m_s);
        self.recoil(&tooth, back_s.value);
        let jump_m_s = Known { value: self.jump_m_s, variance: self.covariance.variance::<JUMP>() };
        Some(Struck { back: back_s, jump: jump_m_s, tooth: tooth_m_s, earlier: earlier_m_s, misfit })
    }

    /// What the conditions make of the errors, linearised about those of a candidate, and nothing of their covariance.
    #[inline(never)]
    fn linearised(&self, blow: &Blow<T>, about: &Candidate<T>, contact: &ContactTuning<T>) -> Candidate<T> {
        let [gap, approach] = self.conditions(blow, about.pair, &about.errors, contact);
        let [f, g] = [&gap, &approach].map(|condition| self.covariance.whitened(&condition.row));
        let [df, dg] = [&f, &g].map(|f| self.covariance.weighted(f));
        let (gap_m2, approach_m2_s2) = (f.dot(&df), g.dot(&dg));
        let bent = self.bent(&[(&gap, gap_m2), (&approach, approach_m2_s2)]);
        let per_gap = T::one() / (gap.noise + bent[0] + gap_m2);
        // The approach, as far as the gap does not tell it.
        let shared = g.dot(&df) * per_gap;
        let left = dg - df * shared;
        let per_approach = T::one() / (approach.noise + bent[1] + not_negative(g.dot(&left)));
        let [of_gap, of_approach] = [&gap, &approach].map(|c| c.innovation(&about.errors));
        let beside = of_approach - shared * of_gap;
        let by = df * (per_gap * of_gap) + left * (per_approach * beside);
        let mut errors = self.covariance.coloured(&by);
        blow.keep_in_period(&mut errors);
        let misfit = of_gap * per_gap * of_gap + beside * per_approach * beside;
        Candidate { pair: about.pair, errors, misfit, bent }
    }

    /// Variances of what bends gap and approach, whose own variances are given: an error of the instant times one of the speed or of the acceleration.
    fn bent(&self, [(gap, gap_m2), (approach, approach_m2_s2)]: &[(&Condition<T>, T); 2]) -> [T; 2] {
        let instant_s2 = self.covariance.variance::<INSTANT>();
        let beside_instant = |condition: &Condition<T>, variance: T| {
            let by_instant = condition.row.get(INSTANT).copied().unwrap_or_default();
            not_negative(variance - by_instant * by_instant * instant_s2)
        };
        let [_, _, stiffest] = &self.oscillators;
        let per_s4 = stiffest.stiffness_per_s2 * stiffest.stiffness_per_s2;
        [
            beside_instant(approach, *approach_m2_s2) * instant_s2,
            beside_instant(gap, *gap_m2) * per_s4 * instant_s2,
        ]
    }

    /// Takes the conditions in, linearised about the best candidate's errors; returns the errors.
    #[inline(never)]
    fn settle_on(&mut self, blow: &Blow<T>, best: &Candidate<T>, contact: &ContactTuning<T>) -> Errors<T> {
        let mut errors = Errors::zeros();
        let conditions = self.conditions(blow, best.pair, &best.errors, contact);
        for (Condition { noise, row, value }, bent) in conditions.into_iter().zip(best.bent) {
            let innovation = row.dot(&best.errors) - value - row.dot(&errors);
            let _ = self.covariance.update(&row, noise + bent, innovation, &mut errors);
        }
        blow.keep_in_period(&mut errors);
        errors
    }

    /// Gap and approach about `errors`.
    #[inline(never)]
    fn conditions(
        &self,
        blow: &Blow<T>,
        pair: usize,
        errors: &Errors<T>,
        contact: &ContactTuning<T>,
    ) -> [Condition<T>; 2] {
        let one = T::one();
        let back_s = blow.back_s(errors);
        let there = self.carried_back(back_s, errors);
        let tooth = self.tooth(pair, errors);
        let (phi, [across, aslant]) = (&tooth.shape, [swinging(&tooth.shape), turned(&tooth.shape)]);
        let of = |state: usize| errors.get(state).copied().unwrap_or_default();
        let found = |state: usize| self.found.get(state).copied().unwrap_or_default() + of(state);
        let speed = phi.dot(&there.velocity_m_s);
        let jump_m_s = blow.jump_m_s + of(JUMP);
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
        let gap = Condition {
            value: self.height_m + of(HEIGHT) - blow.before_m_s * back_s - phi.dot(&there.displacement_m),
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
        let approach = Condition {
            value: speed - blow.before_m_s - per_jump * jump_m_s,
            row: approach_row,
            noise: T::from_f64(1e-8) + square(contact.approach_part * per_jump * jump_m_s),
        };
        [gap, approach]
    }

    /// The tooth's velocity along the rotor `back_s` before the end of the period, followed from now on as a state.
    #[inline(never)]
    fn along(&mut self, tooth: &Shaped<T>, back_s: T, beside_m_s: T) -> Known<T> {
        let there = self.carried_back(back_s, &Errors::zeros());
        let mut row = there.row(&tooth.lever, |r| [r.c_rate, r.s_rate]);
        set(&mut row, INSTANT, tooth.lever.dot(&there.acceleration_m_s2));
        set(&mut row, tooth.scale, tooth.lever.dot(&there.velocity_m_s));
        set(&mut row, ANGLE, turned(&tooth.lever).dot(&there.velocity_m_s));
        self.covariance.follow(&row, beside_m_s * beside_m_s);
        Known { value: tooth.lever.dot(&there.velocity_m_s), variance: self.covariance.variance::<TOOTH>() }
    }

    /// What the jump has done to stator and rotor by the end of the period.
    #[inline(never)]
    fn recoil(&mut self, tooth: &Shaped<T>, back_s: T) {
        let jump = self.jump_m_s;
        let scale = T::one() + self.found.get(RECOIL).copied().unwrap_or_default();
        let responses = self.oscillators.each_ref().map(|oscillator| oscillator.after(back_s));
        let back = Carried::<T>::of(responses);
        let struck = |recoil: &Vector3<T>| back.row(recoil, |r| [-r.s, -r.s_rate]);
        let [by_scale, by_angle] =
            [swinging(&tooth.recoil), turned(&tooth.recoil)].map(|recoil| struck(&recoil) * (scale * jump));
        let mut by_jump = struck(&tooth.recoil);
        let by_part = by_jump * jump;
        by_jump *= scale;
        let mut by_instant = back.row(&tooth.recoil, |r| [r.s_rate, r.s_acceleration]) * (scale * jump);
        set(&mut by_jump, HEIGHT, back_s);
        set(&mut by_instant, HEIGHT, -jump);
        // From the last column to the first, since each reads what the ones before it have not yet changed.
        for (state, effect) in [
            (ANGLE, by_angle),
            (tooth.scale, by_scale),
            (RECOIL, by_part),
            (JUMP, by_jump),
            (INSTANT, by_instant),
        ] {
            let motion = effect.as_slice().get(HEIGHT..INSTANT).unwrap_or_default();
            self.covariance.add_effect(state, HEIGHT, motion);
        }
        let [[_, height, g_a, v_a, g_b, v_b, g_c, v_c, ..]] = (by_jump * jump).data.0;
        self.state.modes.displacement_m += Vector3::new(g_a, g_b, g_c);
        self.state.modes.velocity_m_s += Vector3::new(v_a, v_b, v_c);
        self.height_m += height;
    }
}

fn not_negative<T: Real>(x: T) -> T {
    if x > T::zero() { x } else { T::zero() }
}
