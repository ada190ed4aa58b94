//! Whether two results of the same runs differ beyond chance, run by run: the probability of a difference at least as
//! large where either of each pair may as well be the other.
//!
//! ```text
//! means     Student's t of the differences                                                          (Student 1908)
//! medians   Wilcoxon's signed ranks: the sum of the ranks of |d| over the pairs that rise           (Wilcoxon 1945)
//!           pairs without difference are left out, equal |d| share their mean rank
//! shares    McNemar's test: of the runs in which one alone has it, either one is as likely          (McNemar 1947)
//! ```
//!
//! Signed ranks of up to [`EXACT_MAX`] pairs and shares are exact, signed ranks of more pairs have their normal limit.

use motor_model::math;
use statrs::distribution::{Binomial, ContinuousCDF as _, DiscreteCDF as _, Normal};
use statrs::statistics::{Data, OrderStatistics as _, RankTieBreaker};
use statrs::stats_tests::ttest_onesample::ttest_onesample;
use statrs::stats_tests::{Alternative, NaNPolicy};

use simulation::math::count::real;

/// Most pairs whose signed ranks are counted one by one.
const EXACT_MAX: usize = 100;

/// The probability for the means of pairs with these differences; `None` of fewer than two pairs.
pub fn of_means(differences: Vec<f64>) -> Option<f64> {
    if differences.iter().all(|difference| difference.abs() <= 0.0) {
        return (differences.len() > 1).then_some(1.0);
    }
    let test = ttest_onesample(differences, 0.0, Alternative::TwoSided, NaNPolicy::Propogate);
    test.ok().map(|(_, p)| p).filter(|p| p.is_finite())
}

/// What signed ranks say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignedRanks {
    /// The probability.
    pub p: f64,
    /// The ranks of the pairs that rise less those of the pairs that fall: positive where the second is larger.
    pub rise: f64,
}

/// The signed ranks of pairs with these differences, second less first.
pub fn of_medians(differences: &[f64]) -> SignedRanks {
    let differing: Vec<f64> = differences.iter().copied().filter(|d| d.abs() > 0.0).collect();
    let sizes: Vec<f64> = differing.iter().map(|difference| difference.abs()).collect();
    let ranks = Data::new(sizes).ranks(RankTieBreaker::Average);
    let rise: f64 = ranks.iter().zip(&differing).map(|(rank, difference)| rank * difference.signum()).sum();
    let p = if ranks.len() <= EXACT_MAX { exact(&ranks, rise) } else { normal(&ranks, rise) };
    SignedRanks { p, rise }
}

/// The share of all ways to sign `ranks` whose sum is at least as far from 0 as `rise`.
fn exact(ranks: &[f64], rise: f64) -> f64 {
    // Twice a mean rank is a whole number, and twice the sum of those that rise is the sum of all plus `rise`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "ranks of 100 pairs at most")]
    let whole = |number: f64| number.round() as usize;
    let sum = whole(2.0 * ranks.iter().sum::<f64>());
    let mut chances = vec![0.0; sum + 1];
    chances[0] = 1.0;
    for rank in ranks {
        let step = whole(2.0 * rank);
        for place in (0..=sum).rev() {
            let before = place.checked_sub(step).map_or(0.0, |before| chances[before]);
            chances[place] = 0.5 * (chances[place] + before);
        }
    }
    let risen = whole(ranks.iter().sum::<f64>() + rise);
    let (below, above) = (chances[..=risen].iter().sum::<f64>(), chances[risen..].iter().sum::<f64>());
    (2.0 * below.min(above)).min(1.0)
}

/// The same in the normal limit.
fn normal(ranks: &[f64], rise: f64) -> f64 {
    let square: f64 = ranks.iter().map(|rank| rank * rank).sum();
    2.0 * Normal::standard().cdf(-rise.abs() / math::sqrt(square))
}

/// The probability for shares of pairs of which so many have it in the first alone and in the second alone.
pub fn of_shares(first_alone: u64, second_alone: u64) -> f64 {
    let fewer = Binomial::new(0.5, first_alone + second_alone)
        .map_or(1.0, |binomial| binomial.cdf(first_alone.min(second_alone)));
    (2.0 * fewer).min(1.0)
}

