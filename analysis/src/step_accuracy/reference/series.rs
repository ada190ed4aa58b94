//! Truncated power series in time, and the first instant at which one falls through zero.
//!
//! A quantity over a step of length `h` is `x(t) = sum c_k tau^k`, `tau = t / h` in 0..1, `k` up to [`ORDER`].
//!
//! No root can be missed. On `0..w` the polynomial is a mean of its Bernstein coefficients with non-negative weights:
//!
//! ```text
//! b_j = sum_{i <= j} (C(j, i) / C(n, i)) c_i w^i
//! ```
//!
//! Where no `b_j` is negative, the polynomial is not negative either. Where the signs of `b_j` change once, it has
//! exactly one root (Descartes). In all other cases the interval is halved (de Casteljau), which only takes means. The
//! weights of the sum above are within 0..1 as well, so the `b_j` have no more rounding than the `c_i`. A double root
//! that does not go below zero, a grazing contact, is no contact. One that goes below zero is found if it does so by
//! more than the rounding of the series, 16 units in the last place of its largest term.

/// Highest power. For steps with `rate h <= 1` the terms left out are below `1 / 21! = 2e-20` of the first.
pub const ORDER: usize = 20;

/// Largest number of halvings in the search for a root: `2^-60` of a 20 us step is 2e-23 s.
const HALVINGS_MAX: u32 = 60;

/// Number of coefficients.
const COUNT: usize = ORDER + 1;

/// A polynomial in the fraction of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Series(pub [f64; COUNT]);

impl Series {
    /// Zero.
    pub const ZERO: Self = Self([0.0; COUNT]);

    /// Value at `tau`.
    pub fn at(&self, tau: f64) -> f64 {
        self.0.iter().rev().fold(0.0, |sum, c| sum * tau + c)
    }

    /// Derivative by `tau`, at `tau`.
    fn slope_at(&self, tau: f64) -> f64 {
        self.derivative().at(tau)
    }

    /// Derivative by `tau`.
    #[must_use]
    pub fn derivative(&self) -> Self {
        let mut derivative = Self::ZERO;
        let mut power = 0.0;
        for (d, c) in derivative.0.iter_mut().zip(&self.0[1..]) {
            power += 1.0;
            *d = power * c;
        }
        derivative
    }

    /// Integral from 0 to `tau`.
    pub fn integral_to(&self, tau: f64) -> f64 {
        let mut power = ORDER_F64 + 1.0;
        let mut sum = 0.0;
        for c in self.0.iter().rev() {
            sum = sum * tau + c / power;
            power -= 1.0;
        }
        sum * tau
    }

    /// The same polynomial about `origin`.
    #[must_use]
    pub fn about(&self, origin: f64) -> Self {
        let mut shifted = *self;
        if origin != 0.0 {
            for lowest in 0..ORDER {
                for k in (lowest..ORDER).rev() {
                    shifted.0[k] += origin * shifted.0[k + 1];
                }
            }
        }
        shifted
    }

    /// Divided by `tau^multiplicity`, for a quantity that is known to start with a root. Its low coefficients are only
    /// rounding.
    #[must_use]
    pub fn without_root_at_start(&self, multiplicity: usize) -> Self {
        let mut rest = Self::ZERO;
        for (r, c) in rest.0.iter_mut().zip(self.0.iter().skip(multiplicity)) {
            *r = *c;
        }
        rest
    }

    /// `self + factor other`.
    #[must_use]
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let mut sum = *self;
        for (s, o) in sum.0.iter_mut().zip(&other.0) {
            *s += factor * o;
        }
        sum
    }

    /// `factor self`.
    #[must_use]
    pub fn times(&self, factor: f64) -> Self {
        Self(self.0.map(|c| factor * c))
    }

    /// Bound of the magnitude on 0..=1.
    pub fn bound(&self) -> f64 {
        self.0.iter().map(|c| c.abs()).sum()
    }

    /// The first `tau` in `0..=width` at which the polynomial goes from positive to negative; 0 if it starts negative.
    pub fn first_descent(&self, width: f64) -> Option<f64> {
        let mut scaled = self.0;
        let mut power = 1.0;
        for c in &mut scaled {
            *c *= power;
            power *= width;
        }
        let rest: f64 = scaled[1..].iter().map(|c| c.abs()).sum();
        if scaled[0] >= rest {
            return None;
        }
        // A value that is no number is an event at once, each time. The caller then reports a stall.
        if scaled[0] < 0.0 || !(scaled[0] + rest).is_finite() {
            return Some(0.0);
        }
        let rounding = 16.0 * f64::EPSILON * (scaled[0] + rest);
        self.descent_within(&bernstein(&scaled), (0.0, width), rounding, HALVINGS_MAX)
    }

    /// [`Self::first_descent`] on `low..=high`, given the Bernstein coefficients there and their error.
    fn descent_within(
        &self,
        b: &[f64; COUNT],
        (low, high): (f64, f64),
        rounding: f64,
        halvings: u32,
    ) -> Option<f64> {
        if b.iter().all(|&b| b >= 0.0) {
            return None;
        }
        if b.iter().all(|&b| b <= 0.0) {
            return Some(low);
        }
        // Zero within rounding on the whole interval is no descent.
        if b.iter().all(|&b| b.abs() <= rounding) {
            return None;
        }
        if b[0] > 0.0 && b[ORDER] < 0.0 && sign_changes(b) == 1 {
            return Some(self.root_between(low, high));
        }
        let middle = 0.5 * (low + high);
        if halvings == 0 {
            return (b[ORDER] < 0.0).then_some(middle);
        }
        let (left, right) = halves(b);
        self.descent_within(&left, (low, middle), rounding, halvings - 1)
            .or_else(|| self.descent_within(&right, (middle, high), rounding, halvings - 1))
    }

    /// The one root between `low` (positive) and `high` (negative): Newton's method within a shrinking bracket.
    fn root_between(&self, mut low: f64, mut high: f64) -> f64 {
        let mut tau = 0.5 * (low + high);
        for _ in 0..200 {
            let value = self.at(tau);
            if value > 0.0 {
                low = tau;
            } else {
                high = tau;
            }
            let newton = tau - value / self.slope_at(tau);
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - tau).abs() <= f64::EPSILON * next {
                return next;
            }
            tau = next;
        }
        tau
    }
}

