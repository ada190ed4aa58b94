//! Ways to begin: from variances, or from a covariance.
//!
//! A covariance of many states takes kilobytes. The ways that set it in place need no second one on the stack.

use core::cmp::Ordering;

use nalgebra::{SMatrix, SVector};

use super::{Columns, UdCovariance};
use crate::real::{Real, is_finite};

/// A matrix is not a covariance: some combination of states would have a negative variance, or one that is infinite or
/// NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NotPositiveSemidefinite {
    /// The last state for which this shows, given those after it.
    pub state: usize,
}

impl core::fmt::Display for NotPositiveSemidefinite {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "not positive semidefinite at state {}", self.state)
    }
}

impl core::error::Error for NotPositiveSemidefinite {}

/// A number is no variance: it is negative, infinite or NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NotAVariance {
    /// The first state of such a variance.
    pub state: usize,
}

impl core::fmt::Display for NotAVariance {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "the variance of state {} is negative, infinite or NaN", self.state)
    }
}

impl core::error::Error for NotAVariance {}

/// Two matrices are no factors of a covariance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum NotFactors {
    /// An entry of U is infinite or NaN, not 1 on the diagonal, or not 0 below it.
    Unit {
        /// Its row.
        row: usize,
        /// Its column.
        column: usize,
    },
    /// A diagonal entry of D, or the variance of its state, is negative, infinite or NaN.
    Variance(NotAVariance),
}

impl core::fmt::Display for NotFactors {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Unit { row, column } => {
                write!(f, "the entry of U in row {row}, column {column} is not that of a unit upper triangle")
            }
            Self::Variance(reason) => reason.fmt(f),
        }
    }
}

impl core::error::Error for NotFactors {}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// All states known exactly: every variance is 0.
    pub fn known() -> Self {
        Self { unit: identity(), weights: [T::zero(); N] }
    }

    /// Independent states of these variances; 0 is known exactly.
    ///
    /// For a caller who has nobody to tell: a variance that is infinite or NaN stays so, and a negative one becomes
    /// NaN. Then no measurement of the state is used ([`crate::Refusal::Uncertain`]). [`Self::try_from_diagonal`] says
    /// so at once.
    pub fn from_diagonal(variances: &SVector<T, N>) -> Self {
        Self { unit: identity(), weights: weights_of(variances) }
    }

    /// [`Self::from_diagonal`] in place. No second covariance is on the stack meanwhile, as it may be in an assignment.
    pub fn set_diagonal(&mut self, variances: &SVector<T, N>) {
        set_identity(&mut self.unit);
        self.weights = weights_of(variances);
    }

    /// Independent states of these variances; 0 is known exactly.
    ///
    /// # Errors
    /// When one is negative, infinite or NaN.
    pub fn try_from_diagonal(variances: &SVector<T, N>) -> Result<Self, NotAVariance> {
        are_variances(variances)?;
        Ok(Self::from_diagonal(variances))
    }

    /// [`Self::try_from_diagonal`] in place. No second covariance is on the stack meanwhile.
    ///
    /// # Errors
    /// When one is negative, infinite or NaN; nothing has changed then.
    pub fn try_set_diagonal(&mut self, variances: &SVector<T, N>) -> Result<(), NotAVariance> {
        are_variances(variances)?;
        self.set_diagonal(variances);
        Ok(())
    }

    /// The factors of a covariance, of which the upper triangle is read. Some combinations of states may be known
    /// exactly: a Q of rank one is a covariance.
    ///
    /// A state whose variance, given those after it, is zero must have no covariance left with those before it. Both
    /// are zero if they are so within eight roundings for each state, of the given variances. Where such a variance is
    /// above zero it is kept: rounding makes nothing certain.
    ///
    /// # Errors
    /// When it is not positive semidefinite in this precision, or not finite. A singular matrix is refused, too, if the
    /// rest of it is nearly singular: rounding then hides whether it is semidefinite.
    pub fn from_covariance(covariance: &SMatrix<T, N, N>) -> Result<Self, NotPositiveSemidefinite> {
        let zero = rounding_of::<T>(N);
        let given = covariance.diagonal();
        // The columns not reached yet are the covariance of their states, given those after them.
        let mut factors = Self { unit: covariance.data.0, weights: [T::zero(); N] };
        for (state, (weight, &variance)) in factors.weights.iter_mut().zip(&given).enumerate().rev() {
            let (before, from_here) = factors.unit.split_at_mut(state);
            let Some(column) = from_here.first_mut() else { continue };
            let source = *column;
            let mut pivot = source.get(state).copied().unwrap_or_default();
            let is_zero = pivot <= zero * variance
                && -pivot <= zero * variance
                && column
                    .iter()
                    .zip(&given)
                    .take(state)
                    .all(|(&u, &other)| is_small(u, variance, other, zero));
            if is_zero {
                column.fill(T::zero());
                pivot = if pivot > T::zero() { pivot } else { T::zero() };
            }
            if !(is_zero || pivot > T::zero()) || !is_finite(pivot) || !is_finite(variance) {
                return Err(NotPositiveSemidefinite { state });
            }
            *weight = pivot;
            for (i, u) in column.iter_mut().enumerate() {
                match i.cmp(&state) {
                    Ordering::Less if is_zero => {}
                    Ordering::Less => *u /= pivot,
                    Ordering::Equal => *u = T::one(),
                    Ordering::Greater => *u = T::zero(),
                }
                if !is_finite(*u) {
                    return Err(NotPositiveSemidefinite { state });
                }
            }
            if is_zero {
                continue;
            }
            for (other, &p) in before.iter_mut().zip(&source) {
                for (entry, &u) in other.iter_mut().zip(column.iter()).take(state) {
                    *entry -= u * p;
                }
            }
        }
        Ok(factors)
    }

    /// The covariance of given factors, [`Self::unit_factor`] and [`Self::weights`].
    ///
    /// # Errors
    /// When U is not unit upper triangular, or a variance is negative, infinite or NaN.
    pub fn from_factors(unit: &SMatrix<T, N, N>, weights: &SVector<T, N>) -> Result<Self, NotFactors> {
        for (column, entries) in unit.data.0.iter().enumerate() {
            for (row, &entry) in entries.iter().enumerate() {
                let is_so = match row.cmp(&column) {
                    Ordering::Less => is_finite(entry),
                    Ordering::Equal => entry == T::one(),
                    Ordering::Greater => entry == T::zero(),
                };
                if !is_so {
                    return Err(NotFactors::Unit { row, column });
                }
            }
        }
        let [weights] = weights.data.0;
        let made = Self { unit: unit.data.0, weights };
        are_variances(&weights.into())
            .and_then(|()| are_variances(&made.variances()))
            .map_err(NotFactors::Variance)?;
        Ok(made)
    }
}

