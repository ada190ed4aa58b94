//! Mean and variance of the kick that friction gives to a rate which is known only roughly.
//!
//! ```text
//! kick = clamp(slip, -L, L),   L = mu k dv / R_t,   slip = rate of the tooth less that of the rotor
//! ```
//!
//! The slip is taken as uniform over its mean +- w, `w^2 / 3` its variance. Mean and variance of the kick, and the
//! probabilities of sticking and of slipping either way, are then polynomials. They make a statistical linearisation
//! (Gelb and Vander Velde, "Multiple-Input Describing Functions", 1968): the slope is the probability of sticking, and
//! the variance about the straight line is noise.

use motor_model::Real;

/// Mean, slopes and residual variance of a kick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct KickMoments<T> {
    /// Mean.
    pub(crate) mean: T,
    /// Change per slip: the probability that the teeth stick.
    pub(crate) per_slip: T,
    /// Change per limit: the probability of slipping forwards less that of slipping backwards.
    pub(crate) per_limit: T,
    /// Variance about the straight line.
    pub(crate) scatter: T,
}

impl<T: Real> KickMoments<T> {
    /// For a slip uniform over `slip +- width`, with `width > 0`, and a `limit` not negative.
    pub(crate) fn new(slip: T, width: T, limit: T) -> Self {
        let (low, high) = (slip - width, slip + width);
        let per_span = T::from_f64(0.5) / width;
        let mean = (mean_to(high, limit) - mean_to(low, limit)) * per_span;
        let square = (square_to(high, limit) - square_to(low, limit)) * per_span;
        let (inner_low, inner_high) = (low.clamp_magnitude(limit), high.clamp_magnitude(limit));
        let per_slip = (inner_high - inner_low) * per_span;
        let positive = |x: T| if x > T::zero() { x } else { T::zero() };
        let above = positive(high - if low > limit { low } else { limit });
        let below = positive(if high < -limit { high } else { -limit } - low);
        let explained = per_slip * per_slip * width * width * T::from_f64(1.0 / 3.0);
        Self {
            mean,
            per_slip,
            per_limit: (above - below) * per_span,
            scatter: positive(square - mean * mean - explained),
        }
    }
}

/// Integral of `clamp(x, -limit, limit)` from 0.
fn mean_to<T: Real>(x: T, limit: T) -> T {
    let half = T::from_f64(0.5);
    if x.abs() < limit { half * x * x } else { limit * (x.abs() - half * limit) }
}

/// Integral of its square from 0.
fn square_to<T: Real>(x: T, limit: T) -> T {
    let third = T::from_f64(1.0 / 3.0);
    let inner = x.clamp_magnitude(limit);
    third * inner * inner * inner + limit * limit * (x - inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Moments and slopes against a fine sum over the uniform slip.
        #[test]
        fn dual_moments_equal_sums(slip in -10.0..10.0_f64, width in 0.01..10.0_f64, limit in 0.0..5.0_f64) {
            let n = 20_000;
            let slips = (0..n).map(|i| slip + width * (2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0));
            let mean_of = |f: &dyn Fn(f64) -> f64| slips.clone().map(f).sum::<f64>() / f64::from(n);
            let clamped = |x: f64| x.clamp(-limit, limit);
            let kick = KickMoments::new(slip, width, limit);
            prop_assert!((kick.mean - mean_of(&clamped)).abs() < 1e-6);
            let sticks = mean_of(&|x| f64::from(u8::from(x.abs() < limit)));
            let forwards = mean_of(&|x| f64::from(u8::from(x > limit)) - f64::from(u8::from(x < -limit)));
            prop_assert!((kick.per_slip - sticks).abs() < 2e-4 && (kick.per_limit - forwards).abs() < 2e-4);
            // The residual of the straight line: the variance less that which the line explains.
            let line = |x: f64| clamped(x) - kick.mean;
            let variance = mean_of(&|x| line(x) * line(x)) - sticks * sticks * width * width / 3.0;
            prop_assert!((kick.scatter - variance).abs() < 0.01 * width * width + 1e-6);
        }
    }
}
