//! Upper triangular maps: chains of integrators and of lags.

use nalgebra::{SMatrix, SVector};

use super::{Dense, Transition};
use crate::real::{Real, is_finite, reciprocal, total};
use crate::ud_covariance::{UdCovariance, for_columns};

/// An upper triangular F, of which what lies below the diagonal is not read: position, rate, acceleration.
///
/// `F U` is upper triangular already; only the diagonal's scale goes into D, and not even that where it is 1.
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
pub struct UpperTriangular<T, const N: usize>(pub SMatrix<T, N, N>);

impl<T: Real, const N: usize> Transition<T, N> for UpperTriangular<T, N> {
    #[inline]
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N> {
        let ([state], mut carried) = (&state.data.0, [T::zero(); N]);
        for_columns!(up to N, |j| self.carry_state(j, state, &mut carried));
        carried.into()
    }

    #[inline]
    fn is_finite(&self) -> bool {
        let mut sums = [T::zero(); N];
        for_columns!(up to N, |j| self.add_column(j, &mut sums));
        is_finite(total(&sums))
    }

    #[inline]
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>) {
        let mut scales = [T::one(); N];
        for (i, (scale, f)) in scales.iter_mut().zip(&self.0.data.0).enumerate() {
            *scale = f.get(i).copied().unwrap_or_default();
        }
        // The square too: it is what D is multiplied by.
        if scales.iter().any(|&scale| scale != T::one() && reciprocal(scale * scale).is_none()) {
            return self.carry_as_dense(covariance);
        }
        for_columns!(up to N, |j| self.carry_column(j, &scales, covariance));
    }
}

impl<T: Real, const N: usize> UpperTriangular<T, N> {
    /// A scale without a reciprocal. Rare, and on its own, for it takes two matrices of stack.
    #[cold]
    #[inline(never)]
    fn carry_as_dense(&self, covariance: &mut UdCovariance<T, N>) {
        Dense(self.0.upper_triangle()).carry_factors(covariance);
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn add_column(&self, j: usize, sums: &mut [T; N]) {
        let Some(f) = self.0.data.0.get(j) else { return };
        for (sum, &entry) in sums.iter_mut().zip(f).take(j + 1) {
            *sum += entry;
        }
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn carry_state(&self, j: usize, state: &[T; N], carried: &mut [T; N]) {
        let (Some(f), Some(&x)) = (self.0.data.0.get(j), state.get(j)) else { return };
        for (entry, &f) in carried.iter_mut().zip(f).take(j + 1) {
            *entry += f * x;
        }
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn carry_column(&self, j: usize, scales: &[T; N], covariance: &mut UdCovariance<T, N>) {
        let (Some(column), Some(weight)) = (covariance.unit.get_mut(j), covariance.weights.get_mut(j)) else {
            return;
        };
        let (Some(f_j), Some(&scale)) = (self.0.data.0.get(j), scales.get(j)) else { return };
        let old = *column;
        for (i, ((entry, &f_ij), &f_ii)) in column.iter_mut().zip(f_j).zip(scales).enumerate().take(j) {
            *entry = *entry * f_ii + f_ij;
            for (f, &u) in self.0.data.0.iter().zip(&old).take(j).skip(i + 1) {
                *entry += f.get(i).copied().unwrap_or_default() * u;
            }
        }
        if scale != T::one() {
            *weight *= scale * scale;
            let per_scale = T::one() / scale;
            for entry in column.iter_mut().take(j) {
                *entry *= per_scale;
            }
        }
    }
}
