//! Any map, by Thornton's modified weighted Gram-Schmidt.

use nalgebra::{SMatrix, SVector};

use super::{Sealed, Transition};
use crate::real::{Real, is_finite, reciprocal, total};
use crate::ud_covariance::{Columns, UdCovariance};

/// Any matrix F, singular ones included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dense<T, const N: usize>(pub SMatrix<T, N, N>);

impl<T, const N: usize> Sealed for Dense<T, N> {}

impl<T: Real, const N: usize> Transition<T, N> for Dense<T, N> {
    #[inline]
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N> {
        self.0 * state
    }

    #[inline]
    fn is_finite(&self) -> bool {
        let mut sums = [T::zero(); N];
        for column in &self.0.data.0 {
            for (sum, &entry) in sums.iter_mut().zip(column) {
                *sum += entry;
            }
        }
        is_finite(total(&sums))
    }

    #[inline]
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>) {
        let mut w = self.product(&covariance.unit);
        let old = covariance.weights;
        let columns = covariance.unit.iter_mut().zip(&mut covariance.weights).enumerate().rev();
        for (i, (column, weight)) in columns {
            let sums = weighted_products(&w, &old, i);
            *weight = sums.get(i).copied().unwrap_or_default();
            let per_weight = reciprocal(*weight);
            // Too small for its reciprocal. An infinity or NaN stays: it is not certainty.
            if per_weight.is_none() && is_finite(*weight) {
                *weight = T::zero();
            }
            for (u, &sum) in column.iter_mut().zip(&sums).take(i) {
                *u = per_weight.map_or(T::zero(), |per| sum * per);
            }
            for from in &mut w {
                let Some(entry) = from.get_mut(i) else { continue };
                let share = core::mem::take(entry);
                for (x, &u) in from.iter_mut().zip(column.iter()).take(i) {
                    *x -= share * u;
                }
            }
        }
    }
}

impl<T: Real, const N: usize> Dense<T, N> {
    /// `F U`.
    #[inline]
    fn product(&self, unit: &Columns<T, N>) -> Columns<T, N> {
        let mut product = self.0.data.0;
        for (j, (out, column)) in product.iter_mut().zip(unit).enumerate() {
            for (f, &u) in self.0.data.0.iter().zip(column).take(j) {
                for (entry, &x) in out.iter_mut().zip(f) {
                    *entry += u * x;
                }
            }
        }
        product
    }
}

/// Products of row `i` with every row, in the weights.
#[inline]
fn weighted_products<T: Real, const N: usize>(w: &Columns<T, N>, weights: &[T; N], i: usize) -> [T; N] {
    let mut sums = [T::zero(); N];
    for (column, &weight) in w.iter().zip(weights) {
        let Some(&entry) = column.get(i) else { continue };
        let share = weight * entry;
        for (sum, &x) in sums.iter_mut().zip(column) {
            *sum += share * x;
        }
    }
    sums
}
