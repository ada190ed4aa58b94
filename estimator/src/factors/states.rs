//! Single states of a factorised covariance: how one acts on those before it, follows from those after it, or starts anew.
//!
//! With `x = U y`, `y` independent of the variances D, each of these touches rows or columns of U without any rotation.

use motor_model::Real;
use nalgebra::SVector;

use super::{NoiseSource, UdCovariance};
use crate::transition::{Blocks2, Transition as _};

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// `x_i <- x_i + e x_k` for the states `i` from `first` on, each with its own `e` of `effect`; those from `k` on are not looked at.
    pub(crate) fn add_effect(&mut self, k: usize, first: usize, effect: &[T]) {
        let effect = effect.get(..k.saturating_sub(first)).unwrap_or(effect);
        for column in self.unit.iter_mut().skip(k) {
            let Some(&amount) = column.get(k) else { return };
            for (entry, &e) in column.iter_mut().skip(first).zip(effect) {
                *entry += e * amount;
            }
        }
    }

    /// `U' row`, in which the covariance is D: that of `row . x` and `other . x` is the sum of `weighted(f) * f_other`.
    pub(crate) fn whitened(&self, row: &SVector<T, N>) -> SVector<T, N> {
        let mut f = *row;
        for (j, (column, f)) in self.unit.iter().zip(f.iter_mut()).enumerate() {
            *f += column.iter().zip(row.iter()).take(j).fold(T::zero(), |sum, (&u, &h)| sum + u * h);
        }
        f
    }

    /// `D f`.
    pub(crate) fn weighted(&self, f: &SVector<T, N>) -> SVector<T, N> {
        f.component_mul(&SVector::from(self.weights))
    }

    /// `U y`: from independent errors `y` to those of the states.
    pub(crate) fn coloured(&self, y: &SVector<T, N>) -> SVector<T, N> {
        let mut x = *y;
        for (j, (column, &y)) in self.unit.iter().zip(y.iter()).enumerate() {
            for (x, &u) in x.iter_mut().zip(column).take(j) {
                *x += u * y;
            }
        }
        x
    }

    /// The first state becomes `row . x` of the others, and an error of `variance` beside.
    pub(crate) fn follow(&mut self, row: &SVector<T, N>, variance: T) {
        for column in self.unit.iter_mut().skip(1) {
            let sum = column.iter().zip(row.iter()).skip(1).fold(T::zero(), |sum, (&u, &r)| sum + u * r);
            if let Some(first) = column.first_mut() {
                *first = sum;
            }
        }
        if let Some(weight) = self.weights.first_mut() {
            *weight = variance;
        }
    }

    /// State `k` is forgotten and becomes one of its own, of `variance`. What its error has done to the others stays with them.
    pub(crate) fn renew(&mut self, k: usize, variance: T) {
        let mut left = NoiseSource { gain: SVector::<T, N>::zeros(), variance: T::zero() };
        if let (Some(column), Some(weight)) = (self.unit.get_mut(k), self.weights.get_mut(k)) {
            for (gain, entry) in left.gain.iter_mut().zip(column).take(k) {
                *gain = core::mem::take(entry);
            }
            left.variance = core::mem::replace(weight, variance);
        }
        for entry in self.unit.iter_mut().skip(k + 1).filter_map(|column| column.get_mut(k)) {
            *entry = T::zero();
        }
        self.add_noise(&[left]);
    }

    /// The first `L` states become less certain: what of their variance no later state explains is multiplied by `factor`.
    pub(crate) fn doubt<const L: usize>(&mut self, factor: T) {
        for weight in self.weights.iter_mut().take(L) {
            *weight *= factor;
        }
    }

    /// The first `L` states move on by blocks, the others stay.
    pub(crate) fn carry_first<const L: usize, const B: usize>(&mut self, blocks: &Blocks2<T, B>) {
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

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, SMatrix};
    use proptest::prelude::*;

    use super::*;

    type Dense = SMatrix<f64, 6, 6>;

    /// A covariance of six states from 36 numbers, and its factors.
    fn pair(numbers: &[f64]) -> (Dense, UdCovariance<f64, 6>) {
        let a = Dense::from_column_slice(numbers);
        let p = a * a.transpose() + Dense::identity() * 0.1;
        (p, UdCovariance::from_covariance(&p).unwrap())
    }

    fn close(a: &Dense, b: &Dense) -> bool {
        (a - b).abs().max() < 1e-9 * (1.0 + b.abs().max())
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Each operation against the dense product `M P M'`.
        #[test]
        fn dual_operations_equal_dense_ones(
            numbers in proptest::collection::vec(-2.0..2.0_f64, 36),
            effect in proptest::collection::vec(-2.0..2.0_f64, 6),
            k in 1..6_usize,
        ) {
            let (p, factors) = pair(&numbers);
            let effect = SVector::<f64, 6>::from_column_slice(&effect);

            let (mut map, mut ud) = (Dense::identity(), factors);
            for i in 0..k {
                map[(i, k)] += effect[i];
            }
            ud.add_effect(k, 0, effect.as_slice());
            prop_assert!(close(&ud.covariance(), &(map * p * map.transpose())));

            let (mut map, mut ud) = (Dense::identity(), factors);
            for i in 0..6 {
                map[(0, i)] = if i == 0 { 0.0 } else { effect[i] };
            }
            ud.follow(&effect, 0.3);
            let mut expected = map * p * map.transpose();
            expected[(0, 0)] += 0.3;
            prop_assert!(close(&ud.covariance(), &expected));

            let column = factors.coloured(&factors.weighted(&factors.whitened(&effect)));
            prop_assert!((column - p * effect).abs().max() < 1e-9 * (1.0 + p.abs().max()));

            let (mut map, mut ud) = (Dense::identity(), factors);
            map[(k, k)] = 0.0;
            ud.renew(k, 0.7);
            let mut expected = map * p * map;
            expected[(k, k)] = 0.7;
            prop_assert!(close(&ud.covariance(), &expected));

            let (mut map, mut ud) = (Dense::identity(), factors);
            let block = Matrix2::new(0.9, effect[0], -effect[1], 1.1);
            map.fixed_view_mut::<2, 2>(0, 0).copy_from(&block);
            map.fixed_view_mut::<2, 2>(2, 2).copy_from(&block.transpose());
            ud.carry_first::<4, 2>(&Blocks2([block, block.transpose()]));
            prop_assert!(close(&ud.covariance(), &(map * p * map.transpose())));
        }
    }
}
