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
//! the two are linearised anew about each result (iterated Kalman update, a Gauss-Newton step of the posterior's maximum; Bell and Cathey 1993). Of both pairs the
//! one that fits better is taken. Then
//!
//! ```text
//! g(end) -= rho dv S(t),   g'(end) -= rho dv S'(t),   z(end) += dv t        rho: recoil
//! ```
//!
//! # Why not through the saltation matrix
//!
//! [`motor_model::Saltation`] is the same impact for a twin that runs by itself, `dv = (1 + e) (u' - v) / (1 + r)` and t from the gap's zero. There
//! an error of the gap moves the instant by its quotient with the speed of approach, and so the velocities by the tooth's acceleration over that speed: 3e4 m/s^2 / 0.3 m/s is
//! 1e5 per second, which within a mode's 1e-5 to 1e-4 s is a factor of one to ten each way, some hundred in all for gentle impacts. Measured, `dv` no longer depends on the state: what remains of the map is
//! the identity and three columns, for instant, jump and mass ratio ([`crate::UdCovariance`] takes them without a rotation). The same matrix
//! times the update by a measured `dv` gives the same posterior to first order, but from differences of large numbers, and about a point that may lie
//! outside the period.

use motor_model::{Real, ToothPair};
use nalgebra::Vector3;

use super::oscillator::Response;
use super::stator::{APPROACH, Errors, HEIGHT, INSTANT, JUMP, MODES, RECOIL, STATES, StatorBelief, TOOTH};
use super::tuning::{ContactTuning, TwinTuning};
use crate::factors::UdCovariance;

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
    covariance: UdCovariance<T, STATES>,
    errors: Errors<T>,
    /// Sum of two normalised squares.
    misfit: T,
}

/// A scalar that is to be zero.
struct Condition<T> {
    value: T,
    row: Errors<T>,
    noise: T,
}

/// Height and motion of a tooth, or its motion along the rotor, at an instant; rows per displacement and velocity at the end of the period.
struct Carried<T> {
    displacement_m: Vector3<T>,
    velocity_m_s: Vector3<T>,
    acceleration_m_s2: Vector3<T>,
    responses: [Response<T>; 3],
}

impl<T: Real> StatorBelief<T> {
    /// Takes an impact within the last period in; `None` when a small blow fits neither pair: it is the vibrometer's noise.
    pub(super) fn strike(&mut self, blow: &Blow<T>, tuning: &TwinTuning<T>) -> Option<Struck<T>> {
        let contact = &tuning.contact;
        self.carry();
        let before = self.covariance;
        self.covariance.renew(JUMP, blow.jump_m2_s2);
        self.covariance.renew(INSTANT, blow.within_s * blow.within_s * T::from_f64(1.0 / 12.0));
        let [first, second] = *self.teeth();
        let [zero, one] = [first, second].map(|tooth| self.candidate(blow, &tooth, contact));
        let (tooth, mut best) = if zero.misfit <= one.misfit { (first, zero) } else { (second, one) };
        if blow.jump_m_s < contact.doubtful_m_s && best.misfit > contact.misfit {
            self.covariance = before;
            return None;
        }
        let misfit = best.misfit;
        if misfit > contact.surprise {
            self.covariance.doubt::<INSTANT>(T::from_f64(3.0) * misfit / contact.surprise);
            best = self.candidate(blow, &tooth, contact);
        }
        self.covariance = best.covariance;
        self.jump_m_s = blow.jump_m_s;
        self.correct(&best.errors);
        let earlier_m_s = Known {
            value: best.errors.get(TOOTH).copied().unwrap_or_default(),
            variance: self.covariance.variance::<TOOTH>(),
        };
        let back_s =
            Known { value: blow.back_s(&best.errors), variance: self.covariance.variance::<INSTANT>() };
        let tooth_m_s = self.along(&tooth, back_s.value, tuning.tooth_m_s);
        self.recoil(&tooth, back_s.value);
        let jump_m_s = Known { value: self.jump_m_s, variance: self.covariance.variance::<JUMP>() };
        Some(Struck { back: back_s, jump: jump_m_s, tooth: tooth_m_s, earlier: earlier_m_s, misfit })
    }

    /// The modes `back_s` before the end of the period, were they corrected by `errors`.
    fn carried_back(&self, back_s: T, errors: &Errors<T>) -> Carried<T> {
        let [[_, _, g_a, v_a, g_b, v_b, g_c, v_c, ..]] = errors.data.0;
        let g = self.state.modes.displacement_m + Vector3::new(g_a, g_b, g_c);
        let v = self.state.modes.velocity_m_s + Vector3::new(v_a, v_b, v_c);
        let drive = self.drive_m_s2;
        let responses = self.oscillators.each_ref().map(|oscillator| oscillator.after(-back_s));
        let [a, b, c] = &responses;
        let each = |of: fn(&Response<T>) -> T| Vector3::new(of(a), of(b), of(c));
        let stiffness = Vector3::from(self.oscillators.map(|o| o.stiffness_per_s2));
        let damping = Vector3::from(self.oscillators.map(|o| o.damping_per_s));
        let displacement_m = each(|r| r.c).component_mul(&g)
            + each(|r| r.s).component_mul(&v)
            + drive * (T::from_f64(0.5) * back_s * back_s);
        let velocity_m_s =
            each(|r| r.c_rate).component_mul(&g) + each(|r| r.s_rate).component_mul(&v) - drive * back_s;
        let acceleration_m_s2 =
            drive - stiffness.component_mul(&displacement_m) - damping.component_mul(&velocity_m_s);
        Carried { displacement_m, velocity_m_s, acceleration_m_s2, responses }
    }

