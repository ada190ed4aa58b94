//! Any map, by Thornton's modified weighted Gram-Schmidt.

use nalgebra::{SMatrix, SVector};

use super::Transition;
use crate::real::{Real, is_finite, reciprocal, total};
use crate::ud_covariance::{Columns, UdCovariance, for_columns};

/// Any matrix F, singular ones included.
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
pub struct Dense<T, const N: usize>(pub SMatrix<T, N, N>);

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
        let mut products = [T::zero(); N];
        for (from, &weight) in w.iter().zip(&old) {
            add_products(from, weight, N, &mut products);
        }
        for_columns!(down from N, |i| orthogonalise(i, &mut w, &old, &mut products, covariance));
    }
}

/// Products of the last of the first `rows` with each of them, in the weights: the share of one column.
#[expect(clippy::inline_always, reason = "rows is to be a constant in it")]
#[inline(always)]
fn add_products<T: Real, const N: usize>(from: &[T; N], weight: T, rows: usize, products: &mut [T; N]) {
    let Some(&last) = from.get(rows - 1) else { return };
    let share = weight * last;
    for (product, &x) in products.iter_mut().zip(from).take(rows) {
        *product += share * x;
    }
}

/// Column `i` of U and its weight, from the `products` of row `i`; makes the rows before orthogonal to it, and leaves
/// the products of the one before. Each column of W is passed once.
#[expect(clippy::inline_always, reason = "i is to be a constant in it")]
#[inline(always)]
fn orthogonalise<T: Real, const N: usize>(
    i: usize,
    w: &mut Columns<T, N>,
    old: &[T; N],
    products: &mut [T; N],
    covariance: &mut UdCovariance<T, N>,
) {
    let (Some(column), Some(weight)) = (covariance.unit.get_mut(i), covariance.weights.get_mut(i)) else {
        return;
    };
    *weight = products.get(i).copied().unwrap_or_default();
    let per_weight = reciprocal(*weight);
    // Too small for its reciprocal. An infinity or NaN stays: it is not certainty.
    if per_weight.is_none() && is_finite(*weight) {
        *weight = T::zero();
    }
    if i == 0 {
        return;
    }
    for (u, &product) in column.iter_mut().zip(products.iter()).take(i) {
        *u = per_weight.map_or(T::zero(), |per| product * per);
    }
    *products = [T::zero(); N];
    for (from, &weight) in w.iter_mut().zip(old) {
        let Some(&share) = from.get(i) else { continue };
        for (x, &u) in from.iter_mut().zip(column.iter()).take(i) {
            *x -= share * u;
        }
        add_products(from, weight, i, products);
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
