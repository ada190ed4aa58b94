//! Scale factor, bias and what else is unknown of a gyroscope, by generalised least squares.
//!
//! Over an interval from anchor a to anchor b the gyroscope shows `g`, the sum of its samples, and the reference turns
//! by `r`:
//!
//! ```text
//! g - r = s r + b T + sum of the other unknowns + noise,      cov(noise) = V
//! M = A' V^-1 A + P,    x = M^-1 A' V^-1 y,    cov(x) = M^-1,    chi^2 = (y - A x)' V^-1 (y - A x) + x' P x
//!
//! A: rows (r, T, ...)      y: g - r      x: (s, b, ...)      P: what is known of the unknowns before, see `unknowns`
//! V: the gyroscope's own angle over the spans (random walk, instability, units)
//!    + variance of the reference at a and at b, which neighbours share with the opposite sign
//!    + W T: coning, a random walk of a strength W for each drive
//! ```
//!
//! On a rotor that tilts the gyroscope turns about the rotor's own axis, and the reference is the angle seen from
//! above. Both differ by the solid angle that the axis sweeps. From interval to interval that is a sum of independent
//! steps. Neither their size nor the tilt is in a data sheet, so that `strengths` finds W from the residuals, about a
//! law of the rate (`coning_law`). With it goes a factor on the filter's variances, which are too small where a motor
//! turns slowly. Turns across the rotor's axis, which a misaligned gyroscope shows, are such steps as well, and stand
//! in W. The gyroscope's noise, which the data sheet gives, stays.
//!
//! V contains the drift of the bias during the run. The bias is the constant part; the drift is noise about it. The
//! reference's error in A (some 5 milli-degrees in 10 degrees and more) is left out: it lowers `s` by its own square,
//! 1e-7 of s. Intervals in which a sample was saturated are left out.
//!
//! Source: Aitken, Proc. Roy. Soc. Edinburgh 55 (1935) 42-48; with what is known before, Goldberger, J. Am. Stat.
//! Assoc. 57 (1962) 369-375.

mod budget;
mod coning_law;
mod coordinate_search;
mod strengths;
pub mod turn_design;
pub mod unknowns;
mod whitening;

use motor_model::math;
use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

pub use budget::{CAUSES, StatedBudget};
pub use coning_law::ConingLaw;
use simulation::world::instruments::gyroscope::{GyroscopeNoise, noise::TimeSpan};
pub use unknowns::Unknowns;
use unknowns::{BIAS, COUNT, SCALE};
pub use whitening::NoiseStrengths;

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
    /// The sum over the samples of `L (sample / L)^3` in degrees, L the turn of a sample at the end of the range: what
    /// a non-linearity of 1 shows.
    pub cubed_deg: f64,
    /// The reference's angle at the beginning and at the end, as parts of a turn.
    pub angles_turn: (f64, f64),
    /// Which of the plan's drives turns the rotor: coning has a strength for each. 0 is none.
    pub drive: usize,
}

impl FitInterval {
    /// 0 where the rotor turns clockwise, 1 the other way.
    pub fn side(&self) -> usize {
        usize::from(self.turned_deg < 0.0)
    }
}

/// The unknowns with their covariance.
#[derive(Clone, Debug, PartialEq)]
pub struct CalibrationFit {
    /// Error of the scale factor.
    pub scale: f64,
    /// Bias in deg/s.
    pub bias_deg_s: f64,
    /// Covariance of both: 1, deg/s and deg^2/s^2.
    pub covariance: Matrix2<f64>,
    /// All unknowns in the order of [`unknowns`], and their covariance.
    pub found: DVector<f64>,
    /// See [`Self::found`].
    pub found_covariance: DMatrix<f64>,
    /// Weighted sum of the squared residuals, and of the unknowns that are known before.
    pub chi_square: f64,
    /// Intervals less unknowns that may be anything.
    pub degrees_of_freedom: usize,
    /// Strengths that were found from the residuals.
    pub strengths: NoiseStrengths,
    /// How coning grows with the rate.
    pub coning_law: ConingLaw,
    /// What a degree more in each interval makes of each unknown.
    pub gains: DMatrix<f64>,
}

/// The least squares under given strengths of the noise.
struct LeastSquares {
    found: DVector<f64>,
    covariance: DMatrix<f64>,
    chi_square: f64,
    /// What restricted maximum likelihood makes least.
    criterion: f64,
    /// A per standard deviation, a column an interval.
    regressors_white: DMatrix<f64>,
}

