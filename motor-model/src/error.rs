//! The only error of construction: a named quantity outside its bounds.

use core::fmt;

/// A quantity outside the bounds within which the model is valid (NaN is outside all bounds).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OutOfBounds {
    /// Key of the quantity, as in a scene file.
    pub key: &'static str,
    /// The value refused.
    pub value: f64,
    /// Smallest value allowed.
    pub min: f64,
    /// Largest value allowed.
    pub max: f64,
    /// Unit of all three; empty for a pure number.
    pub unit: &'static str,
}

impl OutOfBounds {
    /// `value` if it lies in `min..=max`, otherwise the error that names it.
    ///
    /// # Errors
    /// When `value` is outside the bounds or NaN.
    pub fn check(key: &'static str, value: f64, min: f64, max: f64, unit: &'static str) -> Result<f64, Self> {
        if value >= min && value <= max { Ok(value) } else { Err(Self { key, value, min, max, unit }) }
    }
}

impl fmt::Display for OutOfBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { key, value, min, max, unit } = self;
        let space = if unit.is_empty() { "" } else { " " };
        write!(f, "{key} = {value} is outside its bounds {min} to {max}{space}{unit}")
    }
}

impl core::error::Error for OutOfBounds {}
