//! When does a tooth meet the rotor? The gap through a span of free motion, and its first descent to zero.
//!
//! The gap `z - u_p`, its rate and its acceleration are known exactly at both ends of the span; the quintic polynomial that
//! shares these six values stands for it in between. Its error is below `(w h)^6 A / 46080` for an oscillation of amplitude `A`: 2e-12 m
//! at 10 us, 1e-10 m at 20 us, in mode B at full amplitude.

use crate::math::Real;

/// Gap, its rate and its acceleration at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GapState<T> {
    pub(crate) gap_m: T,
    pub(crate) rate_m_s: T,
    pub(crate) acceleration_m_s2: T,
}

/// The gap as a polynomial in the fraction `x` of a span, `c0 + c1 x + ... + c5 x^5`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GapCurve<T> {
    c: [T; 6],
}

/// Equal pieces in which a descent is sought; within one the curve turns once at most.
const PIECES: i32 = 4;
/// Most evaluations that refine a root.
const REFINEMENTS: usize = 10;

impl<T: Real> GapCurve<T> {
    /// The quintic through both ends of a span of `span_s`.
    #[inline]
    pub(crate) fn new(start: &GapState<T>, end: &GapState<T>, span_s: T) -> Self {
        let half_square = T::from_f64(0.5) * span_s * span_s;
        let (c0, c1, c2) = (start.gap_m, start.rate_m_s * span_s, start.acceleration_m_s2 * half_square);
        let position = end.gap_m - (c0 + c1 + c2);
        let velocity = end.rate_m_s * span_s - (c1 + c2 + c2);
        let acceleration = end.acceleration_m_s2 * half_square - c2;
        let n = T::from_f64;
        Self {
            c: [
                c0,
                c1,
                c2,
                n(10.0) * position - n(4.0) * velocity + acceleration,
                n(-15.0) * position + n(7.0) * velocity - n(2.0) * acceleration,
                n(6.0) * position - n(3.0) * velocity + acceleration,
            ],
        }
    }

    /// The first `x` in `0..=1` at which the gap, positive before, falls to zero.
    ///
    /// A curve that starts at or below zero and falls gives 0. One that starts there and rises (a tooth that has just struck) is taken to
    /// start at zero, and that root is divided out.
    pub(crate) fn first_descent(&self) -> Option<T> {
        let [c0, c1, c2, c3, c4, c5] = self.c;
        let zero = T::zero();
        if c0 > zero {
            Descent { c: self.c }.first()
        } else if c1 < zero {
            Some(zero)
        } else {
            Descent { c: [c1, c2, c3, c4, c5, zero] }.first()
        }
    }
}

/// A polynomial that is positive at 0.
struct Descent<T> {
    c: [T; 6],
}

impl<T: Real> Descent<T> {
    #[inline]
    fn value(&self, x: T) -> T {
        let [c0, c1, c2, c3, c4, c5] = self.c;
        c0 + x * (c1 + x * (c2 + x * (c3 + x * (c4 + x * c5))))
    }

    #[inline]
    fn slope(&self, x: T) -> T {
        let [_, c1, c2, c3, c4, c5] = self.c;
        let n = T::from_f64;
        c1 + x * (n(2.0) * c2 + x * (n(3.0) * c3 + x * (n(4.0) * c4 + x * (n(5.0) * c5))))
    }

    /// Whether the terms that fall, all at their largest, leave the value positive: no root then, and most curves are of this kind.
    fn stays_positive(&self) -> bool {
        let [c0, rest @ ..] = self.c;
        rest.iter().fold(c0, |low, &c| if c < T::zero() { low + c } else { low }) > T::zero()
    }

    /// Piece by piece: a root lies where the value changes sign, or where the slope does below zero.
    fn first(&self) -> Option<T> {
        if self.stays_positive() {
            return None;
        }
        let piece = T::from_f64(1.0 / f64::from(PIECES));
        let (mut left, mut slope_left) = (T::zero(), self.slope(T::zero()));
        for index in 1..=PIECES {
            let right = if index == PIECES { T::one() } else { T::from_i32(index) * piece };
            let slope_right = self.slope(right);
            if self.value(right) <= T::zero() {
                return Some(self.refine(left, right));
            }
            if slope_left < T::zero() && slope_right > T::zero() {
                let lowest = self.lowest(left, right);
                if self.value(lowest) <= T::zero() {
                    return Some(self.refine(left, lowest));
                }
            }
            (left, slope_left) = (right, slope_right);
        }
        None
    }

    /// The root between `left`, where the value is positive, and `right`, where it is not: Newton's method, kept in the bracket by
    /// bisection. Returns the side that is not positive.
    fn refine(&self, mut left: T, mut right: T) -> T {
        let mut x = right;
        for _ in 0..REFINEMENTS {
            let value = self.value(x);
            if value <= T::zero() {
                right = x;
            } else {
                left = x;
            }
            let next = x - value / self.slope(x);
            let inside = next > left && next < right;
            let next = if inside { next } else { T::from_f64(0.5) * (left + right) };
            if next == x {
                break;
            }
            x = next;
        }
        if self.value(x) <= T::zero() { x } else { right }
    }

