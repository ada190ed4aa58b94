//! A covariance that stays positive semidefinite: `P = U D U'`, U unit upper triangular, D diagonal and not negative.
//!
//! ```text
//! measurement  z = h'x + noise of variance R:   f = U'h,  g = D f,  a_0 = R,  a_j = a_(j-1) + f_j g_j
//!              D_j <- D_j a_(j-1) / a_j,   U_ij <- U_ij - b_i f_j / a_(j-1),   b_i <- b_i + U_ij g_j,   K = b / a_n
//! transition   P <- F P F':  the rows of F U made orthogonal in the weights D, from the last row up
//! noise        P <- P + c a a':  D_j <- D_j + c a_j^2,  a_i <- a_i - a_j U_ij,  U_ij <- U_ij + (c a_j / D_j) a_i,
//!              c <- c (old D_j) / D_j,  from the last column down to the first
//! ```
//!
//! The three are Bierman's, Thornton's and Agee and Turner's.
//!
//! Why not the matrix itself? `P - K h'P` subtracts nearly equal numbers as soon as a measurement is much better than
//! its prediction, and `f32` loses the definiteness of P for good. Joseph's form `(I - K h') P (I - K h')' + K R K'`
//! delays this. The factors end it: D is only multiplied by, and added to, what is not negative, and the condition
//! number that rounding meets is the square root of that of P. Why U D U' and not a Cholesky factor? It has the same
//! accuracy without a square root (a library call for each state on the microcontroller) and a division for each state.
//!
//! Time updates cost `O(n^2)` for each noise source and, for structured transitions, `O(n^2)` in all: see
//! [`crate::Transition`].
//!
//! Bad numbers: an infinity or NaN in a prior, F, noise or measurement is refused with a reason, and nothing has
//! changed then ([`UdCovariance::predict`], [`UdCovariance::update`]). The steps below these two do not look. They make
//! the variances that such a number reaches infinite or NaN, never smaller, and measurements of those are refused.
//!
//! Nothing here compares with an absolute threshold. A vanishing `D_j` (a combination of states known exactly) stays
//! zero until noise or a transition changes it, and `R = 0` makes such a combination of `h'x`. The only limit is the
//! number format: a number too small for its reciprocal counts as zero.
//!
//! Sources: Bierman, "Factorization Methods for Discrete Sequential Estimation" (1977), chapters III and V; Thornton,
//! "Triangular covariance factorizations for Kalman filtering", thesis, UCLA (1976); Agee and Turner, White Sands
//! technical report 38 (1972); Grewal and Andrews, "Kalman Filtering", chapter on square-root filtering; Maybeck,
//! "Stochastic Models, Estimation and Control", volume 1, 7.7.

mod measurement_update;
mod prior;
mod process_noise;
#[cfg(feature = "serde")]
mod serialised;
mod single_states;
mod sparse_row;
mod vector_update;

use nalgebra::{SMatrix, SVector};

use crate::real::{Real, reciprocal};

pub use measurement_update::{Correction, InnovationRecord, Outcome, Refusal};
pub use prior::{NotAVariance, NotFactors, NotPositiveSemidefinite};
pub use process_noise::NoiseSource;
pub(crate) use process_noise::are_usable;
pub use sparse_row::{SparseRow, WhitenedMeasurement};
pub use vector_update::VectorInnovationRecord;

/// Up to so many states the chain of divisions determines the time. Above, several divisions are prepared together.
const FEW_STATES: usize = 3;

/// Up to so many states a column is straight-line code.
const UNROLLED_STATES: usize = 12;

/// A matrix by columns.
pub type Columns<T, const N: usize> = [[T; N]; N];

/// Covariance of N states as its factors `P = U D U'`: symmetric and positive semidefinite whatever the rounding.
///
/// Positive definite from the first, it stays so as long as nothing is known exactly (`R > 0`, F invertible) and
/// nothing underflows.
///
/// The factors are public: a filter may write the zeros and ones of its own model out. What it writes must keep U unit
/// upper triangular and D not negative.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(
        bound(serialize = "T: Real + serde::Serialize", deserialize = "T: Real + serde::Deserialize<'de>"),
        into = "serialised::Factors<T, N>",
        try_from = "serialised::Factors<T, N>"
    )
)]
pub struct UdCovariance<T, const N: usize> {
    /// U by columns, its ones and zeros included.
    pub unit: Columns<T, N>,
    /// The diagonal of D: the variance of each state given those after it. Not negative.
    pub weights: [T; N],
}

impl<T: Real, const N: usize> UdCovariance<T, N> {
    /// P, symmetric to the bit.
    pub fn covariance(&self) -> SMatrix<T, N, N> {
        let mut sum = [[T::zero(); N]; N];
        for (column, &weight) in self.unit.iter().zip(&self.weights) {
            for (out, &u) in sum.iter_mut().zip(column) {
                for (entry, &v) in out.iter_mut().zip(column) {
                    *entry += weight * (u * v);
                }
            }
        }
        sum.into()
    }

    /// The variance of each state, the diagonal of P.
    pub fn variances(&self) -> SVector<T, N> {
        let mut sum = [T::zero(); N];
        for (column, &weight) in self.unit.iter().zip(&self.weights) {
            for (entry, &u) in sum.iter_mut().zip(column) {
                *entry += weight * (u * u);
            }
        }
        sum.into()
    }

