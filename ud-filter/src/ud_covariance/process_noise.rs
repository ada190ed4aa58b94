//! Noise added in factorised form, one source after the other (Agee-Turner).
//!
//! As published, the variance of the source decreases from column to column, `c <- c D_j / (D_j + c a_j^2)`: a chain of
//! four products and a division for each column. Its reciprocal is a sum instead (Gill, Golub, Murray and Saunders,
//! Math. Comp. 28 (1974) 505-535, method C1),
//!
//! ```text
//! s <- s + c a_j^2 / D_j,   s = 1 at the last column,   and the remaining variance is c / s
//! ```
//!
//! which leaves a chain of additions. The published form is used for a few states, where the chain of divisions
//! determines the time, and for a state known exactly (`D_j = 0`, or so small that `s` overflows), which takes all the
//! remaining variance.
//!
//! The column becomes
//!
//! ```text
//! u <- u + b (a - a_j u) = (D_j / D) u + b a,   b = c a_j / (s D),   D the weight after it
//! ```
//!
//! The first form keeps a column exactly where a source adds little. Where a source dwarfs what it meets, `b a_j` is
//! nearly 1 and the first form loses the column to rounding if u is large, as after a transition that is nearly
//! singular. The second is used there, as Gill and others advise, and for a few states, where it costs no more.
//! With more than twelve states the first form alone is used: there the second would be a quarter of the code.

use nalgebra::SVector;

use super::{FEW_STATES, UdCovariance, for_columns};
use crate::real::{Real, is_finite, total};

/// A source of process noise: `variance * gain gain'` is what it adds to the covariance in a step.
///
/// It passes the states from the last one that it acts on to the first, and costs a division and a column for each. So
/// put the states on which noise acts first, within a block of [`crate::Blocks2`] in any case. With modes as (velocity
/// over natural frequency, displacement), and not the other way round, a step of six states and two measurements takes
/// 8 % less time, and one of ten states and one measurement 11 %.
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
pub struct NoiseSource<T, const N: usize> {
    /// Effect on each state. Zeros after the last state with an effect cost nothing.
    pub gain: SVector<T, N>,
    /// Variance over the step, not negative.
    pub variance: T,
}

/// Up to so many states a column is straight-line code.
const UNROLLED_STATES: usize = 12;

/// A source on its way from the last column to the first.
#[derive(Clone, Copy)]
struct SourceSweep<T, const N: usize> {
    /// `a`, less the part that the columns passed have taken.
    gain: [T; N],
    variance: T,
    /// `s`, infinite once no variance remains.
    spent: T,
    per_spent: T,
}

/// What one source does to one column.
struct ColumnGain<T> {
    spent: T,
    per_spent: T,
    weight: T,
    per_weight: T,
    slope: T,
    /// Weight before per weight after.
    kept: T,
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// `P <- P + variance * direction direction'`, as by [`Self::add_noise`].
    ///
    /// There is no counterpart that subtracts, because the result might not be a covariance. A measurement subtracts,
    /// with [`Self::update`].
    #[inline]
    pub fn add_rank_one(&mut self, direction: &SVector<T, N>, variance: T) {
        self.add_noise(&[NoiseSource { gain: *direction, variance }]);
    }

