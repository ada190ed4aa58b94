//! Association: which pair of teeth an impact was of, or whether it was noise.
//!
//! There are three hypotheses: the first pair, the second pair, and a jump that is the vibrometer's noise. Gap and
//! approach of a pair ([`super::contact_measurement`]) have the innovation `nu` with covariance
//!
//! ```text
//! S = H P H' + R,    misfit = nu' S^-1 nu          the squared Mahalanobis distance, or normalised innovation squared
//! density of nu:     -2 ln p(nu) = misfit + ln det S + 2 ln 2 pi
//! ```
//!
//! The pair under which the innovation is more probable is chosen. The determinants count where the pairs' innovations
//! are not predicted equally well: a pair of which little is known fits everything a little. The mean misfit is about
//! two, one a measurement, where the filter is consistent.
//! A jump that is noise has no contact, but the misfit `dv^2 / var dv`, which is above the square of the detector's
//! threshold. Noise is chosen when it misfits less than the pair by [`NOISE_LOG_ODDS`] or more. A jump
//! that is far too large for noise then is an impact all the same, and evidence against the stator filter
//! ([`MeasuredImpact::may_be_noise`]).
//!
//! # Linearisation
//!
//! The tooth accelerates at 3e4 m/s^2, so the gap is curved within the period by 0.1 um. The measurements are
//! linearised about the prediction; for the chosen pair again about the errors that follow from it; and once more for
//! the update, unless the instant has converged. These are Gauss-Newton steps to the maximum of the posterior, an
//! iterated Kalman update (Bell and Cathey, "The iterated Kalman filter update as a Gauss-Newton method", IEEE
//! Transactions on Automatic Control 38, 1993). The products of errors that remain, an error of the instant times one
//! of speed or acceleration, are counted as noise: negligible when the stator is known, dominant when it is not.

use motor_model::Real;

use super::contact_measurement::ContactMeasurement;
use super::measured_impact::{MeasuredImpact, UnassociatedImpact};
use super::states::{IMPACT_STATES, INSTANT, Row, STATES, entry};
use super::stator::StatorFilter;
use crate::innovation::ContactInnovation;

/// An impact is noise when its misfit exceeds that of noise by this: twice the logarithm of the prior odds, how much
/// more often teeth touch the rotor than noise exceeds the threshold. Odds of 22,000.
pub(super) const NOISE_LOG_ODDS: f64 = 20.0;

/// An impact is noise when the misfit about the prediction exceeds the limit so many times: the second linearisation
/// would start too far off to mean anything. Assumed.
const FAR_OFF_RATIO: f64 = 40.0;

/// A misfit beyond this inflates the variance of the impact's instant: the 95 % point of two degrees of freedom.
const INFLATION_MISFIT: f64 = 6.0;

/// Factor on the instant's variance per misfit in units of [`INFLATION_MISFIT`], when that is exceeded. Tuned with it.
const INFLATION: f64 = 3.0;

/// A shift of the instant, in s, within which gap and approach count as linear: the tooth's acceleration bends the gap
/// by 1.4 nm in it, a ninth of its noise at most.
const LINEAR_S: f64 = 3e-7;

/// The pair that an impact is associated with.
pub(super) struct Association<T> {
    pub(super) pair: usize,
    /// Variances of gap and approach by what their linearisation leaves out.
    pub(super) second_order: [T; 2],
    pub(super) innovation: ContactInnovation<T>,
    pub(super) misfit: T,
}

/// A scalar measurement whose row is held as `U' row`.
#[derive(Default)]
pub(super) struct LinearMeasurement<T> {
    /// Derivative by the impact's instant.
    by_instant: T,
    pub(super) innovation: T,
    pub(super) noise: T,
}

/// One pair as the one in contact: gap and approach, as last linearised.
pub(super) struct PairHypothesis<T> {
    pub(super) pair: usize,
    pub(super) measurements: [LinearMeasurement<T>; 2],
    /// Their rows times U.
    pub(super) whitened: [[T; STATES]; 2],
    /// Covariance that the estimates' errors give them, the upper triangle alone.
    variances: [[T; 2]; 2],
}

