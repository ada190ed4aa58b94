//! What the twin's filter takes of a motor, once the model has accepted its parameters.
//!
//! All that can fail is done here. The filter itself is large, and is built where it stays: a function that returned
//! either it or an error would need it twice more on the stack, 14 kB on a microcontroller.

use motor_model::{DriveTuning, Mode, MotorParams, OutOfBounds, Parameter, Real, Stator};

/// Period at which the stator is stepped, in ns and in s: that of the default vibrometer.
pub(super) const PERIOD_NANOS: u64 = 5_000;
pub(super) const PERIOD_S: f64 = 5e-6;

/// A motor whose nominal parameters the model has accepted, for [`crate::TwinFilter::new`].
#[derive(Clone, Debug)]
pub struct CheckedMotor<T: Real> {
    pub(super) modes: [Mode; 3],
    pub(super) stator: Stator<T>,
    /// Mass ratio of rotor and stator at a tooth.
    pub(super) tooth_mass_ratio: f64,
    pub(super) tooth_radius_m: f64,
}

impl<T: Real> CheckedMotor<T> {
    /// A motor of these nominal parameters.
    ///
    /// # Errors
    /// When the model refuses the parameters.
    pub fn try_new(params: &MotorParams) -> Result<Self, OutOfBounds> {
        Ok(Self {
            modes: Mode::all(params)?,
            stator: Stator::try_new(params, DriveTuning::Resonant, PERIOD_S)?,
            tooth_mass_ratio: params.tooth_mass_ratio(),
            tooth_radius_m: params.get(Parameter::ToothRadius),
        })
    }
}
