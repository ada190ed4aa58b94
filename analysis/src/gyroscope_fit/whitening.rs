//! Whitening: what the intervals show, per standard deviation of their noise and without what earlier ones tell of it.
//!
//! The noise of an interval is `V = L L'`. Its inverse factor is applied to the columns of a matrix at once by a Kalman
//! filter of the noise alone, whose states are the drift `d` of the bias and the error `e` of the reference at the
//! interval's begin. So the time grows with the number of intervals and not with its cube.
//!
//! ```text
//! noise of an interval    I + w + c + e_begin - e_end
//! I: integral of the drift   w: random walk and units   c: coning   e: error of the reference, fresh at each anchor
//!
//! with p = exp(-T / C), m1 and m2 as in the gyroscope's noise, D the drift's standard deviation:
//! I = T m1 d + n,   var n = D^2 T^2 (2 m2 - m1^2),   d <- p d + x,   var x = D^2 (1 - p^2),
//! cov(n, x) = D^2 T m1 (1 - p)
//! ```
//!
//! Source: de Jong, Annals of Statistics 19 (1991) 1073-1083: the same filter for observations and regressors.

use motor_model::math;
use nalgebra::DMatrix;

use super::FitInterval;
use simulation::world::instruments::gyroscope::GyroscopeNoise;

/// Standard deviation of the logarithm of a factor on the filter's variances of the reference, before. An assumption: a
/// filter is right within a factor of three.
const LN_REFERENCE_SIGMA: f64 = 1.0;

/// What is not in the data sheet.
#[derive(Clone, Debug, PartialEq)]
pub struct NoiseStrengths {
    /// Factors on the filter's variances of the reference, clockwise and the other way. An anchor between two intervals
    /// has the factor of the earlier one.
    pub reference_factors: [f64; 2],
    /// Strength of the random walk by coning under each drive ([`FitInterval::drive`]), in deg^2 per s.
    pub coning_deg2_s: Vec<f64>,
}

impl NoiseStrengths {
    /// Bounds of a factor on the filter's variances.
    pub(super) const REFERENCE_FACTORS: (f64, f64) = (1e-3, 1e6);

    /// Minus twice the logarithm of the factors' density before, but for a constant.
    pub(super) fn reference_before(&self) -> f64 {
        let square = |factor: &f64| math::ln(*factor) * math::ln(*factor);
        self.reference_factors.iter().map(square).sum::<f64>() / (LN_REFERENCE_SIGMA * LN_REFERENCE_SIGMA)
    }

    /// Variances of the reference at the beginning and at the end of an interval, in deg^2.
    pub fn reference_deg2(&self, interval: &FitInterval) -> (f64, f64) {
        let factor = self.reference_factors[interval.side()];
        (factor * interval.variances_deg2.0, factor * interval.variances_deg2.1)
    }

    /// Variance by coning in an interval, in deg^2.
    pub fn coning_deg2(&self, interval: &FitInterval) -> f64 {
        self.coning_deg2_s[interval.drive] * interval.span.length_s()
    }
}

/// The states' covariance in the order drift, reference.
#[derive(Clone, Copy)]
struct NoiseCovariance {
    drift: f64,
    mixed: f64,
    reference: f64,
}