impl<T: Real> PairHypothesis<T> {
    /// Not linearised yet.
    pub(super) fn of(pair: usize) -> Self {
        let measurements = <[LinearMeasurement<T>; 2]>::default();
        Self { pair, measurements, whitened: [[T::zero(); STATES]; 2], variances: [[T::zero(); 2]; 2] }
    }
}

/// A hypothesis against the covariance.
struct Score<T> {
    /// Squared Mahalanobis distance.
    misfit: T,
    innovation: ContactInnovation<T>,
    /// Variances of gap and approach by what their linearisation leaves out, beside their noise.
    second_order: [T; 2],
    /// `S^-1 nu`: the implied errors are `P H'` times this.
    weighted_innovation: [T; 2],
}

impl<T: Real> StatorFilter<T> {
    /// The pair that the impact is associated with; the one that is `told`, if any. Of the hypotheses that of this pair
    /// is then linearised near the errors that the impact implies. The impact is noise when its misfit exceeds that of
    /// noise by `noise_log_odds`.
    ///
    /// # Errors
    /// When both pairs misfit by more than noise does.
    #[inline(never)]
    pub(super) fn associate(
        &mut self,
        impact: &MeasuredImpact<T>,
        [of_zero, of_one]: &mut [PairHypothesis<T>; 2],
        told: Option<u8>,
        noise_log_odds: T,
    ) -> Result<Association<T>, UnassociatedImpact<T>> {
        self.linearise(of_zero, impact, &Row::zeros());
        self.linearise(of_one, impact, &Row::zeros());
        let (zero, one) = (self.score(of_zero), self.score(of_one));
        // Of the innovation's covariance, in m^4/s^2.
        let determinant = |score: &Score<T>| score.innovation.gap_m2 * score.innovation.approach_m2_s2;
        let surplus = zero.misfit - one.misfit + natural_log(determinant(&zero) / determinant(&one));
        let is_first = told.map_or(surplus <= T::zero(), |pair| pair == 0);
        let (hypothesis, better) = if is_first { (of_zero, zero) } else { (of_one, one) };
        let of_noise = impact.jump_m_s * impact.jump_m_s / impact.jump_m2_s2;
        let limit = of_noise + noise_log_odds;
        let unassociated = |&Score { misfit, innovation, .. }: &Score<T>| UnassociatedImpact {
            excess_misfit: misfit - of_noise,
            innovation,
        };
        if better.misfit > T::from_f64(FAR_OFF_RATIO) * limit {
            return Err(unassociated(&better));
        }
        let implied = self.implied_errors(impact, hypothesis, &better);
        self.linearise(hypothesis, impact, &implied);
        let mut score = self.score(hypothesis);
        let Score { misfit, innovation, .. } = score;
        if misfit > limit {
            return Err(unassociated(&score));
        }
        let inflation_misfit = T::from_f64(INFLATION_MISFIT);
        if misfit > inflation_misfit {
            self.covariance.inflate::<INSTANT>(T::from_f64(INFLATION) * misfit / inflation_misfit);
            self.linearise(hypothesis, impact, &Row::zeros());
            score = self.score(hypothesis);
        }
        let shift_s = self.implied_instant_s(impact, hypothesis, &score) - entry(&implied, INSTANT);
        let has_converged = misfit <= inflation_misfit && shift_s.abs() < T::from_f64(LINEAR_S);
        if !has_converged {
            let implied = self.implied_errors(impact, hypothesis, &score);
            self.linearise(hypothesis, impact, &implied);
        }
        Ok(Association { pair: hypothesis.pair, second_order: score.second_order, innovation, misfit })
    }

    /// Gap and approach of the pair of `hypothesis`, linearised about `errors`.
    #[inline(never)]
    fn linearise(&self, hypothesis: &mut PairHypothesis<T>, impact: &MeasuredImpact<T>, errors: &Row<T>) {
        let [gap, approach] = &self.contact_measurements(impact, hypothesis.pair, errors);
        hypothesis.measurements =
            [gap, approach].map(|&ContactMeasurement { ref row, innovation, noise }| LinearMeasurement {
                by_instant: entry(row, INSTANT),
                innovation,
                noise,
            });
        // Instant and jump are those of this impact: independent of all else.
        hypothesis.variances = self
            .covariance
            .whiten::<IMPACT_STATES, _, _, _, 2>([&gap.row, &approach.row], &mut hypothesis.whitened);
    }

