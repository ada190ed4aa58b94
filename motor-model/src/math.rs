//! The only place that calls transcendental functions, and the scalar type of the model.
//!
//! `libm` is called directly, on the host as on the microcontroller, so that both get the same bits whatever
//! features another crate in the same build turns on. The functions of `f64` serve *construction* only: a step of
//! the model calls none of them.

use core::fmt::{Debug, Display};
use core::ops::Neg;

use crate::decay::DecaySeries;
use crate::phase::PhaseTable;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// The scalar of a model: `f32` on the microcontroller, `f64` for the plant and as the reference.
///
/// The bounds are those that `nalgebra` needs for sums and products of fixed-size vectors. It has no `sin` or `exp`, so
/// that a step of the model cannot call them. Its square root is rounded correctly, so it has the same bits everywhere.
pub trait Real:
    sealed::Sealed
    + PhaseTable
    + DecaySeries
    + nalgebra::Scalar
    + num_traits::NumAssign
    + num_traits::Bounded
    + From<f32>
    + Neg<Output = Self>
    + Copy
    + Default
    + PartialOrd
    + Debug
    + Display
{
    /// The largest finite value.
    const MAX: Self;
    /// Rounds `x` to this precision.
    fn from_f64(x: f64) -> Self;
    /// Rounds `x` to this precision.
    fn from_f32(x: f32) -> Self;
    /// The nearest representable value of an integer.
    fn from_i32(x: i32) -> Self;
    /// The nearest representable value of an integer.
    fn from_i64(x: i64) -> Self;
    /// The nearest representable value of an integer.
    fn from_u64(x: u64) -> Self;
    /// The same value in `f64`, exactly.
    fn to_f64(self) -> f64;
    /// The value rounded to `f32`.
    fn to_f32(self) -> f32;
    /// The whole part, rounded towards zero; saturates at the ends of `i32`, and NaN gives 0.
    fn whole(self) -> i32;
    /// A whole number near the value, and the remainder, of magnitude at most 1: their sum is the value, exactly.
    ///
    /// Beyond +-2^31 the whole number saturates and the remainder is large; NaN stays in the remainder.
    #[inline]
    #[must_use]
    fn split(self) -> (i32, Self) {
        let whole = self.whole();
        (whole, self - Self::from_i32(whole))
    }
    /// The bit pattern, widened to 64 bits (for digests).
    fn bits(self) -> u64;
    /// Magnitude.
    #[must_use]
    fn abs(self) -> Self;
    /// Square root, correctly rounded; NaN below zero.
    #[must_use]
    fn sqrt(self) -> Self;
    /// The smaller of `self` and `most`; `most`, if one of them is NaN.
    #[must_use]
    #[inline]
    fn at_most(self, most: Self) -> Self {
        if self < most { self } else { most }
    }
    /// The larger of `self` and `least`; `least`, if one of them is NaN.
    #[must_use]
    #[inline]
    fn at_least(self, least: Self) -> Self {
        if self > least { self } else { least }
    }
    /// `self` limited to `-limit..=limit`; `limit` is not negative.
    #[must_use]
    #[inline]
    fn clamp_magnitude(self, limit: Self) -> Self {
        if self > limit {
            limit
        } else if self < -limit {
            -limit
        } else {
            self
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "rounding is what these say"
)]
impl Real for f32 {
    const MAX: Self = Self::MAX;
    #[inline]
    fn from_f64(x: f64) -> Self {
        x as f32
    }
    #[inline]
    fn from_f32(x: f32) -> Self {
        x
    }
    #[inline]
    fn from_i32(x: i32) -> Self {
        x as f32
    }
    /// Through `i32` where it fits, which is one instruction where the processor has no 64-bit conversion. Both round
    /// to nearest: the same bits.
    #[inline]
    fn from_i64(x: i64) -> Self {
        // Not inlined: otherwise the compiler converts in both ways and then selects.
        #[cold]
        #[inline(never)]
        fn large(x: i64) -> f32 {
            x as f32
        }
        i32::try_from(x).map_or_else(|_| large(x), |small| small as f32)
    }
    /// As [`Self::from_i64`], through `i32` where it fits.
    #[inline]
    fn from_u64(x: u64) -> Self {
        #[cold]
        #[inline(never)]
        fn large(x: u64) -> f32 {
            x as f32
        }
        i32::try_from(x).map_or_else(|_| large(x), |small| small as f32)
    }
    #[inline]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn to_f32(self) -> f32 {
        self
    }
    #[inline]
    fn whole(self) -> i32 {
        self as i32
    }
    #[inline]
    fn bits(self) -> u64 {
        u64::from(self.to_bits())
    }
    #[inline]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_precision_loss,
    reason = "rounding is what these say"
)]
impl Real for f64 {
    const MAX: Self = Self::MAX;
    #[inline]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline]
    fn from_f32(x: f32) -> Self {
        f64::from(x)
    }
    #[inline]
    fn from_i32(x: i32) -> Self {
        f64::from(x)
    }
    #[inline]
    fn from_i64(x: i64) -> Self {
        x as f64
    }
    #[inline]
    fn from_u64(x: u64) -> Self {
        x as f64
    }
    #[inline]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline]
    fn to_f32(self) -> f32 {
        self as f32
    }
    #[inline]
    fn whole(self) -> i32 {
        self as i32
    }
    /// Adding 1.5 x 2^52 leaves the nearest whole number in the low bits of the sum. This needs no conversion and
    /// takes a third of the time.
    #[inline]
    fn split(self) -> (i32, Self) {
        const SHIFT: f64 = 1.5 * 4_503_599_627_370_496.0;
        let shifted = self.clamp(f64::from(i32::MIN), f64::from(i32::MAX)) + SHIFT;
        (shifted.to_bits() as i32, self - (shifted - SHIFT))
    }
    #[inline]
    fn bits(self) -> u64 {
        self.to_bits()
    }
    #[inline]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }
}

