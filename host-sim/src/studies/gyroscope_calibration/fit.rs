//! Scale factor and bias by generalised least squares.
//!
//! Over an interval from anchor a to anchor b the gyroscope shows `g`, the sum of its samples, and the reference turns
//! by `r`:
//!
//! ```text
//! g - r = s r + b T + noise,      cov(noise) = V
//! x = (A' V^-1 A)^-1 A' V^-1 y,   cov(x) = (A' V^-1 A)^-1,   chi^2 = (y - A x)' V^-1 (y - A x)
//!
//! A: rows (r, T)      y: g - r      x: (s, b)
//! V: the gyroscope's own angle over the spans (random walk, instability, units)
//!    + variance of the reference at a and at b, which neighbours share with the opposite sign
//! ```
//!
//! The gyroscope's part of V is [`GyroscopeNoise::covariance_deg2`]. The sums are solved by the Cholesky factor of V. V
//! contains the drift of the bias during the run, and cov(x) the correlation of scale factor and bias. The bias is the
//! constant part; the drift is noise about it. The reference's error in A (some 5 milli-degrees in 10 degrees and more)
//! is left out: it lowers `s` by its own square, 1e-7 of s. Intervals in which a sample was saturated are left out. The
//! filter's variances are too small where a motor turns slowly. If chi-square per degree of freedom is above 1, one
//! factor raises them all until it is 1. The gyroscope's noise, which the data sheet gives, stays.
//!
//! Source: Aitken, Proc. Roy. Soc. Edinburgh 55 (1935) 42-48.

use motor_model::math;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Matrix2, OMatrix, U2, Vector2};

use simulation::math::count::real;
use simulation::world::instruments::gyroscope::{GyroscopeNoise, noise::TimeSpan};

/// Gyroscope and reference between two anchors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitInterval {
    /// The time between them.
    pub span: TimeSpan,
    /// The turn that the gyroscope shows, in degrees.
    pub shown_deg: f64,
    /// The turn of the reference, in degrees.
    pub turned_deg: f64,
    /// Variances of the reference at the beginning and at the end, in deg^2.
    pub variances_deg2: (f64, f64),
}

/// Scale factor and bias with their covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationFit {
    /// Error of the scale factor.
    pub scale: f64,
    /// Bias in deg/s.
    pub bias_deg_s: f64,
    /// Covariance of both: 1, deg/s and deg^2/s^2.
    pub covariance: Matrix2<f64>,
    /// Weighted sum of the squared residuals, with the raised variances of the reference.
    pub chi_square: f64,
    /// Intervals less unknowns.
    pub degrees_of_freedom: usize,
    /// Factor by which the reference's variances were raised, at least 1.
    pub reference_factor: f64,
}

/// Most iterations of the factor on the reference's variances.
const ROUNDS_MAX: u32 = 20;

/// The covariance of the differences between gyroscope and reference, in deg^2.
fn covariance(intervals: &[FitInterval], noise: &GyroscopeNoise, reference_factor: f64) -> DMatrix<f64> {
    DMatrix::from_fn(intervals.len(), intervals.len(), |row, column| {
        let (one, other) = (&intervals[row], &intervals[column]);
        let shared = if row == column {
            one.variances_deg2.0 + one.variances_deg2.1
        } else if one.span.until_s.total_cmp(&other.span.from_s).is_eq() {
            -one.variances_deg2.1
        } else if one.span.from_s.total_cmp(&other.span.until_s).is_eq() {
            -one.variances_deg2.0
        } else {
            0.0
        };
        reference_factor * shared + noise.covariance_deg2(one.span, other.span)
    })
}

/// How the fit weighs the intervals.
struct FitWeights {
    /// Of V.
    factor: Cholesky<f64, Dyn>,
    /// A per standard deviation.
    regressors_white: OMatrix<f64, Dyn, U2>,
    /// Of the result.
    covariance: Matrix2<f64>,
}

