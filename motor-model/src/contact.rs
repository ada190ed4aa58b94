//! The gap between tooth and rotor over a span of free motion, and its first descent to zero.
//!
//! The gap `z - u_p`, its rate and its acceleration are known exactly at both ends of the span. The quintic
//! polynomial with these six values stands for the gap in between. Its error is below `(w h)^6 A / 46080` for an
//! oscillation of amplitude `A`: 2e-12 m at 10 us, 1e-10 m at 20 us, in mode B at full amplitude.
//!
//! In Bernstein's form, `gap(x) = sum C(5,i) x^i (1-x)^(5-i) b_i`, the quintic needs no fit: with `g, r, a` at the
//! start and `G, R, A` at the end,
//!
//! ```text
//! b_0 = g    b_1 = g + r h/5    b_2 = g + 2 r h/5 + a h^2/20
//! b_3 = G - 2 R h/5 + A h^2/20    b_4 = G - R h/5    b_5 = G
//! ```
//!
//! It has at most as many roots in the span as its coefficients have changes of sign (Descartes' rule, in Bernstein's
//! form): none if all are positive, exactly one if there is one change. Otherwise the span is halved (de Casteljau)
//! and each half is tested, the earlier first. In a piece of 1/16 that may still have two roots, the lowest point
//! decides. So no root of the quintic is missed, however close two of them are.

use crate::math::Real;

/// Gap, its rate and its acceleration at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GapState<T> {
    pub(crate) gap_m: T,
    pub(crate) rate_m_s: T,
    pub(crate) acceleration_m_s2: T,
}

/// The gap through a span, as Bernstein coefficients of its quintic in the fraction `x` of the span.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GapCurve<T> {
    b: [T; 6],
}

/// Times that a span is halved at most.
const HALVINGS: u8 = 4;
/// Most iterations for a root or a lowest point.
const REFINEMENTS: u8 = 10;
/// The iteration for a root ends at a correction below this: it converges with the third order, so the error is its
/// cube.
const LAST_CORRECTION: f64 = 1.0 / 262_144.0;

impl<T: Real> GapCurve<T> {
    /// The quintic through both ends of a span of `span_s`.
    #[inline]
    pub(crate) fn new(start: &GapState<T>, end: &GapState<T>, span_s: T) -> Self {
        let (fifth_s, twentieth_s2) = (T::from_f64(0.2) * span_s, T::from_f64(0.05) * span_s * span_s);
        let (onward, back) = (start.rate_m_s * fifth_s, end.rate_m_s * fifth_s);
        let (b1, b4) = (start.gap_m + onward, end.gap_m - back);
        Self {
            b: [
                start.gap_m,
                b1,
                b1 + onward + start.acceleration_m_s2 * twentieth_s2,
                b4 - back + end.acceleration_m_s2 * twentieth_s2,
                b4,
                end.gap_m,
            ],
        }
    }

    /// The cubic through gap and rate at both ends of a span of `span_s`.
    #[inline]
    pub(crate) fn cubic([start_m, end_m]: [T; 2], [start_m_s, end_m_s]: [T; 2], span_s: T) -> Self {
        let third_s = T::from_f64(1.0 / 3.0) * span_s;
        let (c1, c2) = (start_m + start_m_s * third_s, end_m - end_m_s * third_s);
        let n = T::from_f64;
        // Raised from the third degree to the fifth.
        Self {
            b: [
                start_m,
                n(0.4) * start_m + n(0.6) * c1,
                n(0.1) * start_m + n(0.6) * c1 + n(0.3) * c2,
                n(0.3) * c1 + n(0.6) * c2 + n(0.1) * end_m,
                n(0.6) * c2 + n(0.4) * end_m,
                end_m,
            ],
        }
    }

    /// The first `x` in `0..=1` at which the gap, positive before, falls to zero.
    ///
    /// A curve that starts at or below zero and falls gives 0. One that starts there and rises (just after an impact)
    /// is taken to start at zero, and that root is divided out.
    #[inline]
    pub(crate) fn first_descent(&self) -> Option<T> {
        let [b0, b1, b2, b3, b4, b5] = self.b;
        let zero = T::zero();
        if b0 > zero {
            if b1 > zero && b2 > zero && b3 > zero && b4 > zero && b5 > zero {
                return None;
            }
            return self.first_root(HALVINGS);
        }
        if b1 < b0 {
            return Some(zero);
        }
        if b1 > zero && b2 > zero && b3 > zero && b4 > zero && b5 > zero {
            return None;
        }
        self.without_root_at_start().first_root(HALVINGS)
    }