    /// The covariance of state `i` with every state, a column of P; zeros if there is no such state.
    pub fn column(&self, i: usize) -> SVector<T, N> {
        let mut sum = [T::zero(); N];
        for (column, &weight) in self.unit.iter().zip(&self.weights).skip(i) {
            let share = weight * column.get(i).copied().unwrap_or_default();
            for (entry, &u) in sum.iter_mut().zip(column) {
                *entry += share * u;
            }
        }
        sum.into()
    }

    /// The most probable errors within a bound on one of them, from the most probable `errors` without it: state `i`
    /// goes to `bound`, and every other by its regression on it, `P_ji / P_ii`.
    ///
    /// With a Gaussian density and an inequality that the mean violates, this is the maximum of the posterior (Simon
    /// and Chia, "Kalman filtering with state equality constraints", IEEE Transactions on Aerospace and Electronic
    /// Systems 38, 2002). The covariance remains: it is too large rather than too small.
    pub fn constrain(&self, i: usize, bound: T, errors: &mut SVector<T, N>) {
        let column = self.column(i);
        let (Some(&variance), Some(&error)) = (column.as_slice().get(i), errors.as_slice().get(i)) else {
            return;
        };
        match reciprocal(variance) {
            Some(per_variance) => *errors += column * ((bound - error) * per_variance),
            None => errors.as_mut_slice().iter_mut().skip(i).take(1).for_each(|error| *error = bound),
        }
    }

    /// The sum of all variances, the trace of P.
    pub fn trace(&self) -> T {
        self.variances().sum()
    }

    /// The variance of state `I`.
    #[inline]
    pub fn variance<const I: usize>(&self) -> T {
        const { assert!(I < N, "no such state") };
        let mut sum = self.weights.get(I).copied().unwrap_or_default();
        let later = self.unit.get(I + 1..).unwrap_or_default();
        for (column, &weight) in later.iter().zip(self.weights.get(I + 1..).unwrap_or_default()) {
            if let Some(&u) = column.get(I) {
                sum += weight * (u * u);
            }
        }
        sum
    }

    /// P as sources of noise, one for each column of U: for a Q that is known in full, of any rank.
    ///
    /// ```
    /// use nalgebra::{Matrix2, Vector2};
    /// use ud_filter::{UdCovariance, UpperTriangular};
    ///
    /// // Position and velocity under an acceleration that is white, and constant over a step: a Q of rank one.
    /// let dt = 0.1_f64;
    /// let effect = Vector2::new(0.5 * dt * dt, dt);
    /// let noise = UdCovariance::from_covariance(&(effect * effect.transpose() * 0.25))?.sources();
    /// let mut covariance = UdCovariance::known();
    /// covariance.predict(&UpperTriangular(Matrix2::new(1.0, dt, 0.0, 1.0)), &noise)?;
    /// assert!((covariance.variance::<1>() - 0.0025).abs() < 1e-15);
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    pub fn sources(&self) -> [NoiseSource<T, N>; N] {
        let mut sources = [NoiseSource { gain: SVector::zeros(), variance: T::zero() }; N];
        for (source, (&column, &weight)) in sources.iter_mut().zip(self.unit.iter().zip(&self.weights)) {
            *source = NoiseSource { gain: column.into(), variance: weight };
        }
        sources
    }

    /// The unit upper triangular factor U.
    pub fn unit_factor(&self) -> SMatrix<T, N, N> {
        self.unit.into()
    }

    /// The diagonal of D: the variance of each state given those after it. Not negative.
    pub fn weights(&self) -> SVector<T, N> {
        self.weights.into()
    }
}

/// Runs `body` for every column `j < n`, from the first up or from the last down, as straight-line code for up to
/// twelve states.
///
/// In straight-line code `j` is a constant where `body` calls an always-inlined function. The loops over the rows above
/// the diagonal then have fixed lengths and are unrolled, which halves the work compared with loops over the zeros too.
/// The price is code size, which the crate's feature `unroll` decides on: the arithmetic is the same to the bit.
#[cfg(feature = "unroll")]
macro_rules! for_columns {
    (up to $n:expr, |$j:ident| $body:expr) => {
        for_columns!(@ $n, $j, $body, 0 1 2 3 4 5 6 7 8 9 10 11);
        for $j in 12..$n {
            $body;
        }
    };
    (down from $n:expr, |$j:ident| $body:expr) => {
        for $j in (12..$n).rev() {
            $body;
        }
        for_columns!(@ $n, $j, $body, 11 10 9 8 7 6 5 4 3 2 1 0);
    };
    (@ $n:expr, $j:ident, $body:expr, $($k:literal)*) => {
        $(if $k < $n {
            let $j = $k;
            $body;
        })*
    };
}
/// The same as a loop.
#[cfg(not(feature = "unroll"))]
macro_rules! for_columns {
    (up to $n:expr, |$j:ident| $body:expr) => {
        for $j in 0..$n {
            $body;
        }
    };
    (down from $n:expr, |$j:ident| $body:expr) => {
        for $j in (0..$n).rev() {
            $body;
        }
    };
}
pub(crate) use for_columns;