impl FitWeights {
    fn new(intervals: &[FitInterval], noise: &GyroscopeNoise, reference_factor: f64) -> Option<Self> {
        let factor = covariance(intervals, noise, reference_factor).cholesky()?;
        let regressors = OMatrix::<f64, Dyn, U2>::from_fn(intervals.len(), |row, column| {
            if column == 0 { intervals[row].turned_deg } else { intervals[row].span.length_s() }
        });
        let regressors_white = factor.l_dirty().solve_lower_triangular(&regressors)?;
        let information: Matrix2<f64> = regressors_white.tr_mul(&regressors_white);
        // 1 - square of the correlation: 0 but for rounding where all intervals have one rate.
        let told_apart = information.determinant() / (information.m11 * information.m22);
        let covariance = information.try_inverse().filter(|_| told_apart > 1e-9)?;
        Some(Self { factor, regressors_white, covariance })
    }

    /// Scale factor and bias from differences, and the weighted sum of the squared residuals.
    fn solve(&self, seen_deg: impl Iterator<Item = f64>) -> Option<(Vector2<f64>, f64)> {
        let seen = DVector::from_iterator(self.regressors_white.nrows(), seen_deg);
        let seen_white = self.factor.l_dirty().solve_lower_triangular(&seen)?;
        let right: Vector2<f64> = self.regressors_white.tr_mul(&seen_white);
        let found = self.covariance * right;
        let residual = seen_white - &self.regressors_white * found;
        Some((found, residual.norm_squared()))
    }
}

impl CalibrationFit {
    /// The fit to `intervals`, which are in order and do not overlap; `None` where they do not tell scale factor from
    /// bias, or have no noise.
    pub fn to(intervals: &[FitInterval], noise: &GyroscopeNoise) -> Option<Self> {
        let mut fit = Self::weighted(intervals, noise, 1.0)?;
        for _ in 0..ROUNDS_MAX {
            let excess = fit.chi_square / real(fit.degrees_of_freedom.max(1));
            let reference_factor = (fit.reference_factor * excess).max(1.0);
            if (reference_factor / fit.reference_factor - 1.0).abs() < 0.01 {
                break;
            }
            fit = Self::weighted(intervals, noise, reference_factor)?;
        }
        Some(fit)
    }

    /// With the reference's variances raised by a factor.
    fn weighted(intervals: &[FitInterval], noise: &GyroscopeNoise, reference_factor: f64) -> Option<Self> {
        let degrees_of_freedom = intervals.len().checked_sub(2)?;
        let weights = FitWeights::new(intervals, noise, reference_factor)?;
        let seen = intervals.iter().map(|interval| interval.shown_deg - interval.turned_deg);
        let (found, chi_square) = weights.solve(seen)?;
        let [scale, bias_deg_s] = found.into();
        let covariance = weights.covariance;
        Some(Self { scale, bias_deg_s, covariance, chi_square, degrees_of_freedom, reference_factor })
    }

    /// What differences of `seen_deg` between gyroscope and reference, one for each of the `intervals` of this fit,
    /// make of the scale factor and of the bias in deg/s: the fit is linear in them.
    pub fn part(
        &self,
        intervals: &[FitInterval],
        noise: &GyroscopeNoise,
        seen_deg: impl Iterator<Item = f64>,
    ) -> Option<[f64; 2]> {
        let weights = FitWeights::new(intervals, noise, self.reference_factor)?;
        Some(weights.solve(seen_deg)?.0.into())
    }

    /// Standard deviation of the scale factor.
    pub fn scale_sigma(&self) -> f64 {
        math::sqrt(self.covariance.m11)
    }

    /// Standard deviation of the bias in deg/s.
    pub fn bias_sigma_deg_s(&self) -> f64 {
        math::sqrt(self.covariance.m22)
    }

    /// Correlation of both.
    pub fn correlation(&self) -> f64 {
        self.covariance.m12 / (self.scale_sigma() * self.bias_sigma_deg_s())
    }

    /// Square of the distance from the pair `(scale, bias_deg_s)` in standard deviations, correlation included. For the
    /// true pair it is chi-square with two degrees of freedom.
    pub fn distance_square(&self, scale: f64, bias_deg_s: f64) -> f64 {
        let off = Vector2::new(self.scale - scale, self.bias_deg_s - bias_deg_s);
        self.covariance.try_inverse().map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)))
    }
}

#[cfg(test)]
mod tests;
