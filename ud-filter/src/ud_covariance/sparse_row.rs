//! Sparse rows of many states, whose support (the non-zero columns) is a run of states near the first and a run at the
//! end.
//!
//! Their products with U pass over the columns once for all rows, and read of each column only the support. The lengths
//! are constants and the zeros and ones of U are multiplied like all other entries, so this is straight-line code.
//!
//! Two measurements need only one sweep. The effect of the first on the projection of the second needs no updated U,
//!
//! ```text
//! f_j' = (U' h2)_j - (f_j / a_(j-1)) (h2 . b),    h2 . b  grows by  g_j (U' h2)_j  a column
//! ```
//!
//! so that both slopes are known before a column is touched, and each column is fetched and stored once.

use nalgebra::SVector;

use super::UdCovariance;
use crate::real::{Real, is_finite};

/// A row, or a vector of errors, whose support is `LEAD` states from `FIRST` on and the last `LAST` states.
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
pub struct SparseRow<T, const FIRST: usize, const LEAD: usize, const LAST: usize> {
    /// Entries of the states from `FIRST` on.
    #[cfg_attr(feature = "serde", serde(with = "crate::serialised_array"))]
    pub lead: [T; LEAD],
    /// Entries of the last states.
    #[cfg_attr(feature = "serde", serde(with = "crate::serialised_array"))]
    pub last: [T; LAST],
}

impl<T: Real, const FIRST: usize, const LEAD: usize, const LAST: usize> SparseRow<T, FIRST, LEAD, LAST> {
    /// Zero everywhere.
    #[inline]
    pub fn zeros() -> Self {
        Self { lead: [T::zero(); LEAD], last: [T::zero(); LAST] }
    }

    /// `self . other`.
    #[inline]
    pub fn dot(&self, other: &Self) -> T {
        let ends = self.last.iter().zip(&other.last);
        self.lead.iter().zip(&other.lead).chain(ends).fold(T::zero(), |sum, (&x, &y)| sum + x * y)
    }

    /// The support within a column.
    #[inline]
    fn of(column: &[T]) -> Option<(&[T; LEAD], &[T; LAST])> {
        Some((column.get(FIRST..)?.first_chunk()?, column.last_chunk()?))
    }
}

/// A measurement `h'x + noise`, by its row `U' h`.
pub struct WhitenedMeasurement<'a, T, const N: usize> {
    /// `U' h`, of [`UdCovariance::whiten`].
    pub row: &'a [T; N],
    /// Its variance, positive, and not too small for its reciprocal.
    pub noise: T,
    /// The measurement less its prediction.
    pub innovation: T,
}

/// The effect of one of two measurements on a column.
#[derive(Clone, Copy)]
struct Slope<T> {
    /// `f_j / a_(j-1)`
    slope: T,
    /// `D_j f_j`
    pull: T,
}

/// One of two measurements as it passes through the columns.
struct MeasurementSweep<T> {
    sum: T,
    per_sum: T,
}

impl<T: Real> MeasurementSweep<T> {
    fn new(noise: T) -> Self {
        Self { sum: noise, per_sum: T::one() / noise }
    }

    /// Passes a column whose entry is `f`; `weight` is D before, and afterwards. No sum is less than the noise, and so
    /// none is too small for its reciprocal if that is not.
    #[inline]
    fn pass(&mut self, f: T, weight: &mut T) -> Slope<T> {
        let (slope, pull) = (f * self.per_sum, *weight * f);
        let before = self.sum;
        self.sum += f * pull;
        self.per_sum = T::one() / self.sum;
        *weight *= before * self.per_sum;
        Slope { slope, pull }
    }
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// Sets `whitened` to `f = U' row` of each row, and returns the covariance of the products `row . x`, its upper
    /// triangle alone.
    ///
    /// The last `FREE` states of the lead must be independent of all others: their rows and columns of U are not read.
    #[inline]
    pub fn whiten<
        const FREE: usize,
        const FIRST: usize,
        const LEAD: usize,
        const LAST: usize,
        const M: usize,
    >(
        &self,
        rows: [&SparseRow<T, FIRST, LEAD, LAST>; M],
        whitened: &mut [[T; N]; M],
    ) -> [[T; M]; M] {
        let mut products = [[T::zero(); M]; M];
        for (j, (column, &weight)) in self.unit.iter().zip(&self.weights).enumerate() {
            let Some((lead, last)) = SparseRow::<T, FIRST, LEAD, LAST>::of(column) else { continue };
            let mut sums = [T::zero(); M];
            // In the columns of the free states these are zeros.
            for (i, &u) in lead.iter().enumerate().take(LEAD - FREE) {
                for (sum, row) in sums.iter_mut().zip(&rows) {
                    *sum += u * row.lead.get(i).copied().unwrap_or_default();
                }
            }
            if j + LAST >= N {
                for (i, &u) in last.iter().enumerate() {
                    for (sum, row) in sums.iter_mut().zip(&rows) {
                        *sum += u * row.last.get(i).copied().unwrap_or_default();
                    }
                }
            }
            add_products(weight, &sums, &mut products);
            for (to, sum) in whitened.iter_mut().filter_map(|f| f.get_mut(j)).zip(sums) {
                *to = sum;
            }
        }
        for i in LEAD - FREE..LEAD {
            let entries = rows.map(|row| row.lead.get(i).copied().unwrap_or_default());
            add_products(self.weights.get(FIRST + i).copied().unwrap_or_default(), &entries, &mut products);
            for (to, entry) in whitened.iter_mut().filter_map(|f| f.get_mut(FIRST + i)).zip(entries) {
                *to = entry;
            }
        }
        products
    }

