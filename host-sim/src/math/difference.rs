//! Whether two independent results differ beyond chance: the probability of a difference at least as large where there
//! is none.
//!
//! ```text
//! means       Welch's t:  (m_b - m_a) / sqrt(s_a^2 / n_a + s_b^2 / n_b)                            (Welch 1947)
//! intervals   z:  |b - a| / sqrt(w_a^2 + w_b^2), w: the half that faces the other, per 1.96       (Zou, Donner 2008)
//! counts      Fisher's exact test: hypergeometric tables that are no more likely than the one found
//! many        Holm's method: the i-th smallest of m probabilities counts m - i + 1 times            (Holm 1979)
//! ```

use motor_model::math;
use statrs::distribution::{ContinuousCDF as _, Discrete as _, Hypergeometric, Normal, StudentsT};

use simulation::math::count::real;
use simulation::math::statistics::{NORMAL_95, Spread};

/// Tables whose probabilities differ by less than this part are taken for equally likely.
const EQUALLY_LIKELY: f64 = 1e-7;

/// The probability for the means of two sets of runs; `None` for fewer than two runs in either.
pub fn of_means(a: (Spread, u64), b: (Spread, u64)) -> Option<f64> {
    if a.1 < 2 || b.1 < 2 {
        return None;
    }
    let [square_a, square_b] = [a, b].map(|(spread, runs)| spread.sd * spread.sd / real(runs));
    let (difference, square) = ((b.0.mean - a.0.mean).abs(), square_a + square_b);
    if square <= 0.0 {
        return Some(if difference > 0.0 { 0.0 } else { 1.0 });
    }
    let parts = square_a * square_a / (real(a.1) - 1.0) + square_b * square_b / (real(b.1) - 1.0);
    let student = StudentsT::new(0.0, 1.0, square * square / parts).ok()?;
    Some(2.0 * student.cdf(-difference / math::sqrt(square)))
}

/// The probability for two values with the ends of their 95 % intervals; `None` where an end that faces the other value
/// is missing.
pub fn of_intervals(a: (f64, Option<f64>, Option<f64>), b: (f64, Option<f64>, Option<f64>)) -> Option<f64> {
    let ((low, high), difference) = (if b.0 < a.0 { (b, a) } else { (a, b) }, (b.0 - a.0).abs());
    if difference <= 0.0 {
        return Some(1.0);
    }
    let sigmas = [low.2? - low.0, high.0 - high.1?].map(|half| half.max(0.0) / NORMAL_95);
    let square = sigmas[0] * sigmas[0] + sigmas[1] * sigmas[1];
    if square <= 0.0 {
        return Some(0.0);
    }
    Some(2.0 * Normal::standard().cdf(-difference / math::sqrt(square)))
}

/// The probability for two counts, each of so many runs; `None` without runs in either.
pub fn of_counts(a: (u64, u64), b: (u64, u64)) -> Option<f64> {
    if a.1 == 0 || b.1 == 0 {
        return None;
    }
    let (all, counted) = (a.1 + b.1, a.0 + b.0);
    let tables = Hypergeometric::new(all, counted, a.1).ok()?;
    let found = tables.ln_pmf(a.0) + EQUALLY_LIKELY;
    let (least, most) = (counted.saturating_sub(b.1), counted.min(a.1));
    let likely = (least..=most).map(|count| tables.ln_pmf(count)).filter(|table| *table <= found);
    Some(likely.map(math::exp).sum::<f64>().min(1.0))
}

/// The probabilities adjusted so that the chance of one false alarm among all is at most the level that they are
/// compared with.
pub fn holm(probabilities: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..probabilities.len()).collect();
    order.sort_by(|&a, &b| probabilities[a].total_cmp(&probabilities[b]));
    let mut adjusted = vec![1.0; probabilities.len()];
    let mut largest = 0.0_f64;
    for (rank, place) in order.into_iter().enumerate() {
        largest = largest.max(real(probabilities.len() - rank) * probabilities[place]).min(1.0);
        adjusted[place] = largest;
    }
    adjusted
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;

    fn assert_near(found: Option<f64>, expected: f64, within: f64) {
        assert!(found.is_some_and(|found| (found - expected).abs() < within), "{found:?}, not {expected}");
    }

    /// SciPy 1.17's `ttest_ind(equal_var=False)` of 1, 2, 3, 4 and 3, 4, 5, 6, 7: p = 0.034939, either way round.
    #[test]
    fn tool_welch() {
        let of = |values: &[f64]| (values.iter().copied().collect::<Spread>(), values.len() as u64);
        let (a, b) = (of(&[1.0, 2.0, 3.0, 4.0]), of(&[3.0, 4.0, 5.0, 6.0, 7.0]));
        assert_near(of_means(a, b), 0.034_938_8, 1e-6);
        assert_near(of_means(b, a), 0.034_938_8, 1e-6);
        assert_eq!(of_means(of(&[1.0]), b), None);
        assert_eq!(of_means(of(&[1.0, 1.0]), of(&[1.0, 1.0])), Some(1.0));
        assert_eq!(of_means(of(&[1.0, 1.0]), of(&[2.0, 2.0])), Some(0.0));
    }

    /// Fisher's tea: 3 of 4 against 1 of 4 has p = 34 / 70; 0 of 5 against 5 of 5 has 2 / 252.
    #[test]
    fn exact_fisher() {
        assert_near(of_counts((3, 4), (1, 4)), 34.0 / 70.0, 1e-9);
        assert_near(of_counts((0, 5), (5, 5)), 2.0 / 252.0, 1e-9);
        assert_near(of_counts((2, 100), (2, 100)), 1.0, 1e-9);
        assert_eq!(of_counts((0, 0), (1, 2)), None);
    }

    /// Two symmetric intervals of +-1.96 whose values are 2.7718 apart: 1.96 standard errors.
    #[test]
    fn exact_intervals_by_the_halves_that_face_each_other() {
        let apart = NORMAL_95 * math::sqrt(2.0_f64);
        let a = (0.0, None, Some(NORMAL_95));
        let b = (apart, Some(apart - NORMAL_95), None);
        assert_near(of_intervals(a, b), 0.05, 1e-4);
        assert_near(of_intervals(b, a), 0.05, 1e-4);
        assert_eq!(of_intervals((1.0, None, None), b), None);
        assert_eq!(of_intervals(a, a), Some(1.0));
    }

    /// Holm 1979, as R's `p.adjust` gives it.
    #[test]
    fn exact_holm() {
        let adjusted = holm(&[0.01, 0.04, 0.03, 0.005]);
        for (found, expected) in adjusted.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{adjusted:?}");
        }
        assert_eq!(holm(&[0.9, 0.8]), [1.0, 1.0]);
        assert!(holm(&[]).is_empty());
    }

    /// Of 500 pairs of equal laws, 10 comparisons each, at most 5 % raise an alarm after Holm, and not far fewer: 25 +-
    /// 5, three standard deviations either way.
    #[test]
    fn law_the_chance_of_one_false_alarm_is_5_percent() {
        let mut rng = Pcg64::seed_from_u64(5);
        let mut runs = || -> (Spread, u64) {
            let values: Vec<f64> = (0..12).map(|_| StandardNormal.sample(&mut rng)).collect();
            (values.into_iter().collect(), 12)
        };
        let alarms = (0..500)
            .filter(|_| {
                let of_pair: Vec<f64> = (0..10).filter_map(|_| of_means(runs(), runs())).collect();
                holm(&of_pair).iter().any(|adjusted| *adjusted < 0.05)
            })
            .count();
        assert!((10..=40).contains(&alarms), "{alarms}");
    }
}
