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

use super::conditions::Condition;
use super::shape::{Carried, Row, Shaped, of, set, swinging, turned};
use super::stator::{ANGLE, Errors, HEIGHT, INSTANT, JUMP, RECOIL, STATES, StatorBelief, TOOTH};
use super::tuning::{ContactTuning, TwinTuning};
use crate::factorised::ud_covariance::WhitenedMeasurement;

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
    /// By how much the stator, which moves on in periods of its own, is behind the sample: 0 where samples come in time with them.
    pub(super) behind_s: T,
    /// How far samples below the threshold have moved the flight since the impact before, in m/s.
    pub(super) unheard_m_s: T,
}

impl<T: Real> Blow<T> {
    /// From the instant, counted later from the middle of the period, how long before its end.
    pub(super) fn back_s(&self, late_s: T) -> T {
        T::from_f64(0.5) * self.within_s - late_s
    }

    /// The instant is within the period.
    fn kept_in_period(&self, late_s: T) -> T {
        late_s.clamp_magnitude(T::from_f64(0.5) * self.within_s)
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

/// The pair that fits better, what bends its conditions, the errors that they tell, and its misfit.
struct Likelier<T> {
    pair: usize,
    bent: [T; 2],
    errors: Row<T>,
    misfit: T,
}

/// A jump that fits neither pair better than it fits noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unfit<T> {
    /// By how much both misfits are beyond that of noise.
    pub(super) beyond: T,
}

/// A [`Condition`] of which no more is needed than the row times U.
struct Linear<T> {
    by_instant: T,
    innovation: T,
    noise: T,
}

/// One pair as the one that struck: gap and approach.
struct Looked<T> {
    pair: usize,
    conditions: [Linear<T>; 2],
    /// Their rows times U.
    whitened: [[T; STATES]; 2],
}

/// What the covariance makes of them.
struct Weighed<T> {
    /// Sum of two normalised squares.
    misfit: T,
    /// Variances beside the noise of gap and approach, by what their linearisation leaves out.
    bent: [T; 2],
    /// The errors are `P` times the rows times this.
    pulls: [T; 2],
}

impl<T: Real> StatorBelief<T> {
    /// Takes an impact within the last period in.
    ///
    /// # Errors
    /// When a small blow fits neither pair: it is the vibrometer's noise.
    #[inline(never)]
    pub(super) fn strike(&mut self, blow: &Blow<T>, tuning: &TwinTuning<T>) -> Result<Struck<T>, Unfit<T>> {
        let contact = &tuning.contact;
        self.carry();
        self.unsettle();
        self.covariance.replace_state(JUMP, blow.jump_m2_s2);
        self.covariance.replace_state(INSTANT, blow.within_s * blow.within_s * T::from_f64(1.0 / 12.0));
        let Likelier { pair, bent, errors, misfit } = self.likelier(blow, contact)?;
        let errors = self.settle_on(blow, pair, bent, &errors, contact);
        self.jump_m_s = blow.jump_m_s;
        self.correct(&errors);
        let [[earlier_m_s, ..]] = errors.data.0;
        let earlier_m_s = Known { value: earlier_m_s, variance: self.covariance.variance::<TOOTH>() };
        let late_s = errors.as_slice().get(INSTANT).copied().unwrap_or_default();
        let back_s = Known { value: blow.back_s(late_s), variance: self.covariance.variance::<INSTANT>() };
        let tooth = self.tooth(pair, &Row::zeros());
        let there_s = back_s.value - blow.behind_s;
        let tooth_m_s = self.along(&tooth, there_s, tuning.tooth_m_s);
        self.recoil(&tooth, back_s.value, blow.behind_s);
        let jump_m_s = Known { value: self.jump_m_s, variance: self.covariance.variance::<JUMP>() };
        Ok(Struck { back: back_s, jump: jump_m_s, tooth: tooth_m_s, earlier: earlier_m_s, misfit })
    }

