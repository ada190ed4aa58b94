//! The time update: `P <- F P F' + sum c a a'`.
//!
//! Thornton, "Triangular covariance factorizations for Kalman filtering", thesis, UCLA (1976), for F; Agee and Turner,
//! White Sands technical report 38 (1972), for the noise.

use nalgebra::{SMatrix, SVector};

use crate::real::Real;
use crate::transition::{Blocks2, Dense, Transition};
use crate::ud_covariance::{NoiseSource, UdCovariance, are_usable};

/// Why a prediction was refused. State and covariance are then as they were.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum PredictionRefusal {
    /// An entry of F is infinite or NaN, or F is too large for the precision.
    Transition,
    /// A gain or variance of the noise is infinite or NaN, a variance is negative, or they are too large for the
    /// precision.
    Noise,
    /// An entry of the state that follows is infinite or NaN, or their sum is too large for the precision.
    State,
}

impl core::fmt::Display for PredictionRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Transition => "the transition has an entry that is infinite or NaN",
            Self::Noise => "the noise has a gain that is infinite or NaN, or no variance",
            Self::State => "the predicted state has an entry that is infinite or NaN",
        })
    }
}

impl core::error::Error for PredictionRefusal {}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// A step passes: `P <- F P F' + sum c a a'` over the noise sources. A source costs the less the earlier the last
    /// state is that it acts on ([`NoiseSource`]).
    ///
    /// # Errors
    /// When F or a noise source is no usable number; nothing has changed then.
    #[inline]
    pub fn predict<F: Transition<T, N>, const M: usize>(
        &mut self,
        transition: &F,
        noise: &[NoiseSource<T, N>; M],
    ) -> Result<(), PredictionRefusal> {
        if !transition.is_finite() {
            return Err(PredictionRefusal::Transition);
        }
        if !are_usable(noise) {
            return Err(PredictionRefusal::Noise);
        }
        transition.carry_factors(self);
        self.add_noise(noise);
        Ok(())
    }

    /// `P <- M P M'` for any matrix, singular ones included: for example the saltation matrix of an impact.
    ///
    /// # Errors
    /// When M is no matrix of usable numbers; nothing has changed then.
    pub fn transform(&mut self, map: &SMatrix<T, N, N>) -> Result<(), PredictionRefusal> {
        self.predict(&Dense(*map), &[])
    }

    /// `P <- F P F' + sum c a a'` where F is block diagonal in the first `L` states and 1 in the others, and the noise
    /// acts on the first alone.
    #[inline]
    pub fn carry_first<const L: usize, const B: usize, const M: usize>(
        &mut self,
        blocks: &Blocks2<T, B>,
        noise: &[NoiseSource<T, L>; M],
    ) {
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
        first.add_noise(noise);
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
