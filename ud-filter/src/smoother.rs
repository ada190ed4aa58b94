//! Fixed-interval smoothing: the state at each step of an interval, from the measurements before and after it.
//!
//! From the last step back, where x, P are the filter's at a step and `x-`, `P-` those predicted from them for the next
//! step, whose smoothed ones are `xs+`, `Ps+`:
//!
//! ```text
//! C = P F' (P-)^-1,   xs = x + C (xs+ - x-),   Ps = P + C (Ps+ - P-) C'                  (Rauch, Tung, Striebel)
//!                                                 = (I - C F) P (I - C F)' + C (Ps+ + Q) C'
//! ```
//!
//! The last line is the form used. It follows from `P- = F P F' + Q` as Joseph's form of an update does. It is a sum of
//! three covariances, without a difference: a transition of Ps+ by C, and sources of noise, which are the columns of
//! `(I - C F) U` and of C times those of Q. So the factors keep Ps symmetric and positive semidefinite. With
//! `P- = V E V'` the gain is `C = U W V^-1`, `W = D (V^-1 F U)' E^-1`, by substitutions, and `(I - C F) U` is
//! `U (I - W V^-1 F U)`. Where `E_j` is zero a combination of states is predicted exactly, and C has no use for it. F
//! may be singular.
//!
//! An extended filter's steps are smoothed alike: F and `x-` are those that the filter used.
//!
//! Sources: Rauch, Tung and Striebel, "Maximum likelihood estimates of linear dynamic systems", AIAA Journal 3 (1965)
//! 1445-1450; Bierman, "A new computationally efficient fixed-interval, discrete-time smoother", Automatica 19 (1983)
//! 503-511, which sums such terms too, one source at a time, and asks for the inverse of F.

use nalgebra::{SMatrix, SVector};

use crate::kalman_filter::KalmanFilter;
use crate::prediction::PredictionRefusal;
use crate::real::{Real, is_finite, reciprocal, total};
use crate::transition::Transition;
use crate::ud_covariance::{Columns, NoiseSource, UdCovariance};

/// A step that a filter has made, as the smoother needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "T: Real + serde::Serialize, F: serde::Serialize",
        deserialize = "T: Real + serde::Deserialize<'de>, F: serde::Deserialize<'de>"
    ))
)]
pub struct SmootherStep<T, F, const N: usize, const S: usize> {
    /// State and covariance before the step, with the measurements up to then. [`smooth`] puts those with all
    /// measurements of the interval in their place.
    pub filter: KalmanFilter<T, N>,
    /// F of the step; of an extended filter its Jacobian.
    pub transition: F,
    /// Its noise sources.
    #[cfg_attr(feature = "serde", serde(with = "crate::serialised_array"))]
    pub noise: [NoiseSource<T, N>; S],
    /// The state predicted by the step: `F x + B u`, or `f(x)`.
    pub predicted: SVector<T, N>,
}

/// Why an interval could not be smoothed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SmootherRefusal {
    /// The step that cannot be smoothed. It and those before it are as they were; those after it are smoothed.
    pub step: usize,
    /// What is wrong with it.
    pub reason: PredictionRefusal,
}

impl core::fmt::Display for SmootherRefusal {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "step {} cannot be smoothed: {}", self.step, self.reason)
    }
}

impl core::error::Error for SmootherRefusal {}

/// Smooths the steps of an interval, in order of time, from the filter after the `last` of them and its measurements.
///
/// # Errors
/// When a step has a number that is infinite or NaN, or too large for the precision.
pub fn smooth<T: Real, F: Transition<T, N>, const N: usize, const S: usize>(
    steps: &mut [SmootherStep<T, F, N, S>],
    last: &KalmanFilter<T, N>,
) -> Result<(), SmootherRefusal> {
    let mut next = last;
    for (index, step) in steps.iter_mut().enumerate().rev() {
        step.filter = step.smoothed(next).map_err(|reason| SmootherRefusal { step: index, reason })?;
        next = &step.filter;
    }
    Ok(())
}

impl<T: Real, F: Transition<T, N>, const N: usize, const S: usize> SmootherStep<T, F, N, S> {
    /// State and covariance before the step, from the smoothed ones after it.
    fn smoothed(&self, next: &KalmanFilter<T, N>) -> Result<KalmanFilter<T, N>, PredictionRefusal> {
        let mut predicted = self.filter.covariance;
        predicted.predict(&self.transition, &self.noise)?;
        let (gain, kept) = self.gain(&predicted);
        let mut covariance = next.covariance;
        covariance.transform(&gain)?;
        for (column, &variance) in kept.column_iter().zip(&self.filter.covariance.weights) {
            covariance.add_rank_one(&column.into_owned(), variance);
        }
        for source in &self.noise {
            covariance.add_rank_one(&(gain * source.gain), source.variance);
        }
        let state = self.filter.state + gain * (next.state - self.predicted);
        let [entries] = &state.data.0;
        if !is_finite(total(entries)) {
            return Err(PredictionRefusal::State);
        }
        Ok(KalmanFilter { state, covariance })
    }

    /// `C` and `(I - C F) U`.
    fn gain(&self, predicted: &UdCovariance<T, N>) -> (SMatrix<T, N, N>, SMatrix<T, N, N>) {
        let own = &self.filter.covariance;
        // V^-1 F U: from the last row up.
        let mut seen = own.unit;
        for column in &mut seen {
            let [carried] = self.transition.carry(&(*column).into()).data.0;
            *column = carried;
            for (j, unit) in predicted.unit.iter().enumerate().rev() {
                let entry = column.get(j).copied().unwrap_or_default();
                for (above, &u) in column.iter_mut().zip(unit).take(j) {
                    *above -= entry * u;
                }
            }
        }
        let seen = SMatrix::<T, N, N>::from(seen);
        let mut shares = seen.transpose();
        for (mut column, &weight) in shares.column_iter_mut().zip(&predicted.weights) {
            let per_weight = reciprocal(weight).unwrap_or_default();
            for (share, &own) in column.iter_mut().zip(&own.weights) {
                *share *= own * per_weight;
            }
        }
        let unit = own.unit_factor();
        let kept = unit * (SMatrix::identity() - shares * seen);
        (over_unit((unit * shares).data.0, &predicted.unit), kept)
    }
}

/// `Y V^-1` of a unit upper triangular V: from the first column on.
fn over_unit<T: Real, const N: usize>(mut y: Columns<T, N>, unit: &Columns<T, N>) -> SMatrix<T, N, N> {
    for (j, column) in unit.iter().enumerate() {
        let (before, from_here) = y.split_at_mut(j);
        let Some(own) = from_here.first_mut() else { continue };
        for (done, &v) in before.iter().zip(column) {
            for (entry, &x) in own.iter_mut().zip(done) {
                *entry -= x * v;
            }
        }
    }
    y.into()
}

#[cfg(test)]
mod tests;