    /// `U y` within the support: from independent errors `y` to those of the states. `FREE` is that of
    /// [`Self::whiten`].
    #[inline]
    pub fn coloured<const FREE: usize, const FIRST: usize, const LEAD: usize, const LAST: usize>(
        &self,
        y: impl Iterator<Item = T>,
    ) -> SparseRow<T, FIRST, LEAD, LAST> {
        let mut x = SparseRow::zeros();
        for (j, (column, y)) in self.unit.iter().zip(y).enumerate() {
            let Some((lead, last)) = SparseRow::<T, FIRST, LEAD, LAST>::of(column) else { continue };
            let (dependent, free) = x.lead.split_at_mut(LEAD - FREE);
            for (x, &u) in dependent.iter_mut().zip(lead) {
                *x += u * y;
            }
            if let Some(x) = free.get_mut(j.wrapping_sub(FIRST + LEAD - FREE)) {
                *x = y;
            }
            if j + LAST >= N {
                for (x, &u) in x.last.iter_mut().zip(last) {
                    *x += u * y;
                }
            }
        }
        x
    }

    /// Replaces the first state by `row . x` of the others and an independent error of `variance`; returns its own
    /// variance.
    #[inline]
    pub fn follow<const FIRST: usize, const LEAD: usize, const LAST: usize>(
        &mut self,
        row: &SparseRow<T, FIRST, LEAD, LAST>,
        variance: T,
    ) -> T {
        const { assert!(FIRST > 0, "the support excludes the first state") };
        let mut whitened = [[T::zero(); N]];
        let [[of_row]] = self.whiten::<0, FIRST, LEAD, LAST, 1>([row], &mut whitened);
        let [f] = whitened;
        let others = self.unit.get_mut(1..).unwrap_or_default();
        for (column, &f) in others.iter_mut().zip(f.get(1..).unwrap_or_default()) {
            if let Some(first) = column.first_mut() {
                *first = f;
            }
        }
        if let Some(weight) = self.weights.first_mut() {
            *weight = variance;
        }
        of_row + variance
    }

