//! Ridge regression: a linear map of many features, fitted to many outputs, whose strength of regularisation is chosen
//! by leaving out one row at a time.
//!
//! ```text
//! w = (X^T X + lambda)^-1 X^T y          residual of row i, left out: (y_i - x_i w) / (1 - h_i)
//! ```
//!
//! Features and outputs are centred, features scaled to unit variance. One decomposition `X^T X = V D V^T` serves all
//! outputs and all `lambda`.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use motor_model::math;
use simulation::math::count::real;
use simulation::math::statistics::Spread;

/// Largest feature in standard deviations; one beyond is taken for it.
const FEATURE_MAX: f64 = 8.0;
/// Least share of a row that others explain.
const FREE_MIN: f64 = 1e-3;
/// Strengths of regularisation that are tried, per row: powers of ten.
const STRENGTHS: [f64; 10] = [1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0];

/// Scales of features.
#[derive(Clone, Debug, PartialEq)]
struct Scales {
    spreads: Vec<Spread>,
    /// Means of the features that were scaled and limited.
    means: DVector<f64>,
}

impl Scales {
    /// Of rows of features.
    fn of(rows: &[Vec<f64>]) -> Self {
        let width = rows.first().map_or(0, Vec::len);
        let column = |number: usize| rows.iter().filter_map(move |row| row.get(number).copied());
        let spreads: Vec<Spread> = (0..width).map(|number| column(number).collect()).collect();
        let mut scales = Self { spreads, means: DVector::zeros(width) };
        let sum = rows.iter().fold(DVector::zeros(width), |sum, row| sum + scales.scaled(row));
        scales.means = sum / f64::max(real(rows.len()), 1.0);
        scales
    }

    fn scaled(&self, features: &[f64]) -> DVector<f64> {
        let scaled =
            self.spreads.iter().zip(features).zip(self.means.iter()).map(|((spread, feature), mean)| {
                let sd =
                    if spread.sd > 1e-12 * spread.mean.abs().max(1e-12) { spread.sd } else { f64::INFINITY };
                ((feature - spread.mean) / sd).clamp(-FEATURE_MAX, FEATURE_MAX) - mean
            });
        DVector::from_iterator(self.spreads.len(), scaled)
    }
}

/// Features of many rows, ready to be fitted to.
#[derive(Clone, Debug)]
pub struct Ridge {
    scales: Scales,
    /// `V` and `D`.
    vectors: DMatrix<f64>,
    values: DVector<f64>,
    /// `X V`.
    rotated: DMatrix<f64>,
}

/// A linear map that was fitted.
#[derive(Clone, Debug)]
pub struct LinearMap {
    scales: Scales,
    weights: DVector<f64>,
    mean: f64,
    /// Residual of each row, had it been left out.
    pub left_out: Vec<f64>,
}

impl Ridge {
    /// Of rows of features.
    pub fn new(rows: &[Vec<f64>]) -> Self {
        let scales = Scales::of(rows);
        let scaled: Vec<DVector<f64>> = rows.iter().map(|row| scales.scaled(row)).collect();
        let features = DMatrix::from_fn(rows.len(), scales.spreads.len(), |row, column| scaled[row][column]);
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(features.tr_mul(&features));
        let rotated = &features * &eigenvectors;
        Self { scales, vectors: eigenvectors, values: eigenvalues.map(|value| value.max(0.0)), rotated }
    }

    /// Fits `outputs`, one a row.
    pub fn fit(&self, outputs: &[f64]) -> LinearMap {
        let rows = outputs.len();
        let mean = outputs.iter().sum::<f64>() / real(rows);
        let centred = DVector::from_iterator(rows, outputs.iter().map(|output| output - mean));
        let along = self.rotated.tr_mul(&centred);
        let tried = STRENGTHS.map(|strength| {
            let lambda = strength * real(rows);
            let inverse = self.values.map(|value| 1.0 / (value + lambda));
            let weights = along.component_mul(&inverse);
            let fitted = &self.rotated * &weights;
            let left_out: Vec<f64> = (0..rows)
                .map(|row| {
                    let leverage: f64 = self
                        .rotated
                        .row(row)
                        .iter()
                        .zip(inverse.iter())
                        .map(|(feature, inverse)| feature * feature * inverse)
                        .sum();
                    // A row that only itself explains tells nothing: left out, it is as far off as it is.
                    let free = 1.0 - leverage - 1.0 / real(rows);
                    if free > FREE_MIN { (centred[row] - fitted[row]) / free } else { centred[row] }
                })
                .collect();
            let squares: f64 = left_out.iter().map(|residual| residual * residual).sum();
            (squares, weights, left_out)
        });
        let best = tried.into_iter().min_by(|(one, ..), (other, ..)| one.total_cmp(other));
        let (_, weights, left_out) = best.unwrap_or_default();
        LinearMap { scales: self.scales.clone(), weights: &self.vectors * weights, mean, left_out }
    }
}

/// The outputs of several maps of the same features.
pub fn outputs(maps: &[LinearMap], features: &[f64]) -> DVector<f64> {
    let Some(first) = maps.first() else { return DVector::zeros(0) };
    let scaled = first.scales.scaled(features);
    DVector::from_iterator(maps.len(), maps.iter().map(|map| map.mean + map.weights.dot(&scaled)))
}

impl LinearMap {
    /// Root of the mean square of the residuals, each of a row that was left out.
    pub fn left_out_rms(&self) -> f64 {
        let squares: f64 = self.left_out.iter().map(|residual| residual * residual).sum();
        math::sqrt(squares / real(self.left_out.len()))
    }
}
