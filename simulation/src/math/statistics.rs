//! Statistics of samples: mean and spread in one pass, a straight line, quantiles; and the quantiles of the normal,
//! chi-square, t and binomial distributions that 95 % bounds need.

use average::{Estimate, Variance};
use motor_model::math;
use serde::Serialize;
use statrs::distribution::{Binomial, ChiSquared, ContinuousCDF as _, DiscreteCDF as _, Normal, StudentsT};

use crate::math::count::real;

/// Mean and sample standard deviation of a quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Sample standard deviation; 0 for fewer than two values.
    pub sd: f64,
}

/// Mean and spread of a stream of values.
#[derive(Clone, Debug, Default)]
pub struct Accumulator {
    variance: Variance,
}

impl Accumulator {
    /// Takes a value into account.
    pub fn add(&mut self, value: f64) {
        self.variance.add(value);
    }

    /// Mean and spread so far; zero for no value.
    pub fn spread(&self) -> Spread {
        match self.variance.len() {
            0 => Spread::default(),
            1 => Spread { mean: self.variance.mean(), sd: 0.0 },
            _ => Spread { mean: self.variance.mean(), sd: math::sqrt(self.variance.sample_variance()) },
        }
    }
}

impl FromIterator<f64> for Spread {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut accumulator = Accumulator::default();
        values.into_iter().for_each(|value| accumulator.add(value));
        accumulator.spread()
    }
}

/// A straight line through points, and how well they lie on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Rise of y per x.
    pub slope: f64,
    /// y at x = 0.
    pub intercept: f64,
    /// Pearson's linear correlation of x and y, -1 to 1; 0 where y does not vary.
    pub correlation: f64,
}

impl Line {
    /// Least squares through `points`; `None` unless x takes two values.
    pub fn through(points: &[(f64, f64)]) -> Option<Self> {
        let x: Spread = points.iter().map(|point| point.0).collect();
        let y: Spread = points.iter().map(|point| point.1).collect();
        let products = points.iter().map(|point| (point.0 - x.mean) * (point.1 - y.mean));
        let degrees_of_freedom = u32::try_from(points.len()).ok()?.checked_sub(1)?;
        if x.sd <= 0.0 {
            return None;
        }
        let covariance = products.sum::<f64>() / f64::from(degrees_of_freedom);
        let slope = covariance / (x.sd * x.sd);
        let correlation = if y.sd > 0.0 { covariance / (x.sd * y.sd) } else { 0.0 };
        Some(Self { slope, intercept: y.mean - slope * x.mean, correlation })
    }
}

/// Mean of squares of a stream of values.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeanSquare {
    sum: f64,
    count: f64,
}

impl MeanSquare {
    /// Takes a value into account.
    pub fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.count += 1.0;
    }

    /// Root of the mean square so far; 0 of no value.
    pub fn root(self) -> f64 {
        self.root_of_some().unwrap_or(0.0)
    }

    /// The same; `None` of no value.
    pub fn root_of_some(self) -> Option<f64> {
        (self.count > 0.0).then(|| math::sqrt(self.sum / self.count))
    }
}

/// Root of the mean square of `values`; 0 of no value.
pub fn root_mean_square(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut squares = MeanSquare::default();
    values.into_iter().for_each(|value| squares.add(value));
    squares.root()
}

/// Lower quantile by the nearest rank: the smallest of `values` that at least `per_mille` thousandths of them do not
/// exceed.
///
/// `None` of no value. Reorders `values`.
pub fn quantile<T: Copy + Into<f64>>(values: &mut [T], per_mille: usize) -> Option<f64> {
    let rank = (values.len() * per_mille).div_ceil(1000);
    of_rank(values, rank.saturating_sub(1))
}

/// Upper quantile: the smallest of `values` that more than `per_mille` thousandths of them do not exceed.
///
/// It differs from [`quantile`] where the thousandths are a whole number of values. `None` of no value. Reorders
/// `values`.
pub fn upper_quantile<T: Copy + Into<f64>>(values: &mut [T], per_mille: usize) -> Option<f64> {
    of_rank(values, values.len() * per_mille / 1000)
}

/// The value that `place` others precede in the order of size; the largest for a place beyond it.
fn of_rank<T: Copy + Into<f64>>(values: &mut [T], place: usize) -> Option<f64> {
    let place = place.min(values.len().checked_sub(1)?);
    let (_, value, _) = values.select_nth_unstable_by(place, |a, b| (*a).into().total_cmp(&(*b).into()));
    Some((*value).into())
}

/// Two-sided 95 % quantile of the standard normal distribution.
pub const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Probability outside of two-sided 95 % bounds.
pub const OUTSIDE_95: f64 = 0.05;