    /// The curve divided by `x`, its value at 0 taken for zero.
    fn without_root_at_start(&self) -> Self {
        let [_, b1, b2, b3, b4, b5] = self.b;
        let n = T::from_f64;
        // Of the fourth degree, b_i 5 / i, and raised to the fifth: ((5 - i) q_i + i q_(i-1)) / 5.
        let (q0, q1, q2, q3) = (n(5.0) * b1, n(2.5) * b2, n(5.0 / 3.0) * b3, n(1.25) * b4);
        let mix = |q: T, weight: f64, before: T| n(weight) * q + n(1.0 - weight) * before;
        Self { b: [q0, mix(q1, 0.8, q0), mix(q2, 0.6, q1), mix(q3, 0.4, q2), mix(b5, 0.2, q3), b5] }
    }

    /// The first root of a curve that starts above zero.
    fn first_root(&self, halvings: u8) -> Option<T> {
        match self.sign_changes() {
            0 => None,
            1 => Some(Polynomial::of(self).root(self.polygon_root())),
            _ if halvings == 0 => self.dip(),
            _ => {
                let (early, late) = self.halves();
                let half = T::from_f64(0.5);
                match early.first_root(halvings - 1) {
                    Some(x) => Some(half * x),
                    None => late.first_root(halvings - 1).map(|x| half + half * x),
                }
            }
        }
    }

    /// How often the coefficients change sign, zero counted as below.
    fn sign_changes(&self) -> u8 {
        let above = self.b.map(|b| b > T::zero());
        above.iter().zip(above.iter().skip(1)).map(|(left, right)| u8::from(left != right)).sum()
    }

    /// Where the polygon of the coefficients first comes down to zero: close to the curve's root.
    fn polygon_root(&self) -> T {
        let fifth = T::from_f64(0.2);
        let mut left = T::zero();
        for (&from, &to) in self.b.iter().zip(self.b.iter().skip(1)) {
            if to <= T::zero() {
                return left + fifth * from / (from - to);
            }
            left += fifth;
        }
        T::one()
    }

    /// Both halves of the curve.
    fn halves(&self) -> (Self, Self) {
        let mean = |a: T, b: T| T::from_f64(0.5) * (a + b);
        let [a0, a1, a2, a3, a4, a5] = self.b;
        let [b0, b1, b2, b3, b4] = [mean(a0, a1), mean(a1, a2), mean(a2, a3), mean(a3, a4), mean(a4, a5)];
        let [c0, c1, c2, c3] = [mean(b0, b1), mean(b1, b2), mean(b2, b3), mean(b3, b4)];
        let [d0, d1, d2] = [mean(c0, c1), mean(c1, c2), mean(c2, c3)];
        let (e0, e1) = (mean(d0, d1), mean(d1, d2));
        let middle = mean(e0, e1);
        (Self { b: [a0, b0, c0, d0, e0, middle] }, Self { b: [middle, e1, d2, c3, b4, a5] })
    }

    /// The first root of a piece so short that the curve has at most one minimum in it.
    fn dip(&self) -> Option<T> {
        let curve = Polynomial::of(self);
        let lowest = curve.lowest();
        let bottom = curve.value(lowest);
        if bottom > T::zero() {
            return None;
        }
        let start = self.b.first().copied().unwrap_or_default();
        // The chord down to the lowest point.
        Some(curve.root_before(lowest * start / (start - bottom), lowest))
    }
}

/// The same curve in powers of `x`.
struct Polynomial<T> {
    c: [T; 6],
}

impl<T: Real> Polynomial<T> {
    /// `c_k = C(5,k) D^k b_0`, `D` the forward difference.
    fn of(curve: &GapCurve<T>) -> Self {
        let [b0, b1, b2, b3, b4, b5] = curve.b;
        let [p0, p1, p2, p3, p4] = [b1 - b0, b2 - b1, b3 - b2, b4 - b3, b5 - b4];
        let [q0, q1, q2, q3] = [p1 - p0, p2 - p1, p3 - p2, p4 - p3];
        let [r0, r1, r2] = [q1 - q0, q2 - q1, q3 - q2];
        let (s0, s1) = (r1 - r0, r2 - r1);
        let (five, ten) = (T::from_f64(5.0), T::from_f64(10.0));
        Self { c: [b0, five * p0, ten * q0, ten * r0, five * s0, s1 - s0] }
    }

