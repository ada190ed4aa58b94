//! The probability of a change of a key figure by chance.
//!
//! | figure | runs of the same seeds | independent runs |
//! |---|---|---|
//! | mean | Student's t of the differences | Welch's t |
//! | root mean square | the same of the squares | the halves of the intervals that face each other |
//! | median | Wilcoxon's signed ranks | the same halves |
//! | another quantile | McNemar's test of the runs beyond that quantile of both | the same halves |
//! | count | McNemar's test | Fisher's exact test |
//!
//! McNemar's test of a quantile: if nothing changed, a run that lies beyond it in one result alone does so in either
//! with the same probability, since the quantile of both does not depend on which is which. Fewer than six pairs cannot
//! show anything by ranks and signs; they are taken for independent.

use serde::Serialize;

use super::LEVEL;
use crate::math::{difference, paired_difference};
use crate::report::key_figure::{KeyFigure, Measured, PerRun, Statistic};
use simulation::math::statistics::{Spread, quantile};

/// How a figure was tested.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Test {
    /// Student's t of the differences of pairs.
    PairedT,
    /// Wilcoxon's signed ranks.
    SignedRanks,
    /// McNemar's test.
    Mcnemar,
    /// Welch's t.
    Welch,
    /// Fisher's exact test.
    Fisher,
    /// The halves of 95 % intervals that face each other.
    Intervals,
}

impl Test {
    /// Every test.
    pub const ALL: [Self; 6] =
        [Self::PairedT, Self::SignedRanks, Self::Mcnemar, Self::Welch, Self::Fisher, Self::Intervals];

    /// Its name in a table.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PairedT => "paired t",
            Self::SignedRanks => "signed ranks",
            Self::Mcnemar => "McNemar",
            Self::Welch => "Welch",
            Self::Fisher => "Fisher",
            Self::Intervals => "intervals",
        }
    }

    /// What it tests and by what, in words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::PairedT => "means and root mean squares by Student's t of the differences",
            Self::SignedRanks => "medians by Wilcoxon's signed ranks",
            Self::Mcnemar => "counts and other quantiles by McNemar's test",
            Self::Welch => "means by Welch's t-test",
            Self::Fisher => "counts by Fisher's exact test",
            Self::Intervals => "quantiles and root mean squares by their 95 % intervals",
        }
    }
}

/// What a test of a figure says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Significance {
    /// The test.
    pub test: Test,
    /// Pairs of runs; `None` of independent runs.
    pub pairs: Option<usize>,
    /// The probability.
    pub p: f64,
    /// Positive where most runs are larger in the second, negative where most are smaller; `None` where the figure
    /// itself says so.
    pub rise: Option<f64>,
}

impl Significance {
    /// That of the change from `a` to `b`, in pairs where these are of the same runs; `None` where both say too little.
    pub fn of(a: &KeyFigure, b: &KeyFigure, same_seeds: bool) -> Option<Self> {
        let runs = a.per_run.as_ref().zip(b.per_run.as_ref()).filter(|_| same_seeds);
        runs.and_then(|(a, b)| Self::of_pairs(a, b)).or_else(|| Self::of_independent(a.measured, b.measured))
    }

    fn of_pairs(a: &PerRun, b: &PerRun) -> Option<Self> {
        let pairs = a.pairs(b)?;
        let differences = |of: fn(f64) -> f64| pairs.iter().map(move |[a, b]| of(*b) - of(*a)).collect();
        let paired = |test, p, rise| Self { test, pairs: Some(pairs.len()), p, rise };
        let mcnemar = |has: &dyn Fn(f64) -> bool| {
            let alone =
                |only: usize| pairs.iter().filter(|pair| has(pair[only]) && !has(pair[1 - only])).count();
            paired(Test::Mcnemar, paired_difference::of_shares(alone(0) as u64, alone(1) as u64), None)
        };
        let of_signs = || (pairs.len() >= paired_difference::fewest_signs(LEVEL)).then_some(());
        let student = |p| paired(Test::PairedT, p, None);
        match a.statistic {
            Statistic::Mean => paired_difference::of_means(differences(|value| value)).map(student),
            Statistic::RootMeanSquare => {
                paired_difference::of_means(differences(|value| value * value)).map(student)
            }
            Statistic::Quantile { per_mille: 500 } => of_signs().map(|()| {
                let differences: Vec<f64> = differences(|value| value);
                let found = paired_difference::of_medians(&differences);
                paired(Test::SignedRanks, found.p, Some(found.rise))
            }),
            Statistic::Quantile { per_mille } => of_signs().and_then(|()| {
                let mut both: Vec<f64> = pairs.iter().flatten().copied().collect();
                let level = quantile(&mut both, per_mille.into())?;
                Some(mcnemar(&|value| value > level))
            }),
            Statistic::Share => of_signs().map(|()| mcnemar(&|value| value > 0.5)),
        }
    }