    /// `P <- P + sum c a a'` over the sources. A negative variance adds nothing. A number that is infinite or NaN makes
    /// the variances that it reaches infinite or NaN: [`Self::predict`] refuses it.
    ///
    /// All sources pass column by column, so that a column is fetched once and one source's division overlaps
    /// another's.
    #[inline]
    pub fn add_noise<const M: usize>(&mut self, sources: &[NoiseSource<T, N>; M]) {
        let mut arriving = sources.map(SourceSweep::new);
        for_columns!(down from N, |j| self.add_to_column(j, &mut arriving));
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn add_to_column<const M: usize>(&mut self, j: usize, arriving: &mut [SourceSweep<T, N>; M]) {
        let (Some(column), Some(d)) = (self.unit.get_mut(j), self.weights.get_mut(j)) else { return };
        if j == 0 {
            for source in arriving {
                *d += source.left_at_first();
            }
            return;
        }
        let is_silent =
            |source: &SourceSweep<T, N>| source.gain.get(j).is_none_or(|&entry| entry == T::zero());
        if N > UNROLLED_STATES && arriving.iter().all(is_silent) {
            return;
        }
        let (mut weight, mut per_weight) = (*d, T::one() / *d);
        // A few rows fit in registers meanwhile; many do not.
        let mut unit = if N > UNROLLED_STATES { None } else { Some(*column) };
        for_columns!(up to M, |m| {
            if let Some(source) = arriving.get_mut(m) {
                source.add_to_column(j, unit.as_mut().unwrap_or(column), &mut weight, &mut per_weight);
            }
        });
        if let Some(unit) = unit {
            for (to, from) in column.iter_mut().zip(unit).take(j) {
                *to = from;
            }
        }
        *d = weight;
    }
}

/// Whether all gains and variances are numbers of usable size, and no variance is negative.
#[inline]
pub(crate) fn are_usable<T: Real, const N: usize, const M: usize>(sources: &[NoiseSource<T, N>; M]) -> bool {
    let (mut sums, mut variances) = ([T::zero(); N], T::zero());
    for source in sources {
        for (sum, &gain) in sums.iter_mut().zip(source.gain.as_slice()) {
            *sum += gain;
        }
        variances += source.variance;
    }
    is_finite(total(&sums) + variances) && sources.iter().all(|source| source.variance >= T::zero())
}

impl<T: Real, const N: usize> SourceSweep<T, N> {
    #[inline]
    fn new(source: NoiseSource<T, N>) -> Self {
        let [gain] = source.gain.data.0;
        let variance = if source.variance <= T::zero() { T::zero() } else { source.variance };
        Self { gain, variance, spent: T::one(), per_spent: T::one() }
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn add_to_column(&mut self, j: usize, unit: &mut [T; N], weight: &mut T, per_weight: &mut T) {
        let Some(&entry) = self.gain.get(j) else { return };
        if entry == T::zero() {
            return;
        }
        let Some(meeting) = self.column_gain(entry, *weight, *per_weight) else { return };
        (*weight, *per_weight) = (meeting.weight, meeting.per_weight);
        (self.spent, self.per_spent) = (meeting.spent, meeting.per_spent);
        if N <= FEW_STATES {
            return self.take_share(j, unit, entry, &meeting);
        }
        // With a quarter or more kept, the first form loses two bits at most.
        let twice = meeting.kept + meeting.kept;
        if N <= UNROLLED_STATES && twice + twice < T::one() {
            return self.dwarf_column(j, unit, entry, &meeting);
        }
        for (u, a) in unit.iter_mut().zip(&mut self.gain).take(j) {
            *a -= entry * *u;
            *u += meeting.slope * *a;
        }
    }

    /// The column where little of it remains.
    #[cold]
    #[inline(never)]
    fn dwarf_column(&mut self, j: usize, unit: &mut [T; N], entry: T, meeting: &ColumnGain<T>) {
        self.take_share(j, unit, entry, meeting);
    }

    /// The column by the second form.
    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn take_share(&mut self, j: usize, unit: &mut [T; N], entry: T, meeting: &ColumnGain<T>) {
        for (u, a) in unit.iter_mut().zip(&mut self.gain).take(j) {
            let whole = *a;
            *a -= entry * *u;
            *u = meeting.kept * *u + meeting.slope * whole;
        }
    }

    /// What it adds to the first column, where it ends.
    #[inline]
    fn left_at_first(&self) -> T {
        self.gain.first().map_or(T::zero(), |&entry| self.variance * entry * entry * self.per_spent)
    }

    /// `None` when the source adds nothing to this column in this precision.
    #[inline]
    fn column_gain(&self, entry: T, weight: T, per_weight: T) -> Option<ColumnGain<T>> {
        let pull = self.variance * entry;
        let push = pull * entry;
        let sum = weight + push * self.per_spent;
        let spent = self.spent + push * per_weight;
        let share = pull * per_weight;
        // Both finite, in one comparison. Where the next reciprocal of the weight is not, the next source takes the
        // published form.
        if N > FEW_STATES && is_finite(spent + share) {
            let per_spent = T::one() / spent;
            return Some(ColumnGain {
                spent,
                per_spent,
                weight: sum,
                per_weight: (per_weight * self.spent) * per_spent,
                slope: share * per_spent,
                kept: self.spent * per_spent,
            });
        }
        let per_weight = T::one() / sum;
        let slope = pull * self.per_spent / sum;
        let kept = weight / sum;
        let per_spent = self.per_spent * kept;
        // A weight that is infinite or NaN is told, not left out.
        (is_finite(slope) || !is_finite(sum)).then_some(ColumnGain {
            spent,
            per_spent,
            weight: sum,
            per_weight,
            slope,
            kept,
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;
    use crate::Dense;

    /// A transition that forgets nearly all of a state leaves a column of U that is as large as its weight is small.
    /// The noise that follows has the covariance of the two sums, by matrices: 1 part in 10^12 of the largest entries.
    #[test]
    fn dual_noise_after_a_transition_that_is_nearly_singular() {
        for kept in [0.0, 5e-16, 1e-9, 1e-4, 0.3] {
            let f = Matrix3::new(1.0, 1e-4, 0.0, 0.0, kept, 16.0, 0.0, 0.0, 1.0);
            let before = Matrix3::new(1e-9, 1e-7, 0.0, 1e-7, 2e-5, -2e-6, 0.0, -2e-6, 3e-5);
            let sources = [
                NoiseSource { gain: Vector3::new(8e-6, 1.0, 0.0), variance: 0.04 },
                NoiseSource { gain: Vector3::new(1.0, 0.0, 0.0), variance: 1e-12 },
            ];
            let mut p = UdCovariance::from_covariance(&before).unwrap();
            p.predict(&Dense(f), &sources).unwrap();
            let noise = sources.map(|source| source.gain * source.gain.transpose() * source.variance);
            let expected = f * before * f.transpose() + noise[0] + noise[1];
            let scale = expected.diagonal().map(f64::sqrt);
            let off = (p.covariance() - expected).component_div(&(scale * scale.transpose()));
            assert!(off.amax() < 1e-12, "{kept}: {off}");
        }
    }

    /// A weight among the smallest numbers, and a source so large that their ratio overflows: the result is the
    /// source's share.
    #[test]
    fn exact_a_source_that_dwarfs_what_it_meets() {
        let mut p = UdCovariance::<f32, 6>::from_diagonal(&SVector::repeat(1e-38));
        let gain = SVector::from([1.0, 0.0, 0.5, 1e-10, 0.0, 0.0]);
        p.add_rank_one(&gain, 1e12);
        let (expected, found) = (gain * gain.transpose() * 1e12, p.covariance());
        for (found, expected) in found.iter().zip(expected.iter()) {
            assert!((found - expected).abs() <= 1e-5 * expected.abs() + 1e-30, "{found} {expected}");
        }
    }
}
