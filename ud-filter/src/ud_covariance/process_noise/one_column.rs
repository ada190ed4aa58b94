//! What one source of noise does to one column of U and its weight: see [`super`] for the equations.

use crate::real::{Real, is_finite};

/// Least part of a weight that is kept where the first form serves: it loses two bits at most.
const KEPT_MIN: f32 = 0.25;

/// What the columns passed have left of a source's variance.
#[derive(Clone, Copy)]
pub(super) struct VarianceLeft<T> {
    /// `c`.
    pub(super) variance: T,
    /// `s`, infinite once nothing is left.
    spent: T,
    per_spent: T,
}

/// What one source does to one column.
pub(super) struct ColumnGain<T> {
    spent: T,
    per_spent: T,
    weight: T,
    per_weight: T,
    pub(super) slope: T,
    /// Weight before per weight after.
    kept: T,
}

/// The column by the first form.
#[expect(clippy::inline_always, reason = "rows is to be a constant in it")]
#[inline(always)]
pub(super) fn move_column<T: Real, const N: usize>(
    rows: usize,
    unit: &mut [T; N],
    gain: &mut [T; N],
    entry: T,
    slope: T,
) {
    for (u, a) in unit.iter_mut().zip(gain).take(rows) {
        *a -= entry * *u;
        *u += slope * *a;
    }
}

/// The column by the second form.
#[expect(clippy::inline_always, reason = "j is to be a constant in it")]
#[inline(always)]
pub(super) fn take_share<T: Real, const N: usize>(
    j: usize,
    unit: &mut [T; N],
    gain: &mut [T; N],
    entry: T,
    meeting: &ColumnGain<T>,
) {
    for (u, a) in unit.iter_mut().zip(gain).take(j) {
        let whole = *a;
        *a -= entry * *u;
        *u = meeting.kept * *u + meeting.slope * whole;
    }
}

/// The column by the second form, where little of it is kept, or where a sum has no reciprocal. Rare. What is left of
/// the variance, the weight and its reciprocal come and go by value: what has an address is not held in a register.
#[cold]
#[inline(never)]
pub(super) fn add_to_dwarfed_column<T: Real, const N: usize>(
    j: usize,
    unit: &mut [T; N],
    gain: &mut [T; N],
    mut left: VarianceLeft<T>,
    mut weight: T,
    mut per_weight: T,
) -> (VarianceLeft<T>, T, T) {
    let entry = gain.get(j).copied().unwrap_or_default();
    let by_sums = left.meet(entry, weight, per_weight);
    let meeting =
        if by_sums.is_finite() { Some(by_sums) } else { left.meet_as_published(entry, weight, per_weight) };
    if let Some(meeting) = meeting {
        meeting.leave(&mut left, &mut weight, &mut per_weight);
        take_share(j, unit, gain, entry, &meeting);
    }
    (left, weight, per_weight)
}

impl<T: Real> VarianceLeft<T> {
    #[inline]
    pub(super) fn all_of(variance: T) -> Self {
        Self { variance, spent: T::one(), per_spent: T::one() }
    }

    /// At a column whose row of the gain is `entry`, by sums (C1).
    #[expect(clippy::inline_always, reason = "it is a dozen instructions for each column")]
    #[inline(always)]
    pub(super) fn meet(&self, entry: T, weight: T, per_weight: T) -> ColumnGain<T> {
        let pull = self.variance * entry;
        let push = pull * entry;
        let spent = self.spent + push * per_weight;
        let per_spent = T::one() / spent;
        ColumnGain {
            spent,
            per_spent,
            weight: weight + push * self.per_spent,
            per_weight: (per_weight * self.spent) * per_spent,
            slope: (pull * per_weight) * per_spent,
            kept: self.spent * per_spent,
        }
    }

    /// The same in the published form; `None` when the source adds nothing to this column in this precision.
    #[inline]
    pub(super) fn meet_as_published(&self, entry: T, weight: T, per_weight: T) -> Option<ColumnGain<T>> {
        let pull = self.variance * entry;
        let sum = weight + pull * entry * self.per_spent;
        let (slope, kept) = (pull * self.per_spent / sum, weight / sum);
        // A weight that is infinite or NaN is told, not left out.
        (is_finite(slope) || !is_finite(sum)).then(|| ColumnGain {
            spent: self.spent + pull * entry * per_weight,
            per_spent: self.per_spent * kept,
            weight: sum,
            per_weight: T::one() / sum,
            slope,
            kept,
        })
    }

    /// What it adds to the first column, where it ends.
    #[inline]
    pub(super) fn at_first(&self, entry: T) -> T {
        self.variance * entry * entry * self.per_spent
    }
}

impl<T: Real> ColumnGain<T> {
    #[inline]
    pub(super) fn leave(&self, left: &mut VarianceLeft<T>, weight: &mut T, per_weight: &mut T) {
        (*weight, *per_weight) = (self.weight, self.per_weight);
        (left.spent, left.per_spent) = (self.spent, self.per_spent);
    }

    /// Whether the first form serves, and all is finite, in one comparison: NaN is not more than anything.
    #[inline]
    pub(super) fn keeps_most(&self) -> bool {
        self.kept - self.slope * T::zero() >= T::from(KEPT_MIN)
    }

    /// Whether the sums and their reciprocals are finite, in one comparison.
    #[inline]
    pub(super) fn is_finite(&self) -> bool {
        is_finite(self.spent + self.slope)
    }
}
