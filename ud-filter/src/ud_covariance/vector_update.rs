//! Measurements that share noise, and states that are considered but not estimated.
//!
//! ```text
//! z = H x + noise of covariance R,   R = V E V':   V^-1 z = V^-1 H x + independent noises of the variances E
//! ```
//!
//! V is unit upper triangular, the factor of R as U is that of P: `V^-1` is a substitution from the last row up.
//!
//! A gain K' other than the optimal K leaves `P' = P + (K' - K) S (K' - K)'`, where P is what the optimal one leaves. A
//! considered state (Schmidt) has no gain, so `K' - K` is minus its part of K: the update, and a source of noise.
//!
//! Sources: Bierman (1977), chapter II.7, whitening of measurements; Schmidt, "Applications of state-space methods to
//! navigation problems", Advances in Control Systems 3 (1966).

use nalgebra::{SMatrix, SVector};

use super::{Correction, Outcome, Refusal, UdCovariance};
use crate::real::{Real, is_finite};

/// The record of several measurements at once, used or not: enough to judge a filter by its innovations.
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
pub struct VectorInnovationRecord<T, const M: usize> {
    /// The measurements less their predictions.
    pub innovation: SVector<T, M>,
    /// `i' S^-1 i` (NIS), S their covariance `H P H' + R`: M on average in a consistent filter, before the gate. NaN if
    /// the measurements are refused.
    pub normalised_squared: T,
    /// What became of them: all or none is used.
    pub outcome: Outcome,
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// Updates factors and state by M measurements at once, `z = H x + noise` of the covariance `noise`, positive
    /// semidefinite, of which the upper triangle is read. `rows` are those of H, and `innovation` is `z - H x`.
    ///
    /// Returns the normalised innovation squared of all: M on average in a consistent filter.
    ///
    /// # Errors
    /// When one of the measurements cannot be used; nothing has changed then. A `noise` that is no covariance is
    /// [`Refusal::Noise`].
    pub fn update_vector<const M: usize>(
        &mut self,
        rows: &[SVector<T, N>; M],
        noise: &SMatrix<T, M, M>,
        innovation: &SVector<T, M>,
        state: &mut SVector<T, N>,
    ) -> Result<T, Refusal> {
        let (updated, errors, squared) = self.updated(rows, noise, innovation)?;
        *self = updated;
        *state += errors;
        Ok(squared)
    }

    /// [`Self::update_vector`], unless the normalised innovation squared of all exceeds `gate`. Of a consistent filter
    /// it follows the chi squared law of M degrees of freedom: three standard deviations of one measurement, 99.7 %,
    /// are a gate of 11.8 for two, 14.2 for three and 16.3 for four. A NaN lets nothing pass, an infinite gate all.
    pub fn update_vector_gated<const M: usize>(
        &mut self,
        rows: &[SVector<T, N>; M],
        noise: &SMatrix<T, M, M>,
        innovation: &SVector<T, M>,
        gate: T,
        state: &mut SVector<T, N>,
    ) -> VectorInnovationRecord<T, M> {
        let (normalised_squared, outcome) = match self.updated(rows, noise, innovation) {
            Err(refusal) => (T::zero() / T::zero(), Outcome::Refused(refusal)),
            Ok((updated, errors, squared)) if squared <= gate => {
                *self = updated;
                *state += errors;
                (squared, Outcome::Used)
            }
            Ok((_, _, squared)) => (squared, Outcome::OutsideGate),
        };
        VectorInnovationRecord { innovation: *innovation, normalised_squared, outcome }
    }

