//! Noise added in factorised form, one source after the other (Agee-Turner).

use motor_model::Real;
use nalgebra::SVector;

use super::{UdCovariance, reach, reciprocal};

/// A source of process noise: `variance * gain gain'` is what it adds to the covariance in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseSource<T, const N: usize> {
    /// How each state answers it. Zeros after the last state that does cost nothing.
    pub gain: SVector<T, N>,
    /// Its variance over the step. One that is not positive adds nothing.
    pub variance: T,
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// `P <- P + variance * direction direction'`, for a variance that is not negative; another one adds nothing.
    ///
    /// There is no counterpart that subtracts: what remained could be no covariance. A measurement subtracts, with [`Self::update`].
    #[inline]
    pub fn add_rank_one(&mut self, direction: &SVector<T, N>, variance: T) {
        self.add_noise(&[NoiseSource { gain: *direction, variance }]);
    }

    /// All sources pass column by column, so that a column is fetched once and one source's division overlaps another's.
    #[inline]
    pub(super) fn add_noise<const M: usize>(&mut self, sources: &[NoiseSource<T, N>; M]) {
        let mut rest = *sources;
        for (j, (column, weight)) in self.unit.iter_mut().zip(&mut self.weights).enumerate().rev() {
            for NoiseSource { gain, variance } in &mut rest {
                let [gain] = &mut gain.data.0;
                let Some(&entry) = gain.get(j) else { continue };
                if entry == T::zero() || !(*variance > T::zero()) {
                    continue;
                }
                let pull = *variance * entry;
                let sum = *weight + pull * entry;
                let Some(per_sum) = reciprocal(sum) else { continue };
                *variance *= *weight * per_sum;
                *weight = sum;
                let slope = pull * per_sum;
                // At the diagonal, where U is 1, `a` becomes 0; below it both are 0.
                for (u, a) in column.iter_mut().zip(gain.iter_mut()).take(reach::<N>(j)) {
                    *a -= entry * *u;
                    *u += slope * *a;
                }
            }
        }
    }
}
