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
//! With more than twelve states it is used only where a sum has no reciprocal.
//!
//! What takes the time is less the products than what waits for what: a source waits for its row of the gain, which the
//! column before has changed, and for the weight after the source before.

mod one_column;

use nalgebra::SVector;

use super::{FEW_STATES, UNROLLED_STATES, UdCovariance, for_columns};
use crate::real::{Real, is_finite, total};
use one_column::{VarianceLeft, add_to_dwarfed_column, move_column, take_share};

/// A source of process noise: `variance * gain gain'` is what it adds to the covariance in a step.
///
/// It passes the states from the last one that it acts on to the first, and costs a division and a column for each. So
/// put the states on which noise acts first, within a block of [`crate::Blocks2`] in any case. With modes as (velocity
/// over natural frequency, displacement), and not the other way round, a step of six states and two measurements takes
/// 8 % less time, and one of ten states and one measurement 9 %.
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

/// Whether the processor works on many instructions at once, as those of 64 bits do.
const SOURCE_BY_SOURCE: bool = cfg!(target_pointer_width = "64");

/// A source on its way from the last column to the first.
#[derive(Clone, Copy)]
struct SourceSweep<T, const N: usize> {
    /// `a`, less the part that the columns passed have taken.
    gain: [T; N],
    left: VarianceLeft<T>,
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
    /// The sources pass together, so that a column is fetched once; or, of a dozen states or less on a large processor,
    /// one by one: then its columns hardly wait for each other. The order changes no bit.
    #[inline]
    pub fn add_noise<const M: usize>(&mut self, sources: &[NoiseSource<T, N>; M]) {
        if SOURCE_BY_SOURCE && N > FEW_STATES && N <= UNROLLED_STATES {
            self.add_source_by_source(sources);
        } else {
            self.add_column_by_column(sources);
        }
    }

    #[inline]
    fn add_column_by_column<const M: usize>(&mut self, sources: &[NoiseSource<T, N>; M]) {
        let mut arriving = sources.map(SourceSweep::new);
        for_columns!(down from N, |j| self.add_to_column(j, &mut arriving));
    }

    #[inline]
    fn add_source_by_source<const M: usize>(&mut self, sources: &[NoiseSource<T, N>; M]) {
        let mut per_weights = self.weights;
        for per_weight in &mut per_weights {
            *per_weight = T::one() / *per_weight;
        }
        for source in sources {
            let SourceSweep { mut gain, left } = SourceSweep::new(*source);
            self.add_source(&mut gain, left.variance, &mut per_weights);
        }
    }

    /// One source to all columns. Not inlined: the compiler would hold the factors in registers that they do not fit.
    #[inline(never)]
    fn add_source(&mut self, gain: &mut [T; N], variance: T, per_weights: &mut [T; N]) {
        let mut left = VarianceLeft::all_of(variance);
        let mut entry = gain.last().copied().unwrap_or_default();
        for_columns!(down from N, |j| {
            self.add_source_to_column(j, &mut entry, gain, &mut left, per_weights);
        });
    }

    /// `entry` is row `j` of the gain, and then the row before it, so that the next column need not wait for all rows.
    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn add_source_to_column(
        &mut self,
        j: usize,
        entry: &mut T,
        gain: &mut [T; N],
        left: &mut VarianceLeft<T>,
        per_weights: &mut [T; N],
    ) {
        let (Some(unit), Some(weight), Some(per_weight)) =
            (self.unit.get_mut(j), self.weights.get_mut(j), per_weights.get_mut(j))
        else {
            return;
        };
        let before = j.wrapping_sub(1);
        let (Some(&next), Some(&u)) = (gain.get(before), unit.get(before)) else {
            *weight += left.at_first(*entry);
            return;
        };
        let here = core::mem::replace(entry, next);
        if here == T::zero() {
            return;
        }
        let meeting = left.meet(here, *weight, *per_weight);
        if meeting.keeps_most() {
            *entry -= here * u;
            meeting.leave(left, weight, per_weight);
            // An even number of rows, for a processor that takes two at a time: that of the diagonal stays as it is.
            move_column(j + j % 2, unit, gain, here, meeting.slope);
        } else {
            (*left, *weight, *per_weight) = add_to_dwarfed_column(j, unit, gain, *left, *weight, *per_weight);
            *entry = gain.get(before).copied().unwrap_or_default();
        }
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn add_to_column<const M: usize>(&mut self, j: usize, arriving: &mut [SourceSweep<T, N>; M]) {
        let (Some(column), Some(d)) = (self.unit.get_mut(j), self.weights.get_mut(j)) else { return };
        if j == 0 {
            for SourceSweep { gain, left } in arriving {
                *d += gain.first().map_or(T::zero(), |&entry| left.at_first(entry));
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

/// A variance, or zero if it is negative. NaN stays, to be told.
#[inline]
fn not_negative<T: Real>(variance: T) -> T {
    if variance <= T::zero() { T::zero() } else { variance }
}

impl<T: Real, const N: usize> SourceSweep<T, N> {
    #[inline]
    fn new(source: NoiseSource<T, N>) -> Self {
        let [gain] = source.gain.data.0;
        Self { gain, left: VarianceLeft::all_of(not_negative(source.variance)) }
    }

    #[expect(clippy::inline_always, reason = "j is to be a constant in it")]
    #[inline(always)]
    fn add_to_column(&mut self, j: usize, unit: &mut [T; N], weight: &mut T, per_weight: &mut T) {
        let Self { gain, left } = self;
        let Some(&entry) = gain.get(j) else { return };
        if entry == T::zero() {
            return;
        }
        if N <= FEW_STATES {
            if let Some(meeting) = left.meet_as_published(entry, *weight, *per_weight) {
                meeting.leave(left, weight, per_weight);
                take_share(j, unit, gain, entry, &meeting);
            }
            return;
        }
        let meeting = left.meet(entry, *weight, *per_weight);
        if meeting.keeps_most() || N > UNROLLED_STATES && meeting.is_finite() {
            meeting.leave(left, weight, per_weight);
            move_column(j, unit, gain, entry, meeting.slope);
        } else {
            (*left, *weight, *per_weight) = add_to_dwarfed_column(j, unit, gain, *left, *weight, *per_weight);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, SMatrix, Vector3};

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

    /// To the bit: usual sources, those that dwarf what they meet or meet a state known exactly, and no numbers.
    #[test]
    fn dual_source_by_source_is_column_by_column() {
        for (weight, variance) in [(1.0, 0.1), (1e-9, 4.0), (0.0, 1.0), (1.0, f64::NAN), (f64::INFINITY, 1.0)]
        {
            let number = |i: usize| 0.1 * ((7 * i + 3) % 11) as f64 - 0.4;
            let mut start = UdCovariance::from_diagonal(&SVector::<f64, 7>::from_fn(|i, _| number(i) + 0.5));
            start.transform(&SMatrix::from_fn(|i, j| number(i + 5 * j))).unwrap();
            start.weights[4] = weight;
            let sources = [3, 6, 5].map(|last| NoiseSource {
                gain: SVector::from_fn(|i, _| if i == last || i == 1 { number(i + last) } else { 0.0 }),
                variance,
            });
            let (mut by_source, mut by_column) = (start, start);
            by_source.add_source_by_source(&sources);
            by_column.add_column_by_column(&sources);
            let bits = |p: &UdCovariance<f64, 7>| {
                (p.unit.map(|column| column.map(f64::to_bits)), p.weights.map(f64::to_bits))
            };
            assert_ne!(bits(&by_source), bits(&start));
            assert_eq!(bits(&by_source), bits(&by_column), "{weight} {variance}");
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
