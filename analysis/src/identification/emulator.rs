//! How summaries of the statistics follow from the parameters, learnt from motors that were drawn.
//!
//! ```text
//! summary_j = a linear map of all statistics, that which tells parameter j best         (first half of the motors)
//! summary   = m(z) + e,    m quadratic in the parameters,    e ~ t(0, Sigma)             (second half)
//! ```
//!
//! A linear map that regresses a parameter on the statistics is the summary of them that loses least (Fearnhead and
//! Prangle, Journal of the Royal Statistical Society B 74 (2012) 419-474). The covariance `Sigma` is that of motors
//! that were left out of the fit: it has the chaos of the motion, the noise of the instruments, every parameter that
//! these recordings do not tell, and the error of the emulator itself.

use motor_model::math;
use nalgebra::{Cholesky, DMatrix, DVector};

use super::ridge::{LinearMap, Ridge, outputs};
use super::training::DrawnMotor;
use simulation::math::count::real;
use simulation::math::statistics::upper_quantile;

/// Standard deviation of a parameter after the recordings per that before, below which they tell it.
pub const TOLD: f64 = 0.8;
/// Degrees of freedom of the errors' t distribution: outliers among chaotic motions are rare and not unheard of.
const DEGREES_OF_FREEDOM: f64 = 10.0;
/// What 68.3 % of such errors do not exceed, in units of their scale: the 84.15 % quantile of t.
const SIZE_OF_T: f64 = 1.0526;

/// The summaries of recordings, and what each tells.
#[derive(Clone, Debug)]
pub struct Summaries {
    maps: Vec<LinearMap>,
    /// Of every parameter what its standard deviation after the recordings is expected to stay below, per that before:
    /// at most 1.
    pub expected: Vec<f64>,
}

/// Standard errors that are added to a standard deviation which is known from few motors.
const ERRORS_ADDED: f64 = 2.0;

impl Summaries {
    /// Learns them from motors.
    pub fn learn(motors: &[DrawnMotor]) -> Self {
        let rows: Vec<Vec<f64>> = motors.iter().map(|motor| motor.statistics.clone()).collect();
        let ridge = Ridge::new(&rows);
        let count = motors.first().map_or(0, |motor| motor.standard.len());
        let maps: Vec<LinearMap> = (0..count)
            .map(|number| {
                let outputs: Vec<f64> = motors.iter().map(|motor| motor.standard[number]).collect();
                ridge.fit(&outputs)
            })
            .collect();
        // A standard deviation is known from n motors to 1 / sqrt(2 n) of it. That of the prior is 1.
        let stays_below = 1.0 + ERRORS_ADDED / math::sqrt(2.0 * f64::max(real(motors.len()), 1.0));
        let expected = maps.iter().map(|map| (stays_below * map.left_out_rms()).min(1.0)).collect();
        Self { maps, expected }
    }

    /// Numbers of the parameters that the recordings tell.
    pub fn told(&self) -> Vec<usize> {
        let told = self.expected.iter().enumerate().filter(|(_, ratio)| **ratio < TOLD);
        told.map(|(number, _)| number).collect()
    }

    fn of(&self, told: &[usize], statistics: &[f64]) -> DVector<f64> {
        let all = outputs(&self.maps, statistics);
        DVector::from_iterator(told.len(), told.iter().map(|number| all[*number]))
    }
}

/// Constant, parameters, squares and products.
pub fn quadratic(standard: &[f64]) -> Vec<f64> {
    let mut features = standard.to_vec();
    for (number, one) in standard.iter().enumerate() {
        features.extend(standard[..=number].iter().map(|other| one * other));
    }
    features
}

/// The likelihood of parameters that are told, given recordings.
#[derive(Clone, Debug)]
pub struct Emulator {
    summaries: Summaries,
    /// Numbers of the parameters that are told.
    pub told: Vec<usize>,
    maps: Vec<LinearMap>,
    /// Cholesky factor of the scale matrix.
    lower: DMatrix<f64>,
}

impl Emulator {
    /// Learns from motors; `None` if they tell nothing.
    pub fn learn(motors: &[DrawnMotor]) -> Option<Self> {
        let (first, second) = motors.split_at(motors.len() / 2);
        let summaries = Summaries::learn(first);
        let told = summaries.told();
        if told.is_empty() {
            return None;
        }
        let inputs: Vec<Vec<f64>> =
            second.iter().map(|motor| quadratic(&of_told(&told, &motor.standard))).collect();
        let summed: Vec<DVector<f64>> =
            second.iter().map(|motor| summaries.of(&told, &motor.statistics)).collect();
        let ridge = Ridge::new(&inputs);
        let maps: Vec<LinearMap> = (0..told.len())
            .map(|number| ridge.fit(&summed.iter().map(|output| output[number]).collect::<Vec<_>>()))
            .collect();
        let scale = scale_matrix(&maps);
        let lower = Cholesky::new(scale)?.l();
        Some(Self { summaries, told, maps, lower })
    }

    /// Of every parameter what its standard deviation after the recordings is expected to stay below, per that before.
    pub fn expected(&self) -> &[f64] {
        &self.summaries.expected
    }

    /// The summaries of statistics.
    pub fn summary(&self, statistics: &[f64]) -> DVector<f64> {
        self.summaries.of(&self.told, statistics)
    }

    /// The mean of the summaries of motors with these parameters.
    pub fn mean(&self, told: &[f64]) -> DVector<f64> {
        outputs(&self.maps, &quadratic(told))
    }

    /// Logarithm of the likelihood of parameters, up to a constant.
    pub fn log_likelihood(&self, summary: &DVector<f64>, told: &[f64]) -> f64 {
        let whitened = self.whitened(&(summary - self.mean(told)));
        let width = real(self.told.len());
        let n = DEGREES_OF_FREEDOM;
        -0.5 * (n + width) * math::ln(1.0 + whitened.norm_squared() / n)
    }

    /// `L^-1 e`, of unit scale.
    pub fn whitened(&self, error: &DVector<f64>) -> DVector<f64> {
        self.lower.solve_lower_triangular(error).unwrap_or_else(|| error.clone())
    }
}

/// Scale matrix of the errors of rows that were left out, for a t distribution of [`DEGREES_OF_FREEDOM`].
///
/// A few motors far off, of which there are always some, would make the root of the mean square too large for all
/// others. So the size of each error is that which 68 % do not exceed, and correlations are those of errors limited to
/// three times that.
fn scale_matrix(maps: &[LinearMap]) -> DMatrix<f64> {
    let sizes: Vec<f64> = maps
        .iter()
        .map(|map| {
            let mut sizes: Vec<f64> = map.left_out.iter().map(|error| error.abs()).collect();
            upper_quantile(&mut sizes, 683).unwrap_or(0.0).max(1e-9)
        })
        .collect();
    let limited = |number: usize| {
        let size = sizes[number];
        maps[number].left_out.iter().map(move |error| (error / size).clamp(-3.0, 3.0))
    };
    let product =
        |one: usize, other: usize| limited(one).zip(limited(other)).map(|(a, b)| a * b).sum::<f64>();
    DMatrix::from_fn(maps.len(), maps.len(), |row, column| {
        let correlation = product(row, column) / math::sqrt(product(row, row) * product(column, column));
        correlation * sizes[row] * sizes[column] / (SIZE_OF_T * SIZE_OF_T)
    })
}

/// The told ones of all parameters.
pub fn of_told(told: &[usize], standard: &[f64]) -> Vec<f64> {
    told.iter().filter_map(|number| standard.get(*number).copied()).collect()
}
