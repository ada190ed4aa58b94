//! Block-diagonal maps whose blocks have different sizes.
//!
//! `F U` is upper triangular but for the blocks on its diagonal. The columns of one block are made so again by
//! Thornton's Gram-Schmidt on themselves, the rows within the block first. K rows of K columns span all that the
//! columns hold, to rounding, unless the block is singular or nearly so. What is left in the rows above is added to
//! them, as noise is, so that nothing is lost in any case.

use nalgebra::{SMatrix, SVector};

use super::Transition;
use crate::real::{Real, is_finite, reciprocal};
use crate::ud_covariance::UdCovariance;

/// A block-diagonal F of two to six square blocks, each of its own size: `Blocks((Matrix2::..., Matrix3::...))`.
///
/// A block of K states costs `O(K^2 n)`. For pairs only, [`crate::Blocks2`] costs less.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Blocks<L>(pub L);

mod sealed {
    pub trait Sealed {}
}
use sealed::Sealed;

/// Square blocks in order: tuples of two to six square matrices.
pub trait BlockList<T: Real>: Sealed {
    /// States of all blocks.
    const STATES: usize;

    /// `F x` on the first states of `rows`, by each block that begins at state `last` or before.
    #[doc(hidden)]
    fn carry_rows(&self, last: usize, rows: &mut [T]);

    /// `P <- F P F'` on the factors.
    #[doc(hidden)]
    fn carry_columns<const N: usize>(&self, covariance: &mut UdCovariance<T, N>);

    /// The sum of all entries.
    #[doc(hidden)]
    fn sum(&self) -> T;
}

impl<T: Real, L: BlockList<T>, const N: usize> Transition<T, N> for Blocks<L> {
    #[inline]
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N> {
        const { assert!(L::STATES == N, "the blocks have as many states as the filter") };
        let mut carried = *state;
        self.0.carry_rows(N, carried.as_mut_slice());
        carried
    }

    #[inline]
    fn is_finite(&self) -> bool {
        is_finite(self.0.sum())
    }

    #[inline]
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>) {
        const { assert!(L::STATES == N, "the blocks have as many states as the filter") };
        self.0.carry_columns(covariance);
    }
}

macro_rules! block_list {
    ($($block:ident $size:ident),*) => {
        impl<T, $(const $size: usize),*> Sealed for ($(SMatrix<T, $size, $size>,)*) {}

        impl<T: Real, $(const $size: usize),*> BlockList<T> for ($(SMatrix<T, $size, $size>,)*) {
            const STATES: usize = 0 $(+ $size)*;

            #[inline]
            fn carry_rows(&self, last: usize, rows: &mut [T]) {
                let (($($block,)*), mut first) = (self, 0);
                $(
                    if first <= last {
                        carry_block($block, rows.get_mut(first..).unwrap_or_default());
                    }
                    first += $size;
                )*
                let _ = first;
            }

            #[inline]
            fn carry_columns<const N: usize>(&self, covariance: &mut UdCovariance<T, N>) {
                let mut first = 0;
                $(
                    for column in covariance.unit.iter_mut().skip(first).take($size) {
                        self.carry_rows(first, column);
                    }
                    restore::<T, N, $size>(covariance, first);
                    first += $size;
                )*
                let _ = first;
            }

            #[inline]
            fn sum(&self) -> T {
                let ($($block,)*) = self;
                let sums = [$($block.iter().fold(T::zero(), |sum, &entry| sum + entry)),*];
                sums.iter().fold(T::zero(), |sum, &of_block| sum + of_block)
            }
        }
    };
}

block_list!(a A, b B);
block_list!(a A, b B, c C);
block_list!(a A, b B, c C, d D);
block_list!(a A, b B, c C, d D, e E);
block_list!(a A, b B, c C, d D, e E, f F);

/// The first K of `rows`, by their block.
#[inline]
fn carry_block<T: Real, const K: usize>(block: &SMatrix<T, K, K>, rows: &mut [T]) {
    let Some(rows) = rows.first_chunk_mut::<K>() else { return };
    let before = core::mem::replace(rows, [T::zero(); K]);
    for (column, &x) in block.data.0.iter().zip(&before) {
        for (row, &entry) in rows.iter_mut().zip(column) {
            *row += entry * x;
        }
    }
}

