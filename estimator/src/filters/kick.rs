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
        let (half, third, per_span) = (T::from_f64(0.5), T::from_f64(1.0 / 3.0), T::from_f64(0.5) / width);
        let (inner_low, inner_high) = (low.clamp_magnitude(limit), high.clamp_magnitude(limit));
        let above = (high - low.at_least(limit)).at_least(T::zero());
        let below = (high.at_most(-limit) - low).at_least(T::zero());
        // About the middle of the kicks that stick, so that no large numbers cancel.
        let (middle, reach) = (half * (inner_low + inner_high), half * (inner_high - inner_low));
        let (up, down) = (limit - middle, limit + middle);
        let mean = (above * up - below * down) * per_span;
        let sticking_square = T::from_f64(2.0) * third * reach * reach * reach;
        let square = (sticking_square + above * up * up + below * down * down) * per_span;
        let per_slip = (inner_high - inner_low) * per_span;
        let explained = per_slip * per_slip * width * width * third;
        Self {
            mean: middle + mean,
            per_slip,
            per_limit: (above - below) * per_span,
            scatter: (square - mean * mean - explained).at_least(T::zero()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// In `f32`, a slip known to a thousandth: the kick certainly slips, sticks, or does either. Its scatter is that of
    /// `f64` to a thousandth of the slip's variance, whatever the slip.
    #[test]
    fn dual_the_scatter_of_a_slip_that_is_known_well_is_no_rounding() {
        let width = 1e-3_f32;
        for slip in [-8.4, -4.421, -4.42, -4.419, 0.3, 4.4195, 20.0_f32] {
            let single = KickMoments::new(slip, width, 4.42);
            let double = KickMoments::new(f64::from(slip), f64::from(width), f64::from(4.42_f32));
            let off = (f64::from(single.scatter) - double.scatter).abs();
            assert!(off < 1e-3 * f64::from(width * width) / 3.0, "{slip}: {single:?} {double:?}");
            assert!((f64::from(single.mean) - double.mean).abs() < 1e-6, "{slip}: {single:?} {double:?}");
        }
    }

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
