//! The factors of the rows of a table: how far this motor's rate, coast or turn differs from the prior map's, estimated
//! from the rows that were measured.
//!
//! # Model (C5)
//!
//! A table's rows share a factor `f`. It may grow with the turn of the row: `h` is that slope in its standard
//! deviations, and `z_i` what one of them changes in row `i`. A row has a deviation `d_i` of its own. Repeats of a row
//! give the mean `y_i`, in units of the prior row, with the variance `m_i`:
//!
//! ```text
//! f ~ N(1, v),   h ~ N(0, 1),   d_i ~ N(0, o_i),   y_i = f + h z_i + d_i + noise,    w_i = 1 / (o_i + m_i)
//! f and h given all y:      precision [1/v + sum w, sum w z; sum w z, 1 + sum w z^2]
//!                           precision times mean (1/v + sum w y, sum w z y)
//! row i without its own y:  N(mean, variance) of f + h z_i from the other rows, and o_i
//! row i:                    that and N(y_i, m_i), weighted by their precisions
//! ```
//!
//! A row that was not measured keeps the prior's shape under factor and slope. A slow motor's rows differ by less:
//! `o_i` and `z_i^2` are multiplied by the square of the level of the rows, from a hundredth to 1.
//!
//! # Where the prior does not hold
//!
//! The rows alone give the factor by least squares with the covariance `V = W^-1 + z z'`: `mean = 1'M y / 1'M 1`, with
//! `M = V^-1 = W - W z z' W / (1 + z'W z)`.
//!
//! - Level: this mean lies beyond [`LEVEL_SIGMAS`] of what the prior expects. `v` becomes the square of that distance,
//!   so that the measurement decides. Such a motor is none of the prior's, so its rows need not have their shape.
//! - Shape: `Q = (y - mean)' M (y - mean)` exceeds the 1 % point of chi-square with n - 1 degrees of freedom.
//! - Either: all `o_i` grow by the variance between rows that explains Q, if any:
//!   `(Q - (n - 1)) / (tr M - |M 1|^2 / 1'M 1)` (`DerSimonian` and Laird, "Meta-analysis in clinical trials",
//!   Controlled Clinical Trials 7 (1986) 177, there without a slope).

use motor_model::math;

use super::quantiles;

/// Standard deviations beyond which a table's level is not that of the prior's motors: one normal motor in 1,000.
const LEVEL_SIGMAS: f32 = 3.3;
/// Probability with which the shape of a motor like the prior's is told to be wrong.
pub(super) const SHAPE_FALSE: f32 = 0.01;

/// Least part of the prior's own deviations: a motor of a tenth of the prior's rate. An assumption.
const SCALE_MIN: f32 = 0.01;

/// A mean and its variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normal {
    /// Mean.
    pub mean: f32,
    /// Variance.
    pub variance: f32,
}

/// A row, in units of the prior row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowMeasured {
    /// Variance of the row's own deviation from the common factor, `o_i`.
    pub own: f32,
    /// What a slope of one standard deviation changes in the row, `z_i`.
    pub lever: f32,
    /// What was measured, `y_i` and `m_i`; `None` of a row that was not.
    pub measured: Option<Normal>,
}

/// A measured row as it counts in the sums.
#[derive(Clone, Copy, Debug)]
struct Weighted {
    weight: f32,
    lever: f32,
    mean: f32,
}

/// The sums over measured rows: of `w`, `w y`, `w z`, `w z^2` and `w z y`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    weight: f32,
    mean: f32,
    lever: f32,
    lever2: f32,
    lever_mean: f32,
}

/// The factors of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowFactors {
    /// Of the common factor, before the rows count.
    prior: Normal,
    sums: Sums,
    /// What all `o_i` are multiplied by, and what they have grown by.
    scale: f32,
    extra: f32,
    measured: u16,
    /// Whether the level of the rows alone was not that of the prior's motors.
    has_other_level: bool,
    /// `Q`.
    chi_square: f32,
}

