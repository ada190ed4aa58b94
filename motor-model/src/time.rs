//! Time as an integer count of nanoseconds, from an instant that the user chooses.

use crate::math::Real;

/// An instant; 584 years fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Time(u64);

impl Time {
    /// The start.
    pub const ZERO: Self = Self(0);

    /// From nanoseconds.
    pub const fn from_nanos(nanos: u64) -> Self {
        Self(nanos)
    }

    /// From whole microseconds.
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros.saturating_mul(1000))
    }

    /// In nanoseconds.
    pub const fn nanos(self) -> u64 {
        self.0
    }

    /// This instant `nanos` later; saturates at the largest count.
    #[inline]
    #[must_use]
    pub const fn plus_nanos(self, nanos: u64) -> Self {
        Self(self.0.saturating_add(nanos))
    }

    /// Nanoseconds from `earlier` to this instant; 0 if it is not earlier.
    #[inline]
    pub const fn nanos_since(self, earlier: Self) -> u64 {
        self.0.saturating_sub(earlier.0)
    }

    /// Whether this instant and `other` are at most `nanos` apart, for `nanos` below 2^63.
    #[inline]
    pub const fn is_within(self, nanos: u64, other: Self) -> bool {
        self.0.wrapping_sub(other.0).wrapping_add(nanos) <= 2 * nanos
    }

    /// Nanoseconds from `earlier` to this instant, if it is later, by at most `most`; for instants less than 2^63
    /// apart.
    #[inline]
    #[expect(clippy::cast_possible_truncation, reason = "it is at most `most`")]
    pub const fn nanos_soon_after(self, earlier: Self, most: u32) -> Option<u32> {
        let since = self.0.wrapping_sub(earlier.0);
        if since.wrapping_sub(1) < most as u64 { Some(since as u32) } else { None }
    }

    /// Seconds from `earlier` to this instant, 0 if it is not earlier: exact until the rounding to `T`.
    #[inline]
    pub fn seconds_since<T: Real>(self, earlier: Self) -> T {
        T::from_u64(self.nanos_since(earlier)) * T::from_f64(1e-9)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_differences_after_a_day_in_f32() {
        let day = Time::from_micros(86_400_000_000);
        let dt: f32 = day.plus_nanos(10_000).seconds_since(day);
        assert!((dt - 1e-5).abs() < 1e-12);
    }

    /// Instants may be as far apart as the count reaches: seconds are never negative.
    #[test]
    fn exact_differences_over_the_whole_range() {
        for nanos in [1, 1 << 31, u64::from(u32::MAX), 1 << 62, (1 << 63) - 1, 1 << 63, u64::MAX] {
            let (single, double): (f32, f64) = (
                Time::from_nanos(nanos).seconds_since(Time::ZERO),
                Time::from_nanos(nanos).seconds_since(Time::ZERO),
            );
            let expected = nanos as f64 * 1e-9;
            assert!((double / expected - 1.0).abs() < 1e-15, "{nanos} {double}");
            assert!((f64::from(single) / expected - 1.0).abs() < 2e-7, "{nanos} {single}");
        }
    }

    #[test]
    fn exact_nearness_is_the_same_either_way() {
        let near = |a: u64, b: u64| Time::from_nanos(a).is_within(5, Time::from_nanos(b));
        for (a, b, expected) in
            [(0, 5, true), (0, 6, false), (9, 9, true), (0, u64::MAX - 5, false), (7, u64::MAX, false)]
        {
            assert_eq!((near(a, b), near(b, a)), (expected, expected), "{a} {b}");
        }
    }

    #[test]
    fn exact_soon_after_is_later_and_not_by_much() {
        let soon = |a: u64, b: u64| Time::from_nanos(a).nanos_soon_after(Time::from_nanos(b), 5);
        let hour = 3_600_000_000_000;
        for (later, earlier, expected) in [
            (0, 0, None),
            (1, 0, Some(1)),
            (hour + 5, hour, Some(5)),
            (6, 0, None),
            (hour, hour + 1, None),
            (u64::MAX, 0, None),
            ((1 << 32) + 1, 0, None),
        ] {
            assert_eq!(soon(later, earlier), expected, "{later} {earlier}");
        }
    }

    #[test]
    fn exact_backwards_is_zero() {
        assert_eq!(Time::from_micros(1).nanos_since(Time::from_micros(2)), 0);
    }
}