    #[inline]
    fn value(&self, x: T) -> T {
        let [c0, c1, c2, c3, c4, c5] = self.c;
        let x2 = x * x;
        (c0 + c1 * x) + x2 * ((c2 + c3 * x) + x2 * (c4 + c5 * x))
    }

    #[inline]
    fn slope(&self, x: T) -> T {
        let [_, c1, c2, c3, c4, c5] = self.c;
        let n = T::from_f64;
        let x2 = x * x;
        (c1 + n(2.0) * c2 * x) + x2 * ((n(3.0) * c3 + n(4.0) * c4 * x) + x2 * (n(5.0) * c5))
    }

    /// Half the second derivative.
    #[inline]
    fn half_curvature(&self, x: T) -> T {
        let [_, _, c2, c3, c4, c5] = self.c;
        let n = T::from_f64;
        (c2 + n(3.0) * c3 * x) + x * x * (n(6.0) * c4 + n(10.0) * c5 * x)
    }

    /// The only root in `0..=1`, from `x` on.
    fn root(&self, x: T) -> T {
        self.root_before(x, T::one())
    }

    /// The root between 0, where the curve is positive, and `right`, where it is not, by Halley's method, kept in the
    /// bracket by bisection.
    fn root_before(&self, mut x: T, mut right: T) -> T {
        let mut left = T::zero();
        // A curve that starts below zero has no such bracket; rounding may give one too.
        let bracketed = x >= left && x <= right;
        if !bracketed {
            x = T::from_f64(0.5) * right;
        }
        for _ in 0..REFINEMENTS {
            let (value, slope) = (self.value(x), self.slope(x));
            if value > T::zero() {
                left = x;
            } else {
                right = x;
            }
            let correction = value * slope / (slope * slope - value * self.half_curvature(x));
            let next = x - correction;
            let inside = next >= left && next <= right;
            if inside && correction.abs() < T::from_f64(LAST_CORRECTION) {
                return next;
            }
            x = if inside { next } else { T::from_f64(0.5) * (left + right) };
        }
        right
    }

    /// The minimum of a curve that falls at 0 and rises at 1, by Newton's method on the slope, kept in the bracket;
    /// otherwise the lower end.
    fn lowest(&self) -> T {
        let (mut left, mut right) = (T::zero(), T::one());
        if self.slope(left) >= T::zero() {
            return left;
        }
        if self.slope(right) <= T::zero() {
            return right;
        }
        let mut x = T::from_f64(0.5);
        for _ in 0..REFINEMENTS {
            let (slope, half_curvature) = (self.slope(x), self.half_curvature(x));
            if slope < T::zero() {
                left = x;
            } else {
                right = x;
            }
            let correction = slope / (half_curvature + half_curvature);
            let next = x - correction;
            let inside = next >= left && next <= right;
            x = if inside { next } else { T::from_f64(0.5) * (left + right) };
            if inside && correction.abs() < T::from_f64(LAST_CORRECTION) {
                break;
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
        // Thrown up from contact: the root at the start is the impact itself, the next one the landing.
        let thrown = Motion { height: 0.0, velocity: 0.25, ..fall };
        assert!((thrown.curve().first_descent().unwrap() - 0.5).abs() < 1e-14);
        assert!(Motion { height: 0.0, velocity: 0.7, ..fall }.curve().first_descent().is_none());
        // Found inside the tooth and still falling: at once.
        let late = Motion { height: -0.01, velocity: -0.1, ..fall };
        assert!(late.curve().first_descent().unwrap().abs() < 1e-300);
    }

    /// A gap that closes and opens again between the ends: found at any depth, and not found where the gap stays open.
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

        /// Whatever the gaps, also those of a rotor inside a tooth: a descent lies within the span.
        #[test]
        fn law_a_descent_lies_within_the_span(
            gaps in prop::array::uniform2(-1.0..1.0_f64), rates in prop::array::uniform2(-9.0..9.0_f64),
            accelerations in prop::array::uniform2(-90.0..90.0_f64)
        ) {
            let [start, end] = [0, 1].map(|i| GapState {
                gap_m: gaps[i],
                rate_m_s: rates[i],
                acceleration_m_s2: accelerations[i],
            });
            if let Some(x) = GapCurve::new(&start, &end, 1.0).first_descent() {
                prop_assert!((0.0..=1.0).contains(&x), "{x}");
            }
        }

        /// Against a scan of the true gap: the first crossing deeper than the curve's own error is found, and no other.
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
