//! Single states of a factorised covariance: how one acts on those before it, follows from those after it, or starts anew.
//!
//! With `x = U y`, `y` independent of the variances D, each of these touches rows or columns of U without any rotation.

use motor_model::Real;
use nalgebra::SVector;

use super::{NoiseSource, UdCovariance};
use crate::factorised::transition::{Blocks2, Transition as _};

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// `x_i <- x_i + e x_k` for the `L` states `i` from `first` on, each with its own `e` of `effect`; all of them before `k`.
    #[inline]
    pub(crate) fn add_effect<const L: usize>(&mut self, k: usize, first: usize, effect: &[T; L]) {
        for column in self.unit.get_mut(k..).unwrap_or_default() {
            let Some(&amount) = column.get(k) else { return };
            let reached = column.get_mut(first..).and_then(|from| from.first_chunk_mut::<L>());
            for (entry, &e) in reached.into_iter().flatten().zip(effect) {
                *entry += e * amount;
            }
        }
    }

    /// State `k` is forgotten and becomes one of its own, of `variance`. What its error has done to the others stays with them.
    #[inline(never)]
    pub(crate) fn replace_state(&mut self, k: usize, variance: T) {
        let mut left = NoiseSource { gain: SVector::<T, N>::zeros(), variance: T::zero() };
        if let (Some(column), Some(weight)) = (self.unit.get_mut(k), self.weights.get_mut(k)) {
            for (gain, entry) in left.gain.as_mut_slice().iter_mut().zip(column).take(k) {
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
    pub(crate) fn inflate<const L: usize>(&mut self, factor: T) {
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
            k in 3..6_usize,
        ) {
            let (p, factors) = pair(&numbers);
            let effect = SVector::<f64, 6>::from_column_slice(&effect);

            let (mut map, mut ud) = (Dense::identity(), factors);
            for i in 1..3 {
                map[(i, k)] += effect[i];
            }
            ud.add_effect(k, 1, &[effect[1], effect[2]]);
            prop_assert!(close(&ud.covariance(), &(map * p * map.transpose())));
            prop_assert!((factors.trace() - p.trace()).abs() < 1e-9 * (1.0 + p.abs().max()));

            let (mut map, mut ud) = (Dense::identity(), factors);
            map[(k, k)] = 0.0;
            ud.replace_state(k, 0.7);
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
