//! How states change over a step, `x <- F x`, and what the shape of F saves. For a step that is not linear F is its
//! Jacobian.
//!
//! For `P = U D U'` the product `F U` must be brought back to unit upper triangular form.
//!
//! | F | to restore | cost |
//! |---|---|---|
//! | [`UpperTriangular`] | nothing but the scale of each column | a product |
//! | [`Blocks2`], 2 x 2 blocks on the diagonal | one element below the diagonal in every second column | `O(n^2)` |
//! | [`Blocks`], blocks of different sizes | the block on the diagonal of each of its columns | `O(n^2)` |
//! | [`Dense`], and a shape of your own | everything, by Thornton's weighted Gram-Schmidt | `O(n^3)` |

mod blocks;
mod dense;
mod different_blocks;
mod triangular;

use nalgebra::{SMatrix, SVector};

use crate::real::Real;
use crate::ud_covariance::UdCovariance;
pub use blocks::Blocks2;
pub use dense::Dense;
pub use different_blocks::{BlockList, Blocks};
pub use triangular::UpperTriangular;

/// A linear map of N states, applied to states and to factors.
///
/// A shape of your own needs [`Self::carry`] alone. The other two then read F column by column from it, at the cost of
/// [`Dense`]. A shape that knows better gives its own, and must keep to this, for filter and smoother rely on it:
///
/// - `carry` is linear, and all three are the same F at every call;
/// - `is_finite` is false if an entry is infinite or NaN;
/// - `carry_factors` leaves U unit upper triangular and D not negative, with `U D U' = F P F'` to rounding. Where it
///   divides, a divisor without a [`crate::reciprocal`] is another case: [`Dense`] has it;
/// - an entry that is infinite or NaN makes the variances that it reaches infinite or NaN, never smaller.
///
/// A shape that breaks this gives wrong numbers and nothing worse: no panic, and no access out of bounds.
///
/// ```
/// use nalgebra::SVector;
/// use ud_filter::{KalmanFilter, Transition, UdCovariance};
///
/// /// A line of delays: each state is the one before it, a step later, and the first keeps its value.
/// struct Delays;
///
/// impl<const N: usize> Transition<f64, N> for Delays {
///     fn carry(&self, state: &SVector<f64, N>) -> SVector<f64, N> {
///         SVector::from_fn(|i, _| state[i.saturating_sub(1)])
///     }
/// }
///
/// let prior = UdCovariance::from_diagonal(&SVector::from([4.0, 1.0, 1.0]));
/// let mut filter = KalmanFilter::new(SVector::from([2.0, 0.0, 0.0]), prior);
/// filter.predict(&Delays, &[])?;
/// assert_eq!(filter.state, SVector::from([2.0, 2.0, 0.0]));
/// assert_eq!(filter.covariance.variances(), SVector::from([4.0, 4.0, 1.0]));
/// # Ok::<(), ud_filter::PredictionRefusal>(())
/// ```
pub trait Transition<T: Real, const N: usize> {
    /// `F x`.
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N>;

    /// Whether all entries of F that are read are numbers of usable size: neither infinite nor NaN, nor so large that
    /// their sum is.
    fn is_finite(&self) -> bool {
        Dense(columns_of(self)).is_finite()
    }

    /// `P <- F P F'` on the factors. An entry that is infinite or NaN makes variances infinite or NaN, never smaller:
    /// [`UdCovariance::predict`] refuses it.
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>) {
        Dense(columns_of(self)).carry_factors(covariance);
    }
}

/// F in full, by the states of one alone.
fn columns_of<T: Real, F: Transition<T, N> + ?Sized, const N: usize>(transition: &F) -> SMatrix<T, N, N> {
    let mut columns = SMatrix::<T, N, N>::identity().data.0;
    for column in &mut columns {
        let [carried] = transition.carry(&(*column).into()).data.0;
        *column = carried;
    }
    columns.into()
}
