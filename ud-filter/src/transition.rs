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
//! | [`Dense`] | everything, by Thornton's weighted Gram-Schmidt | `O(n^3)` |

mod blocks;
mod dense;
mod different_blocks;
mod triangular;

use nalgebra::SVector;

use crate::real::Real;
use crate::ud_covariance::UdCovariance;
pub use blocks::Blocks2;
pub use dense::Dense;
pub use different_blocks::{BlockList, Blocks};
pub use triangular::UpperTriangular;

mod sealed {
    pub trait Sealed {}
}
pub(crate) use sealed::Sealed;

/// A linear map of N states, applied to states and to factors.
pub trait Transition<T: Real, const N: usize>: Sealed {
    /// `F x`.
    fn carry(&self, state: &SVector<T, N>) -> SVector<T, N>;

    /// Whether all entries of F that are read are numbers of usable size: neither infinite nor NaN, nor so large that
    /// their sum is.
    fn is_finite(&self) -> bool;

    /// `P <- F P F'` on the factors. An entry that is infinite or NaN makes variances infinite or NaN, never smaller:
    /// [`UdCovariance::predict`] refuses it.
    fn carry_factors(&self, covariance: &mut UdCovariance<T, N>);
}