    /// One pair as the one that struck.
    fn candidate(&self, blow: &Blow<T>, tooth: &ToothPair<T>, contact: &ContactTuning<T>) -> Candidate<T> {
        let mut best = Candidate { covariance: self.covariance, errors: Errors::zeros(), misfit: T::zero() };
        for _ in 0..contact.iterations {
            let about = best.errors;
            let conditions = self.conditions(blow, tooth, &about, contact);
            best = Candidate { covariance: self.covariance, errors: Errors::zeros(), misfit: T::zero() };
            for Condition { value, row, noise } in conditions {
                // Linear about `about`: value + row . (x - about) = 0.
                let innovation = row.dot(&about) - value - row.dot(&best.errors);
                if let Ok(done) = best.covariance.update(&row, noise, innovation, &mut best.errors) {
                    best.misfit += done.normalised_squared;
                }
            }
            let half = T::from_f64(0.5) * blow.within_s;
            if let Some(late) = best.errors.get_mut(INSTANT) {
                *late = late.clamp_magnitude(half);
            }
        }
        best
    }

    /// Gap and approach about `errors`.
    fn conditions(
        &self,
        blow: &Blow<T>,
        tooth: &ToothPair<T>,
        errors: &Errors<T>,
        contact: &ContactTuning<T>,
    ) -> [Condition<T>; 2] {
        let one = T::one();
        let back_s = blow.back_s(errors);
        let there = self.carried_back(back_s, errors);
        let phi = &tooth.shape;
        let of = |state: usize| errors.get(state).copied().unwrap_or_default();
        let found = |state: usize| self.found.get(state).copied().unwrap_or_default() + of(state);
        let speed = phi.dot(&there.velocity_m_s);
        let jump_m_s = blow.jump_m_s + of(JUMP);
        let per_jump = self.approach_per_jump * (one + self.recoil_share * found(RECOIL) + found(APPROACH));
        let swing = (phi.y * there.displacement_m.y).abs() + (phi.z * there.displacement_m.z).abs();
        let square = |x: T| x * x;

        let mut gap_row = there.row(phi, |r| [-r.c, -r.s]);
        set(&mut gap_row, HEIGHT, one);
        set(&mut gap_row, INSTANT, blow.before_m_s - speed);
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
        let approach = Condition {
            value: speed - blow.before_m_s - per_jump * jump_m_s,
            row: approach_row,
            noise: T::from_f64(1e-8) + square(contact.approach_part * per_jump * jump_m_s),
        };
        [gap, approach]
    }

    /// The tooth's velocity along the rotor `back_s` before the end of the period, followed from now on as a state.
    fn along(&mut self, tooth: &ToothPair<T>, back_s: T, beside_m_s: T) -> Known<T> {
        let there = self.carried_back(back_s, &Errors::zeros());
        let mut row = there.row(&tooth.lever, |r| [r.c_rate, r.s_rate]);
        set(&mut row, INSTANT, tooth.lever.dot(&there.acceleration_m_s2));
        self.covariance.follow(&row, beside_m_s * beside_m_s);
        Known { value: tooth.lever.dot(&there.velocity_m_s), variance: self.covariance.variance::<TOOTH>() }
    }

    /// What the jump has done to stator and rotor by the end of the period.
    fn recoil(&mut self, tooth: &ToothPair<T>, back_s: T) {
        let jump = self.jump_m_s;
        let scale = T::one() + self.found.get(RECOIL).copied().unwrap_or_default();
        let responses = self.oscillators.each_ref().map(|oscillator| oscillator.after(back_s));
        let back = Carried::<T>::of(responses);
        let mut by_jump = back.row(&tooth.recoil, |r| [-r.s, -r.s_rate]);
        let by_part = by_jump * jump;
        by_jump *= scale;
        let mut by_instant = back.row(&tooth.recoil, |r| [r.s_rate, r.s_acceleration]) * (scale * jump);
        set(&mut by_jump, HEIGHT, back_s);
        set(&mut by_instant, HEIGHT, -jump);
        // From the last column to the first, since each reads what the ones before it have not yet changed.
        self.covariance.add_effect(RECOIL, &keep_motion(by_part));
        self.covariance.add_effect(JUMP, &keep_motion(by_jump));
        self.covariance.add_effect(INSTANT, &keep_motion(by_instant));
        let [[_, height, g_a, v_a, g_b, v_b, g_c, v_c, ..]] = (by_jump * jump).data.0;
        self.state.modes.displacement_m += Vector3::new(g_a, g_b, g_c);
        self.state.modes.velocity_m_s += Vector3::new(v_a, v_b, v_c);
        self.height_m += height;
    }
}

impl<T: Real> Carried<T> {
    /// Responses alone.
    fn of(responses: [Response<T>; 3]) -> Self {
        let still = Vector3::zeros();
        Self { displacement_m: still, velocity_m_s: still, acceleration_m_s2: still, responses }
    }

    /// A row, or an effect: what `part` makes of each mode's response, times the mode's weight.
    fn row(&self, weights: &Vector3<T>, part: impl Fn(&Response<T>) -> [T; 2]) -> Errors<T> {
        let mut row = Errors::zeros();
        let entries = row.iter_mut().skip(MODES);
        let parts = self
            .responses
            .iter()
            .zip(weights.iter())
            .flat_map(|(response, &weight)| part(response).map(|entry| weight * entry));
        for (to, from) in entries.zip(parts) {
            *to = from;
        }
        row
    }
}

/// An effect on height and modes alone.
fn keep_motion<T: Real>(mut effect: Errors<T>) -> Errors<T> {
    for entry in effect.iter_mut().skip(INSTANT) {
        *entry = T::zero();
    }
    effect
}

fn set<T: Real>(row: &mut Errors<T>, state: usize, value: T) {
    if let Some(entry) = row.get_mut(state) {
        *entry = value;
    }
}