/// Sine and cosine of `x` radians.
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// Angle of the point (`x`, `y`) in rad, counter-clockwise from the x axis, within half a turn.
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// `exp(x)`.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Natural logarithm.
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `exp(x) - 1`, without cancellation near zero.
pub fn exp_m1(x: f64) -> f64 {
    libm::expm1(x)
}

/// Square root.
pub fn sqrt(x: f64) -> f64 {
    libm::sqrt(x)
}

/// Square root in single precision, for the loop on a microcontroller.
#[inline]
pub fn sqrt_f32(x: f32) -> f32 {
    libm::sqrtf(x)
}

/// `exp(x)` in single precision, for the loop on a microcontroller.
pub fn exp_f32(x: f32) -> f32 {
    libm::expf(x)
}

/// Sine of `x` radians in single precision, for the loop on a microcontroller.
#[inline]
pub fn sin_f32(x: f32) -> f32 {
    libm::sinf(x)
}

/// `(1 - exp(-x)) / x`, which is 1 at `x = 0`: the mean over a step of a decay that starts at 1.
///
/// Smooth through zero and without overflow for large `x >= 0`.
pub fn decay_mean(x: f64) -> f64 {
    if x.abs() < 1e-300 { 1.0 } else { -exp_m1(-x) / x }
}

/// `(x - 1 + exp(-x)) / x^2`, which is 1/2 at `x = 0`: the mean over a step, per unit step, of the integral of
/// [`decay_mean`]'s decay.
///
/// Below `x = 0.5` the Taylor series `1/2! - x/3! + x^2/4! - ...` replaces the formula, whose numerator cancels.
pub fn decay_second_mean(x: f64) -> f64 {
    if x.abs() >= 0.5 {
        return (x + exp_m1(-x)) / (x * x);
    }
    // The first term left out is 0.5^16 / 18! = 2e-21.
    let mut sum = 0.0;
    let mut term = 0.5;
    for k in 3..19_u8 {
        sum += term;
        term *= -x / f64::from(k);
    }
    sum
}

/// `(x - 2 (1 - exp(-x)) + (1 - exp(-2x)) / 2) / x^3`, which is 1/3 at `x = 0`: the mean over a step, per square of
/// the step, of the square of the integral of [`decay_mean`]'s decay.
///
/// Below `x = 0.5` the Taylor series `sum over n >= 3 of (2^(n-1) - 2) (-x)^(n-3) / n!` replaces the formula, whose
/// numerator cancels.
pub fn decay_square_mean(x: f64) -> f64 {
    if x.abs() >= 0.5 {
        // With u = 1 - exp(-x) the numerator is x - u - u^2 / 2.
        let first = decay_mean(x);
        return (decay_second_mean(x) - 0.5 * first * first) / x;
    }
    // Terms 2^(n-1) (-x)^(n-3) / n! and 2 (-x)^(n-3) / n!; the first left out is 2^18 0.5^16 / 19! = 3e-17.
    let mut sum = 0.0;
    let (mut double, mut single) = (4.0 / 6.0, 2.0 / 6.0);
    for n in 4..20_u8 {
        sum += double - single;
        double *= -2.0 * x / f64::from(n);
        single *= -x / f64::from(n);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The decay means against their integrals by composite Simpson, across the change of formula.
    #[test]
    fn dual_decay_means_are_the_integrals_they_name() {
        for x in [0.0, 1e-12, 1e-3, 0.4, 0.499_999, 0.5, 0.6, 3.0, 40.0] {
            let n = 4000_u32;
            let mut first = 0.0;
            let mut second = 0.0;
            let mut square = 0.0;
            for i in 0..=n {
                let t = f64::from(i) / f64::from(n);
                let weight = if i == 0 || i == n {
                    1.0
                } else if i % 2 == 1 {
                    4.0
                } else {
                    2.0
                };
                first += weight * exp(-x * t);
                // integral from 0 to 1 of (1 - t) exp(-x t) is the second mean
                second += weight * (1.0 - t) * exp(-x * t);
                square += weight * t * t * decay_mean(x * t) * decay_mean(x * t);
            }
            let simpson = 3.0 * f64::from(n);
            assert!((decay_mean(x) - first / simpson).abs() < 1e-9, "{x}");
            assert!((decay_second_mean(x) - second / simpson).abs() < 1e-9, "{x}");
            assert!((decay_square_mean(x) - square / simpson).abs() < 1e-9, "{x}");
        }
    }

    #[test]
    fn law_decay_means_stay_finite_for_huge_damping() {
        assert!((decay_mean(1e8) - 1e-8).abs() < 1e-20);
        assert!((decay_second_mean(1e8) - 1e-8).abs() < 1e-15);
        assert!((decay_square_mean(1e8) - 1e-16).abs() < 1e-23);
    }

    /// Series and formula of the square's mean at the same place, to rounding: the formula's numerator cancels to
    /// 1/12 there.
    #[test]
    fn dual_square_mean_is_continuous_where_the_formula_changes() {
        let (below, above) = (decay_square_mean(0.5 - 1e-15), decay_square_mean(0.5));
        assert!((below - above).abs() < 1e-14, "{below} {above}");
        assert!((decay_square_mean(0.0) - 1.0 / 3.0).abs() < 1e-16);
    }

    #[test]
    fn exact_whole_truncates_saturates_and_swallows_nan() {
        assert_eq!(1.9_f32.whole(), 1);
        assert_eq!((-1.9_f64).whole(), -1);
        assert_eq!(1e30_f32.whole(), i32::MAX);
        assert_eq!(f64::NAN.whole(), 0);
    }
}
