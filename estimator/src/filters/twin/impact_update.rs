//! An impact as a measurement of the stator, and the state transition at it.
//!
//! The impact is not predicted. The vibrometer gives its jump, and [`super::association`] the pair of teeth; gap and
//! approach then correct stator, parameters, instant and jump. At the impact the jump `dv` changes the motion at the
//! end of the period by the transition
//!
//! ```text
//! g(end) -= rho dv S(t),   g'(end) -= rho dv S'(t),   z(end) += dv t        rho: recoil per jump, t: time since
//! ```
//!
//! # Why not the saltation matrix
//!
//! The saltation matrix is the Jacobian of an impact that a model predicts: the jump follows from the state,
//! `dv = (1 + e) (u' - v) / (1 + r)`, and the instant from the zero of the gap. An error of the gap then moves the
//! instant by its quotient with the speed of approach, and so the velocities by the tooth's acceleration over that
//! speed: 3e4 m/s^2 / 0.3 m/s = 1e5 per second. Within a mode's 1e-5 to 1e-4 s this is a factor of one to ten each
//! way, some hundred in all for gentle impacts.
//!
//! A measured jump does not depend on the state. What remains of the transition is the identity and five columns:
//! instant, jump, mass ratio, amplitude of the pair and teeth's angle ([`ud_filter::UdCovariance`] takes them without a
//! rotation). The saltation matrix followed by an update with a measured `dv` gives the same posterior to first order,
//! but as a difference of large numbers, and about a point that may lie outside the period.

use motor_model::Real;
use nalgebra::Vector3;
use ud_filter::WhitenedMeasurement;

use super::association::{Association, NOISE_LOG_ODDS, PairHypothesis};
use super::measured_impact::{ExplainedImpact, MeasuredImpact, UnassociatedImpact, Uncertain};
use super::modes_at::entries;
use super::states::{Errors, HEIGHT, INSTANT, JUMP, MASS_RATIO, PAIR_AMPLITUDES, Row, TOOTH_ANGLE};
use super::stator::StatorFilter;
use super::tooth::{Tooth, by_amplitude, by_angle};

/// The logarithm of the odds where the filter is told that a pair struck: no misfit reaches it.
const NO_NOISE_LOG_ODDS: f64 = 1e30;

impl<T: Real> StatorFilter<T> {
    /// Updates the stator by an impact within the last period, and applies the transition. The variance of its instant
    /// is `instant_s2`, its pair of teeth is `told` or `None`, and the tooth's velocity has errors of standard
    /// deviation `beside_m_s` beside those of the stator.
    ///
    /// # Errors
    /// When the impact fits neither pair of teeth and counts as noise.
    #[inline(never)]
    pub(super) fn update_by_impact(
        &mut self,
        impact: &MeasuredImpact<T>,
        instant_s2: T,
        told: Option<u8>,
        beside_m_s: T,
    ) -> Result<ExplainedImpact<T>, UnassociatedImpact<T>> {
        self.predict_to_impact(instant_s2, impact.jump_m2_s2);
        self.at_rest = false;
        let noise_log_odds = if told.is_some() { NO_NOISE_LOG_ODDS } else { NOISE_LOG_ODDS };
        let mut hypotheses = [0, 1].map(PairHypothesis::of);
        let Association { pair, second_order, innovation, misfit } =
            self.associate(impact, &mut hypotheses, told, T::from_f64(noise_log_odds))?;
        let [of_zero, of_one] = &hypotheses;
        let hypothesis = if pair == 0 { of_zero } else { of_one };
        let errors = self.update_by_pair(impact, hypothesis, second_order);
        self.jump_m_s = impact.jump_m_s;
        self.correct(&errors);
        let instant_s = errors.as_slice().get(INSTANT).copied().unwrap_or_default();
        let back =
            Uncertain { value: impact.back_s(instant_s), variance: self.covariance.variance::<INSTANT>() };
        let tooth = self.tooth(pair, &Row::zeros());
        let stator_back_s = back.value - impact.behind_s;
        let tooth_velocity = self.begin_tooth_velocity(&tooth, stator_back_s, beside_m_s);
        self.apply_recoil(&tooth, back.value, impact.behind_s);
        let jump = Uncertain { value: self.jump_m_s, variance: self.covariance.variance::<JUMP>() };
        Ok(ExplainedImpact { back, jump, tooth_velocity, innovation, misfit })
    }

