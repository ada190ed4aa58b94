//! Ways to begin: from variances, or from a covariance.
//!
//! A covariance of many states takes kilobytes. The ways that set it in place need no second one on the stack.

use core::cmp::Ordering;

use nalgebra::{SMatrix, SVector};

use super::{Columns, UdCovariance};
use crate::real::{Real, is_finite};

/// A matrix is not a covariance: some combination of states would have no positive variance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct NotPositiveDefinite {
    /// The last state for which this shows, given those after it.
    pub state: usize,
}

impl core::fmt::Display for NotPositiveDefinite {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "not positive definite at state {}", self.state)
    }
}

impl core::error::Error for NotPositiveDefinite {}

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

    /// The factors of a covariance, of which the upper triangle is read.
    ///
    /// # Errors
    /// When it is not positive definite in this precision, or not finite.
    pub fn from_covariance(covariance: &SMatrix<T, N, N>) -> Result<Self, NotPositiveDefinite> {
        // The columns not reached yet are the covariance of their states, given those after them.
        let mut factors = Self { unit: covariance.data.0, weights: [T::zero(); N] };
        for (state, weight) in factors.weights.iter_mut().enumerate().rev() {
            let (before, from_here) = factors.unit.split_at_mut(state);
            let Some(column) = from_here.first_mut() else { continue };
            let source = *column;
            let pivot = source.get(state).copied().unwrap_or_default();
            if !(pivot > T::zero() && is_finite(pivot)) {
                return Err(NotPositiveDefinite { state });
            }
            *weight = pivot;
            for (i, u) in column.iter_mut().enumerate() {
                match i.cmp(&state) {
                    Ordering::Less => *u /= pivot,
                    Ordering::Equal => *u = T::one(),
                    Ordering::Greater => *u = T::zero(),
                }
                if !is_finite(*u) {
                    return Err(NotPositiveDefinite { state });
                }
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
