//! Independent pairs of states, such as lightly damped modes.
//!
//! With `F = diag(F_1 .. F_m)`, the 2 x 2 blocks of U transform one by one, `U_ij <- F_i U_ij T_j`, where `T_j`
//! restores the form of the diagonal block: of the two columns `w_a`, `w_b` of `F U` with the elements `alpha`, `beta`
//! in the block's lower row,
//!
//! ```text
//! D_b' = alpha^2 D_a + beta^2 D_b         w_b' = (alpha D_a w_a + beta D_b w_b) / D_b'
//! D_a' = det^2 D_a D_b / D_b'             w_a' = (beta w_a - alpha w_b) / det          det = det F_j
//! ```
//!
//! This is Thornton's weighted Gram-Schmidt on the only two columns with entries in the block's lower row: a fast
//! Givens rotation (Gentleman, J. Inst. Maths Applics 12 (1973) 329-336) whose scale factor is restored. The diagonal
//! is `det / det`, which need not be computed. 2 x 2 products only, so `2 n^2` multiply-adds instead of Thornton's `1.5
//! n^3`.

use nalgebra::{Matrix2, SMatrix, SVector};

use super::{Dense, Transition};
use crate::real::{Real, is_finite, reciprocal_of_sum, total};
use crate::ud_covariance::{UdCovariance, for_columns};

/// A block-diagonal F of B blocks of 2 x 2, for `N = 2 B` states.
///
/// The order of the states within a block is free, but not its cost: put the state on which noise acts first
/// ([`crate::NoiseSource`]).
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
pub struct Blocks2<T, const B: usize>(
    #[cfg_attr(feature = "serde", serde(with = "crate::serialised_array"))] pub [Matrix2<T>; B],
);

/// How a pair of columns combines: `a' = aa a + ab b`, `b' = ba a + bb b`.
#[derive(Clone, Copy, Default)]
struct Pairing<T> {
    lower: T,
    upper: T,
    above: T,
    aa: T,
    ab: T,
    ba: T,
    bb: T,
}

impl<T: Real, const B: usize, const N: usize> Transition<T, N> for Blocks2<T, B> {
    #[inline]
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N> {
        const { assert!(N == 2 * B, "two states a block") };
        let mut carried = *state;
        let [entries] = &mut carried.data.0;
        for (pair, f) in entries.as_chunks_mut::<2>().0.iter_mut().zip(&self.0) {
            let [x, y] = pair;
            (*x, *y) = times(f, *x, *y);
        }
        carried
    }

    #[inline]
    fn is_finite(&self) -> bool {
        let mut sums = [T::zero(); 4];
        for f in &self.0 {
            for (sum, &entry) in sums.iter_mut().zip(f.as_slice()) {
                *sum += entry;
            }
        }
        is_finite(total(&sums))
    }

    #[inline]
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>) {
        const { assert!(N == 2 * B, "two states a block") };
        let mut pairings = [Pairing::default(); B];
        let columns = covariance.unit.as_chunks_mut::<2>().0;
        let weights = covariance.weights.as_chunks_mut::<2>().0;
        for (b, (((pairing, f), [_, column]), &[da, db])) in
            pairings.iter_mut().zip(&self.0).zip(columns.iter()).zip(weights.iter()).enumerate()
        {
            let above = column.as_chunks::<2>().0.get(b).map_or(T::zero(), |[u, _]| *u);
            let Some(possible) = Pairing::new(f, above, da, db) else {
                return Dense(self.matrix()).carry_factors(covariance);
            };
            *pairing = possible;
        }
        for_columns!(up to B, |b| self.carry_pair(b, columns, weights, &pairings));
    }
}

impl<T: Real, const B: usize> Blocks2<T, B> {
    #[expect(clippy::inline_always, reason = "b is to be a constant in it")]
    #[inline(always)]
    fn carry_pair<const N: usize>(
        &self,
        b: usize,
        columns: &mut [[[T; N]; 2]],
        weights: &mut [[T; 2]],
        pairings: &[Pairing<T>; B],
    ) {
        let (Some([a, c]), Some(d), Some(&pairing)) =
            (columns.get_mut(b), weights.get_mut(b), pairings.get(b))
        else {
            return;
        };
        let [da, db] = d;
        (*da, *db) = (pairing.lower, pairing.upper);
        let rows = a.as_chunks_mut::<2>().0.iter_mut().zip(c.as_chunks_mut::<2>().0);
        for (([a0, a1], [c0, c1]), f) in rows.zip(&self.0).take(b) {
            let ((x0, x1), (y0, y1)) = (times(f, *a0, *a1), times(f, *c0, *c1));
            (*a0, *a1) = (pairing.aa * x0 + pairing.ab * y0, pairing.aa * x1 + pairing.ab * y1);
            (*c0, *c1) = (pairing.ba * x0 + pairing.bb * y0, pairing.ba * x1 + pairing.bb * y1);
        }
        if let Some([above, _]) = c.as_chunks_mut::<2>().0.get_mut(b) {
            *above = pairing.above;
        }
    }

