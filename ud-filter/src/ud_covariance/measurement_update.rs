//! The update by one scalar measurement (Bierman).

mod gated_update;

use nalgebra::SVector;

use super::{FEW_STATES, UNROLLED_STATES, UdCovariance, for_columns};
use crate::real::{Real, is_finite, reciprocal_of_sum};

pub use gated_update::{InnovationRecord, Outcome};

/// What a measurement did.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "T: Real + serde::Serialize",
        deserialize = "T: Real + serde::Deserialize<'de>"
    ))
)]
pub struct Correction<T, const N: usize> {
    /// Variance predicted for the innovation, `h'P h + R`.
    pub variance: T,
    /// Kalman gain: correction of each state per innovation.
    pub gain: SVector<T, N>,
    /// Innovation squared over its variance (NIS): 1 on average in a consistent filter.
    pub normalised_squared: T,
}

/// Why a measurement was refused. State and covariance are then as they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Refusal {
    /// The noise variance is negative or NaN.
    Noise,
    /// The innovation variance is zero or too small for its reciprocal: measurement and prediction are both exact.
    Certain,
    /// The innovation variance is infinite or NaN.
    Uncertain,
    /// The innovation is infinite, NaN, or so large that its normalised square overflows.
    Innovation,
}

impl core::fmt::Display for Refusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Noise => "the noise variance is negative or NaN",
            Self::Certain => "the prediction was exact, and so is the measurement",
            Self::Uncertain => "the innovation variance is infinite or NaN",
            Self::Innovation => "the innovation is no number of usable size",
        })
    }
}

impl core::error::Error for Refusal {}

/// `f = U'h`, `g = D f` and the sums `a_j = R + f_1 g_1 + ... + f_j g_j`.
struct Projection<T, const N: usize> {
    noise: T,
    f: [T; N],
    g: [T; N],
    sums: [T; N],
}

/// What is carried from column to column: `a_(j-1)` and its reciprocal, and `b`.
struct Sweep<T, const N: usize> {
    sum: T,
    per_sum: Option<T>,
    b: [T; N],
}

impl<T: Real, const N: usize> Sweep<T, N> {
    #[inline]
    fn new(noise: T) -> Self {
        Self { sum: noise, per_sum: None, b: [T::zero(); N] }
    }
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// Variance of the innovation of `z = h'x + noise`, `h'P h + R`.
    #[inline]
    pub fn innovation_variance(&self, row: &SVector<T, N>, noise: T) -> T {
        self.project(row, noise).variance()
    }

