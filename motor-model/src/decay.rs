//! Exponential decay over part of a step, without a transcendental call.
//!
//! ```text
//! exp(-y) = 2^-n exp(-f),   n = round(y / ln 2),   |f| <= ln 2 / 2
//! exp(-f) - 1 = -f (1 - f/2 (1 - f/3 (...)))
//! ```
//!
//! The series is short because `f` is; the power of two is written into the exponent's bits.

use core::f64::consts::{LN_2, LOG2_E};

use crate::math::Real;

/// Constants and bit operations of one precision for the decay over part of a step.
pub trait DecaySeries: Sized + 'static {
    /// `1/K, 1/(K-1), ..., 1/2`: the series in Horner's order, with as many terms as this precision resolves for `|f|
    /// <= ln 2 / 2`.
    const RECIPROCALS: &'static [Self];
    /// `2^-n`, for `n >= 0`; 0 where it would be subnormal.
    fn inverse_power_of_two(n: i32) -> Self;
}

impl DecaySeries for f64 {
    /// First term left out: 0.347^15 / 15! = 1e-19.
    const RECIPROCALS: &'static [Self] = &[
        1.0 / 14.0,
        1.0 / 13.0,
        1.0 / 12.0,
        1.0 / 11.0,
        1.0 / 10.0,
        1.0 / 9.0,
        1.0 / 8.0,
        1.0 / 7.0,
        1.0 / 6.0,
        1.0 / 5.0,
        1.0 / 4.0,
        1.0 / 3.0,
        1.0 / 2.0,
    ];

    #[inline]
    fn inverse_power_of_two(n: i32) -> Self {
        if (0..1023).contains(&n) { Self::from_bits((1023 - u64::from(n.unsigned_abs())) << 52) } else { 0.0 }
    }
}

impl DecaySeries for f32 {
    /// First term left out: 0.347^8 / 8! = 5e-9.
    const RECIPROCALS: &'static [Self] = &[1.0 / 7.0, 1.0 / 6.0, 1.0 / 5.0, 1.0 / 4.0, 1.0 / 3.0, 1.0 / 2.0];

    #[inline]
    fn inverse_power_of_two(n: i32) -> Self {
        if (0..127).contains(&n) { Self::from_bits((127 - n.unsigned_abs()) << 23) } else { 0.0 }
    }
}

/// Below this the series needs only the last [`SHORT`] of its factors: `(1/64)^8 / 8! = 1e-19`.
const SMALL: f64 = 1.0 / 64.0;
/// Factors `1/7, ..., 1/2`.
const SHORT: usize = 6;

/// `1 - y/2 (1 - y/3 (...))` with the factors given, in Horner's order.
#[inline]
fn series<T: Real>(y: T, reciprocals: &[T]) -> T {
    reciprocals.iter().fold(T::one(), |sum, &reciprocal| T::one() - y * reciprocal * sum)
}

/// The factors that `y` needs.
#[inline]
fn factors<T: Real>(y: T) -> &'static [T] {
    let all = T::RECIPROCALS;
    if y < T::from_f64(SMALL) { all.split_at(all.len().saturating_sub(SHORT)).1 } else { all }
}

/// `exp(-y) - 1` for `y >= 0`, without cancellation near zero.
#[inline]
pub fn decay_loss<T: Real>(y: T) -> T {
    if y < T::from_f64(SMALL) {
        return -y * series(y, factors(y));
    }
    // For larger `y` the decay is complete, and `whole` would saturate.
    let y = if y < T::from_f64(1000.0) { y } else { T::from_f64(1000.0) };
    let n = (y * T::from_f64(LOG2_E) + T::from_f64(0.5)).whole();
    let f = y - T::from_i32(n) * T::from_f64(LN_2);
    let power = T::inverse_power_of_two(n);
    power * (-f * series(f, T::RECIPROCALS)) + (power - T::one())
}

/// `(exp(-y) - 1, m1, m2)` for `y >= 0`: the loss of a decay, and the means of the decay and of its integral, as in
/// [`crate::rotor`].
#[inline]
pub fn decay_means<T: Real>(y: T) -> (T, T, T) {
    if y < T::from_f64(0.25) {
        // The same series holds, since y < ln 2 / 2: m2 = 1/2! - y/3! + y^2/4! - ..., then m1 = 1 - y m2 and the
        // loss -y m1: no cancellation anywhere.
        let all_but_half = factors(y).split_last().map_or(T::RECIPROCALS, |(_, rest)| rest);
        let series = series(y, all_but_half);
        let second = series * T::from_f64(0.5);
        let first = T::one() - y * second;
        (-y * first, first, second)
    } else {
        let loss = decay_loss(y);
        let first = -loss / y;
        (loss, first, (T::one() - first) / y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;

    #[test]
    fn tool_decay_loss_agrees_with_libm() {
        for exponent in -120..=40 {
            let y = libm::exp2(f64::from(exponent) / 4.0);
            let expected = math::exp_m1(-y);
            assert!((decay_loss(y) - expected).abs() <= 4e-16 * expected.abs(), "{y}");
            let single = f64::from(decay_loss(y as f32));
            let expected = math::exp_m1(-f64::from(y as f32));
            assert!((single - expected).abs() <= 3e-7 * expected.abs(), "{y}");
        }
    }

    #[test]
    fn exact_ends() {
        assert!(decay_loss(0.0_f64).abs() < 1e-300);
        for y in [800.0, 1e5, 1e9, 3e15, 1e300] {
            assert!((decay_loss(y) + 1.0).abs() < 1e-300);
            assert!((decay_loss(y as f32) + 1.0).abs() < 1e-30);
        }
    }

    #[test]
    fn dual_means_are_those_of_construction() {
        for y in [0.0, 1e-9, 1e-3, 0.249, 0.251, 2.0, 50.0] {
            let (loss, first, second) = decay_means(y);
            assert!((loss - math::exp_m1(-y)).abs() < 1e-15);
            assert!((first - math::decay_mean(y)).abs() < 2e-15, "{y}");
            assert!((second - math::decay_second_mean(y)).abs() < 2e-15, "{y}");
        }
    }
}