    /// Scores a hypothesis without an update of the covariance: gap first, then approach given the gap.
    #[inline(never)]
    fn score(&self, hypothesis: &PairHypothesis<T>) -> Score<T> {
        let PairHypothesis { measurements: [gap, approach], variances, .. } = hypothesis;
        let [[gap_m2, both], [_, approach_m2_s2]] = *variances;
        let second_order = self.second_order(hypothesis);
        let [second_order_m2, second_order_m2_s2] = second_order;
        let innovation_m2 = gap.noise + second_order_m2 + gap_m2;
        let per_gap = T::one() / innovation_m2;
        // What the gap does not tell of the approach. Its rounding is a millionth of the approach's variance.
        let shared = both * per_gap;
        let conditional_m2_s2 = not_negative(approach_m2_s2 - both * shared);
        let innovation_m2_s2 = approach.noise + second_order_m2_s2 + conditional_m2_s2;
        let per_approach = T::one() / innovation_m2_s2;
        let given_gap = approach.innovation - shared * gap.innovation;
        let (by_gap, by_approach) = (per_gap * gap.innovation, per_approach * given_gap);
        let misfit = gap.innovation * by_gap + given_gap * by_approach;
        Score {
            misfit,
            innovation: ContactInnovation {
                gap_m: gap.innovation,
                gap_m2: innovation_m2,
                approach_m_s: given_gap,
                approach_m2_s2: innovation_m2_s2,
            },
            second_order,
            weighted_innovation: [by_gap - shared * by_approach, by_approach],
        }
    }

    /// The errors that the measurements imply, `P H' S^-1 nu`, within the support of the rows.
    #[inline(never)]
    fn implied_errors(
        &self,
        impact: &MeasuredImpact<T>,
        hypothesis: &PairHypothesis<T>,
        score: &Score<T>,
    ) -> Row<T> {
        let ([f, g], [by_gap, by_approach]) = (&hypothesis.whitened, score.weighted_innovation);
        let rows = self.covariance.weights.iter().zip(f.iter().zip(g));
        let y = rows.map(|(&d, (&f, &g))| d * (f * by_gap + g * by_approach));
        let mut errors: Row<T> = self.covariance.coloured::<IMPACT_STATES, _, _, _>(y);
        let [.., instant, _] = &mut errors.lead;
        *instant = self.implied_instant_s(impact, hypothesis, score);
        errors
    }

    /// The instant among them.
    fn implied_instant_s(
        &self,
        impact: &MeasuredImpact<T>,
        hypothesis: &PairHypothesis<T>,
        score: &Score<T>,
    ) -> T {
        let ([gap, approach], [by_gap, by_approach]) = (&hypothesis.measurements, score.weighted_innovation);
        impact.clamp_instant_s(
            self.instant_s2() * (gap.by_instant * by_gap + approach.by_instant * by_approach),
        )
    }

    /// Variance of the instant, which is independent of all else before the update.
    fn instant_s2(&self) -> T {
        self.covariance.weights.get(INSTANT).copied().unwrap_or_default()
    }

    /// Variances of the second-order terms of gap and approach: an error of the instant times one of the speed or of
    /// the acceleration.
    fn second_order(&self, hypothesis: &PairHypothesis<T>) -> [T; 2] {
        let PairHypothesis { measurements: [gap, approach], variances, .. } = hypothesis;
        let ([[gap_m2, _], [_, approach_m2_s2]], instant_s2) = (*variances, self.instant_s2());
        let beside_instant = |measurement: &LinearMeasurement<T>, variance: T| {
            not_negative(variance - measurement.by_instant * measurement.by_instant * instant_s2)
        };
        let [_, _, stiffest] = &self.oscillators;
        let per_s4 = stiffest.stiffness_per_s2 * stiffest.stiffness_per_s2;
        [
            beside_instant(approach, approach_m2_s2) * instant_s2,
            beside_instant(gap, gap_m2) * per_s4 * instant_s2,
        ]
    }
}