/// Eight roundings for each of `states`: of a given matrix, which may be a product, and of its factors.
fn rounding_of<T: Real>(states: usize) -> T {
    let half = T::one() / (T::one() + T::one());
    let mut rounding = T::one();
    // As many as any format has bits.
    for _ in 0..256 {
        if T::one() + rounding * half == T::one() {
            break;
        }
        rounding *= half;
    }
    (0..8 * states).fold(T::zero(), |sum, _| sum + rounding)
}

/// Whether a covariance is zero beside the variances of its two states: a correlation of at most `zero`. Ratios, for a
/// product of variances may be too small for the precision.
fn is_small<T: Real>(covariance: T, variance: T, other: T, zero: T) -> bool {
    covariance == T::zero() || (covariance / variance) * (covariance / other) <= zero * zero
}

/// Makes it the unit matrix.
#[inline]
fn set_identity<T: Real, const N: usize>(unit: &mut Columns<T, N>) {
    for (j, column) in unit.iter_mut().enumerate() {
        column.fill(T::zero());
        if let Some(entry) = column.get_mut(j) {
            *entry = T::one();
        }
    }
}

/// The unit matrix.
fn identity<T: Real, const N: usize>() -> Columns<T, N> {
    SMatrix::<T, N, N>::identity().data.0
}

/// A negative variance is NaN.
fn weights_of<T: Real, const N: usize>(variances: &SVector<T, N>) -> [T; N] {
    let [weights] = variances.data.0;
    weights.map(|variance| if variance < T::zero() { T::zero() / T::zero() } else { variance })
}

