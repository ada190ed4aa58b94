//! Phase of the drive as an integer, and its sine and cosine without a transcendental call.
//!
//! A [`Phase`] counts 2^-64 of a turn and wraps by itself, so nothing is lost over any number of steps, in any
//! precision. Its sine and cosine come from 64 roots of unity computed at compile time and a short rotation:
//!
//! ```text
//! exp(i (c + d)) = exp(i c) (cos d + i sin d),   c = the nearest of 64 roots,  |d| <= pi / 64
//! cos d = 1 - d^2/2 + d^4/24 - d^6/720 + ...     first term left out: d^8 / 40320  < 8.4e-16
//! sin d = d - d^3/6 + d^5/120 - d^7/5040 + ...   first term left out: d^9 / 362880 < 4.6e-18
//! ```

use core::f64::consts::TAU;

use crate::math::Real;

/// Roots of unity in the table.
const ROOTS: usize = 64;
/// Bits of a phase below the table's index.
const FRACTION_BITS: u32 = 64 - ROOTS.trailing_zeros();

/// A phase in units of 2^-64 turn; sums wrap at a full turn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Phase(u64);

impl Phase {
    /// Phase zero.
    pub const ZERO: Self = Self(0);

    /// The phase of `turns` turns, whole turns dropped. Meant for construction; NaN gives zero.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the fraction is in 0..1")]
    pub fn from_turns(turns: f64) -> Self {
        const TWO_POW_64: f64 = 18_446_744_073_709_551_616.0;
        let fraction = turns - libm::floor(turns);
        Self((fraction * TWO_POW_64) as u64)
    }

    /// From units of 2^-64 turn.
    pub const fn from_units(units: u64) -> Self {
        Self(units)
    }

    /// In units of 2^-64 turn.
    pub const fn units(self) -> u64 {
        self.0
    }

    /// This phase advanced by `increment`, modulo a turn.
    #[inline]
    #[must_use]
    pub const fn advanced(self, increment: Self) -> Self {
        Self(self.0.wrapping_add(increment.0))
    }

    /// Half of this phase, taken as lying in `-1/2..1/2` turn.
    #[inline]
    #[must_use]
    pub const fn halved(self) -> Self {
        Self((self.0.cast_signed() >> 1).cast_unsigned())
    }

    /// Sine and cosine: a table look-up and a polynomial; no division, no branch, no call.
    ///
    /// The error is below 2e-15 in `f64` and 2e-7 in `f32`.
    #[inline]
    pub fn sin_cos<T: Real>(self) -> (T, T) {
        // Half a cell is added so that the remainder is centred on its root.
        let centred = self.0.wrapping_add(1 << (FRACTION_BITS - 1));
        let index = (centred >> FRACTION_BITS) as usize;
        #[expect(clippy::indexing_slicing, reason = "six bits index 64 roots; the compiler drops the check")]
        let (root_sin, root_cos) = T::ROOTS_OF_UNITY[index];
        // Shifting the index out leaves the remainder, signed, in units of 2^-64 cell.
        let (sin, cos) = T::short_arc((self.0 << ROOTS.trailing_zeros()).cast_signed());
        (root_sin * cos + root_cos * sin, root_cos * cos - root_sin * sin)
    }
}

/// Sine and cosine of `turns`, of magnitude up to 1000, for part of a step: like [`Phase::sin_cos`] for a phase
/// in floating point.
#[inline]
pub(crate) fn sin_cos_of_turns<T: Real>(turns: T) -> (T, T) {
    const PER_TURN: f64 = 64.0;
    let (index, remainder) = (turns * T::from_f64(PER_TURN)).nearest_root();
    #[expect(clippy::indexing_slicing, reason = "six bits index 64 roots; the compiler drops the check")]
    let (root_sin, root_cos) = T::ROOTS_OF_UNITY[index % ROOTS];
    let (sin, cos) = T::arc(remainder * T::from_f64(TAU / PER_TURN));
    (root_sin * cos + root_cos * sin, root_cos * cos - root_sin * sin)
}

/// Table and polynomial of one precision for [`Phase::sin_cos`].
pub trait PhaseTable: Sized + 'static {
    /// Sine and cosine of `k / 64` turn.
    const ROOTS_OF_UNITY: &'static [(Self, Self); ROOTS];
    /// Sine and cosine of `remainder` in units of 2^-70 turn, that is of at most `pi / 64`.
    fn short_arc(remainder: i64) -> (Self, Self);
    /// Sine and cosine of `d`, at most `pi / 64` in magnitude.
    fn arc(d: Self) -> (Self, Self);
    /// For a value in units of 1/64 turn, of magnitude up to 64,000: the number of the nearest root, modulo 64 in its
    /// lowest six bits, and the signed remainder.
    fn nearest_root(self) -> (usize, Self);
}

