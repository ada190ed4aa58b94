//! Quantiles of the distributions that the tests of commissioning need, by closed approximations.
//!
//! Sources: Abramowitz and Stegun, "Handbook of Mathematical Functions", 26.2.23 (normal, to 4.5e-4), 26.7.5 (Student),
//! 26.4.17 (chi-square, Wilson and Hilferty). The libraries that have these compute in `f64` for many instructions, and
//! panic at a probability out of range, which a step must not.

use motor_model::math;

/// The value that a standard normal variable exceeds with probability `outside`, 0 to 1.
pub(super) fn normal(outside: f32) -> f32 {
    if outside > 0.5 {
        return -normal(1.0 - outside);
    }
    let t = math::sqrt_f32(-2.0 * ln(outside.max(1e-30)));
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let below = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    t - above / below
}

/// The value that Student's t of `freedom` degrees of freedom exceeds with probability `outside`: to 1.5 % for a
/// `freedom` of 7.5 or more, that of one run, and an `outside` of 1e-4 or more, and too small by a tenth for 4.
pub(super) fn student(freedom: f32, outside: f32) -> f32 {
    let z = normal(outside);
    let z2 = z * z;
    let first = z * (z2 + 1.0) / 4.0;
    let second = z * (z2 * (5.0 * z2 + 16.0) + 3.0) / 96.0;
    let third = z * (z2 * (z2 * (3.0 * z2 + 19.0) + 17.0) - 15.0) / 384.0;
    z + (first + (second + third / freedom) / freedom) / freedom
}

/// The value that chi-square of `freedom` degrees of freedom exceeds with probability `outside`: to 3.5 % in the middle
/// and above it. A lower limit is too small, by a quarter for two degrees of freedom and wholly for one.
pub(super) fn chi_square(freedom: f32, outside: f32) -> f32 {
    let part = 2.0 / (9.0 * freedom);
    let root = 1.0 - part + normal(outside) * math::sqrt_f32(part);
    freedom * (root * root * root).max(0.0)
}

/// Probability that at least `least` of `n` trials succeed, each with `probability`.
pub(super) fn binomial_tail(n: u16, least: u16, probability: f64) -> f64 {
    let failure = 1.0 - probability;
    let mut term = math::exp(f64::from(n) * math::ln(failure));
    let mut below = 0.0;
    for count in 0..least.min(n) {
        below += term;
        term *= f64::from(n - count) / f64::from(count + 1) * probability / failure;
    }
    if least > n { 0.0 } else { (1.0 - below).max(0.0) }
}

#[expect(clippy::cast_possible_truncation, reason = "a quantile needs no more than single precision")]
pub(super) fn ln(x: f32) -> f32 {
    math::ln(f64::from(x)) as f32
}

#[cfg(test)]
mod tests {
    use statrs::distribution::{
        Binomial, ChiSquared, ContinuousCDF as _, DiscreteCDF as _, Normal, StudentsT,
    };

    use super::*;

    /// Beside another library's, where they are used: errors of 4.5e-4 of the normal quantile, which others inherit,
    /// and those that the functions state.
    #[test]
    fn dual_quantiles_are_those_of_another_library() {
        let unit = Normal::new(0.0, 1.0).unwrap();
        for outside in [1e-5, 1e-4, 1e-3, 0.01, 0.05, 0.3, 0.5, 0.7, 0.95, 0.999_f32] {
            let exact = unit.inverse_cdf(1.0 - f64::from(outside));
            assert!((f64::from(normal(outside)) - exact).abs() < 5e-4, "{outside}");
        }
        for freedom in [7.5, 11.5, 20.0, 100.0_f32] {
            let law = StudentsT::new(0.0, 1.0, freedom.into()).unwrap();
            for outside in [1e-4, 1.4e-4, 1e-3, 0.025_f32] {
                let ratio = f64::from(student(freedom, outside)) / law.inverse_cdf(1.0 - f64::from(outside));
                assert!((0.985..1.002).contains(&ratio), "{freedom} {outside}: {ratio}");
            }
        }
        for freedom in [1.0, 2.0, 3.0, 5.0, 10.0, 40.0_f32] {
            let law = ChiSquared::new(freedom.into()).unwrap();
            for outside in [0.001, 0.01, 0.05, 0.5_f32] {
                let ratio =
                    f64::from(chi_square(freedom, outside)) / law.inverse_cdf(1.0 - f64::from(outside));
                assert!((0.965..1.035).contains(&ratio), "{freedom} {outside}: {ratio}");
            }
            // A lower limit that is too small shrinks a spread by less.
            assert!(f64::from(chi_square(freedom, 0.95)) <= 1.002 * law.inverse_cdf(0.05), "{freedom}");
        }
        for (n, least, probability) in [(4, 2, 0.02), (8, 1, 0.02), (16, 5, 0.02), (40, 3, 0.3)] {
            let above = Binomial::new(probability, n.into()).unwrap().sf(u64::from(least) - 1);
            assert!((binomial_tail(n, least, probability) - above).abs() < 1e-9, "{n} {least}");
        }
    }

    /// Tables 26.1, 26.10 and 26.8 of Abramowitz and Stegun; the approximations are within 4.5e-4, 2 % and 1 %.
    #[test]
    fn exact_tabled_quantiles() {
        for (outside, z) in
            [(0.5, 0.0), (0.025, 1.95996), (0.001, 3.09023), (1e-5, 4.26489), (0.975, -1.95996)]
        {
            assert!((normal(outside) - z).abs() < 5e-4, "{outside}");
        }
        for (freedom, outside, t) in [(5.0, 0.025, 2.571), (5.0, 0.005, 4.032), (20.0, 0.001, 3.552)] {
            assert!((student(freedom, outside) / t - 1.0).abs() < 0.02, "{freedom} {outside}");
        }
        for (freedom, outside, x) in [(2.0, 0.01, 9.210), (10.0, 0.95, 3.940), (10.0, 0.01, 23.209)] {
            assert!((chi_square(freedom, outside) / x - 1.0).abs() < 0.01, "{freedom} {outside}");
        }
    }

    /// Sums written out: of three coins, and of ten dice.
    #[test]
    fn exact_binomial_tails() {
        for (n, least, probability, tail) in [
            (3, 2, 0.5, 0.5),
            (3, 0, 0.5, 1.0),
            (3, 4, 0.5, 0.0),
            (10, 1, 1.0 / 6.0, 1.0 - (5.0_f64 / 6.0).powi(10)),
        ] {
            assert!((binomial_tail(n, least, probability) - tail).abs() < 1e-12, "{n} {least}");
        }
    }
}
