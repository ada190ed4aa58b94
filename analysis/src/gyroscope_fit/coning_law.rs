//! How coning grows with the rate.
//!
//! ```text
//! W = w |rate / rate_0|^p,    clockwise and the other way each
//! ln w, p: normal before,     L of `strengths` + ((ln(w / w_0)) / 2)^2 + ((p - 4) / 1.5)^2 is least
//! ```
//!
//! Of a drive that a plan has seen for eight intervals the strength is known to half of itself. All drives of a side
//! together tell it better, and also at rates at which the rotor has not turned.
//!
//! What is known before is an assumption, from two rotors each drawn about sets F and G, that were led for 40 s at each
//! of seven rates. On them coning is a random walk, as strong over 0.25 s as over 4 s, with a mean that is not told
//! from none; its strength grows with an exponent of 2 to 5.

use motor_model::math;

use super::FitInterval;
use super::coordinate_search::least;
use super::whitening::NoiseStrengths;

/// Rates in deg/s at which strengths are stated, clockwise and the other way: amid those of a plan, where a strength
/// and an exponent are told apart best.
const RATES_DEG_S: [f64; 2] = [60.0, -70.0];
/// Strengths at these rates before, in deg^2 per s, and the standard deviation of their logarithm.
const STRENGTHS_DEG2_S: [f64; 2] = [2e-5, 1.2e-5];
const LN_STRENGTH_SIGMA: f64 = 2.0;
/// The exponent before, and its standard deviation.
const EXPONENT: f64 = 4.0;
const EXPONENT_SIGMA: f64 = 1.5;

/// Bounds of a strength per that before, and of the exponent.
const PER_BEFORE: (f64, f64) = (1e-5, 1e5);
const EXPONENTS: (f64, f64) = (0.5, 8.0);

/// Strength of coning by the rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConingLaw {
    /// Clockwise and the other way: the strength at [`RATES_DEG_S`] in deg^2 per s, and the exponent.
    sides: [(f64, f64); 2],
}

impl ConingLaw {
    /// The law under which `criterion` of the strengths is least, with what is known before, and how much it is there;
    /// `rates_deg_s` are those of the drives. The criterion has what is known before of the reference. `None` where the
    /// criterion is not finite.
    pub(super) fn found(
        rates_deg_s: &[f64],
        criterion: &impl Fn(&NoiseStrengths) -> f64,
    ) -> Option<(Self, f64)> {
        let law = |values: &[f64]| Self {
            sides: [0, 1].map(|side| (values[2 + 2 * side] * STRENGTHS_DEG2_S[side], values[3 + 2 * side])),
        };
        let square = |sigmas: f64| sigmas * sigmas;
        let before = |values: &[f64]| {
            let strength = |per_before: f64| square(math::ln(per_before) / LN_STRENGTH_SIGMA);
            let exponent = |exponent: f64| square((exponent - EXPONENT) / EXPONENT_SIGMA);
            strength(values[2]) + exponent(values[3]) + strength(values[4]) + exponent(values[5])
        };
        let reference = NoiseStrengths::REFERENCE_FACTORS;
        let bounds = [reference, reference, PER_BEFORE, EXPONENTS, PER_BEFORE, EXPONENTS];
        let (values, least) = least(vec![1.0, 1.0, 1.0, EXPONENT, 1.0, EXPONENT], &bounds, |values| {
            let law = law(values);
            let coning_deg2_s =
                rates_deg_s.iter().map(|rate_deg_s| law.strength_deg2_s(*rate_deg_s)).collect();
            criterion(&NoiseStrengths { reference_factors: [values[0], values[1]], coning_deg2_s })
                + before(values)
        })?;
        Some((law(&values), least))
    }

    /// Strength of coning in deg^2 per s at a rate in deg/s; none at rest.
    pub fn strength_deg2_s(&self, rate_deg_s: f64) -> f64 {
        let side = usize::from(rate_deg_s < 0.0);
        let (strength_deg2_s, exponent) = self.sides[side];
        // At rest the logarithm is minus infinity.
        strength_deg2_s * math::exp(exponent * math::ln((rate_deg_s / RATES_DEG_S[side]).abs()))
    }
}

