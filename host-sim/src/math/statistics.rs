//! Mean and spread, in one pass and constant memory.

use average::{Estimate, Variance};
use motor_model::math;
use serde::Serialize;

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

/// Two-sided 95 % bounds of the mean of `n` independent squares of standard normals, `chi^2_n / n`; `n` at least 1.
///
/// By Wilson and Hilferty (1931, PNAS 17, 684): the cube root of `chi^2_n / n` is nearly normal with mean `1 - 2 / (9 n)` and variance `2 / (9 n)`.
/// Within 1 % at `n = 10`, 0.2 % from `n = 20` on.
pub fn chi_square_mean_bounds(n: f64) -> (f64, f64) {
    const TWO_SIDED_95: f64 = 1.959_964;
    let variance = 2.0 / (9.0 * n);
    let bound = |normal: f64| {
        let root = (1.0 - variance + normal * math::sqrt(variance)).max(0.0);
        root * root * root
    };
    (bound(-TWO_SIDED_95), bound(TWO_SIDED_95))
}

/// Two-sided 95 % quantile of Student's t for so many degrees of freedom, at least 1: Fisher's expansion about the normal one, from three on within 1 %; exact below.
pub fn student_95(degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom < 1.5 {
        return 12.706_2;
    }
    if degrees_of_freedom < 2.5 {
        return 4.302_7;
    }
    let x = 1.0 / degrees_of_freedom;
    1.959_964 + x * (2.372_3 + x * (2.822_5 + x * 2.555_9))
}

/// Two-sided 95 % bounds of how many of `n` independent trials succeed with `probability` each, within 0 to 1: at most 2.5 % of all sets lie below, and 2.5 % above.
///
/// Probabilities follow from their ratios to the most likely count's, so that none of importance vanishes.
pub fn binomial_bounds(n: u32, probability: f64) -> (u32, u32) {
    let odds = probability / (1.0 - probability);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most n")]
    let likeliest = (f64::from(n) * probability) as u32;
    // P(k + 1) / P(k)
    let ratio = |k: u32| f64::from(n - k) / f64::from(k + 1) * odds;
    let upward = (likeliest..n).scan(1.0, |weight, k| {
        *weight *= ratio(k);
        Some(*weight)
    });
    let downward = (0..likeliest).rev().scan(1.0, |weight, k| {
        *weight /= ratio(k);
        Some(*weight)
    });
    let mut weights: Vec<f64> = downward.collect();
    weights.reverse();
    weights.push(1.0);
    weights.extend(upward);
    let total: f64 = weights.iter().sum();
    let count_reaching = |part: f64| {
        let mut sum = 0.0;
        let below = weights.iter().take_while(|weight| {
            sum += **weight / total;
            sum < part
        });
        u32::try_from(below.count()).map_or(n, |below| below.min(n))
    };
    (count_reaching(0.025), count_reaching(0.975))
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

    /// Large offset, small spread: the sum of squares would lose every digit.
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

    /// Quantiles 0.025 and 0.975 of chi-square as tables print them (NIST/SEMATECH e-Handbook, 1.3.6.7.4).
    #[test]
    fn exact_chi_square_bounds() {
        for (n, low, high, within) in
            [(10.0, 3.247, 20.483, 1e-2), (20.0, 9.591, 34.170, 2e-3), (100.0, 74.222, 129.561, 2e-3)]
        {
            let bounds = chi_square_mean_bounds(n);
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

    /// 2.5 % and 97.5 % quantiles of binomial distributions, as R's `qbinom` gives them; a fair coin thrown thrice by hand.
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
}