    fn of_independent(a: Measured, b: Measured) -> Option<Self> {
        use Measured::{Count, Mean};
        let (test, p) = match (a, b) {
            (Mean { value: mean_a, sd: sd_a, runs: of_a }, Mean { value: mean_b, sd: sd_b, runs: of_b }) => {
                let [a, b] = [(mean_a, sd_a, of_a), (mean_b, sd_b, of_b)]
                    .map(|(mean, sd, runs)| (Spread { mean, sd }, runs));
                (Test::Welch, difference::of_means(a, b))
            }
            (Count { value: of_a, runs: all_a }, Count { value: of_b, runs: all_b }) => {
                (Test::Fisher, difference::of_counts((of_a, all_a), (of_b, all_b)))
            }
            _ => {
                let of = |measured: Measured| {
                    let (low, high) = measured.interval_95();
                    (measured.value(), low, high)
                };
                let p = difference::of_intervals(of(a), of(b)).filter(|_| a.runs() > 1 && b.runs() > 1);
                (Test::Intervals, p)
            }
        };
        p.map(|p| Self { test, pairs: None, p, rise: None })
    }
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution as _, StandardNormal};
    use rand_pcg::Pcg64;
    use rand_pcg::rand_core::SeedableRng as _;

    use super::*;

    /// The errors of forty motors in mdeg, which differ by far more than what a change makes of each.
    fn errors() -> Vec<f64> {
        let mut rng = Pcg64::seed_from_u64(11);
        (0..40).map(|_| 1.0 + f64::abs(StandardNormal.sample(&mut rng))).collect()
    }

    fn figures(errors: &[f64]) -> [KeyFigure; 5] {
        let each = || errors.iter().copied();
        [
            KeyFigure::mean("mean", "mdeg", each()),
            KeyFigure::root_mean_square("rms", "mdeg", each()),
            KeyFigure::quantile("median", "mdeg", each(), 500),
            KeyFigure::quantile("75 %", "mdeg", each(), 750),
            KeyFigure::count("failed", each().map(|error| error > 1.5)),
        ]
    }

    fn found(a: &[f64], b: &[f64], same_seeds: bool) -> [Significance; 5] {
        let [a, b] = [a, b].map(figures);
        std::array::from_fn(|place| Significance::of(&a[place], &b[place], same_seeds).unwrap())
    }

    /// Every motor is 5 to 15 % worse: a twentieth of the spread between motors, and eight times the spread of the
    /// change over the root of 40. In pairs this is beyond chance of one in a thousand; between independent runs it is
    /// within it.
    #[test]
    fn law_a_small_change_of_every_run_is_found_in_pairs_alone() {
        let before = errors();
        let mut rng = Pcg64::seed_from_u64(12);
        let mut worse = || 1.1 + 0.025 * f64::clamp(StandardNormal.sample(&mut rng), -2.0, 2.0);
        let after: Vec<f64> = before.iter().map(|error| error * worse()).collect();
        let paired = found(&before, &after, true);
        let tests = [Test::PairedT, Test::PairedT, Test::SignedRanks, Test::Mcnemar, Test::Mcnemar];
        assert_eq!(paired.map(|found| (found.test, found.pairs)), tests.map(|test| (test, Some(40))));
        assert!(paired[..3].iter().all(|found| found.p < 1e-3), "{paired:?}");
        assert!(paired[2].rise.is_some_and(|rise| rise > 0.0));
        let independent = found(&before, &after, false);
        let tests = [Test::Welch, Test::Intervals, Test::Intervals, Test::Intervals, Test::Fisher];
        assert_eq!(independent.map(|found| (found.test, found.pairs)), tests.map(|test| (test, None)));
        assert!(independent.iter().all(|found| found.p > LEVEL), "{independent:?}");
    }

    /// The squares of 3 and 4, 5 and 6, 7 and 9 differ by 7, 11 and 32: SciPy 1.17.1's `ttest_1samp` has p = 0.1645755.
    #[test]
    fn tool_root_mean_squares_are_compared_by_their_squares() {
        let [a, b] =
            [[3.0, 5.0, 7.0], [4.0, 6.0, 9.0]].map(|runs| KeyFigure::root_mean_square("rms", "", runs));
        assert!((Significance::of(&a, &b, true).unwrap().p - 0.164_575_5).abs() < 1e-6);
    }

    /// Of eight runs four are beyond the upper quartile of all sixteen values in the second alone: p = 2 / 16.
    #[test]
    fn exact_quantiles_are_compared_by_the_runs_beyond_that_of_both() {
        let [a, b] = [[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0], [1.5, 2.5, 3.5, 4.5, 10.0, 11.0, 12.0, 13.0]]
            .map(|runs| KeyFigure::quantile("75 %", "", runs, 750));
        let found = Significance::of(&a, &b, true).unwrap();
        assert!(found.test == Test::Mcnemar && (found.p - 0.125).abs() < 1e-12, "{found:?}");
    }

    /// Five pairs could at best have p = 1 / 16 by their signs.
    #[test]
    fn exact_few_pairs_are_taken_for_independent() {
        let test = |runs: usize| {
            let of = |holds| KeyFigure::count("failed", vec![holds; runs]);
            Significance::of(&of(false), &of(true), true).map(|found| found.test)
        };
        assert_eq!([test(5), test(6)], [Some(Test::Fisher), Some(Test::Mcnemar)]);
    }
}