    /// Updates factors and state by a scalar measurement `z = h'x + noise` of variance `noise`, zero or more, whose
    /// innovation is `z - h'x`.
    ///
    /// Measurements with independent noises are used one after the other, each innovation with the state after the one
    /// before. For a measurement `z = h(x)` that is not linear, `row` is its Jacobian and the innovation `z - h(x)`.
    ///
    /// # Errors
    /// When the measurement cannot be used; nothing has changed then.
    #[inline]
    pub fn update(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal> {
        if N > FEW_STATES && noise * T::max_value() < T::one() {
            return self.update_exactly(row, noise, innovation, state);
        }
        let projection = self.project(row, noise);
        let judged = projection.judge(innovation)?;
        let b = if N > FEW_STATES {
            self.sweep_at_once(&projection, judged.per_variance)
        } else {
            self.sweep(&projection, None)
        };
        Ok(judged.correct(b, innovation, state))
    }

    /// [`Self::update`] by a measurement whose noise, and with it a sum, may be too small for its reciprocal. Rare, so
    /// the code is short.
    #[cold]
    #[inline(never)]
    fn update_exactly(
        &mut self,
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal> {
        let projection = self.project(row, noise);
        let judged = projection.judge(innovation)?;
        let mut sweep = Sweep::new(noise);
        for (j, &sum) in projection.sums.iter().enumerate() {
            self.sweep_column(j, &projection, None, reciprocal_of_sum(sum), &mut sweep);
        }
        Ok(judged.correct(sweep.b, innovation, state))
    }

    /// [`Self::update`] by a measurement of state `I` itself, `z = x_I + noise`.
    ///
    /// Row I of U is then only scaled, `U_Ij <- U_Ij R / a_(j-1)`, without a subtraction.
    ///
    /// # Errors
    /// As of [`Self::update`].
    #[inline]
    pub fn update_state<const I: usize>(
        &mut self,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal> {
        const { assert!(I < N, "no such state") };
        let projection = self.project_state(I, noise);
        let judged = projection.judge(innovation)?;
        let b = self.sweep(&projection, Some(I));
        Ok(judged.correct(b, innovation, state))
    }

    #[inline]
    fn project(&self, row: &SVector<T, N>, noise: T) -> Projection<T, N> {
        let [row] = &row.data.0;
        let mut p = Projection { noise, f: *row, g: [T::zero(); N], sums: [noise; N] };
        let mut sum = noise;
        for_columns!(up to N, |j| {
            self.project_on_column(j, row, &mut p.f);
            self.sum_column(j, &mut p, &mut sum);
        });
        p
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn project_on_column(&self, j: usize, row: &[T; N], f: &mut [T; N]) {
        let (Some(column), Some(f)) = (self.unit.get(j), f.get_mut(j)) else { return };
        for (&u, &h) in column.iter().zip(row).take(j) {
            *f += u * h;
        }
    }

    /// [`Self::project`] on a row that is 1 at `state` and 0 elsewhere.
    #[inline]
    fn project_state(&self, state: usize, noise: T) -> Projection<T, N> {
        let mut p = Projection { noise, f: [T::zero(); N], g: [T::zero(); N], sums: [noise; N] };
        let mut sum = noise;
        for_columns!(up to N, |j| {
            if j >= state {
                if let (Some(column), Some(f)) = (self.unit.get(j), p.f.get_mut(j)) {
                    *f = if j == state { T::one() } else { column.get(state).copied().unwrap_or_default() };
                }
                self.sum_column(j, &mut p, &mut sum);
            }
        });
        p
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn sum_column(&self, j: usize, p: &mut Projection<T, N>, sum: &mut T) {
        let (Some(&f), Some(g), Some(a)) = (p.f.get(j), p.g.get_mut(j), p.sums.get_mut(j)) else { return };
        *g = self.weights.get(j).copied().unwrap_or_default() * f;
        *sum += f * *g;
        *a = *sum;
    }

    /// The factors after the measurement, of `state` alone or of a combination; returns `b = P h`.
    #[inline]
    fn sweep(&mut self, p: &Projection<T, N>, state: Option<usize>) -> [T; N] {
        let mut sweep = Sweep::new(p.noise);
        for_columns!(up to N, |j| {
            let per_sum = p.sums.get(j).and_then(|&sum| reciprocal_of_sum(sum));
            self.sweep_column(j, p, state, per_sum, &mut sweep);
        });
        sweep.b
    }

    /// [`Self::sweep`] where the noise has a reciprocal, and so have all the sums, none of which is less.
    #[inline]
    fn sweep_at_once(&mut self, p: &Projection<T, N>, per_variance: T) -> [T; N] {
        let per_sums = p.per_sums(per_variance);
        let mut sweep = Sweep::new(p.noise);
        for_columns!(up to N, |j| self.sweep_column(j, p, None, per_sums.get(j).copied(), &mut sweep));
        sweep.b
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn sweep_column(
        &mut self,
        j: usize,
        p: &Projection<T, N>,
        state: Option<usize>,
        per_sum: Option<T>,
        sweep: &mut Sweep<T, N>,
    ) {
        if state.is_some_and(|state| j < state) {
            return;
        }
        let (Some(column), Some(weight)) = (self.unit.get_mut(j), self.weights.get_mut(j)) else { return };
        let (Some(&f), Some(&g), Some(&sum)) = (p.f.get(j), p.g.get(j), p.sums.get(j)) else { return };
        // While the sum is zero so is b, and the column does not change.
        let slope = sweep.per_sum.map_or(T::zero(), |per| f * per);
        *weight *= per_sum.map_or(T::one(), |per| sweep.sum * per);
        let pass = |(u, b): (&mut T, &mut T)| {
            let old = *u;
            *u -= slope * *b;
            *b += g * old;
        };
        if N > UNROLLED_STATES && N.is_multiple_of(4) {
            // Four rows at a time. On the diagonal, whose one stays, and below it b is still zero, and so is U below
            // it.
            let fours = column.as_chunks_mut::<4>().0.iter_mut().zip(sweep.b.as_chunks_mut::<4>().0);
            for (us, bs) in fours.take(j / 4 + 1) {
                us.iter_mut().zip(bs).for_each(pass);
            }
        } else {
            column.iter_mut().zip(&mut sweep.b).take(j).for_each(pass);
        }
        if let Some(u) = state.filter(|&state| state < j).and_then(|state| column.get_mut(state)) {
            *u = sweep.per_sum.map_or(f, |per| f * (p.noise * per));
        }
        if let Some(b) = sweep.b.get_mut(j) {
            *b = g;
        }
        (sweep.sum, sweep.per_sum) = (sum, per_sum);
    }
}

/// A measurement that can be used.
struct Judged<T> {
    variance: T,
    per_variance: T,
    normalised_squared: T,
}

impl<T: Real, const N: usize> Projection<T, N> {
    #[inline]
    fn variance(&self) -> T {
        self.sums.last().copied().unwrap_or(self.noise)
    }

    /// `1 / a_j` of all columns before any changes: independent divisions overlap in the processor.
    #[inline]
    fn per_sums(&self, per_variance: T) -> [T; N] {
        let mut per_sums = [per_variance; N];
        let before_last = self.sums.split_last().map_or(&[][..], |(_, sums)| sums);
        for (per, &sum) in per_sums.iter_mut().zip(before_last) {
            *per = T::one() / sum;
        }
        per_sums
    }

    /// A finite normalised square bounds the correction too: `(K_i innovation)^2 <= P_ii NIS`.
    #[inline]
    fn judge(&self, innovation: T) -> Result<Judged<T>, Refusal> {
        // Written so that NaN is refused too.
        let noise_known = self.noise >= T::zero();
        if !noise_known {
            return Err(Refusal::Noise);
        }
        let variance = self.variance();
        if !is_finite(variance) {
            return Err(Refusal::Uncertain);
        }
        let per_variance = reciprocal_of_sum(variance).ok_or(Refusal::Certain)?;
        let normalised_squared = innovation * per_variance * innovation;
        if !is_finite(normalised_squared) {
            return Err(Refusal::Innovation);
        }
        Ok(Judged { variance, per_variance, normalised_squared })
    }
}

impl<T: Real> Judged<T> {
    #[inline]
    fn correct<const N: usize>(
        self,
        b: [T; N],
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Correction<T, N> {
        let gain = SVector::from(b) * self.per_variance;
        *state += gain * innovation;
        Correction { variance: self.variance, gain, normalised_squared: self.normalised_squared }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;
    use proptest::prelude::*;

    use super::*;
    use crate::test_support::Rounded;

    type Dense = SMatrix<f64, 6, 6>;
    type Row = SVector<f64, 6>;

    /// A covariance of six states from 36 numbers, two combinations of them known exactly.
    fn partly_known(numbers: &[f64]) -> UdCovariance<f64, 6> {
        let mut p = UdCovariance::from_diagonal(&Row::from([1.0, 2.0, 0.0, 0.5, 0.0, 3.0]));
        p.transform(&(Dense::identity() + Dense::from_column_slice(numbers) * 0.2)).unwrap();
        p
    }

    fn assert_one_by_one_is_at_once<T: Rounded>(p: &UdCovariance<f64, 6>, row: &Row, noise: f64) {
        let p = UdCovariance::<T, 6> {
            unit: p.unit.map(|column| column.map(T::rounded)),
            weights: p.weights.map(T::rounded),
        };
        let (row, noise, innovation) = (row.map(T::rounded), T::rounded(noise), T::rounded(0.7));
        let (mut at_once, mut one_by_one) = (p, p);
        let (mut x, mut y) = (SVector::zeros(), SVector::zeros());
        let correction = at_once.update(&row, noise, innovation, &mut x);
        assert_eq!(correction, one_by_one.update_exactly(&row, noise, innovation, &mut y));
        assert!(at_once != p && at_once == one_by_one && x == y);
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// To the bit, since both divide by the same sums.
        #[test]
        fn dual_divisions_together_are_those_one_by_one(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 36),
            row in proptest::array::uniform6(-2.0..2.0_f64),
            noise in -12.0..3.0_f64,
        ) {
            let (p, row, noise) = (partly_known(&numbers), Row::from(row), 10.0_f64.powf(noise));
            assert_one_by_one_is_at_once::<f64>(&p, &row, noise);
            assert_one_by_one_is_at_once::<f32>(&p, &row, noise);
        }

        /// A perfect measurement by the textbook, `P - P h h'P / h'P h`; and one whose noise has no reciprocal is
        /// perfect to rounding.
        #[test]
        fn exact_a_perfect_measurement_of_six_states(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 36),
            row in proptest::array::uniform6(-2.0..2.0_f64),
            unseen in 0..6_usize,
        ) {
            let (before, mut row) = (partly_known(&numbers), Row::from(row));
            // The sums begin with zeros.
            row.rows_mut(0, unseen).fill(0.0);
            let p = before.covariance();
            let cross = p * row;
            let variance = row.dot(&cross);
            prop_assume!(variance > 1e-3);
            let expected = p - cross * cross.transpose() / variance;
            for noise in [0.0, f64::from_bits(1), 1e-310] {
                let (mut after, mut x) = (before, Row::zeros());
                let correction = after.update(&row, noise, 0.7, &mut x).unwrap();
                prop_assert!((after.covariance() - expected).abs().max() < 1e-12 * (1.0 + p.abs().max() / variance));
                prop_assert!((x - cross * (0.7 / variance)).abs().max() < 1e-12 * (1.0 + p.abs().max() / variance));
                prop_assert!((correction.variance / variance - 1.0).abs() < 1e-12);
                prop_assert!(after.weights().iter().all(|&weight| weight >= 0.0));
            }
        }
    }
}