fn are_variances<T: Real, const N: usize>(numbers: &SVector<T, N>) -> Result<(), NotAVariance> {
    let is_variance = |&variance: &T| variance >= T::zero() && is_finite(variance);
    numbers
        .iter()
        .position(|variance| !is_variance(variance))
        .map_or(Ok(()), |state| Err(NotAVariance { state }))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix3, Matrix4, Vector2, Vector4};
    use proptest::prelude::*;

    use super::*;
    use crate::test_support::Rounded;

    /// `U D U'` in units of the `scales`, whose entries have been rounded to the precision; some D may be zero.
    fn semidefinite<T: Rounded>(u: &[f64; 6], d: &[f64; 4], scales: [i8; 4]) -> Matrix4<T> {
        let [a, b, c, e, f, g] = *u;
        let unit = Matrix4::new(1.0, a, b, c, 0.0, 1.0, e, f, 0.0, 0.0, 1.0, g, 0.0, 0.0, 0.0, 1.0);
        let units = Matrix4::from_diagonal(&Vector4::from(scales).map(|scale| libm::exp10(f64::from(scale))));
        let root = units * unit;
        (root * Matrix4::from_diagonal(&Vector4::from(*d)) * root.transpose()).map(T::rounded)
    }

    /// The largest difference of a covariance and its factors, over the standard deviations of both states.
    fn difference<T: Rounded>(given: &Matrix4<T>) -> Result<f64, NotPositiveSemidefinite> {
        let factors = UdCovariance::from_covariance(given)?;
        UdCovariance::from_factors(&factors.unit_factor(), &factors.weights()).unwrap();
        let (given, unit) = (given.map(Rounded::wide), factors.unit_factor().map(Rounded::wide));
        let made = unit * Matrix4::from_diagonal(&factors.weights().map(Rounded::wide)) * unit.transpose();
        let deviations = given.diagonal().map(libm::sqrt);
        let scaled = (made - given).component_div(&(deviations * deviations.transpose()));
        // A state known exactly has no deviation, and no difference.
        Ok(scaled.map(|x| if x.is_nan() { 0.0 } else { x.abs() }).max())
    }

    fn weight() -> impl Strategy<Value = f64> {
        prop_oneof![Just(0.0), 0.25..4.0_f64]
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// Of any rank, with standard deviations over twelve decades.
        #[test]
        fn law_a_semidefinite_matrix_is_a_covariance(
            u in prop::array::uniform6(-1.0..1.0_f64), d in prop::array::uniform4(weight()),
            scales in prop::array::uniform4(-6..6_i8),
        ) {
            let single = difference(&semidefinite::<f32>(&u, &d, scales));
            let double = difference(&semidefinite::<f64>(&u, &d, scales));
            // The eight roundings of four states.
            prop_assert!(single.is_ok_and(|error| error < 32.0 * f64::from(f32::EPSILON)), "{single:?}");
            prop_assert!(double.is_ok_and(|error| error < 32.0 * f64::EPSILON), "{double:?}");
        }

        /// A combination of states with a negative variance, be it a ten thousandth of what a state has.
        #[test]
        fn law_an_indefinite_matrix_is_refused(
            u in prop::array::uniform6(-1.0..1.0_f64), d in prop::array::uniform4(weight()),
            scales in prop::array::uniform4(-6..6_i8), negative in 0..4_usize, part in 1e-4..1.0_f64,
        ) {
            let mut d = d;
            d[negative] = -part;
            let double = difference(&semidefinite::<f64>(&u, &d, scales));
            prop_assert!(double.is_err(), "{double:?}");
            let single = difference(&semidefinite::<f32>(&u, &d, scales));
            prop_assert!(single.is_err(), "{single:?}");
        }
    }

    /// Position, velocity and acceleration under white noise that is constant over a step, in each order.
    #[test]
    fn exact_noise_of_rank_one() {
        for dt in [1e-6_f32, 1e-3, 0.1, 3.0] {
            let gain = Vector2::new(0.5 * dt * dt, dt);
            for gain in [gain, Vector2::new(gain.y, gain.x)] {
                let q = gain * gain.transpose() * 0.3;
                let sources = UdCovariance::from_covariance(&q).unwrap().sources();
                let sum: Matrix2<f32> =
                    sources.iter().map(|s| s.gain * s.gain.transpose() * s.variance).sum();
                assert!((sum - q).component_div(&q).abs().max() < 1e-6, "{sum} {q}");
            }
        }
        let of_one = UdCovariance::from_covariance(&Matrix3::from_diagonal(&[0.0, 0.5, 0.0].into()));
        assert_eq!(of_one, Ok(UdCovariance::from_diagonal(&[0.0, 0.5, 0.0].into())));
        assert_eq!(UdCovariance::from_covariance(&Matrix3::<f32>::zeros()), Ok(UdCovariance::known()));
    }

    /// A state known exactly that depends on another; and a variance that is small, and not zero.
    #[test]
    fn law_a_zero_has_no_covariance_and_a_small_variance_is_kept() {
        let refused = |p| UdCovariance::<f32, 2>::from_covariance(&p).map_err(|error| error.state);
        assert_eq!(refused(Matrix2::new(1.0, 1e-30, 1e-30, 0.0)), Err(1));
        assert_eq!(refused(Matrix2::new(0.0, 1e-10, 1e-10, 1.0)), Err(0));
        // Their product is too small for the precision.
        assert_eq!(refused(Matrix2::new(1e-30, 1e-25, 1e-25, 1e-30)), Err(0));
        assert_eq!(refused(Matrix2::new(-1e-30, 0.0, 0.0, 1.0)), Err(0));
        for bad in [f32::NAN, f32::INFINITY] {
            assert_eq!(refused(Matrix2::new(1.0, 0.0, 0.0, bad)), Err(1));
            assert_eq!(refused(Matrix2::new(bad, 0.0, 0.0, 1.0)), Err(0));
            assert!(refused(Matrix2::new(1.0, bad, bad, 0.0)).is_err());
        }
        // Two states that are one, of which a third sees one alone.
        let seen = Matrix3::new(1.0, 1e-10, 0.0, 1e-10, 1.0, 1.0, 0.0, 1.0, 1.0);
        let refused_of_three = UdCovariance::<f64, 3>::from_covariance(&seen);
        assert_eq!(refused_of_three, Err(NotPositiveSemidefinite { state: 1 }));
        let correlation = 1.0 - f32::EPSILON;
        let near = UdCovariance::from_covariance(&Matrix2::new(1.0, correlation, correlation, 1.0)).unwrap();
        assert!(near.weights[0] > 0.0, "{near:?}");
    }
}