    /// Where the slope, negative at `left` and positive at `right`, vanishes: false position, to where the value no longer shows it.
    fn lowest(&self, mut left: T, mut right: T) -> T {
        let (mut slope_left, mut slope_right) = (self.slope(left), self.slope(right));
        let mut x = left;
        for _ in 0..REFINEMENTS / 2 {
            x = left + (right - left) * slope_left / (slope_left - slope_right);
            let slope = self.slope(x);
            if slope < T::zero() {
                (left, slope_left) = (x, slope);
                slope_right *= T::from_f64(0.5);
            } else {
                (right, slope_right) = (x, slope);
                slope_left *= T::from_f64(0.5);
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The gap over a span of 1 of a rotor in free fall above a sum of oscillations.
    #[derive(Clone, Copy, Debug)]
    struct Motion {
        height: f64,
        velocity: f64,
        gravity: f64,
        amplitude: f64,
        rad: f64,
        phase: f64,
    }

    impl Motion {
        fn at(&self, x: f64) -> GapState<f64> {
            let Self { height, velocity, gravity, amplitude, rad, phase } = *self;
            let (sin, cos) = (rad * x + phase).sin_cos();
            GapState {
                gap_m: height + velocity * x - 0.5 * gravity * x * x - amplitude * sin,
                rate_m_s: velocity - gravity * x - amplitude * rad * cos,
                acceleration_m_s2: -gravity + amplitude * rad * rad * sin,
            }
        }

        fn curve(&self) -> GapCurve<f64> {
            GapCurve::new(&self.at(0.0), &self.at(1.0), 1.0)
        }

        /// `(w h)^6 A / 46080`, the quintic's error.
        fn error(&self) -> f64 {
            self.rad.powi(6) * self.amplitude / 46_080.0
        }
    }

    #[test]
    fn exact_descent_of_a_parabola() {
        let fall = Motion { height: 0.3, velocity: 0.0, gravity: 1.0, amplitude: 0.0, rad: 1.0, phase: 0.0 };
        let expected = 0.6_f64.sqrt();
        assert!((fall.curve().first_descent().unwrap() - expected).abs() < 1e-14);
        assert!(Motion { height: 0.6, ..fall }.curve().first_descent().is_none());
        // Thrown up from contact: the root at the start is the blow itself, the next one the landing.
        let thrown = Motion { height: 0.0, velocity: 0.25, ..fall };
        assert!((thrown.curve().first_descent().unwrap() - 0.5).abs() < 1e-14);
        assert!(Motion { height: 0.0, velocity: 0.7, ..fall }.curve().first_descent().is_none());
        // Found inside the tooth and still falling: at once.
        let late = Motion { height: -0.01, velocity: -0.1, ..fall };
        assert!(late.curve().first_descent().unwrap().abs() < 1e-300);
    }

    /// A gap that closes and opens again between the ends: found down to the last hair, and none where there is none.
    #[test]
    fn exact_graze_between_the_ends() {
        for depth in [1e-3, 1e-6, 1e-9, 1e-12] {
            // (x - 0.6)^2 / 2 + lowest, which turns inside a piece.
            let dip = |lowest: f64| Motion {
                height: 0.18 + lowest,
                velocity: -0.6,
                gravity: -1.0,
                amplitude: 0.0,
                rad: 1.0,
                phase: 0.0,
            };
            let found = dip(-depth).curve().first_descent().expect("a graze");
            // Within the dip, before it turns: there the gap is between 0 and -depth.
            let half_width = (2.0 * depth).sqrt();
            assert!(found >= 0.6 - half_width - 1e-9 && found <= 0.6 + 1e-6, "{depth} {found}");
            assert!(dip(depth).curve().first_descent().is_none(), "{depth}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

        /// Against a scan of the true gap: no crossing deeper than the curve's own error is missed, none invented, none later than the
        /// first.
        #[test]
        fn dual_first_descent_equals_a_scan(
            height in 0.0..2.0_f64, velocity in -2.0..2.0_f64, gravity in -1.0..1.0_f64,
            amplitude in 0.0..1.0_f64, rad in 0.1..1.0_f64, phase in 0.0..6.3_f64
        ) {
            let motion = Motion { height, velocity, gravity, amplitude, rad, phase };
            prop_assume!(motion.at(0.0).gap_m > 1e-6);
            let n = 4000;
            let gap = |i: i32| motion.at(f64::from(i) / f64::from(n)).gap_m;
            let slack = motion.error() + 1e-9;
            let crossing = (1..=n).find(|&i| gap(i) < -slack);
            let touching = (1..=n).find(|&i| gap(i) < slack);
            match (motion.curve().first_descent(), crossing, touching) {
                (None, crossing, _) => prop_assert!(crossing.is_none(), "missed {crossing:?}"),
                (Some(_), _, None) => prop_assert!(false, "invented"),
                (Some(x), crossing, Some(touching)) => {
                    let earliest = f64::from(touching - 1) / f64::from(n);
                    let latest = crossing.map_or(1.0, |i| f64::from(i) / f64::from(n));
                    prop_assert!(x >= earliest - 1e-9 && x <= latest + 1e-9, "{earliest} {x} {latest}");
                    prop_assert!(motion.at(x).gap_m.abs() <= slack);
                }
            }
        }
    }
}
