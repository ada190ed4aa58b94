//! The time update: `P <- F P F' + sum c a a'`.
//!
//! Thornton, "Triangular covariance factorizations for Kalman filtering", thesis, UCLA (1976), for F; Agee and Turner,
//! White Sands technical report 38 (1972), for the noise.

use nalgebra::{SMatrix, SVector};

use crate::real::Real;
use crate::transition::{Blocks2, Dense, Transition};
use crate::ud_covariance::{NoiseSource, UdCovariance};

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// A step passes: `P <- F P F' + sum c a a'` over the noise sources. A source costs the less the earlier the last
    /// state is that it acts on ([`NoiseSource`]).
    #[inline]
    pub fn predict<F: Transition<T, N>, const M: usize>(
        &mut self,
        transition: &F,
        noise: &[NoiseSource<T, N>; M],
    ) {
        transition.carry_factors(self);
        self.add_noise(noise);
    }

    /// `P <- M P M'` for any matrix, singular ones included: for example the saltation matrix of an impact.
    pub fn transform(&mut self, map: &SMatrix<T, N, N>) {
        Dense(*map).carry_factors(self);
    }

    /// `P <- F P F'` where F is block diagonal in the first `L` states and 1 in the others.
    pub fn carry_first<const L: usize, const B: usize>(&mut self, blocks: &Blocks2<T, B>) {
        let mut first = UdCovariance::<T, L> { unit: [[T::zero(); L]; L], weights: [T::zero(); L] };
        for (to, from) in first.unit.iter_mut().zip(&self.unit) {
            for (to, &from) in to.iter_mut().zip(from) {
                *to = from;
            }
        }
        for (to, &from) in first.weights.iter_mut().zip(&self.weights) {
            *to = from;
        }
        blocks.carry_factors(&mut first);
        for (to, from) in self.unit.iter_mut().zip(&first.unit) {
            for (to, &from) in to.iter_mut().zip(from) {
                *to = from;
            }
        }
        for (to, &from) in self.weights.iter_mut().zip(&first.weights) {
            *to = from;
        }
        for column in self.unit.iter_mut().skip(L) {
            let mut lead = SVector::<T, L>::zeros();
            for (to, &from) in lead.iter_mut().zip(column.iter()) {
                *to = from;
            }
            for (to, &from) in column.iter_mut().zip(blocks.carry(&lead).iter()) {
                *to = from;
            }
        }
    }
}