/// `a` and `b`, independent measurements of one thing.
fn both(a: Normal, b: Normal) -> Normal {
    let sum = a.variance + b.variance;
    let part = if sum > 0.0 { a.variance / sum } else { 0.5 };
    Normal { mean: a.mean + part * (b.mean - a.mean), variance: part * b.variance }
}

impl Sums {
    /// Adds a row, or takes it away for a `sign` of -1.
    fn with(self, sign: f32, row: Weighted) -> Self {
        let Weighted { weight, lever, mean } = row;
        let weight = sign * weight;
        Self {
            weight: self.weight + weight,
            mean: self.mean + weight * mean,
            lever: self.lever + weight * lever,
            lever2: self.lever2 + weight * lever * lever,
            lever_mean: self.lever_mean + weight * lever * mean,
        }
    }

    /// The entry of `row` in `M 1`.
    fn of_row(&self, row: Weighted) -> f32 {
        row.weight * (1.0 - row.lever * self.lever / (1.0 + self.lever2))
    }

    /// The common factor by the rows alone: `1'M y / 1'M 1`, and the variance `1 / 1'M 1`.
    fn alone(&self) -> Option<Normal> {
        let slope = self.lever / (1.0 + self.lever2);
        let precision = self.weight - slope * self.lever;
        (precision > 0.0).then(|| Normal {
            mean: (self.mean - slope * self.lever_mean) / precision,
            variance: 1.0 / precision,
        })
    }

    /// The factor of a row with this `lever`, but for its own deviation. The precision of `f` and `h` is multiplied by
    /// the prior's variance, which may be next to nothing.
    fn expected(&self, prior: Normal, lever: f32) -> Normal {
        let v = prior.variance;
        let (of_factor, across, of_slope) = (1.0 + v * self.weight, self.lever, 1.0 + self.lever2);
        let determinant = of_factor * of_slope - v * across * across;
        let (factor, slope) = (prior.mean + v * self.mean, self.lever_mean);
        Normal {
            mean: (of_slope * factor - v * across * slope + lever * (of_factor * slope - across * factor))
                / determinant,
            variance: (v * of_slope - 2.0 * lever * v * across + lever * lever * of_factor) / determinant,
        }
    }
}

impl RowFactors {
    /// The factors of `rows`, whose common factor is `N(1, spread)` in the prior's motors.
    pub fn of(spread: f32, rows: impl Iterator<Item = RowMeasured> + Clone) -> Self {
        let mut factors = Self {
            prior: Normal { mean: 1.0, variance: spread },
            sums: Sums::default(),
            scale: 1.0,
            extra: 0.0,
            measured: 0,
            has_other_level: false,
            chi_square: 0.0,
        };
        factors.sum(rows.clone());
        if let Some(Normal { mean, .. }) = factors.sums.alone() {
            factors.scale = (mean * mean).clamp(SCALE_MIN, 1.0);
            factors.sum(rows.clone());
        }
        if let Some(alone) = factors.sums.alone() {
            factors.has_other_level = factors.is_other_level(alone);
            factors.judge_shape(alone, rows);
        }
        factors.widen();
        factors
    }

    /// Computes `Q` about the mean of the rows `alone`, and widens the own deviations where the prior does not hold.
    fn judge_shape(&mut self, alone: Normal, rows: impl Iterator<Item = RowMeasured> + Clone) {
        let Normal { mean, variance } = alone;
        let per_slope = 1.0 / (1.0 + self.sums.lever2);
        let (mut trace, mut square, mut along) = (0.0, 0.0, 0.0);
        let counted = *self;
        for row in rows.clone().filter_map(|row| counted.weighted(&row)) {
            let off = row.mean - mean;
            self.measured = self.measured.saturating_add(1);
            self.chi_square += row.weight * off * off;
            along += row.weight * row.lever * off;
            trace += row.weight * (1.0 - row.weight * row.lever * row.lever * per_slope);
            let of_row = self.sums.of_row(row);
            square += of_row * of_row;
        }
        self.chi_square -= along * along * per_slope;
        if self.contradicts_the_prior() {
            let left = trace - square * variance;
            self.extra = ((self.chi_square - self.freedom()) / left.max(f32::MIN_POSITIVE)).max(0.0);
            self.sum(rows);
        }
    }

