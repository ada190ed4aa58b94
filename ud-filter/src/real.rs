//! The scalar of a filter.

use core::ops::Neg;

use nalgebra::Scalar;
use num_traits::{Bounded, NumAssign};

/// What a filter asks of its numbers: `f32` and `f64` have it. Any other type that rounds, and has infinities and NaN
/// as they have, has it too.
///
/// There is nothing to implement: a type with these traits is a `Real`. They are those of sums and products. A filter
/// needs no square root and no other function.
pub trait Real:
    Scalar + NumAssign + Neg<Output = Self> + Bounded + From<f32> + Copy + Default + PartialOrd
{
}

impl<T> Real for T where
    T: Scalar + NumAssign + Neg<Output = T> + Bounded + From<f32> + Copy + Default + PartialOrd
{
}

/// Whether `x` is neither infinite nor NaN.
#[inline]
pub fn is_finite<T: Real>(x: T) -> bool {
    x * T::zero() == T::zero()
}

/// `1 / x`, unless this is too large for the precision.
#[inline]
pub fn reciprocal<T: Real>(x: T) -> Option<T> {
    let inverse = T::one() / x;
    is_finite(inverse).then_some(inverse)
}

/// The sum: finite only if all are. It is infinite, too, if they are too large for the precision.
#[inline]
pub(crate) fn total<T: Real, const N: usize>(numbers: &[T; N]) -> T {
    numbers.iter().fold(T::zero(), |sum, &x| sum + x)
}

/// [`reciprocal`] of what is not negative: one comparison instead of a product and two.
#[inline]
pub(crate) fn reciprocal_of_sum<T: Real>(x: T) -> Option<T> {
    let inverse = T::one() / x;
    (inverse <= T::max_value()).then_some(inverse)
}