/// Natural logarithm of a positive number to 2e-4, within plus and minus 28: by halvings and the series of the inverse
/// hyperbolic tangent. It is enough to compare probabilities.
fn natural_log<T: Real>(x: T) -> T {
    let (one, half, two) = (T::one(), T::from_f64(0.5), T::from_f64(2.0));
    let (mut rest, mut log) = (x, T::zero());
    for _ in 0..40 {
        if rest > T::from_f64(1.5) {
            rest *= half;
            log += T::from_f64(core::f64::consts::LN_2);
        } else if rest < T::from_f64(0.75) {
            rest *= two;
            log -= T::from_f64(core::f64::consts::LN_2);
        } else {
            break;
        }
    }
    let y = (rest - one) / (rest + one);
    let y2 = y * y;
    log + two * y * (one + y2 * (T::from_f64(1.0 / 3.0) + y2 * T::from_f64(0.2)))
}

fn not_negative<T: Real>(x: T) -> T {
    if x > T::zero() { x } else { T::zero() }
}

#[cfg(test)]
mod tests {
    use motor_model::{MotorParams, Parameter};
    use nalgebra::Vector3;
    use ud_filter::UdCovariance;

    use super::*;
    use crate::filters::twin::checked_motor::{CheckedMotor, PERIOD_S};
    use crate::filters::twin::states::{HEIGHT, JUMP, PAIR_AMPLITUDES};
    use crate::filters::twin::tuning::TwinTuning;
    use crate::instruments::Instruments;

    #[test]
    fn exact_natural_log() {
        for x in [1e-12, 0.3, 0.74, 0.76, 1.0, 1.49, 1.51, 7.0, 1e12_f64] {
            assert!((natural_log(x) - x.ln()).abs() < 3e-4, "{x:e}");
        }
        assert!(natural_log(f64::NAN).is_nan() && natural_log(0.0_f64) < -27.0);
    }

    /// Both pairs approach the rotor, at 0.20 m/s but for 0.02 m/s of mode B in opposite senses. The second made the
    /// impact, whose measured jump is two standard deviations off. Of the first next to nothing is known: with an
    /// amplitude within a factor of ten, its speed may be any, so its misfit is near zero. The innovation still is some
    /// hundred times more probable under the second.
    #[test]
    fn law_a_pair_that_fits_everything_is_not_preferred() {
        let params = MotorParams::nominal();
        let tuning = TwinTuning::<f64>::new(&params, &Instruments::default());
        let mut stator = StatorFilter::at_rest(&CheckedMotor::try_new(&params).unwrap(), &tuning);
        let shapes = [0, 1].map(|pair| stator.tooth(pair, &Row::zeros()).shape);
        let mode_b_m_s = 0.02 / shapes[1].y;
        let back_s = 0.5 * PERIOD_S;
        stator.state.modes.velocity_m_s = Vector3::new(0.2 / shapes[1].x, mode_b_m_s, 0.0);
        let modes = stator.modes_at(back_s, &Row::zeros());
        stator.height_m = shapes[1].dot(&modes.displacement_m);
        let jump_m2_s2 = 4e-8_f64;
        let jump_m_s =
            shapes[1].dot(&modes.velocity_m_s) / stator.approach_per_jump + 2.0 * jump_m2_s2.sqrt();
        let impact = MeasuredImpact {
            before_m_s: 0.0,
            jump_m_s,
            jump_m2_s2,
            within_s: PERIOD_S,
            behind_s: 0.0,
            drift_m_s: 0.0,
        };
        stator.covariance.replace_state(JUMP, jump_m2_s2);
        stator.covariance.replace_state(INSTANT, PERIOD_S * PERIOD_S / 12.0);
        stator.covariance.replace_state(PAIR_AMPLITUDES, 100.0);
        let mut hypotheses = [0, 1].map(PairHypothesis::of);
        let [vague, true_one] = hypotheses.each_mut().map(|hypothesis| {
            stator.linearise(hypothesis, &impact, &Row::zeros());
            stator.score(hypothesis).misfit
        });
        assert!(vague < true_one, "the case is as described: {vague} {true_one}");
        let associated = stator.associate(&impact, &mut hypotheses, None, NOISE_LOG_ODDS);
        assert_eq!(associated.map(|association| association.pair).ok(), Some(1));
    }