    /// The pair that fits better.
    ///
    /// # Errors
    /// When both fit worse than noise.
    #[inline(never)]
    fn likelier(&mut self, blow: &Blow<T>, contact: &ContactTuning<T>) -> Result<Likelier<T>, Unfit<T>> {
        let predicted = [0, 1].map(|pair| self.look(blow, pair, &Row::zeros(), contact));
        let [zero, one] = predicted.each_ref().map(|looked| self.weigh(looked));
        let [of_zero, of_one] = &predicted;
        let (looked, better) = if zero.misfit <= one.misfit { (of_zero, zero) } else { (of_one, one) };
        let of_noise = blow.jump_m_s * blow.jump_m_s / blow.jump_m2_s2;
        let alarm = of_noise + contact.alarm;
        if better.misfit > T::from_f64(FAR) * alarm {
            return Err(Unfit { beyond: better.misfit - of_noise });
        }
        let pair = looked.pair;
        let meant = self.look(blow, pair, &self.told(blow, looked, &better), contact);
        let best = self.weigh(&meant);
        let misfit = best.misfit;
        if misfit > alarm {
            return Err(Unfit { beyond: misfit - of_noise });
        }
        if misfit > contact.surprise {
            self.covariance.inflate::<INSTANT>(T::from_f64(3.0) * misfit / contact.surprise);
            let doubted = self.weigh(looked);
            let errors = self.told(blow, looked, &doubted);
            return Ok(Likelier { pair, bent: doubted.bent, errors, misfit });
        }
        Ok(Likelier { pair, bent: best.bent, errors: self.told(blow, &meant, &best), misfit })
    }

    /// Gap and approach of `pair`, linear about `errors`.
    #[inline(never)]
    fn look(&self, blow: &Blow<T>, pair: usize, errors: &Row<T>, contact: &ContactTuning<T>) -> Looked<T> {
        let [gap, approach] = self.conditions(blow, pair, errors, contact);
        let linear = |of_row: &Condition<T>| Linear {
            by_instant: of(&of_row.row, INSTANT),
            innovation: of_row.innovation,
            noise: of_row.noise,
        };
        Looked {
            pair,
            conditions: [linear(&gap), linear(&approach)],
            whitened: self.covariance.whitened([&gap.row, &approach.row]),
        }
    }

    /// What the conditions make of the errors, and nothing of their covariance.
    #[inline(never)]
    fn weigh(&self, looked: &Looked<T>) -> Weighed<T> {
        let Looked { conditions: [gap, approach], whitened: [f, g], .. } = looked;
        let weights = &self.covariance.weights;
        let (mut gap_m2, mut approach_m2_s2, mut both) = (T::zero(), T::zero(), T::zero());
        for ((&f, &g), &d) in f.iter().zip(g).zip(weights) {
            let (df, dg) = (d * f, d * g);
            gap_m2 += f * df;
            approach_m2_s2 += g * dg;
            both += g * df;
        }
        let bent = self.bent(&[(gap, gap_m2), (approach, approach_m2_s2)]);
        let [bent_gap_m2, bent_m2_s2] = bent;
        let per_gap = T::one() / (gap.noise + bent_gap_m2 + gap_m2);
        // The approach, as far as the gap does not tell it.
        let shared = both * per_gap;
        let mut left_m2_s2 = T::zero();
        for ((&f, &g), &d) in f.iter().zip(g).zip(weights) {
            left_m2_s2 += g * (d * (g - f * shared));
        }
        let per_approach = T::one() / (approach.noise + bent_m2_s2 + not_negative(left_m2_s2));
        let beside = approach.innovation - shared * gap.innovation;
        let (by_gap, by_approach) = (per_gap * gap.innovation, per_approach * beside);
        let misfit = gap.innovation * by_gap + beside * by_approach;
        Weighed { misfit, bent, pulls: [by_gap - shared * by_approach, by_approach] }
    }

    /// The errors that the conditions tell, as far as their rows reach.
    #[inline(never)]
    fn told(&self, blow: &Blow<T>, looked: &Looked<T>, weighed: &Weighed<T>) -> Row<T> {
        let ([f, g], [by_gap, by_approach]) = (&looked.whitened, weighed.pulls);
        let mut y = [T::zero(); STATES];
        for ((y, &d), (&f, &g)) in y.iter_mut().zip(&self.covariance.weights).zip(f.iter().zip(g)) {
            *y = d * (f * by_gap + g * by_approach);
        }
        let mut errors = self.covariance.coloured(&y);
        let late_s = blow.kept_in_period(of(&errors, INSTANT));
        set(&mut errors, INSTANT, late_s);
        errors
    }

