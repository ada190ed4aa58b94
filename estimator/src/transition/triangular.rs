//! Upper triangular maps: chains of integrators and of lags.

use motor_model::Real;
use nalgebra::{SMatrix, SVector};

use super::{Dense, Sealed, Transition};
use crate::factors::{UdCovariance, reciprocal};

/// An upper triangular F, of which what lies below the diagonal is not read: position, rate, acceleration.
///
/// `F U` is upper triangular already; only the diagonal's scale goes into D, and not even that where it is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UpperTriangular<T, const N: usize>(pub SMatrix<T, N, N>);

impl<T, const N: usize> Sealed for UpperTriangular<T, N> {}

impl<T: Real, const N: usize> Transition<T, N> for UpperTriangular<T, N> {
    #[inline]
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N> {
        let mut carried = SVector::<T, N>::zeros();
        for (j, (f, &x)) in self.0.data.0.iter().zip(state.iter()).enumerate() {
            for (entry, &f) in carried.iter_mut().zip(f).take(j + 1) {
                *entry += f * x;
            }
        }
        carried
    }

    #[inline]
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>) {
        let mut scales = [T::one(); N];
        for (i, (scale, f)) in scales.iter_mut().zip(&self.0.data.0).enumerate() {
            *scale = f.get(i).copied().unwrap_or_default();
        }
        if scales.iter().any(|&scale| reciprocal(scale).is_none()) {
            return Dense(self.0.upper_triangle()).carry_factors(covariance);
        }
        let columns = covariance.unit.iter_mut().zip(&mut covariance.weights).zip(&self.0.data.0).zip(scales).enumerate();
        for (j, (((column, weight), f_j), scale)) in columns {
            let old = *column;
            for (i, (entry, f_i)) in column.iter_mut().zip(&scales).enumerate().take(j) {
                *entry *= *f_i;
                for (f, &u) in self.0.data.0.iter().zip(&old).take(j).skip(i + 1) {
                    *entry += f.get(i).copied().unwrap_or_default() * u;
                }
                *entry += f_j.get(i).copied().unwrap_or_default();
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
}