    /// The height is known to 1 um, the jump to 0.2 mm/s and the instant to 1.4 us, all else exactly. A gap that is off
    /// by `h` at an instant off by `tau` changes the approach by `h tau` times the stiffness of the fastest mode, at
    /// most; an approach off by `v` the gap by `v tau`. What the instant itself does is of first order.
    #[test]
    fn exact_second_order_terms_are_products_of_an_error_and_the_instant_s() {
        let params = MotorParams::nominal();
        let tuning = TwinTuning::<f64>::new(&params, &Instruments::default());
        let mut stator = StatorFilter::at_rest(&CheckedMotor::try_new(&params).unwrap(), &tuning);
        stator.state.modes.velocity_m_s = Vector3::new(0.1, 0.2, 0.05);
        let (height_m2, jump_m2_s2, instant_s2) = (1e-12, 4e-8, 2e-12);
        stator.covariance = UdCovariance::known();
        for (state, variance) in [(HEIGHT, height_m2), (JUMP, jump_m2_s2), (INSTANT, instant_s2)] {
            stator.covariance.replace_state(state, variance);
        }
        let impact = MeasuredImpact {
            before_m_s: 0.0,
            jump_m_s: 0.05,
            jump_m2_s2,
            within_s: PERIOD_S,
            behind_s: 0.0,
            drift_m_s: 0.0,
        };
        let mut hypothesis = PairHypothesis::of(0);
        stator.linearise(&mut hypothesis, &impact, &Row::zeros());
        let [approach_s2, gap_s2] = stator.score(&hypothesis).second_order;
        let fastest_s2 = (core::f64::consts::TAU * params.get(Parameter::ModeCFrequency)).powi(2);
        let approach_m2_s2 = stator.approach_per_jump.powi(2) * jump_m2_s2;
        for (own, expected) in [
            (approach_s2, approach_m2_s2 * instant_s2),
            (gap_s2, height_m2 * fastest_s2 * fastest_s2 * instant_s2),
        ] {
            assert!((own / expected - 1.0).abs() < 1e-6, "{own:e} {expected:e}");
        }
    }

    /// A jump of 0.8 mm/s is four standard deviations of noise, a misfit of 16. A rotor 0.3 um above teeth at rest
    /// misfits both pairs by hundreds: the jump is noise, unless the odds are said to be far from it.
    #[test]
    fn law_a_jump_that_noise_explains_better_is_no_impact() {
        let params = MotorParams::nominal();
        let tuning = TwinTuning::<f64>::new(&params, &Instruments::default());
        let impact = MeasuredImpact {
            before_m_s: 0.0,
            jump_m_s: 8e-4,
            jump_m2_s2: 4e-8,
            within_s: PERIOD_S,
            behind_s: 0.0,
            drift_m_s: 0.0,
        };
        let associated = |noise_log_odds: f64| {
            let mut stator = StatorFilter::at_rest(&CheckedMotor::try_new(&params).unwrap(), &tuning);
            stator.height_m = 3e-7;
            stator.covariance.replace_state(JUMP, impact.jump_m2_s2);
            stator.covariance.replace_state(INSTANT, PERIOD_S * PERIOD_S / 12.0);
            stator.associate(&impact, &mut [0, 1].map(PairHypothesis::of), None, noise_log_odds)
        };
        let noise = associated(NOISE_LOG_ODDS).err().expect("noise");
        assert!((100.0..500.0).contains(&noise.excess_misfit), "{}", noise.excess_misfit);
        assert!(associated(2.0 * noise.excess_misfit).is_ok());
    }
}