    /// Variances of what bends gap and approach, whose own variances are given: an error of the instant times one of the speed or of the acceleration.
    fn bent(&self, [(gap, gap_m2), (approach, approach_m2_s2)]: &[(&Linear<T>, T); 2]) -> [T; 2] {
        let instant_s2 = self.covariance.variance::<INSTANT>();
        let beside_instant = |condition: &Linear<T>, variance: T| {
            not_negative(variance - condition.by_instant * condition.by_instant * instant_s2)
        };
        let [_, _, stiffest] = &self.oscillators;
        let per_s4 = stiffest.stiffness_per_s2 * stiffest.stiffness_per_s2;
        [
            beside_instant(approach, *approach_m2_s2) * instant_s2,
            beside_instant(gap, *gap_m2) * per_s4 * instant_s2,
        ]
    }

    /// Takes the conditions of `pair` in, linearised about `errors`; returns the errors then.
    #[inline(never)]
    fn settle_on(
        &mut self,
        blow: &Blow<T>,
        pair: usize,
        bent: [T; 2],
        errors: &Row<T>,
        contact: &ContactTuning<T>,
    ) -> Errors<T> {
        let looked = self.look(blow, pair, errors, contact);
        let ([gap, approach], [f, g], [bent_gap, bent_approach]) =
            (&looked.conditions, &looked.whitened, bent);
        let mut errors = self.covariance.update_pair([
            WhitenedMeasurement { row: f, noise: gap.noise + bent_gap, innovation: gap.innovation },
            WhitenedMeasurement {
                row: g,
                noise: approach.noise + bent_approach,
                innovation: approach.innovation,
            },
        ]);
        if let Some(late_s) = errors.as_mut_slice().get_mut(INSTANT) {
            *late_s = blow.kept_in_period(*late_s);
        }
        errors
    }

    /// The tooth's velocity along the rotor `back_s` before the end of the period, followed from now on as a state.
    #[inline(never)]
    fn along(&mut self, tooth: &Shaped<T>, back_s: T, beside_m_s: T) -> Known<T> {
        let there = self.carried_back(back_s, &Row::zeros());
        let mut row = there.row(&tooth.lever, |r| [r.c_rate, r.s_rate]);
        set(&mut row, INSTANT, tooth.lever.dot(&there.acceleration_m_s2));
        set(&mut row, tooth.scale, tooth.lever.dot(&there.velocity_m_s));
        set(&mut row, ANGLE, turned(&tooth.lever).dot(&there.velocity_m_s));
        self.covariance.follow(&row, beside_m_s * beside_m_s);
        Known { value: tooth.lever.dot(&there.velocity_m_s), variance: self.covariance.variance::<TOOTH>() }
    }

    /// What the jump has done to stator and rotor by the end of the period.
    #[inline(never)]
    fn recoil(&mut self, tooth: &Shaped<T>, back_s: T, behind_s: T) {
        let jump = self.jump_m_s;
        let scale = T::one() + self.found.get(RECOIL).copied().unwrap_or_default();
        let responses = self.oscillators.each_ref().map(|oscillator| oscillator.after(back_s - behind_s));
        let back = Carried::<T>::of(responses);
        let struck = |recoil: &Vector3<T>, factor: T| back.motion(recoil, factor, |r| [-r.s, -r.s_rate]);
        let [by_scale, by_angle] =
            [swinging(&tooth.recoil), turned(&tooth.recoil)].map(|recoil| struck(&recoil, scale * jump));
        let by_part = struck(&tooth.recoil, jump);
        let mut by_jump = struck(&tooth.recoil, scale);
        let mut by_instant = back.motion(&tooth.recoil, scale * jump, |r| [r.s_rate, r.s_acceleration]);
        (by_jump[0], by_instant[0]) = (back_s, -jump);
        // From the last column to the first, since each reads what the ones before it have not yet changed.
        for (state, effect) in [
            (ANGLE, by_angle),
            (tooth.scale, by_scale),
            (RECOIL, by_part),
            (JUMP, by_jump),
            (INSTANT, by_instant),
        ] {
            self.covariance.add_effect(state, HEIGHT, &effect);
        }
        let [height, g_a, v_a, g_b, v_b, g_c, v_c] = by_jump.map(|entry| entry * jump);
        self.state.modes.displacement_m += Vector3::new(g_a, g_b, g_c);
        self.state.modes.velocity_m_s += Vector3::new(v_a, v_b, v_c);
        self.height_m += height;
    }
}

fn not_negative<T: Real>(x: T) -> T {
    if x > T::zero() { x } else { T::zero() }
}

#[cfg(test)]
mod tests {
    use motor_model::MotorParams;

