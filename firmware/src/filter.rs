//! The filter that a configuration selects, out of those that the program is built with: `constant_rate` always,
//! `impact_aided` and `twin` by the features of their names.

use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Health, Innovation, Instruments,
    LdvSample,
};
#[cfg(feature = "impact_aided")]
use estimator::{ImpactAided, ImpactAidedTuning};
#[cfg(feature = "twin")]
use estimator::{TwinFilter, TwinTuning};
use link::FilterKind;
use motor_model::{DriveCommand, MotorParams, OutOfBounds, Time};

/// The filter that a configuration selects.
#[derive(Debug)]
#[cfg_attr(feature = "twin", expect(clippy::large_enum_variant, reason = "a program has one, and no heap"))]
pub enum SelectedFilter {
    /// Camera only.
    ConstantRate(ConstantRate<f32>),
    /// Camera, and impacts from the vibrometer.
    #[cfg(feature = "impact_aided")]
    ImpactAided(ImpactAided<f32>),
    /// Camera, and the twin driven by the vibrometer's impacts.
    #[cfg(feature = "twin")]
    Twin(TwinFilter<f32>),
}

/// The same call to the filter of any variant.
macro_rules! forward {
    ($self:ident, $filter:ident => $call:expr) => {
        match $self {
            SelectedFilter::ConstantRate($filter) => $call,
            #[cfg(feature = "impact_aided")]
            SelectedFilter::ImpactAided($filter) => $call,
            #[cfg(feature = "twin")]
            SelectedFilter::Twin($filter) => $call,
        }
    };
}

impl SelectedFilter {
    /// A filter without measurements, for a motor of `params` under `instruments`.
    ///
    /// # Errors
    /// When the program was built without it, or the model refuses the motor.
    // Inlined, so that it is constructed at its destination: it is too large for the stack.
    #[expect(clippy::inline_always, reason = "it saves a copy of the filter")]
    #[inline(always)]
    pub fn try_new(
        kind: FilterKind,
        params: &MotorParams,
        instruments: &Instruments,
    ) -> Result<Self, OutOfBounds> {
        match kind {
            FilterKind::ConstantRate => {
                Ok(Self::ConstantRate(ConstantRate::new(&ConstantRateTuning::for_motor(params, instruments))))
            }
            #[cfg(feature = "impact_aided")]
            FilterKind::ImpactAided => {
                Ok(Self::ImpactAided(ImpactAided::new(&ImpactAidedTuning::new(params, instruments))))
            }
            #[cfg(feature = "twin")]
            FilterKind::Twin => {
                Ok(Self::Twin(TwinFilter::try_new(params, &TwinTuning::new(params, instruments))?))
            }
            #[cfg(not(all(feature = "impact_aided", feature = "twin")))]
            absent => Err(OutOfBounds {
                key: "estimator.filter",
                value: f64::from(absent as u8),
                min: 0.0,
                max: 0.0,
                unit: "",
            }),
        }
    }
}

impl AngleFilter<f32> for SelectedFilter {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        forward!(self, filter => filter.drive(at, command));
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<Innovation<f32>> {
        forward!(self, filter => filter.update_ldv(sample))
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<f32> {
        forward!(self, filter => filter.update_camera(frame))
    }

    fn estimate(&self, now: Time) -> Option<Estimate<f32>> {
        forward!(self, filter => filter.estimate(now))
    }

    fn health(&self, now: Time) -> Health {
        forward!(self, filter => filter.health(now))
    }

    fn assess(&self, now: Time) -> (Option<Estimate<f32>>, Health) {
        forward!(self, filter => filter.assess(now))
    }
}