/// Probability below the lower and below the upper of two-sided bounds that have `outside` outside.
const fn two_sided(outside: f64) -> [f64; 2] {
    [0.5 * outside, 1.0 - 0.5 * outside]
}

/// Two-sided quantile of the standard normal distribution: a value beyond it in either direction has the probability
/// `outside`, 0 to 1.
pub fn normal_quantile(outside: f64) -> f64 {
    let [_, below] = two_sided(outside);
    Normal::standard().inverse_cdf(below)
}

/// Two-sided bounds of the mean of `n` independent squares of standard normals, `chi^2_n / n`, which lies below the
/// lower and above the upper with the probability `outside / 2` each.
///
/// `n` is above 0 and need not be whole. Both bounds are 1 where it is infinite, and NaN where it is not a number.
pub fn chi_square_mean_bounds(n: f64, outside: f64) -> (f64, f64) {
    if n.is_infinite() {
        return (1.0, 1.0);
    }
    let bound = |below| ChiSquared::new(n).map_or(f64::NAN, |squares| squares.inverse_cdf(below) / n);
    let [low, high] = two_sided(outside).map(bound);
    (low, high)
}

/// Two-sided quantile of Student's t for `degrees_of_freedom` above 0; infinite for 0. A value beyond it in either
/// direction has the probability `outside`, 0 to 1.
pub fn student_quantile(degrees_of_freedom: f64, outside: f64) -> f64 {
    let [_, below] = two_sided(outside);
    StudentsT::new(0.0, 1.0, degrees_of_freedom)
        .map_or(f64::INFINITY, |distribution| distribution.inverse_cdf(below))
}

/// Its 95 % quantile.
pub fn student_95(degrees_of_freedom: f64) -> f64 {
    student_quantile(degrees_of_freedom, OUTSIDE_95)
}

/// Two-sided 95 % bounds of how many of `n` independent trials succeed with `probability` each, within 0 to 1: at most
/// 2.5 % of all sets lie below, and 2.5 % above.
pub fn binomial_bounds(n: u32, probability: f64) -> (u32, u32) {
    let bound = |below| {
        let count = Binomial::new(probability, n.into()).map_or(0, |trials| trials.inverse_cdf(below));
        u32::try_from(count).map_or(n, |count| count.min(n))
    };
    let [low, high] = two_sided(OUTSIDE_95).map(bound);
    (low, high)
}