    /// Kalman update by gap and approach of a pair; returns the errors that they imply.
    #[inline(never)]
    fn update_by_pair(
        &mut self,
        impact: &MeasuredImpact<T>,
        hypothesis: &PairHypothesis<T>,
        second_order: [T; 2],
    ) -> Errors<T> {
        let ([gap, approach], [f, g], [beside_gap, beside_approach]) =
            (&hypothesis.measurements, &hypothesis.whitened, second_order);
        let mut errors = self.covariance.update_pair([
            WhitenedMeasurement { row: f, noise: gap.noise + beside_gap, innovation: gap.innovation },
            WhitenedMeasurement {
                row: g,
                noise: approach.noise + beside_approach,
                innovation: approach.innovation,
            },
        ]);
        // The instant alone: the most probable errors with it at its bound are far off where the linearisation is, as
        // where samples were lost. There the estimate went astray by 0.25 degrees in a run of 24.
        if let Some(instant_s) = errors.as_mut_slice().get_mut(INSTANT) {
            *instant_s = impact.clamp_instant_s(*instant_s);
        }
        errors
    }

    /// The tooth's tangential velocity `back_s` before the end of the period. State 0 is its error from now on: that of
    /// the stator, plus an independent one of standard deviation `beside_m_s`.
    #[inline(never)]
    pub(super) fn begin_tooth_velocity(
        &mut self,
        tooth: &Tooth<T>,
        back_s: T,
        beside_m_s: T,
    ) -> Uncertain<T> {
        let modes = self.modes_at(back_s, &Row::zeros());
        let (zero, velocity_m_s) = (T::zero(), &modes.velocity_m_s);
        let row = tooth.row(
            entries(&modes.responses, zero, &tooth.lever, |r| [r.c_rate, r.s_rate]),
            [tooth.lever.dot(&modes.acceleration_m_s2), zero],
            [zero; 2],
            [by_amplitude(&tooth.lever).dot(velocity_m_s), by_angle(&tooth.lever).dot(velocity_m_s)],
        );
        let variance = self.covariance.follow(&row, beside_m_s * beside_m_s);
        Uncertain { value: tooth.lever.dot(velocity_m_s), variance }
    }

    /// The transition of stator and height at an impact `back_s` before the end of the period.
    #[inline(never)]
    pub(super) fn apply_recoil(&mut self, tooth: &Tooth<T>, back_s: T, behind_s: T) {
        let jump = self.jump_m_s;
        let mass_ratio = T::one() + self.parameters.get(MASS_RATIO).copied().unwrap_or_default();
        let responses = self.oscillators.each_ref().map(|oscillator| oscillator.after(back_s - behind_s));
        let recoiled = |recoil: &Vector3<T>, factor: T, height: T| {
            entries(&responses, height, &(recoil * factor), |r| [-r.s, -r.s_rate])
        };
        let [by_pair_amplitude, by_tooth_angle] = [by_amplitude(&tooth.recoil), by_angle(&tooth.recoil)]
            .map(|recoil| recoiled(&recoil, mass_ratio * jump, T::zero()));
        let by_mass_ratio = recoiled(&tooth.recoil, jump, T::zero());
        let by_jump = recoiled(&tooth.recoil, mass_ratio, back_s);
        let blow = tooth.recoil * (mass_ratio * jump);
        let by_instant = entries(&responses, -jump, &blow, |r| [r.s_rate, r.s_acceleration]);
        let of_tooth = [(PAIR_AMPLITUDES + tooth.pair, by_pair_amplitude), (TOOTH_ANGLE, by_tooth_angle)];
        self.covariance.add_effects(HEIGHT, &of_tooth);
        self.covariance.add_effects(HEIGHT, &[(MASS_RATIO, by_mass_ratio)]);
        self.covariance.add_effects(HEIGHT, &[(INSTANT, by_instant), (JUMP, by_jump)]);
        self.move_by(by_jump.map(|entry| entry * jump));
    }
}

#[cfg(test)]
mod tests {
    use motor_model::MotorParams;

    use super::*;
    use crate::filters::twin::TwinTuning;
    use crate::filters::twin::checked_motor::{CheckedMotor, PERIOD_S};
    use crate::filters::twin::states::STATES;
    use crate::filters::twin::tests::set_entry;
    use crate::instruments::Instruments;

    /// A stator that swings in mode B, an impact of a tooth `back_s` before the end of the period that approaches the
    /// rotor at `speed_m_s`, and its exact measurement.
    fn impact_of(back_s: f64, speed_m_s: f64) -> (StatorFilter<f64>, MeasuredImpact<f64>) {
        let params = MotorParams::nominal();
        let motor = CheckedMotor::try_new(&params).unwrap();
        let mut stator = StatorFilter::at_rest(&motor, &TwinTuning::new(&params, &Instruments::default()));
        // Low in its swing, where the tooth's speed changes by 0.15 m/s within a period.
        stator.state.modes.displacement_m = Vector3::new(0.0, -2.2e-5, 0.0);
        let shape = stator.tooth(0, &Row::zeros()).shape;
        let modes = stator.modes_at(back_s, &Row::zeros());
        stator.state.modes.velocity_m_s.y += (speed_m_s - shape.dot(&modes.velocity_m_s)) / shape.y;
        let modes = stator.modes_at(back_s, &Row::zeros());
        stator.height_m = shape.dot(&modes.displacement_m);
        let jump_m_s = shape.dot(&modes.velocity_m_s) / stator.approach_per_jump;
        let impact = MeasuredImpact {
            before_m_s: 0.0,
            jump_m_s,
            jump_m2_s2: 4e-8,
            within_s: PERIOD_S,
            behind_s: 0.0,
            drift_m_s: 0.0,
        };
        (stator, impact)
    }

