//! The filter that a configuration picks: all of them are in one program.

use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Health, ImpactAided,
    ImpactAidedTuning, Innovation, LdvSample, TwinFilter, TwinTuning,
};
use link::FilterKind;
use motor_model::{DriveCommand, MotorParams, OutOfBounds, Time};

/// One of the filters.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one, and no heap to put it on")]
pub enum Filter {
    /// Camera only.
    ConstantRate(ConstantRate<f32>),
    /// Camera, and impacts from the vibrometer.
    ImpactAided(ImpactAided<f32>),
    /// Camera, and the twin driven by the vibrometer's impacts.
    Twin(TwinFilter<f32>),
}

impl Filter {
    /// A filter that has seen nothing. What it knows of the motor is nominal.
    ///
    /// # Errors
    /// When the model refuses the nominal motor: never.
    // Inlined, so that it is built where it goes: it is larger than a stack should carry.
    #[expect(clippy::inline_always, reason = "a copy of the filter on the way is what counts, not the call")]
    #[inline(always)]
    pub fn of(kind: FilterKind) -> Result<Self, OutOfBounds> {
        let nominal = MotorParams::nominal();
        Ok(match kind {
            FilterKind::ConstantRate => Self::ConstantRate(ConstantRate::new(&ConstantRateTuning::default())),
            FilterKind::ImpactAided => Self::ImpactAided(ImpactAided::new(&ImpactAidedTuning::new(&nominal))),
            FilterKind::Twin => Self::Twin(TwinFilter::try_new(&nominal, &TwinTuning::new(&nominal))?),
        })
    }
}

impl AngleFilter<f32> for Filter {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        match self {
            Self::ConstantRate(filter) => filter.drive(at, command),
            Self::ImpactAided(filter) => filter.drive(at, command),
            Self::Twin(filter) => filter.drive(at, command),
        }
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<Innovation<f32>> {
        match self {
            Self::ConstantRate(filter) => filter.update_ldv(sample),
            Self::ImpactAided(filter) => filter.update_ldv(sample),
            Self::Twin(filter) => filter.update_ldv(sample),
        }
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<f32> {
        match self {
            Self::ConstantRate(filter) => filter.update_camera(frame),
            Self::ImpactAided(filter) => filter.update_camera(frame),
            Self::Twin(filter) => filter.update_camera(frame),
        }
    }

    fn estimate(&self, now: Time) -> Option<Estimate<f32>> {
        match self {
            Self::ConstantRate(filter) => filter.estimate(now),
            Self::ImpactAided(filter) => filter.estimate(now),
            Self::Twin(filter) => filter.estimate(now),
        }
    }

    fn health(&self, now: Time) -> Health {
        match self {
            Self::ConstantRate(filter) => filter.health(now),
            Self::ImpactAided(filter) => filter.health(now),
            Self::Twin(filter) => filter.health(now),
        }
    }
}
