//! Operations on single states of a factorised covariance: one state acts on those before it, or is replaced.
//!
//! With `x = U y`, where `y` are independent with the variances D, each of these changes rows or columns of U without a
//! rotation.

use nalgebra::SVector;

use super::{NoiseSource, UdCovariance};
use crate::real::Real;

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// `x_i <- x_i + sum of e x_k` for the `L` states `i` from `first` on, over the `M` effects: each has a state `k`
    /// after those, and an `e` for each `i`.
    ///
    /// A column is fetched and stored once for all effects: put those together whose states are near each other.
    #[inline]
    pub fn add_effects<const L: usize, const M: usize>(
        &mut self,
        first: usize,
        effects: &[(usize, [T; L]); M],
    ) {
        let from = effects.iter().fold(N, |from, (k, _)| from.min(*k));
        for column in self.unit.get_mut(from..).unwrap_or_default() {
            let Some((head, later)) = column.split_at_mut_checked(first + L) else { return };
            let Some(rows) = head.last_chunk_mut::<L>() else { return };
            let mut sums = *rows;
            for (k, effect) in effects {
                // Zero in the columns before that of the state.
                let amount = later.get(k.wrapping_sub(first + L)).copied().unwrap_or_default();
                for (sum, &e) in sums.iter_mut().zip(effect) {
                    *sum += e * amount;
                }
            }
            *rows = sums;
        }
    }

    /// Replaces state `k` by an independent one of `variance`. The other states keep their covariance.
    #[inline(never)]
    pub fn replace_state(&mut self, k: usize, variance: T) {
        let left = self.take_state::<N>(k, variance);
        self.add_noise(&[left]);
    }

    /// The same without what state `k` alone explained of the states before it: returned is what is to be added to the
    /// first `L` of these as noise.
    pub fn take_state<const L: usize>(&mut self, k: usize, variance: T) -> NoiseSource<T, L> {
        let mut left = NoiseSource { gain: SVector::<T, L>::zeros(), variance: T::zero() };
        if let (Some(column), Some(weight)) = (self.unit.get_mut(k), self.weights.get_mut(k)) {
            let mut entries = column.iter_mut().take(k);
            left.gain.iter_mut().zip(&mut entries).for_each(|(gain, entry)| *gain = core::mem::take(entry));
            entries.for_each(|entry| *entry = T::zero());
            left.variance = core::mem::replace(weight, variance);
        }
        for entry in self.unit.iter_mut().skip(k + 1).filter_map(|column| column.get_mut(k)) {
            *entry = T::zero();
        }
        left
    }

    /// The covariance of the last `M` states.
    pub fn last_states<const M: usize>(&self) -> UdCovariance<T, M> {
        const { assert!(M <= N, "no so many states") };
        let mut last = UdCovariance::<T, M>::known();
        let from = self.unit.iter().zip(&self.weights).skip(N - M);
        for ((column, weight), (source, &d)) in last.unit.iter_mut().zip(&mut last.weights).zip(from) {
            *weight = d;
            for (to, &u) in column.iter_mut().zip(source.iter().skip(N - M)) {
                *to = u;
            }
        }
        last
    }

    /// Replaces the last `M` states by others with the covariance `last`, independent of those before, which keep
    /// theirs only if they do not depend on the last ones now.
    pub fn replace_last_states<const M: usize>(&mut self, last: &UdCovariance<T, M>) {
        const { assert!(M <= N, "no so many states") };
        let to = self.unit.iter_mut().zip(&mut self.weights).skip(N - M);
        for ((column, weight), (source, &d)) in to.zip(last.unit.iter().zip(&last.weights)) {
            *weight = d;
            let (before, own) = column.split_at_mut(N - M);
            before.fill(T::zero());
            own.copy_from_slice(source);
        }
    }

    /// Inflates the variance of the first `L` states: the part that no later state explains is multiplied by `factor`.
    pub fn inflate<const L: usize>(&mut self, factor: T) {
        for weight in self.weights.iter_mut().take(L) {
            *weight *= factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::transition::Blocks2;
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
            let later = 3 + (k - 2) % 3;
            for i in 1..3 {
                map[(i, k)] += effect[i];
                map[(i, later)] += effect[i + 2];
            }
            ud.add_effects(1, &[(k, [effect[1], effect[2]]), (later, [effect[3], effect[4]])]);
            prop_assert!(close(&ud.covariance(), &(map * p * map.transpose())));
            prop_assert!((factors.trace() - p.trace()).abs() < 1e-9 * (1.0 + p.abs().max()));

            let (mut map, mut ud) = (Dense::identity(), factors);
            map[(k, k)] = 0.0;
            ud.replace_state(k, 0.7);
            let mut expected = map * p * map;
            expected[(k, k)] = 0.7;
            prop_assert!(close(&ud.covariance(), &expected));

            // The bounded maximum against the Lagrange conditions: P^-1 (x - mean) acts along state k alone.
            let mut bounded = effect;
            factors.constrain(k, 0.5, &mut bounded);
            let pull = p.try_inverse().unwrap() * (bounded - effect);
            prop_assert!((bounded[k] - 0.5).abs() < 1e-9);
            for (i, &pull) in pull.iter().enumerate() {
                prop_assert!(i == k || pull.abs() < 1e-6, "{i}: {pull}");
            }

            let last = factors.last_states::<2>();
            let corner = p.fixed_view::<2, 2>(4, 4).into_owned();
            prop_assert!((last.covariance() - corner).abs().max() < 1e-9 * (1.0 + p.abs().max()));
            let mut ud = UdCovariance::from_diagonal(&SVector::<f64, 6>::repeat(0.3));
            ud.replace_last_states(&last);
            let mut expected = Dense::identity() * 0.3;
            expected.fixed_view_mut::<2, 2>(4, 4).copy_from(&corner);
            prop_assert!(close(&ud.covariance(), &expected));

            // Of first states that depend on the last ones, what these do not explain is left: Schur complements.
            let inverse = p.fixed_view::<2, 2>(4, 4).try_inverse().unwrap();
            let of_four = p.fixed_view::<4, 4>(0, 0)
                - p.fixed_view::<4, 2>(0, 4) * inverse * p.fixed_view::<2, 4>(4, 0);
            let inverse = p.fixed_view::<4, 4>(2, 2).try_inverse().unwrap();
            let of_two = p.fixed_view::<2, 2>(0, 0)
                - p.fixed_view::<2, 4>(0, 2) * inverse * p.fixed_view::<4, 2>(2, 0);
            let mut ud = factors;
            ud.replace_last_states(&UdCovariance::from_diagonal(&SVector::<f64, 2>::new(0.4, 0.7)));
            let mut expected = Dense::from_diagonal(&SVector::<f64, 6>::from([0.0, 0.0, 0.0, 0.0, 0.4, 0.7]));
            expected.fixed_view_mut::<4, 4>(0, 0).copy_from(&of_four);
            prop_assert!(close(&ud.covariance(), &expected));

            let mut ud = factors;
            ud.inflate::<2>(3.0);
            let mut expected = p;
            let mut corner = expected.fixed_view_mut::<2, 2>(0, 0);
            corner += of_two * 2.0;
            prop_assert!(close(&ud.covariance(), &expected));

            let (mut map, mut ud) = (Dense::identity(), factors);
            let block = Matrix2::new(0.9, effect[0], -effect[1], 1.1);
            map.fixed_view_mut::<2, 2>(0, 0).copy_from(&block);
            map.fixed_view_mut::<2, 2>(2, 2).copy_from(&block.transpose());
            let gain = SVector::<f64, 4>::from_column_slice(&effect.as_slice()[..4]);
            let noise = NoiseSource { gain, variance: 0.3 };
            ud.carry_first(&Blocks2([block, block.transpose()]), &[noise]);
            let mut expected = map * p * map.transpose();
            let mut corner = expected.fixed_view_mut::<4, 4>(0, 0);
            corner += gain * gain.transpose() * 0.3;
            prop_assert!(close(&ud.covariance(), &expected));

            // The last two states, taken from the first three, which get what is left of them.
            let (mut map, mut ud) = (Dense::identity(), factors);
            let left = [5, 4].map(|state| {
                (map[(state, state)], map[(3, 3)]) = (0.0, 0.0);
                ud.take_state::<3>(state, 0.7)
            });
            let mut first = ud;
            first.replace_state(3, 0.7);
            for NoiseSource { gain, variance } in left {
                let gain = SVector::from_fn(|i, _| gain.as_slice().get(i).copied().unwrap_or_default());
                first.add_rank_one(&gain, variance);
            }
            let expected = map * p * map + (Dense::identity() - map) * 0.7;
            prop_assert!(close(&first.covariance(), &expected));
        }
    }
}