    /// Twice the negative logarithm of the posterior density of errors, each per its standard deviation before the
    /// impact; those are independent.
    fn negative_log_posterior(
        stator: &StatorFilter<f64>,
        impact: &MeasuredImpact<f64>,
        normals: &Errors<f64>,
    ) -> f64 {
        let variances = stator.covariance.variances();
        let mut errors = Row::zeros();
        for state in (HEIGHT..=JUMP).chain(MASS_RATIO..STATES) {
            set_entry(&mut errors, state, normals[state] * variances[state].sqrt());
        }
        let measurements = stator.contact_measurements(impact, 0, &errors);
        let misfits = measurements.iter().map(|m| (m.row.dot(&errors) - m.innovation).powi(2) / m.noise);
        normals.norm_squared() + misfits.sum::<f64>()
    }

    /// The minimum over all errors, by steps that shrink along every state in turn.
    fn minimum(stator: &StatorFilter<f64>, impact: &MeasuredImpact<f64>) -> f64 {
        let mut normals = Errors::zeros();
        let (mut least, mut step) = (negative_log_posterior(stator, impact, &normals), 1.0);
        while step > 1e-6 {
            let before = least;
            for state in 0..STATES {
                for way in [-step, step] {
                    let mut tried = normals;
                    tried[state] += way;
                    let value = negative_log_posterior(stator, impact, &tried);
                    if value < least {
                        (normals, least) = (tried, value);
                    }
                }
            }
            if least >= before {
                step *= 0.5;
            }
        }
        least
    }

    /// The gap bends by 0.1 um within the period, ten times its noise. In a linear problem the misfit, from the
    /// innovations alone, is the minimum of the negative log posterior. In this one it is, when linearised about what
    /// the first linearisation implies. The minimum is found without derivatives. Linearised about the prediction,
    /// some microseconds off, the misfit is 7 to 13 % beside it.
    #[test]
    fn dual_the_misfit_is_the_minimum_of_the_negative_log_posterior() {
        for (back_s, speed_m_s) in [(0.6e-6, 0.12), (1.0e-6, 0.1), (4.0e-6, 0.15), (4.6e-6, 0.2)] {
            let (mut stator, impact) = impact_of(back_s, speed_m_s);
            stator.covariance.replace_state(JUMP, impact.jump_m2_s2);
            let instant_s2 = impact.within_s * impact.within_s / 12.0;
            stator.covariance.replace_state(INSTANT, instant_s2);
            let least = minimum(&stator, &impact);
            let explained = stator.update_by_impact(&impact, instant_s2, None, 3.5e-5).expect("an impact");
            let (misfit, back) = (explained.misfit, explained.back.value);
            assert!((misfit - least).abs() < 0.01 * least, "{back_s:e}: {misfit} {least}");
            assert!((back - back_s).abs() < 6e-8, "{back_s:e}: {back:e}");
        }
    }

    /// The recoil is a blow to each mode at the impact, which swings freely from then to the last period of the stator:
    /// the mode's exact propagator. The rotor rises with the whole jump until the sample, which may be later.
    #[test]
    fn dual_the_recoil_swings_freely_since_the_impact() {
        let params = MotorParams::nominal();
        let motor = CheckedMotor::<f64>::try_new(&params).unwrap();
        let start = StatorFilter::at_rest(&motor, &TwinTuning::new(&params, &Instruments::default()));
        for (back_s, behind_s) in [(4e-6, 0.0), (4e-6, 3e-6), (1e-6, 3e-6)] {
            let mut stator = start.clone();
            stator.jump_m_s = 0.05;
            let tooth = stator.tooth(1, &Row::zeros());
            stator.apply_recoil(&tooth, back_s, behind_s);
            let (g, v) = (stator.state.modes.displacement_m, stator.state.modes.velocity_m_s);
            for (m, mode) in motor.modes.iter().enumerate() {
                let [[_, gv], [_, vv]] = mode.propagator(back_s - behind_s);
                let blow_m_s = -tooth.recoil[m] * 0.05;
                let size = blow_m_s.abs();
                assert!(
                    (g[m] - gv * blow_m_s).abs() < 1e-11 * size && (v[m] - vv * blow_m_s).abs() < 1e-5 * size
                );
            }
            assert!((stator.height_m - back_s * 0.05).abs() < 1e-15, "{:e}", stator.height_m);
        }
    }
}