    /// Updates by two measurements, one after the other, in one sweep. Rows and innovations of both are those before
    /// the update. Returns the corrections of the states: all zero when one of the two cannot be used, and then nothing
    /// has changed.
    #[inline]
    pub fn update_pair(&mut self, [first, second]: [WhitenedMeasurement<'_, T, N>; 2]) -> SVector<T, N> {
        let mut errors = SVector::<T, N>::zeros();
        let mut slopes = [[Slope { slope: T::zero(), pull: T::zero() }; 2]; N];
        let mut weights = self.weights;
        let (mut one, mut two) = (MeasurementSweep::new(first.noise), MeasurementSweep::new(second.noise));
        // h2 . b of the first.
        let mut shared = T::zero();
        let rows = first.row.iter().zip(second.row);
        for ((slopes, weight), (&f, &w)) in slopes.iter_mut().zip(&mut weights).zip(rows) {
            let of_first = one.pass(f, weight);
            let of_second = two.pass(w - of_first.slope * shared, weight);
            shared += of_first.pull * w;
            *slopes = [of_first, of_second];
        }
        let by_first = first.innovation * one.per_sum;
        let remaining = second.innovation - shared * by_first;
        let by_second = remaining * two.per_sum;
        let squared = first.innovation * by_first + remaining * by_second;
        // Written so that NaN is refused too.
        let usable = |noise: T| noise > T::zero() && is_finite(T::one() / noise);
        if !(usable(first.noise) && usable(second.noise) && is_finite(squared + one.sum + two.sum)) {
            return errors;
        }
        self.weights = weights;
        self.sweep_pair(&slopes, [by_first, by_second], &mut errors);
        errors
    }

    /// U after two measurements of these slopes, and the `errors` by their weighted innovations. No row of U asks for
    /// another, so that four at a time pass through the columns with their `P h` of both measurements in registers.
    #[inline]
    fn sweep_pair(
        &mut self,
        slopes: &[[Slope<T>; 2]; N],
        [by_first, by_second]: [T; 2],
        errors: &mut SVector<T, N>,
    ) {
        const { assert!(N.is_multiple_of(4), "rows of four at a time") };
        for (block, errors) in errors.as_mut_slice().as_chunks_mut::<4>().0.iter_mut().enumerate() {
            // With the covariance before each measurement. In the columns before the diagonal both are zero, and so is
            // U; on it, its one stays.
            let (mut b, mut c) = ([T::zero(); 4], [T::zero(); 4]);
            let (Some(columns), Some(slopes)) = (self.unit.get_mut(4 * block..), slopes.get(4 * block..))
            else {
                return;
            };
            for (column, &[first, second]) in columns.iter_mut().zip(slopes) {
                let Some(us) = column.as_chunks_mut::<4>().0.get_mut(block) else { continue };
                for (u, (b, c)) in us.iter_mut().zip(b.iter_mut().zip(&mut c)) {
                    let once = *u - first.slope * *b;
                    *b += first.pull * *u;
                    *u = once - second.slope * *c;
                    *c += second.pull * once;
                }
            }
            for (error, (b, c)) in errors.iter_mut().zip(b.into_iter().zip(c)) {
                *error = b * by_first + c * by_second;
            }
        }
    }
}

/// Adds the products of the sums, times a weight, to the upper triangle.
#[inline]
fn add_products<T: Real, const M: usize>(weight: T, sums: &[T; M], products: &mut [[T; M]; M]) {
    for (m, (products, &one)) in products.iter_mut().zip(sums).enumerate() {
        let share = weight * one;
        for (product, &other) in products.iter_mut().zip(sums).skip(m) {
            *product += share * other;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::SMatrix;
    use proptest::prelude::*;

    use super::*;

    type Dense = SMatrix<f64, 8, 8>;
    type Row = SparseRow<f64, 1, 3, 2>;

    /// A covariance of eight states from 64 numbers, and its factors.
    fn pair(numbers: &[f64]) -> (Dense, UdCovariance<f64, 8>) {
        let a = Dense::from_column_slice(numbers);
        let p = a * a.transpose() + Dense::identity() * 0.1;
        (p, UdCovariance::from_covariance(&p).unwrap())
    }

    fn row(numbers: [f64; 5]) -> (Row, SVector<f64, 8>) {
        let [a, b, c, d, e] = numbers;
        (
            Row { lead: [a, b, c], last: [d, e] },
            SVector::<f64, 8>::from_column_slice(&[0.0, a, b, c, 0.0, 0.0, d, e]),
        )
    }

    fn close(a: &Dense, b: &Dense) -> bool {
        (a - b).abs().max() < 1e-9 * (1.0 + b.abs().max())
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Products against the dense ones.
        #[test]
        fn dual_products_equal_dense_ones(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 64),
            entries in proptest::array::uniform5(-2.0..2.0_f64),
        ) {
            let (p, factors) = pair(&numbers);
            let (row, full) = row(entries);
            let mut whitened = [[0.0; 8]];
            let [[variance]] = factors.whiten::<0, 1, 3, 2, 1>([&row], &mut whitened);
            let [f] = whitened;
            prop_assert!((variance - full.dot(&(p * full))).abs() < 1e-9 * (1.0 + p.abs().max()));
            let expected = factors.unit_factor().transpose() * full;
            prop_assert!((SVector::from(f) - expected).abs().max() < 1e-12 * (1.0 + expected.abs().max()));

            let y = f.into_iter().zip(factors.weights).map(|(f, d)| d * f);
            let errors: Row = factors.coloured::<0, 1, 3, 2>(y);
            let column = p * full;
            let expected = [column[1], column[2], column[3], column[6], column[7]];
            for (x, e) in errors.lead.iter().chain(&errors.last).zip(expected) {
                prop_assert!((x - e).abs() < 1e-9 * (1.0 + p.abs().max()));
            }
            prop_assert!((row.dot(&row) - full.dot(&full)).abs() < 1e-12);

            let (mut map, mut ud) = (Dense::identity(), factors);
            for i in 0..8 {
                map[(0, i)] = full[i];
            }
            let variance = ud.follow(&row, 0.3);
            let mut expected = map * p * map.transpose();
            expected[(0, 0)] += 0.3;
            prop_assert!(close(&ud.covariance(), &expected));
            prop_assert!((variance - expected[(0, 0)]).abs() < 1e-9 * (1.0 + p.abs().max()));
        }

        /// States that are independent of the others need not be multiplied.
        #[test]
        fn dual_products_leave_independent_states_out(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 64),
            one in proptest::array::uniform5(-2.0..2.0_f64), other in proptest::array::uniform5(-2.0..2.0_f64),
        ) {
            let (_, mut factors) = pair(&numbers);
            for state in [3, 2] {
                factors.replace_state(state, 0.7);
            }
            let ((one, _), (other, _)) = (row(one), row(other));
            let (mut all, mut some) = ([[0.0; 8]; 2], [[0.0; 8]; 2]);
            let [[a, b], [_, c]] = factors.whiten::<0, 1, 3, 2, 2>([&one, &other], &mut all);
            let [[d, e], [_, f]] = factors.whiten::<2, 1, 3, 2, 2>([&one, &other], &mut some);
            let close = |x: f64, y: f64| (x - y).abs() < 1e-12 * (1.0 + a + c);
            prop_assert!(close(a, d) && close(b, e) && close(c, f));
            prop_assert!(all.iter().flatten().zip(some.iter().flatten()).all(|(&x, &y)| close(x, y)));
            let [f, _] = all;
            let x: Row = factors.coloured::<0, 1, 3, 2>(f.into_iter());
            let y: Row = factors.coloured::<2, 1, 3, 2>(f.into_iter());
            let entries = x.lead.iter().chain(&x.last).zip(y.lead.iter().chain(&y.last));
            prop_assert!(entries.into_iter().all(|(&x, &y)| close(x, y)));
        }

        /// Two measurements at once against one after the other.
        #[test]
        fn dual_a_pair_of_updates_equals_two(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 64),
            one in proptest::array::uniform5(-2.0..2.0_f64), other in proptest::array::uniform5(-2.0..2.0_f64),
            noise in proptest::array::uniform2(0.01..2.0_f64), innovation in proptest::array::uniform2(-2.0..2.0_f64),
        ) {
            let (_, factors) = pair(&numbers);
            let ((first, first_full), (second, second_full)) = (row(one), row(other));
            let mut whitened = [[0.0; 8]; 2];
            factors.whiten::<0, 1, 3, 2, 2>([&first, &second], &mut whitened);
            let [f, w] = whitened;
            let mut at_once = factors;
            let errors = at_once.update_pair([
                WhitenedMeasurement { row: &f, noise: noise[0], innovation: innovation[0] },
                WhitenedMeasurement { row: &w, noise: noise[1], innovation: innovation[1] },
            ]);
            let (mut in_turn, mut expected) = (factors, SVector::<f64, 8>::zeros());
            in_turn.update(&first_full, noise[0], innovation[0], &mut expected).unwrap();
            let left = innovation[1] - second_full.dot(&expected);
            in_turn.update(&second_full, noise[1], left, &mut expected).unwrap();
            prop_assert!((errors - expected).abs().max() < 1e-9 * (1.0 + expected.abs().max()));
            prop_assert!(close(&at_once.covariance(), &in_turn.covariance()));
            prop_assert!(at_once.unit_factor().lower_triangle() == Dense::identity());

            let mut refused = factors;
            let zero = refused.update_pair([
                WhitenedMeasurement { row: &f, noise: noise[0], innovation: f64::NAN },
                WhitenedMeasurement { row: &w, noise: noise[1], innovation: innovation[1] },
            ]);
            prop_assert!(zero == SVector::<f64, 8>::zeros() && refused == factors);
        }
    }
}