    /// F in full.
    pub fn matrix<const N: usize>(&self) -> SMatrix<T, N, N> {
        const { assert!(N == 2 * B, "two states a block") };
        let mut full = SMatrix::<T, N, N>::zeros();
        for (b, (f, columns)) in self.0.iter().zip(full.data.0.as_chunks_mut::<2>().0).enumerate() {
            for (from, to) in f.data.0.iter().zip(columns) {
                if let Some(rows) = to.as_chunks_mut::<2>().0.get_mut(b) {
                    *rows = *from;
                }
            }
        }
        full
    }
}

impl<T: Real> Pairing<T> {
    /// For a block F whose columns of U read (1, 0) and (`u`, 1); `None` when F is singular, both states are known
    /// exactly, or a number is infinite or NaN.
    #[inline]
    fn new(f: &Matrix2<T>, u: T, da: T, db: T) -> Option<Self> {
        let [[f00, f10], [f01, f11]] = f.data.0;
        let det = f00 * f11 - f01 * f10;
        let per_det = T::one() / det;
        // The square too: D is multiplied by that of the determinant.
        if !is_finite(per_det * per_det) {
            return None;
        }
        let (alpha, beta) = (f10, f10 * u + f11);
        let upper = f00 * u + f01;
        let (pull_a, pull_b) = (alpha * da, beta * db);
        let sum = alpha * pull_a + beta * pull_b;
        let per_sum = reciprocal_of_sum(sum)?;
        let (ba, bb) = (pull_a * per_sum, pull_b * per_sum);
        Some(Self {
            lower: det * da * (det * (db * per_sum)),
            upper: sum,
            above: ba * f00 + bb * upper,
            aa: beta * per_det,
            ab: -(alpha * per_det),
            ba,
            bb,
        })
    }
}

/// Not an array, since one of two `f32` is passed as a single integer.
#[inline]
fn times<T: Real>(f: &Matrix2<T>, x: T, y: T) -> (T, T) {
    let [[f00, f10], [f01, f11]] = f.data.0;
    (f00 * x + f01 * y, f10 * x + f11 * y)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::NoiseSource;
    use crate::test_support::Rounded;

    fn rounded<T: Rounded, const R: usize, const C: usize>(m: &SMatrix<f64, R, C>) -> SMatrix<T, R, C> {
        m.map(T::rounded)
    }

    /// A prediction and a measurement, with the states of each block as they come or exchanged, and the covariance in
    /// the order in which they come.
    fn step<T: Rounded>(numbers: &[f64], blocks: &[[f64; 4]; 3], exchanged: bool) -> SMatrix<f64, 6, 6> {
        let mut order = SMatrix::<f64, 6, 6>::identity();
        if exchanged {
            for b in [0, 2, 4] {
                order.swap_rows(b, b + 1);
            }
        }
        let a = SMatrix::<f64, 6, 6>::from_column_slice(numbers);
        let start = order * (a * a.transpose() + SMatrix::identity()) * order;
        let exchange = |f: Matrix2<f64>| if exchanged { Matrix2::new(f.m22, f.m21, f.m12, f.m11) } else { f };
        let transition = Blocks2(blocks.map(|[a, b, c, d]| {
            rounded(&exchange(Matrix2::new(0.3 * a, 1.0 + 0.3 * b, -1.0 + 0.3 * c, 0.3 * d)))
        }));
        let source_on = |state: usize| NoiseSource {
            gain: rounded(&(order * SVector::<f64, 6>::ith(state, 1.0))),
            variance: T::rounded(0.1),
        };
        let mut covariance = UdCovariance::from_covariance(&rounded(&start)).unwrap();
        covariance.predict(&transition, &[source_on(1), source_on(3), source_on(5)]).unwrap();
        let row = order * SVector::from([1.0, 0.0, -0.5, 0.0, 1.0, 0.0]);
        covariance.update(&rounded(&row), T::one(), T::one(), &mut SVector::zeros()).unwrap();
        order * covariance.covariance().map(Rounded::wide) * order
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn dual_states_of_a_block_may_come_in_either_order(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 36),
            blocks in proptest::array::uniform3(proptest::array::uniform4(-1.0..1.0_f64)),
        ) {
            let double = step::<f64>(&numbers, &blocks, false);
            let scale = double.abs().max();
            let exchanged = step::<f64>(&numbers, &blocks, true);
            prop_assert!((double - exchanged).abs().max() < 1e-12 * scale, "{double} {exchanged}");
            let single = step::<f32>(&numbers, &blocks, true);
            prop_assert!((double - single).abs().max() < 1e-4 * scale, "{double} {single}");
        }
    }
}
