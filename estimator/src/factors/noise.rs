//! Noise added in factorised form, one source after the other (Agee-Turner).
//!
//! As published, the source's variance runs down with the columns, `c <- c D_j / (D_j + c a_j^2)`: four products and a division, one waiting for the
//! other, a column. Its reciprocal is a sum instead (Gill, Golub, Murray and Saunders, Math. Comp. 28 (1974) 505-535, method C1),
//!
//! ```text
//! s <- s + c a_j^2 / D_j,   s = 1 at the last column,   and what is left of the variance is c / s
//! ```
//!
//! which leaves only an addition to wait for.

use motor_model::Real;
use nalgebra::SVector;

use super::{UdCovariance, for_columns, is_finite, reciprocal};

/// A source of process noise: `variance * gain gain'` is what it adds to the covariance in a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoiseSource<T, const N: usize> {
    /// How each state answers it. Zeros after the last state that does cost nothing.
    pub gain: SVector<T, N>,
    /// Its variance over the step. One that is not positive adds nothing.
    pub variance: T,
}

/// A source on its way from the last column to the first.
#[derive(Clone, Copy)]
struct Arriving<T, const N: usize> {
    /// `a`, less what the columns passed have taken.
    gain: [T; N],
    variance: T,
    /// `s`, infinite once nothing is left.
    spent: T,
    per_spent: T,
}

/// What one source does to one column.
struct Meeting<T> {
    spent: T,
    per_spent: T,
    weight: T,
    per_weight: T,
    slope: T,
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
        let mut arriving = sources.map(Arriving::new);
        for_columns!(down from N, |j| self.add_to_column(j, &mut arriving));
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn add_to_column<const M: usize>(&mut self, j: usize, arriving: &mut [Arriving<T, N>; M]) {
        let (Some(column), Some(d)) = (self.unit.get_mut(j), self.weights.get_mut(j)) else { return };
        let (mut unit, mut weight, mut per_weight) = (*column, *d, T::one() / *d);
        for source in arriving {
            let Some(&entry) = source.gain.get(j) else { continue };
            if entry == T::zero() {
                continue;
            }
            let Some(meeting) = source.meet(entry, weight, per_weight) else { continue };
            (weight, per_weight) = (meeting.weight, meeting.per_weight);
            (source.spent, source.per_spent) = (meeting.spent, meeting.per_spent);
            for (u, a) in unit.iter_mut().zip(&mut source.gain).take(j) {
                *a -= entry * *u;
                *u += meeting.slope * *a;
            }
        }
        (*column, *d) = (unit, weight);
    }
}

impl<T: Real, const N: usize> Arriving<T, N> {
    #[inline]
    fn new(source: NoiseSource<T, N>) -> Self {
        let [gain] = source.gain.data.0;
        let variance = if source.variance > T::zero() { source.variance } else { T::zero() };
        Self { gain, variance, spent: T::one(), per_spent: T::one() }
    }

    /// `None` when nothing is left of the source, to this precision.
    #[inline]
    fn meet(&self, entry: T, weight: T, per_weight: T) -> Option<Meeting<T>> {
        let pull = self.variance * entry;
        let push = pull * entry;
        let spent = self.spent + push * per_weight;
        let sum = weight + push * self.per_spent;
        if is_finite(spent) {
            let per_spent = T::one() / spent;
            let share = per_weight * per_spent;
            return Some(Meeting { spent, per_spent, weight: sum, per_weight: share * self.spent, slope: pull * share });
        }
        // The state was known exactly, or as good as: all that is left of the source goes here.
        let per_weight = reciprocal(sum)?;
        Some(Meeting {
            spent,
            per_spent: T::zero(),
            weight: sum,
            per_weight,
            slope: pull * self.per_spent * per_weight,
        })
    }
}
