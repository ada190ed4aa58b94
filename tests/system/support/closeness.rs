//! The one tolerance: two-sided, relative plus absolute, and NaN is never close.

use std::fmt::Display;

/// `|actual - expected| <= atol + rtol |expected|`.
#[derive(Clone, Copy, Debug)]
pub struct Within {
    /// Share of the expected value's magnitude.
    pub rtol: f64,
    /// In the unit of the values.
    pub atol: f64,
}

impl Within {
    /// A relative tolerance.
    pub const fn relative(rtol: f64) -> Self {
        Self { rtol, atol: 0.0 }
    }

    /// An absolute tolerance.
    pub const fn absolute(atol: f64) -> Self {
        Self { rtol: 0.0, atol }
    }

    /// Whether `actual` is as close to `expected` as this asks. NaN and infinity are not.
    pub fn holds(self, actual: f64, expected: f64) -> bool {
        let limit = self.atol + self.rtol * expected.abs();
        limit.is_finite() && (actual - expected).abs() <= limit
    }
}

/// Panics with both values, their difference and `what` unless they are close.
#[track_caller]
pub fn assert_close(actual: f64, expected: f64, within: Within, what: impl Display) {
    assert!(
        within.holds(actual, expected),
        "{what}: {actual:e} against {expected:e}, off by {:e}, allowed {within:?}",
        actual - expected
    );
}

/// Panics unless `low <= actual <= high`; NaN is outside.
#[track_caller]
pub fn assert_between(actual: f64, low: f64, high: f64, what: impl Display) {
    assert!(actual >= low && actual <= high, "{what}: {actual} is not within {low} to {high}");
}

#[test]
fn exact_tolerance_is_two_sided_and_refuses_nan() {
    let within = Within { rtol: 0.01, atol: 0.5 };
    assert!(within.holds(101.5, 100.0) && within.holds(98.5, 100.0));
    assert!(!within.holds(101.6, 100.0) && !within.holds(98.4, 100.0));
    for (actual, expected) in [(f64::NAN, 1.0), (1.0, f64::NAN), (f64::INFINITY, f64::INFINITY)] {
        assert!(!within.holds(actual, expected));
    }
    assert!(!Within::absolute(f64::NAN).holds(1.0, 1.0));
}