impl PhaseTable for f64 {
    const ROOTS_OF_UNITY: &'static [(Self, Self); ROOTS] = &roots_of_unity();

    #[inline]
    fn short_arc(remainder: i64) -> (Self, Self) {
        /// 2 pi 2^-70
        const RADIANS: f64 = TAU / (64.0 * 18_446_744_073_709_551_616.0);
        #[expect(clippy::cast_precision_loss, reason = "rounding to the nearest f64 is wanted")]
        let d = remainder as f64 * RADIANS;
        Self::arc(d)
    }

    #[inline]
    fn arc(d: Self) -> (Self, Self) {
        let d2 = d * d;
        let sin = d - d * d2 * (1.0 / 6.0 - d2 * (1.0 / 120.0 - d2 * (1.0 / 5040.0)));
        let cos = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0 - d2 * (1.0 / 720.0)));
        (sin, cos)
    }

    /// Adding 1.5 x 2^52 leaves the nearest whole number in the low bits of the sum.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "the low bits are wanted")]
    fn nearest_root(self) -> (usize, Self) {
        const SHIFT: f64 = 1.5 * 4_503_599_627_370_496.0;
        let shifted = self + SHIFT;
        (shifted.to_bits() as usize, self - (shifted - SHIFT))
    }
}

impl PhaseTable for f32 {
    const ROOTS_OF_UNITY: &'static [(Self, Self); ROOTS] = &roots_of_unity_f32();

    /// The upper half of the remainder and two terms fewer are enough: d^5 / 120 < 2.4e-9, d^6 / 720 < 2e-11.
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_precision_loss, reason = "f32 holds 24 bits")]
    fn short_arc(remainder: i64) -> (Self, Self) {
        /// 2 pi 2^-38
        const RADIANS: f32 = (TAU / (64.0 * 4_294_967_296.0)) as f32;
        let d = (remainder >> 32) as i32 as f32 * RADIANS;
        Self::arc(d)
    }

    #[inline]
    fn arc(d: Self) -> (Self, Self) {
        let d2 = d * d;
        let sin = d - d * d2 * (1.0 / 6.0);
        let cos = 1.0 - d2 * (0.5 - d2 * (1.0 / 24.0));
        (sin, cos)
    }

    /// The same with 1.5 x 2^23.
    #[inline]
    fn nearest_root(self) -> (usize, Self) {
        const SHIFT: f32 = 1.5 * 8_388_608.0;
        let shifted = self + SHIFT;
        (shifted.to_bits() as usize, self - (shifted - SHIFT))
    }
}

#[expect(clippy::indexing_slicing, reason = "evaluated by the compiler")]
const fn roots_of_unity() -> [(f64, f64); ROOTS] {
    let mut roots = [(0.0, 1.0); ROOTS];
    let eighth = ROOTS / 8;
    let mut k = 0;
    while k < ROOTS {
        // Fold into the first octant, where the series is shortest and symmetric roots get equal values.
        let in_quadrant = k % (2 * eighth);
        let (sin, cos) = if in_quadrant <= eighth {
            sin_cos_series(in_quadrant)
        } else {
            let (sin, cos) = sin_cos_series(2 * eighth - in_quadrant);
            (cos, sin)
        };
        roots[k] = match k / (2 * eighth) {
            0 => (sin, cos),
            1 => (cos, -sin),
            2 => (-sin, -cos),
            _ => (-cos, sin),
        };
        k += 1;
    }
    roots
}

#[expect(clippy::cast_possible_truncation, reason = "the f32 table is the f64 table, rounded")]
#[expect(clippy::indexing_slicing, reason = "evaluated by the compiler")]
const fn roots_of_unity_f32() -> [(f32, f32); ROOTS] {
    let exact = roots_of_unity();
    let mut roots = [(0.0, 1.0); ROOTS];
    let mut k = 0;
    while k < ROOTS {
        roots[k] = (exact[k].0 as f32, exact[k].1 as f32);
        k += 1;
    }
    roots
}