    use super::*;
    use crate::filters::twin::stator::{Errors, PERIOD_S};

    /// A stator that swings in mode B, a tooth that strikes `back_s` before the end of the period at `speed_m_s` over the rotor, and what the vibrometer makes of it, exactly.
    fn struck(back_s: f64, speed_m_s: f64) -> (StatorBelief<f64>, Blow<f64>) {
        let params = MotorParams::nominal();
        let mut stator = StatorBelief::try_new(&params, &TwinTuning::new(&params)).unwrap();
        // Low in its swing, where the tooth's speed changes by 0.15 m/s within a period.
        stator.state.modes.displacement_m = Vector3::new(0.0, -2.2e-5, 0.0);
        let shape = stator.tooth(0, &Row::zeros()).shape;
        let there = stator.carried_back(back_s, &Row::zeros());
        stator.state.modes.velocity_m_s.y += (speed_m_s - shape.dot(&there.velocity_m_s)) / shape.y;
        let there = stator.carried_back(back_s, &Row::zeros());
        stator.height_m = shape.dot(&there.displacement_m);
        let jump_m_s = shape.dot(&there.velocity_m_s) / stator.approach_per_jump;
        let blow = Blow {
            before_m_s: 0.0,
            jump_m_s,
            jump_m2_s2: 4e-8,
            within_s: PERIOD_S,
            behind_s: 0.0,
            unheard_m_s: 0.0,
        };
        (stator, blow)
    }

    /// Twice the negative logarithm of the posterior density of errors, each per its standard deviation before the impact; those are independent.
    fn surprise(stator: &StatorBelief<f64>, blow: &Blow<f64>, normals: &Errors<f64>) -> f64 {
        let contact = TwinTuning::new(&MotorParams::nominal()).contact;
        let variances = stator.covariance.variances();
        let mut errors = Row::zeros();
        for state in (HEIGHT..=JUMP).chain(RECOIL..STATES) {
            set(&mut errors, state, normals[state] * variances[state].sqrt());
        }
        let conditions = stator.conditions(blow, 0, &errors, &contact);
        let misses = conditions.iter().map(|c| (c.row.dot(&errors) - c.innovation).powi(2) / c.noise);
        normals.norm_squared() + misses.sum::<f64>()
    }

    /// The least surprise of all errors, by steps that shrink along every state in turn.
    fn least_surprise(stator: &StatorBelief<f64>, blow: &Blow<f64>) -> f64 {
        let mut normals = Errors::zeros();
        let (mut least, mut step) = (surprise(stator, blow, &normals), 1.0);
        while step > 1e-6 {
            let before = least;
            for state in 0..STATES {
                for way in [-step, step] {
                    let mut tried = normals;
                    tried[state] += way;
                    let surprise = surprise(stator, blow, &tried);
                    if surprise < least {
                        (normals, least) = (tried, surprise);
                    }
                }
            }
            if least >= before {
                step *= 0.5;
            }
        }
        least
    }

    /// The gap bends by 0.1 um within the period, ten times its noise. Of a linear problem the misfit, from the innovations alone, is the least surprise that any errors leave;
    /// of this one it is where it has been linearised about what the first linearisation found. The least surprise is found without derivatives, by steps along every state.
    /// Linearised about the prediction, some microseconds off, it is 7 to 13 % beside it.
    #[test]
    fn dual_the_misfit_is_the_least_surprise() {
        let tuning = TwinTuning::new(&MotorParams::nominal());
        for (back_s, speed_m_s) in [(0.6e-6, 0.12), (1.0e-6, 0.1), (4.0e-6, 0.15), (4.6e-6, 0.2)] {
            let (mut stator, blow) = struck(back_s, speed_m_s);
            stator.covariance.replace_state(JUMP, blow.jump_m2_s2);
            stator.covariance.replace_state(INSTANT, blow.within_s * blow.within_s / 12.0);
            let least = least_surprise(&stator, &blow);
            let found = stator.strike(&blow, &tuning).expect("an impact");
            assert!((found.misfit - least).abs() < 0.01 * least, "{back_s:e}: {} {least}", found.misfit);
            assert!((found.back.value - back_s).abs() < 6e-8, "{back_s:e}: {:e}", found.back.value);
        }
    }
}
