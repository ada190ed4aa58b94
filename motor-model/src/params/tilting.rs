//! A checked set of the tilting motor's own parameters.

use rand_core::Rng;

use super::draw::drawn_value;
use super::tilting_table::COUNT;
pub use super::tilting_table::TiltingParameter;
use crate::error::OutOfBounds;

/// Values of the parameters that a tilting motor has beside [`crate::MotorParams`], each finite and within its bounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TiltingParams {
    values: [f64; COUNT],
}

impl Default for TiltingParams {
    fn default() -> Self {
        Self::nominal()
    }
}

impl TiltingParams {
    /// The nominal values: 20 um of clearance, the stator of the finite elements, no ceiling and no floor.
    pub const fn nominal() -> Self {
        let mut values = [0.0; COUNT];
        let mut number = 0;
        while number < COUNT {
            #[expect(clippy::indexing_slicing, reason = "below the length of both")]
            {
                values[number] = TiltingParameter::ALL[number].spec().nominal;
            }
            number += 1;
        }
        Self { values }
    }

    /// The value of `parameter`, in the unit of its spec.
    pub fn get(&self, parameter: TiltingParameter) -> f64 {
        #[expect(clippy::indexing_slicing, reason = "there is one value per discriminant")]
        self.values[parameter as usize]
    }

    /// The same set with `parameter` at `value`.
    ///
    /// # Errors
    /// When `value` is outside the parameter's bounds or NaN.
    pub fn with(mut self, parameter: TiltingParameter, value: f64) -> Result<Self, OutOfBounds> {
        let value = parameter.check(value)?;
        #[expect(clippy::indexing_slicing, reason = "there is one value per discriminant")]
        {
            self.values[parameter as usize] = value;
        }
        Ok(self)
    }

    /// Another motor of the design whose values these are, drawn as [`crate::MotorParams::draw`] draws.
    ///
    /// The tolerance of a parameter whose nominal value is 0 does not scale with the design's value.
    #[must_use]
    pub fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> Self {
        self.draw_within(|_| None, rng)
    }

    /// The same with tolerances of one's own, as [`crate::MotorParams::draw_within`] has them.
    #[must_use]
    pub fn draw_within<R: Rng + ?Sized>(
        &self,
        own: impl Fn(TiltingParameter) -> Option<f64>,
        rng: &mut R,
    ) -> Self {
        let mut drawn = *self;
        for parameter in TiltingParameter::ALL {
            let value = drawn_value(&parameter.spec(), self.get(parameter), own(parameter), rng);
            if let Ok(changed) = drawn.with(parameter, value) {
                drawn = changed;
            }
        }
        drawn
    }
}