impl LeastSquares {
    fn solve(
        intervals: &[FitInterval],
        noise: &GyroscopeNoise,
        unknowns: &Unknowns,
        strengths: &NoiseStrengths,
    ) -> Option<Self> {
        let mut white = unknowns.columns(intervals);
        let log_determinant = whitening::whiten(intervals, noise, strengths, &mut white)?;
        let seen = white.row(COUNT).transpose();
        let regressors_white = white.remove_row(COUNT);
        let mut information = &regressors_white * regressors_white.transpose();
        // 1 - square of the correlation: 0 but for rounding where all intervals have one rate.
        let of = |row: usize, column: usize| information[(row, column)];
        let told_apart = 1.0 - of(SCALE, BIAS) * of(SCALE, BIAS) / (of(SCALE, SCALE) * of(BIAS, BIAS));
        if !told_apart.is_finite() || told_apart < 1e-9 {
            return None;
        }
        for unknown in 0..COUNT {
            information[(unknown, unknown)] += Unknowns::before(unknown);
        }
        let factor = information.cholesky()?;
        let found = factor.solve(&(&regressors_white * &seen));
        let residual = &seen - regressors_white.tr_mul(&found);
        let before = |unknown: usize| Unknowns::before(unknown) * found[unknown] * found[unknown];
        let chi_square = residual.norm_squared() + (0..COUNT).map(before).sum::<f64>();
        let log_information: f64 =
            factor.l_dirty().diagonal().iter().map(|pivot| 2.0 * math::ln(*pivot)).sum();
        let criterion = log_determinant + log_information + chi_square;
        Some(Self { found, covariance: factor.inverse(), chi_square, criterion, regressors_white })
    }
}

impl CalibrationFit {
    /// The fit to `intervals`, which are in order and do not overlap; `None` where they do not tell scale factor from
    /// bias, or have no noise.
    pub fn to(intervals: &[FitInterval], noise: &GyroscopeNoise, unknowns: &Unknowns) -> Option<Self> {
        let degrees_of_freedom = intervals.len().checked_sub(2)?;
        let (strengths, coning_law, solved) = strengths::found(intervals, noise, unknowns)?;
        let LeastSquares { found, covariance: found_covariance, chi_square, regressors_white, .. } = solved;
        let mut inverse_factor = DMatrix::identity(intervals.len(), intervals.len());
        whitening::whiten(intervals, noise, &strengths, &mut inverse_factor)?;
        let gains = &found_covariance * (regressors_white * inverse_factor.transpose());
        let covariance = found_covariance.fixed_view::<2, 2>(0, 0).into_owned();
        let (scale, bias_deg_s) = (found[SCALE], found[BIAS]);
        Some(Self {
            scale,
            bias_deg_s,
            covariance,
            found,
            found_covariance,
            chi_square,
            degrees_of_freedom,
            strengths,
            coning_law,
            gains,
        })
    }

    /// What differences of `seen_deg` between gyroscope and reference, one for each interval of this fit, make of the
    /// scale factor and of the bias in deg/s: the fit is linear in them.
    pub fn part(&self, seen_deg: impl Iterator<Item = f64>) -> [f64; 2] {
        let mut parts = [0.0; 2];
        for (gains, seen_deg) in self.gains.column_iter().zip(seen_deg) {
            parts[0] += gains[SCALE] * seen_deg;
            parts[1] += gains[BIAS] * seen_deg;
        }
        parts
    }

    /// What the fit explains of the difference between gyroscope and reference in each interval, in degrees.
    pub fn explained_deg(&self, intervals: &[FitInterval], unknowns: &Unknowns) -> Vec<f64> {
        let columns = unknowns.columns(intervals);
        columns.column_iter().map(|column| column.rows(0, COUNT).dot(&self.found)).collect()
    }

    /// Standard deviation of the scale factor.
    pub fn scale_sigma(&self) -> f64 {
        math::sqrt(self.covariance.m11)
    }

    /// Standard deviation of the bias in deg/s.
    pub fn bias_sigma_deg_s(&self) -> f64 {
        math::sqrt(self.covariance.m22)
    }

    /// An unknown and its standard deviation; of those that are known before, per the standard deviation before.
    pub fn unknown(&self, unknown: usize) -> (f64, f64) {
        (self.found[unknown], math::sqrt(self.found_covariance[(unknown, unknown)]))
    }

    /// Correlation of scale factor and bias.
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