/// The fewest pairs with which a test of signs can find anything at `level`: all of them on one side.
pub fn fewest_signs(level: f64) -> usize {
    (1_u32..64).find(|pairs| 2.0 / real(1_u64 << pairs) < level).map_or(64, |pairs| pairs as usize)
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;

    fn assert_near(found: f64, expected: f64, within: f64) {
        assert!((found - expected).abs() < within, "{found}, not {expected}");
    }

    /// A score of depression of nine patients before and after therapy, in thousandths (Hollander and Wolfe 1973,
    /// section 3.1). SciPy 1.17.1: `ttest_rel` 0.016177, `wilcoxon(method="exact")` 0.0390625.
    #[test]
    fn tool_nine_pairs() {
        let before = [1830.0, 500.0, 1620.0, 2480.0, 1680.0, 1880.0, 1550.0, 3060.0, 1300.0];
        let after = [878.0, 647.0, 598.0, 2050.0, 1060.0, 1290.0, 1060.0, 3140.0, 1290.0];
        let differences: Vec<f64> = before.iter().zip(after).map(|(before, after)| after - before).collect();
        let found = of_medians(&differences);
        assert_near(found.p, 0.039_062_5, 1e-12);
        assert!(found.rise < 0.0, "{found:?}");
        assert_near(of_means(differences).unwrap(), 0.016_176_627, 1e-8);
    }

    /// Of the 256 ways to sign eight ranks, two threes of which are shared, 34 have a sum at least 23 from 0: counted
    /// one by one in Python. A pair without difference says nothing.
    #[test]
    fn exact_equal_differences_share_a_rank() {
        let differences = [1.0, 1.0, 2.0, -1.0, 3.0, -2.0, 0.0, 4.0, 5.0];
        let found = of_medians(&differences);
        assert_near(found.p, 34.0 / 256.0, 1e-12);
        assert_near(found.rise, 23.0, 1e-12);
        assert_eq!(of_medians(&[0.0; 9]), SignedRanks { p: 1.0, rise: 0.0 });
    }

    /// SciPy 1.17.1's `wilcoxon(method="asymptotic", correction=False)` of 150 pairs with many equal differences.
    #[test]
    fn tool_many_pairs() {
        let sizes = (1..=150_u32).map(|k| f64::from(k % 10 + 1) * if k % 3 == 0 { -1.0 } else { 1.0 });
        assert_near(of_medians(&sizes.collect::<Vec<_>>()).p, 3.914_626_06e-4, 1e-11);
    }

    /// Both ways to compute the same: 100 pairs are enough for the normal limit, to its third moment's 1 / 100.
    #[test]
    fn law_exact_and_normal_meet() {
        let ranks: Vec<f64> = (1..=100_u32).map(f64::from).collect();
        for rise in [0.0, 500.0, 1200.0] {
            assert_near(exact(&ranks, rise), normal(&ranks, rise), 0.01);
        }
    }

    /// SciPy 1.17.1's `binomtest(3, 15)` and `binomtest(1, 10)`.
    #[test]
    fn tool_shares() {
        assert_near(of_shares(3, 12), 0.035_156_25, 1e-12);
        assert_near(of_shares(9, 1), 0.021_484_375, 1e-12);
        assert_near(of_shares(0, 0), 1.0, 1e-12);
        assert_near(of_shares(2, 2), 1.0, 1e-12);
    }

    /// Six on one side have p = 1 / 32, five 1 / 16.
    #[test]
    fn exact_fewest_signs() {
        assert_eq!(fewest_signs(0.05), 6);
        assert!(of_shares(0, 6) < 0.05 && of_shares(0, 5) > 0.05);
    }

    #[test]
    fn exact_pairs_that_say_nothing() {
        assert_eq!(of_means(vec![1.0]), None);
        assert_eq!(of_means(vec![0.0; 3]), Some(1.0));
        assert_eq!(of_means(vec![1.0; 3]), Some(0.0));
    }

    /// Of 1,000 sets of 12 pairs without a difference each test finds one at 5 % in at most 5 %, and Student's, which
    /// is exact here, in no less: 50 +- 7.
    #[test]
    fn law_chance_is_5_percent() {
        let mut rng = Pcg64::seed_from_u64(7);
        let (mut means, mut medians) = (0, 0);
        for _ in 0..1000 {
            let differences: Vec<f64> = (0..12).map(|_| StandardNormal.sample(&mut rng)).collect();
            medians += u32::from(of_medians(&differences).p < 0.05);
            means += u32::from(of_means(differences).unwrap() < 0.05);
        }
        assert!((26..=74).contains(&means) && (20..=74).contains(&medians), "{means} {medians}");
    }
}