/// Two-sided 95 % bounds of a probability, from `count` successes in `n` trials: Wilson's score interval (Wilson 1927).
/// Both are 0 and 1 for no trial.
pub fn wilson_95(count: u64, n: u64) -> (f64, f64) {
    if n == 0 {
        return (0.0, 1.0);
    }
    let (n, share) = (real(n), real(count) / real(n));
    let square = NORMAL_95 * NORMAL_95 / n;
    let half = math::sqrt(square * share * (1.0 - share) + 0.25 * square * square);
    let (middle, scale) = (share + 0.5 * square, 1.0 + square);
    (((middle - half) / scale).max(0.0), ((middle + half) / scale).min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2, 4, 4, 4, 5, 5, 7, 9: mean 5, sum of squares 32, so the sample variance is 32 / 7.
    #[test]
    fn exact_mean_and_sample_deviation() {
        let spread: Spread = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0].into_iter().collect();
        assert!((spread.mean - 5.0).abs() < 1e-15);
        assert!((spread.sd * spread.sd - 32.0 / 7.0).abs() < 1e-14);
    }

    #[test]
    fn exact_none_and_one_value() {
        assert_eq!([].into_iter().collect::<Spread>(), Spread { mean: 0.0, sd: 0.0 });
        assert_eq!([3.0].into_iter().collect::<Spread>(), Spread { mean: 3.0, sd: 0.0 });
    }

    /// Large offset, small spread: the difference of sums of squares would lose every digit.
    #[test]
    fn law_shift_leaves_the_spread() {
        let spread: Spread = [1e9 + 1.0, 1e9 + 2.0, 1e9 + 3.0].into_iter().collect();
        assert!((spread.sd - 1.0).abs() < 1e-12);
    }

    /// Anscombe's first set: slope 0.5001, intercept 3.0001, r = 0.81642 (Anscombe 1973).
    #[test]
    fn tool_anscombe() {
        let x = [10.0, 8.0, 13.0, 9.0, 11.0, 14.0, 6.0, 4.0, 12.0, 7.0, 5.0];
        let y = [8.04, 6.95, 7.58, 8.81, 8.33, 9.96, 7.24, 4.26, 10.84, 4.82, 5.68];
        let points: Vec<_> = x.into_iter().zip(y).collect();
        let line = Line::through(&points).unwrap();
        assert!((line.slope - 0.500_09).abs() < 1e-5);
        assert!((line.intercept - 3.000_09).abs() < 1e-5);
        assert!((line.correlation - 0.816_42).abs() < 1e-5);
        assert_eq!(Line::through(&points[..1]), None);
    }

    #[test]
    fn exact_quantiles_by_nearest_rank() {
        let values = || [4.0, 1.0, 3.0, 2.0];
        for (per_mille, lower, upper) in
            [(0, 1.0, 1.0), (250, 1.0, 2.0), (500, 2.0, 3.0), (510, 3.0, 3.0), (1000, 4.0, 4.0)]
        {
            assert_eq!(quantile(&mut values(), per_mille), Some(lower), "{per_mille}");
            assert_eq!(upper_quantile(&mut values(), per_mille), Some(upper), "{per_mille}");
        }
        assert_eq!((quantile::<f64>(&mut [], 500), upper_quantile::<f32>(&mut [], 500)), (None, None));
    }

    /// 3 and -4: `sqrt((9 + 16) / 2)`.
    #[test]
    fn exact_root_mean_square() {
        assert!((root_mean_square([3.0, -4.0]) - math::sqrt(12.5)).abs() < 1e-15);
        assert!(root_mean_square([]).abs() <= 0.0);
    }

    /// Quantiles 0.025 and 0.975 of chi-square as tables print them (NIST/SEMATECH e-Handbook, 1.3.6.7.4).
    #[test]
    fn exact_chi_square_bounds() {
        for (n, low, high, within) in
            [(10.0, 3.247, 20.483, 1e-2), (20.0, 9.591, 34.170, 2e-3), (100.0, 74.222, 129.561, 2e-3)]
        {
            let bounds = chi_square_mean_bounds(n, OUTSIDE_95);
            assert!((n * bounds.0 / low - 1.0).abs() < within, "{n}: {}", n * bounds.0);
            assert!((n * bounds.1 / high - 1.0).abs() < within, "{n}: {}", n * bounds.1);
        }
    }

    /// As tables print them (NIST/SEMATECH e-Handbook, 1.3.6.7.2).
    #[test]
    fn exact_student_quantiles() {
        for (n, expected) in [
            (1.0, 12.706),
            (2.0, 4.303),
            (3.0, 3.182),
            (4.0, 2.776),
            (11.0, 2.201),
            (39.0, 2.023),
            (99.0, 1.984),
        ] {
            assert!((student_95(n) / expected - 1.0).abs() < 1e-2, "{n}: {}", student_95(n));
        }
    }

    /// The normal quantile of 0.9995, and the quantiles of 0.999 of Student's t of 7 and of chi-square of 10 degrees of
    /// freedom as tables print them (NIST/SEMATECH e-Handbook, 1.3.6.7.1, 1.3.6.7.2, 1.3.6.7.4).
    #[test]
    fn exact_quantiles_of_other_levels() {
        assert!((normal_quantile(OUTSIDE_95) - NORMAL_95).abs() < 1e-9);
        assert!((normal_quantile(1e-3) - 3.291).abs() < 1e-3);
        assert!((student_quantile(7.0, 2e-3) / 4.785 - 1.0).abs() < 1e-3);
        let (_, high) = chi_square_mean_bounds(10.0, 2e-3);
        assert!((10.0 * high / 29.588 - 1.0).abs() < 1e-3, "{high}");
    }

    /// 2.5 % and 97.5 % quantiles of binomial distributions, as R's `qbinom` gives them; three throws of a fair coin by
    /// hand.
    #[test]
    fn exact_binomial_bounds() {
        for (n, probability, bounds) in [
            (200, 0.95, (184, 196)),
            (1000, 0.95, (936, 963)),
            (20, 0.5, (6, 14)),
            (3, 0.5, (0, 3)),
            (1, 0.95, (0, 1)),
            (0, 0.95, (0, 0)),
            (100_000, 0.95, (94_864, 95_135)),
        ] {
            assert_eq!(binomial_bounds(n, probability), bounds, "{n} {probability}");
        }
    }

    /// 81 of 263 (Newcombe 1998, table I: 0.2553 to 0.3662), 0 of 20 (0 to 0.1611), 29 of 29 (0.8830 to 1).
    #[test]
    fn exact_wilson_intervals() {
        for (count, n, low, high) in [(81, 263, 0.2553, 0.3662), (0, 20, 0.0, 0.1611), (29, 29, 0.8830, 1.0)]
        {
            let found = wilson_95(count, n);
            assert!(
                (found.0 - low).abs() < 6e-5 && (found.1 - high).abs() < 6e-5,
                "{count} of {n}: {found:?}"
            );
        }
        assert_eq!(wilson_95(0, 0), (0.0, 1.0));
    }
}