/// Makes the K columns from `first` on unit upper triangular again.
#[inline]
fn restore<T: Real, const N: usize, const K: usize>(covariance: &mut UdCovariance<T, N>, first: usize) {
    let columns = covariance.unit.get_mut(first..).and_then(|from| from.first_chunk_mut::<K>());
    let weights = covariance.weights.get_mut(first..).and_then(|from| from.first_chunk_mut::<K>());
    let (Some(columns), Some(weights)) = (columns, weights) else { return };
    let (mut left, old) = (*columns, *weights);
    for (k, (column, weight)) in columns.iter_mut().zip(weights.iter_mut()).enumerate().rev() {
        let i = first + k;
        let mut sums = [T::zero(); N];
        for (from, &weight) in left.iter().zip(&old) {
            let share = weight * from.get(i).copied().unwrap_or_default();
            for (sum, &x) in sums.iter_mut().zip(from).take(i + 1) {
                *sum += share * x;
            }
        }
        *weight = sums.get(i).copied().unwrap_or_default();
        let per_weight = reciprocal(*weight);
        // Too small for its reciprocal. An infinity or NaN stays: it is not certainty.
        if per_weight.is_none() && is_finite(*weight) {
            *weight = T::zero();
        }
        for (j, (u, &sum)) in column.iter_mut().zip(&sums).enumerate() {
            *u = match j.cmp(&i) {
                core::cmp::Ordering::Less => per_weight.map_or(T::zero(), |per| sum * per),
                core::cmp::Ordering::Equal => T::one(),
                core::cmp::Ordering::Greater => T::zero(),
            };
        }
        for from in &mut left {
            let share = from.get_mut(i).map(core::mem::take).unwrap_or_default();
            for (x, &u) in from.iter_mut().zip(column.iter()).take(i) {
                *x -= share * u;
            }
        }
    }
    for (left, weight) in left.into_iter().zip(old) {
        covariance.add_rank_one(&left.into(), weight);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix1, Matrix2, Matrix3, SMatrix};
    use proptest::prelude::*;

    use super::*;
    use crate::test_support::Rounded;

    type Sizes<T> = Blocks<(SMatrix<T, 2, 2>, SMatrix<T, 1, 1>, SMatrix<T, 3, 3>)>;

    /// A covariance, the blocks, and F in full.
    fn model<T: Rounded>(
        numbers: &[f64],
        entries: &[f64],
    ) -> (UdCovariance<T, 6>, Sizes<T>, SMatrix<T, 6, 6>) {
        let a = SMatrix::<f64, 6, 6>::from_column_slice(numbers);
        let p = (a * a.transpose() + SMatrix::identity() * 0.1).map(T::rounded);
        let first = Matrix2::from_column_slice(&entries[..4]).map(T::rounded);
        let second = Matrix1::new(entries[4]).map(T::rounded);
        let third = Matrix3::from_column_slice(&entries[5..]).map(T::rounded);
        let mut full = SMatrix::<T, 6, 6>::zeros();
        full.fixed_view_mut::<2, 2>(0, 0).copy_from(&first);
        full.fixed_view_mut::<1, 1>(2, 2).copy_from(&second);
        full.fixed_view_mut::<3, 3>(3, 3).copy_from(&third);
        (UdCovariance::from_covariance(&p).unwrap(), Blocks((first, second, third)), full)
    }

    /// The largest difference of state and covariance from `F x` and `F P F'` in `f64`, over the largest variance; and
    /// whether the factors are such.
    fn difference<T: Rounded>(numbers: &[f64], entries: &[f64], known: Option<usize>) -> (f64, bool) {
        let (mut blocks, f, full) = model::<T>(numbers, entries);
        if let Some(state) = known {
            blocks.weights[state] = T::zero();
        }
        let (unit, d, wide) = (blocks.unit_factor(), blocks.weights(), full.map(Rounded::wide));
        let half = wide * unit.map(Rounded::wide);
        let expected = half * SMatrix::from_diagonal(&d.map(Rounded::wide)) * half.transpose();
        blocks.predict(&f, &[]).unwrap();
        let is_unit = blocks.unit_factor().lower_triangle() == SMatrix::<T, 6, 6>::identity();
        let positive = blocks.weights.iter().all(|&weight| weight >= T::zero());
        let state = SVector::from_fn(|i, _| T::rounded(i as f64 - 2.0));
        let moved = (f.carry(&state) - full * state).map(Rounded::wide).abs().max();
        let error = (blocks.covariance().map(Rounded::wide) - expected).abs().max();
        let error = error.max(moved) / (1.0 + expected.abs().max());
        (error, is_unit && positive)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Two, one and three states; a block may be singular, and a state known exactly. The bounds are some dozens of
        /// roundings.
        #[test]
        fn dual_blocks_of_different_sizes_equal_the_matrix_product(
            numbers in prop::collection::vec(-2.0..2.0_f64, 36),
            entries in prop::collection::vec(-1.5..1.5_f64, 14),
            singular in 0..4_usize, known in prop::option::of(0..6_usize),
        ) {
            let mut entries = entries;
            match singular {
                0 => entries.copy_within(..2, 2),
                1 => entries[4] = 0.0,
                2 => entries[8..].fill(0.0),
                _ => {}
            }
            let (error, is_factors) = difference::<f64>(&numbers, &entries, known);
            prop_assert!(error < 1e-12 && is_factors, "{error:e}");
            let (error, is_factors) = difference::<f32>(&numbers, &entries, known);
            prop_assert!(error < 1e-5 && is_factors, "{error:e}");
        }
    }
}