    /// The factors after M measurements, the correction of the state, and the normalised innovation squared.
    fn updated<const M: usize>(
        &self,
        rows: &[SVector<T, N>; M],
        noise: &SMatrix<T, M, M>,
        innovation: &SVector<T, M>,
    ) -> Result<(Self, SVector<T, N>, T), Refusal> {
        let noise = UdCovariance::<T, M>::from_covariance(noise).map_err(|_| Refusal::Noise)?;
        let (mut rows, [mut innovations]) = (*rows, innovation.data.0);
        for (last, column) in noise.unit.iter().enumerate().rev() {
            let (Some(&row), Some(&innovation)) = (rows.get(last), innovations.get(last)) else { continue };
            for ((to, from), &v) in rows.iter_mut().zip(&mut innovations).zip(column).take(last) {
                *to -= row * v;
                *from -= innovation * v;
            }
        }
        let (mut updated, mut errors, mut sum) = (*self, SVector::zeros(), T::zero());
        for ((row, &innovation), &variance) in rows.iter().zip(&innovations).zip(&noise.weights) {
            let remaining = innovation - row.dot(&errors);
            sum += updated.update(row, variance, remaining, &mut errors)?.normalised_squared;
        }
        if is_finite(sum) { Ok((updated, errors, sum)) } else { Err(Refusal::Innovation) }
    }

    /// [`Self::update`] without a correction of the states that are `considered`: their uncertainty counts, and the
    /// measurement says nothing of them. Their variances stay as they are; their covariances with the others change.
    ///
    /// # Errors
    /// As of [`Self::update`].
    pub fn update_considering(
        &mut self,
        considered: &[bool; N],
        row: &SVector<T, N>,
        noise: T,
        innovation: T,
        state: &mut SVector<T, N>,
    ) -> Result<Correction<T, N>, Refusal> {
        let mut errors = SVector::zeros();
        let mut correction = self.update(row, noise, innovation, &mut errors)?;
        let mut left_out = SVector::<T, N>::zeros();
        let gains = correction.gain.iter_mut().zip(left_out.iter_mut());
        for ((gain, left_out), _) in gains.zip(considered).filter(|(_, is_considered)| **is_considered) {
            *left_out = core::mem::take(gain);
        }
        self.add_rank_one(&left_out, correction.variance);
        *state += correction.gain * innovation;
        Ok(correction)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};
    use proptest::prelude::*;

    use super::*;

    fn full(numbers: &[f64; 16]) -> Matrix4<f64> {
        let a = Matrix4::from_column_slice(numbers);
        a * a.transpose() + Matrix4::identity() * 0.1
    }