/// Applies the inverse factor of the noise's covariance to `columns`, which have a column an interval; the logarithm of
/// the covariance's determinant. `None` where an interval has no noise.
pub fn whiten(
    intervals: &[FitInterval],
    noise: &GyroscopeNoise,
    strengths: &NoiseStrengths,
    columns: &mut DMatrix<f64>,
) -> Option<f64> {
    let rows = columns.nrows();
    let (mut drift_means, mut reference_means) = (vec![0.0; rows], vec![0.0; rows]);
    let drift_variance = noise.drift_deg_s * noise.drift_deg_s;
    let mut state = NoiseCovariance { drift: drift_variance, mixed: 0.0, reference: 0.0 };
    let mut ended_s = f64::NEG_INFINITY;
    let mut log_determinant = 0.0;
    for (mut column, interval) in columns.column_iter_mut().zip(intervals) {
        let (begin_deg2, end_deg2) = strengths.reference_deg2(interval);
        if interval.span.from_s.total_cmp(&ended_s).is_ne() {
            let kept = math::exp((ended_s - interval.span.from_s) / noise.drift_time_s);
            state = NoiseCovariance {
                drift: kept * kept * state.drift + drift_variance * (1.0 - kept * kept),
                mixed: 0.0,
                reference: begin_deg2,
            };
            for mean in &mut drift_means {
                *mean *= kept;
            }
            reference_means.fill(0.0);
        }
        ended_s = interval.span.until_s;
        let length_s = interval.span.length_s();
        let per_time = length_s / noise.drift_time_s;
        let (kept, mean) = (math::exp(-per_time), math::decay_mean(per_time));
        let integral_s = length_s * mean;
        let fresh = (2.0 * math::decay_second_mean(per_time) - mean * mean).max(0.0) * length_s * length_s;
        let variance = integral_s * (integral_s * state.drift + 2.0 * state.mixed)
            + state.reference
            + drift_variance * fresh
            + noise.white_deg2_s() * length_s
            + strengths.coning_deg2(interval)
            + end_deg2;
        if variance <= 0.0 || !variance.is_finite() {
            return None;
        }
        log_determinant += math::ln(variance);
        let sigma = math::sqrt(variance);
        let drift_with =
            kept * (integral_s * state.drift + state.mixed) + drift_variance * integral_s * (1.0 - kept);
        let (drift_gain, reference_gain) = (drift_with / sigma, -end_deg2 / sigma);
        for ((value, drift), reference) in column.iter_mut().zip(&mut drift_means).zip(&mut reference_means) {
            *value = (*value - integral_s * *drift - *reference) / sigma;
            *drift = kept * *drift + drift_gain * *value;
            *reference = reference_gain * *value;
        }
        state = NoiseCovariance {
            drift: kept * kept * state.drift + drift_variance * (1.0 - kept * kept) - drift_gain * drift_gain,
            mixed: -drift_gain * reference_gain,
            reference: end_deg2 - reference_gain * reference_gain,
        };
    }
    Some(log_determinant)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{NOISE, intervals};
    use super::*;

    /// Variance of one of two intervals, or their covariance, in deg^2, from the closed form of the gyroscope's noise.
    fn dense(intervals: &[FitInterval], noise: &GyroscopeNoise, strengths: &NoiseStrengths) -> DMatrix<f64> {
        DMatrix::from_fn(intervals.len(), intervals.len(), |row, column| {
            let (one, other) = (&intervals[row], &intervals[column]);
            // The anchor between two intervals has the factor of the earlier one, which ends there.
            let ends_at = |time_s: f64| {
                let ends = |interval: &&FitInterval| interval.span.until_s.total_cmp(&time_s).is_eq();
                intervals.iter().find(ends).map(|interval| strengths.reference_deg2(interval).1)
            };
            let begin_deg2 = ends_at(one.span.from_s).unwrap_or(strengths.reference_deg2(one).0);
            let shared = if row == column {
                begin_deg2 + strengths.reference_deg2(one).1 + strengths.coning_deg2(one)
            } else if one.span.until_s.total_cmp(&other.span.from_s).is_eq() {
                -strengths.reference_deg2(one).1
            } else if one.span.from_s.total_cmp(&other.span.until_s).is_eq() {
                -begin_deg2
            } else {
                0.0
            };
            shared + noise.covariance_deg2(one.span, other.span)
        })
    }

    /// With drift, coning, two factors on the reference and two gaps: `L L'` is the covariance, and the determinant is
    /// its own.
    #[test]
    fn dual_the_factor_is_that_of_the_dense_covariance() {
        let noise = GyroscopeNoise { drift_deg_s: 2e-3, drift_time_s: 7.0, resolution_deg: 1e-4, ..NOISE };
        let turned: Vec<f64> = (0..20_u32).map(|k| if k / 3 % 2 == 0 { 40.0 } else { -40.0 }).collect();
        let mut all = intervals(&turned, 0.0, 0.0, 9e-6);
        for (index, interval) in all.iter_mut().enumerate() {
            interval.drive = index % 3;
        }
        all.drain(5..9);
        all.remove(12);
        let strengths =
            NoiseStrengths { reference_factors: [2.5, 0.4], coning_deg2_s: vec![0.0, 3e-6, 2e-5] };
        let covariance = dense(&all, &noise, &strengths);
        let mut inverse_factor = DMatrix::identity(all.len(), all.len());
        let log_determinant = whiten(&all, &noise, &strengths, &mut inverse_factor).unwrap();
        // Columns stand for intervals: this is the transposed inverse of L.
        let one = inverse_factor.transpose() * &covariance * &inverse_factor;
        let off = (one - DMatrix::identity(all.len(), all.len())).amax();
        assert!(off < 1e-11, "{off:e}");
        let expected = math::ln(covariance.determinant());
        assert!((log_determinant / expected - 1.0).abs() < 1e-12, "{log_determinant} {expected}");
    }
}