/// Taylor series at `k / 64` turn, `k <= 8`: the last term is below 1e-21.
#[expect(clippy::cast_precision_loss, reason = "k is at most 8")]
const fn sin_cos_series(k: usize) -> (f64, f64) {
    let x = TAU * k as f64 / ROOTS as f64;
    let (mut sin, mut cos) = (0.0, 0.0);
    let mut n = 21;
    // Smallest terms first: sum of (-1)^j x^n / n! in Horner form.
    while n > 0 {
        sin = 1.0 - x * x / ((2 * n) * (2 * n + 1)) as f64 * sin;
        cos = 1.0 - x * x / ((2 * n - 1) * (2 * n)) as f64 * cos;
        n -= 1;
    }
    (x * sin, cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math;

    fn worst_errors() -> (f64, f64) {
        let mut worst = (0.0_f64, 0.0_f64);
        let mut phase = Phase::ZERO;
        // An odd increment near the golden section visits every cell at many remainders.
        for _ in 0..200_000 {
            phase = phase.advanced(Phase::from_units(0x9E37_79B9_7F4A_7C15));
            #[expect(clippy::cast_precision_loss, reason = "rounds to 53 bits: 1e-16 of a turn")]
            let turns = phase.units() as f64 / 18_446_744_073_709_551_616.0;
            let (sin, cos) = math::sin_cos(TAU * turns);
            let (sin64, cos64) = phase.sin_cos::<f64>();
            let (sin32, cos32) = phase.sin_cos::<f32>();
            worst.0 = worst.0.max((sin64 - sin).abs()).max((cos64 - cos).abs());
            worst.1 = worst.1.max((f64::from(sin32) - sin).abs()).max((f64::from(cos32) - cos).abs());
        }
        worst
    }

    #[test]
    fn tool_sine_and_cosine_agree_with_libm_to_the_stated_errors() {
        let (f64_error, f32_error) = worst_errors();
        assert!(f64_error < 2e-15, "{f64_error:e}");
        assert!(f32_error < 2e-7, "{f32_error:e}");
    }

    #[test]
    fn tool_sine_and_cosine_of_turns_agree_with_libm() {
        for index in -20_000..20_000 {
            let turns = f64::from(index) * 0.000_618_034;
            let (sin, cos) = math::sin_cos(TAU * turns);
            let (sin64, cos64) = sin_cos_of_turns(turns);
            // An f64 of 12 turns is good to 1e-14 rad, an f32 to 3e-6.
            assert!((sin64 - sin).abs().max((cos64 - cos).abs()) < 2e-14, "{turns}");
            let (sin32, cos32) = sin_cos_of_turns(turns as f32);
            let error = (f64::from(sin32) - sin).abs().max((f64::from(cos32) - cos).abs());
            assert!(error < 2e-7 + 4e-7 * turns.abs(), "{turns} {error:e}");
        }
    }

    #[test]
    fn exact_quarter_turns() {
        for (quarter, expected) in [(0, (0.0, 1.0)), (1, (1.0, 0.0)), (2, (0.0, -1.0)), (3, (-1.0, 0.0))] {
            let (sin, cos) = Phase::from_units(quarter << 62).sin_cos::<f64>();
            assert!((sin - expected.0).abs() < 1e-16 && (cos - expected.1).abs() < 1e-16);
        }
    }

    /// 6.3 kHz at 1 us for 10^9 steps: the phase is the exact product, modulo a turn, of integers.
    #[test]
    fn exact_phase_after_a_billion_steps() {
        let increment = Phase::from_turns(6300.0 * 1e-6);
        let total = u128::from(increment.units()) * 1_000_000_000;
        #[expect(clippy::cast_possible_truncation, reason = "modulo a turn")]
        let expected = total as u64;
        let mut phase = Phase::ZERO;
        for _ in 0..1_000_000 {
            phase = phase.advanced(increment);
        }
        assert_eq!(phase.units().wrapping_mul(1000), expected);
        // The increment itself is within 2^-64 turn of 6300 x 1e-6, so after 10^9 steps the phase is within 1e-9 turn.
        #[expect(clippy::cast_precision_loss, reason = "a fraction of a turn")]
        let turns = expected as f64 / 18_446_744_073_709_551_616.0;
        assert!(turns.min(1.0 - turns) < 1e-3);
    }

    #[test]
    fn exact_from_turns_drops_whole_turns_and_survives_nan() {
        assert_eq!(Phase::from_turns(3.25).units(), 1 << 62);
        assert_eq!(Phase::from_turns(-0.25).units(), 3 << 62);
        assert_eq!(Phase::from_turns(f64::NAN).units(), 0);
        assert_eq!(Phase::from_turns(-0.25).halved().units(), 7 << 61);
    }
}