/// [`ORDER`] as a number.
const ORDER_F64: f64 = 20.0;

/// Bernstein coefficients on 0..=1 of a polynomial given by its powers.
fn bernstein(powers: &[f64; COUNT]) -> [f64; COUNT] {
    // With d_i = c_i / C(n, i), b_j = sum_i C(j, i) d_i is Pascal's rule applied in place.
    let mut b = *powers;
    let mut binomial = 1.0;
    let (mut taken, mut left) = (0.0, ORDER_F64);
    for c in &mut b {
        *c /= binomial;
        taken += 1.0;
        binomial *= left / taken;
        left -= 1.0;
    }
    for lowest in 1..COUNT {
        for k in (lowest..COUNT).rev() {
            b[k] += b[k - 1];
        }
    }
    b
}

/// Bernstein coefficients on both halves.
fn halves(b: &[f64; COUNT]) -> ([f64; COUNT], [f64; COUNT]) {
    let (mut left, mut right) = (*b, *b);
    for (level, left) in left.iter_mut().enumerate() {
        *left = right[0];
        for k in 0..(ORDER - level) {
            right[k] = 0.5 * (right[k] + right[k + 1]);
        }
    }
    (left, right)
}

/// Changes of sign along the coefficients, zeros left out.
fn sign_changes(b: &[f64; COUNT]) -> usize {
    let mut signs = b.iter().filter(|b| **b != 0.0).map(|b| *b > 0.0);
    let Some(mut last) = signs.next() else { return 0 };
    signs.filter(|&sign| core::mem::replace(&mut last, sign) != sign).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The monic polynomial with these roots, times `factor`.
    fn with_roots(factor: f64, roots: &[f64]) -> Series {
        let mut series = Series::ZERO;
        series.0[0] = factor;
        for root in roots {
            for k in (0..COUNT).rev() {
                series.0[k] = if k > 0 { series.0[k - 1] } else { 0.0 } - root * series.0[k];
            }
        }
        series
    }

    #[test]
    fn exact_first_descent_is_the_first_root_from_above() {
        // Positive at 0, roots 0.3, 0.31, 0.9: down at 0.3.
        let series = with_roots(-1.0, &[0.3, 0.31, 0.9]);
        assert!((series.first_descent(1.0).unwrap() - 0.3).abs() < 1e-13);
        assert_eq!(series.first_descent(0.29), None);
        // Negative at 0: at once.
        assert_eq!(series.times(-1.0).first_descent(1.0), Some(0.0));
    }

    /// Dips of width 1e-6 and depth 2.5e-13 are found; a double root and a minimum just above zero are none.
    #[test]
    fn exact_grazing() {
        let dip = with_roots(1.0, &[0.4, 0.400_001]);
        assert!((dip.first_descent(1.0).unwrap() - 0.4).abs() < 1e-9);
        let mut above = with_roots(1.0, &[0.4, 0.4]);
        above.0[0] += 1e-14;
        assert_eq!(above.first_descent(1.0), None);
        assert_eq!(with_roots(1.0, &[0.5, 0.5]).first_descent(1.0), None);
    }

    #[test]
    fn exact_a_root_at_the_start_can_be_taken_out() {
        // tau (0.25 - tau)
        let series = with_roots(-1.0, &[0.0, 0.25]);
        assert!((series.without_root_at_start(1).first_descent(1.0).unwrap() - 0.25).abs() < 1e-15);
    }

    /// exp(x) at x = 0.3, from itself about 0.2; its integral and its derivative.
    #[test]
    fn exact_arithmetic() {
        let mut exp = Series::ZERO;
        let mut term = 1.0;
        for (k, c) in exp.0.iter_mut().enumerate() {
            *c = term;
            term /= f64::from(u32::try_from(k).unwrap() + 1);
        }
        assert!((exp.about(0.2).at(0.1) - motor_model::math::exp(0.3)).abs() < 1e-15);
        assert!((exp.integral_to(0.5) - (motor_model::math::exp(0.5) - 1.0)).abs() < 1e-15);
        assert!((exp.derivative().at(0.4) - motor_model::math::exp(0.4)).abs() < 1e-15);
    }
}
