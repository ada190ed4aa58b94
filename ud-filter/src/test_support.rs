//! What the tests need of a scalar beside [`Real`]: the way from and to `f64`.

use crate::Real;

/// A scalar with a way from and to `f64`.
pub(crate) trait Rounded: Real {
    /// Rounds `x` to this precision.
    fn rounded(x: f64) -> Self;
    /// The same value in `f64`, exactly.
    fn wide(self) -> f64;
}

impl Rounded for f32 {
    fn rounded(x: f64) -> Self {
        x as f32
    }
    fn wide(self) -> f64 {
        f64::from(self)
    }
}

impl Rounded for f64 {
    fn rounded(x: f64) -> Self {
        x
    }
    fn wide(self) -> f64 {
        self
    }
}