/// The mean rate of each drive in deg/s; 0 of the first, which is rest, and of one without an interval.
pub(super) fn mean_rates(intervals: &[FitInterval]) -> Vec<f64> {
    let drives = intervals.iter().map(|interval| interval.drive + 1).max().unwrap_or(0);
    let mut turned = vec![(0.0, 0.0); drives];
    for FitInterval { drive, turned_deg, span, .. } in intervals.iter().filter(|interval| interval.drive > 0)
    {
        turned[*drive].0 += turned_deg;
        turned[*drive].1 += span.length_s();
    }
    let rate = |(turned_deg, length_s): (f64, f64)| if length_s > 0.0 { turned_deg / length_s } else { 0.0 };
    turned.into_iter().map(rate).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Strengths of `n` intervals each whose mean squares are as the law says exactly: `n (ln W + W_true / W)` is least
    /// at the truth, and the prior of 2 in the logarithm and of 1.5 in the exponent moves it by a part of `1 / n`.
    #[test]
    fn exact_the_law_of_many_intervals() {
        let rates_deg_s = [0.0, 120.0, 60.0, 30.0, -100.0, -70.0, -50.0];
        let truth = ConingLaw { sides: [(3.5e-4, 2.5), (1.4e-6, 5.5)] };
        let criterion = |strengths: &NoiseStrengths| {
            let of_drive = |(strength, rate_deg_s): (&f64, &f64)| {
                let (found, truth) = (strength + 1e-12, truth.strength_deg2_s(*rate_deg_s) + 1e-12);
                1e4 * (math::ln(found) + truth / found)
            };
            strengths.coning_deg2_s.iter().zip(&rates_deg_s).map(of_drive).sum::<f64>()
                + strengths.reference_before()
        };
        let (law, _) = ConingLaw::found(&rates_deg_s, &criterion).unwrap();
        for (side, (strength_deg2_s, exponent)) in truth.sides.into_iter().enumerate() {
            assert!((law.sides[side].0 / strength_deg2_s - 1.0).abs() < 0.02, "{law:?}");
            assert!((law.sides[side].1 - exponent).abs() < 0.03, "{law:?}");
        }
        assert!(law.strength_deg2_s(0.0).abs() <= 0.0 && law.strength_deg2_s(-0.0).abs() <= 0.0);
        // Half of the rate: 2^-2.5 and 2^-5.5 of the strength.
        for (rate_deg_s, part) in [(60.0, 0.176_78), (-50.0, 0.022_097)] {
            let twice = truth.strength_deg2_s(2.0 * rate_deg_s);
            assert!((truth.strength_deg2_s(rate_deg_s) / twice / part - 1.0).abs() < 1e-3, "{rate_deg_s}");
        }
    }

    /// A likelihood of the logarithm as wide as what is known before, four away from it, at the rate at which strengths
    /// are stated: the law is halfway. The other way, where nothing is told, it is what is known before. The same of
    /// the exponent, three away, where the strength is told.
    #[test]
    fn exact_what_is_known_before_weighs_as_much_as_it_should() {
        let square = |sigmas: f64| sigmas * sigmas;
        let clockwise_deg2_s = STRENGTHS_DEG2_S[0];
        let (law, _) = ConingLaw::found(&[0.0, 60.0], &|strengths| {
            square((math::ln(strengths.coning_deg2_s[1] / clockwise_deg2_s) - 4.0) / LN_STRENGTH_SIGMA)
                + strengths.reference_before()
        })
        .unwrap();
        assert!((math::ln(law.sides[0].0 / clockwise_deg2_s) - 2.0).abs() < 0.01, "{law:?}");
        assert!((law.sides[0].1 - EXPONENT).abs() < 0.01, "{law:?}");
        assert!((law.sides[1].0 / STRENGTHS_DEG2_S[1] - 1.0).abs() < 0.01, "{law:?}");
        let (law, _) = ConingLaw::found(&[0.0, 60.0, 120.0], &|strengths| {
            let of_drive = |drive: usize| math::ln(strengths.coning_deg2_s[drive] / clockwise_deg2_s);
            let exponent = (of_drive(2) - of_drive(1)) / math::ln(2.0);
            1e4 * square(of_drive(1))
                + square((exponent - EXPONENT - 3.0) / EXPONENT_SIGMA)
                + strengths.reference_before()
        })
        .unwrap();
        assert!((law.sides[0].1 - EXPONENT - 1.5).abs() < 0.02, "{law:?}");
    }
}