    /// Variance of the deviation of `row` from factor and slope.
    fn own(&self, row: &RowMeasured) -> f32 {
        self.scale * row.own + self.extra
    }

    /// What a slope of one standard deviation changes in `row` of a motor of this level.
    fn lever(&self, row: &RowMeasured) -> f32 {
        math::sqrt_f32(self.scale) * row.lever
    }

    /// `row` as it counts, if it was measured.
    fn weighted(&self, row: &RowMeasured) -> Option<Weighted> {
        let Normal { mean, variance } = row.measured?;
        let weight = 1.0 / (self.own(row) + variance).max(f32::MIN_POSITIVE);
        Some(Weighted { weight, lever: self.lever(row), mean })
    }

    fn sum(&mut self, rows: impl Iterator<Item = RowMeasured>) {
        self.sums =
            rows.filter_map(|row| self.weighted(&row)).fold(Sums::default(), |sums, row| sums.with(1.0, row));
    }

    /// Widens the prior where the rows' level is not that of the prior's motors.
    fn widen(&mut self) {
        if let Some(alone) = self.sums.alone().filter(|alone| self.is_other_level(*alone)) {
            let off = alone.mean - self.prior.mean;
            self.prior.variance = self.prior.variance.max(off * off);
        }
    }

    /// Whether the level of the rows `alone` is not that of the prior's motors.
    fn is_other_level(&self, alone: Normal) -> bool {
        let off = alone.mean - self.prior.mean;
        off * off > LEVEL_SIGMAS * LEVEL_SIGMAS * (self.prior.variance + alone.variance)
    }

    /// The same where the common factor of a related table, with the covariance `covariance` over motors, is measured
    /// by `other` alone. A related table of another shape tells nothing.
    #[must_use]
    pub fn related(mut self, other: &Self, covariance: f32) -> Self {
        if let Some(measured) = other.sums.alone().filter(|_| !other.has_other_shape()) {
            let gain = covariance / (other.prior.variance + measured.variance);
            self.prior.mean += gain * (measured.mean - other.prior.mean);
            self.prior.variance = (self.prior.variance - gain * covariance).max(f32::MIN_POSITIVE);
            self.widen();
        }
        self
    }

    /// Rows that were measured.
    pub fn measured(&self) -> u16 {
        self.measured
    }

    fn freedom(&self) -> f32 {
        f32::from(self.measured.saturating_sub(1))
    }

    /// Chi-square of the rows about their common factor, per degree of freedom; `None` of fewer than two rows.
    pub fn reduced_chi_square(&self) -> Option<f32> {
        (self.measured > 1).then(|| self.chi_square / self.freedom())
    }

    /// Whether the rows contradict the prior's shape.
    pub fn has_other_shape(&self) -> bool {
        self.measured > 1 && self.chi_square > quantiles::chi_square(self.freedom(), SHAPE_FALSE)
    }

    /// Whether the rows, two or more, contradict the prior's level.
    pub fn has_other_level(&self) -> bool {
        self.measured > 1 && self.has_other_level
    }

    /// Whether they contradict its level or shape: the motor is none of the prior's.
    pub fn contradicts_the_prior(&self) -> bool {
        self.has_other_level() || self.has_other_shape()
    }

    /// The common factor.
    pub fn common(&self) -> Normal {
        self.sums.expected(self.prior, 0.0)
    }

    /// The factor of `row`, one of the rows of the table.
    pub fn row(&self, row: &RowMeasured) -> Normal {
        let others = self.weighted(row).map_or(self.sums, |own| self.sums.with(-1.0, own));
        let expected = others.expected(self.prior, self.lever(row));
        let expected = Normal { variance: expected.variance + self.own(row), ..expected };
        row.measured.map_or(expected, |measured| both(expected, measured))
    }
}

#[cfg(test)]
mod tests;