    fn close(a: &Matrix4<f64>, b: &Matrix4<f64>) -> bool {
        (a - b).abs().max() < 1e-10 * (1.0 + b.abs().max())
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// The textbook's matrices, `K = P H' (H P H' + R)^-1`.
        #[test]
        fn dual_correlated_measurements_equal_the_matrix_equations(
            p in prop::array::uniform16(-2.0..2.0_f64), h in prop::array::uniform8(-2.0..2.0_f64),
            r in prop::array::uniform3(-1.0..1.0_f64), z in prop::array::uniform2(-2.0..2.0_f64),
        ) {
            let (p, h, z) = (full(&p), Matrix2x4::from_row_slice(&h), Vector2::from(z));
            let root = Matrix2::new(1.0 + r[0], r[1], 0.0, 1.5 + r[2]);
            let r = root * root.transpose() + Matrix2::identity() * 0.01;
            let s = h * p * h.transpose() + r;
            let gain = p * h.transpose() * s.try_inverse().unwrap();
            let mut factors = UdCovariance::from_covariance(&p).unwrap();
            let mut state = Vector4::new(1.0, -2.0, 3.0, 0.5);
            let expected = state + gain * z;
            let rows = [h.row(0).transpose(), h.row(1).transpose()];
            let squared = factors.update_vector(&rows, &r, &z, &mut state).unwrap();
            prop_assert!((state - expected).abs().max() < 1e-10 * (1.0 + expected.abs().max()));
            prop_assert!(close(&factors.covariance(), &(p - gain * h * p)));
            let expected = (z.transpose() * s.try_inverse().unwrap() * z)[0];
            prop_assert!((squared - expected).abs() < 1e-9 * (1.0 + expected));

            // A gate only decides, at the square itself and below it.
            let before = (UdCovariance::from_covariance(&p).unwrap(), Vector4::new(1.0, -2.0, 3.0, 0.5));
            let (mut gated, mut passed) = before;
            let record = gated.update_vector_gated(&rows, &r, &z, squared, &mut passed);
            let used = (z, squared, Outcome::Used);
            prop_assert_eq!((record.innovation, record.normalised_squared, record.outcome), used);
            prop_assert!((gated, passed) == (factors, state));
            for (gate, noise, outcome) in [
                (0.999 * squared, r, Outcome::OutsideGate),
                (f64::NAN, r, Outcome::OutsideGate),
                (f64::INFINITY, -r, Outcome::Refused(Refusal::Noise)),
            ] {
                let (mut gated, mut passed) = before;
                let record = gated.update_vector_gated(&rows, &noise, &z, gate, &mut passed);
                prop_assert_eq!(record.outcome, outcome);
                prop_assert_eq!(record.normalised_squared.is_nan(), noise != r);
                prop_assert!((gated, passed) == before);
            }

            let before = (factors, state);
            let bad = Vector2::new(z.x, f64::NAN);
            prop_assert!(factors.update_vector(&rows, &r, &bad, &mut state) == Err(Refusal::Innovation));
            prop_assert!(factors.update_vector(&rows, &-r, &z, &mut state) == Err(Refusal::Noise));
            prop_assert!((factors, state) == before);
        }

        /// Noises that are one and the same, of a rank of one: their difference is measured without noise.
        #[test]
        fn dual_measurements_that_share_all_noise_equal_the_matrix_equations(
            p in prop::array::uniform16(-2.0..2.0_f64), h in prop::array::uniform8(-2.0..2.0_f64),
            r in prop::array::uniform2(0.1..1.0_f64), z in prop::array::uniform2(-2.0..2.0_f64),
        ) {
            let (p, h, z) = (full(&p), Matrix2x4::from_row_slice(&h), Vector2::from(z));
            let r = Vector2::from(r) * Vector2::from(r).transpose();
            let s = h * p * h.transpose() + r;
            prop_assume!(s.determinant() > 1e-3 * s.trace());
            let gain = p * h.transpose() * s.try_inverse().unwrap();
            let (mut factors, mut state) = (UdCovariance::from_covariance(&p).unwrap(), Vector4::zeros());
            let rows = [h.row(0).transpose(), h.row(1).transpose()];
            factors.update_vector(&rows, &r, &z, &mut state).unwrap();
            prop_assert!((state - gain * z).abs().max() < 1e-8 * (1.0 + gain.abs().max()));
            prop_assert!((factors.covariance() - (p - gain * h * p)).abs().max() < 1e-8 * (1.0 + p.abs().max()));
        }

        /// Joseph's form with a gain whose rows of the considered states are zero.
        #[test]
        fn dual_considered_states_have_no_gain(
            p in prop::array::uniform16(-2.0..2.0_f64), row in prop::array::uniform4(-2.0..2.0_f64),
            r in 0.01..2.0_f64, considered in prop::array::uniform4(any::<bool>()),
        ) {
            let (p, row) = (full(&p), Vector4::from(row));
            let mut gain = p * row / (row.dot(&(p * row)) + r);
            for (gain, considered) in gain.iter_mut().zip(considered) {
                *gain = if considered { 0.0 } else { *gain };
            }
            let kept = Matrix4::identity() - gain * row.transpose();
            let expected = kept * p * kept.transpose() + gain * r * gain.transpose();
            let (mut factors, mut state) = (UdCovariance::from_covariance(&p).unwrap(), Vector4::zeros());
            let correction = factors.update_considering(&considered, &row, r, 0.7, &mut state).unwrap();
            prop_assert!(close(&factors.covariance(), &expected));
            prop_assert!((state - gain * 0.7).abs().max() < 1e-10 * (1.0 + gain.abs().max()));
            prop_assert!((correction.gain - gain).abs().max() < 1e-10 * (1.0 + gain.abs().max()));
        }
    }
}
