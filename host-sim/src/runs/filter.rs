//! The estimator that a scene picks.

use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Health, ImpactAided,
    ImpactAidedTuning, Innovation, LdvSample, TwinFilter, TwinTuning,
};
use motor_model::{DriveCommand, MotorParams, OutOfBounds, Real, Time};

use crate::scene::Scene;
pub use crate::scene::keys::estimator::FILTERS;

/// How far back a smoothed estimate lies, in ms.
pub const SMOOTHER_LAG_MS: u64 = 2;

/// One of the filters, in the precision of the microcontroller unless another is asked for.
#[derive(Clone, Debug)]
pub enum AnyFilter<T: Real = f32> {
    /// Camera only.
    ConstantRate(Box<ConstantRate<T>>),
    /// Camera, and impacts from the vibrometer.
    ImpactAided(Box<ImpactAided<T>>),
    /// Camera, and the twin driven by the vibrometer's impacts.
    Twin(Box<TwinFilter<T>>),
}

impl<T: Real> AnyFilter<T> {
    /// The filter of a scene.
    ///
    /// # Errors
    /// As of [`Self::named`].
    pub fn of(scene: &Scene) -> Result<Self, OutOfBounds> {
        Self::named(scene.choice("estimator.filter"))
    }

    /// The filter of this name; the simplest for any other word. Its parameters are those of the nominal motor.
    ///
    /// # Errors
    /// When the model refuses the nominal motor: never.
    pub fn named(name: &str) -> Result<Self, OutOfBounds> {
        let nominal = MotorParams::nominal();
        Ok(match name {
            "twin" => Self::Twin(Box::new(TwinFilter::try_new(&nominal, &TwinTuning::new(&nominal))?)),
            "impact_aided" => {
                Self::ImpactAided(Box::new(ImpactAided::new(&ImpactAidedTuning::new(&nominal))))
            }
            _ => Self::ConstantRate(Box::new(ConstantRate::new(&ConstantRateTuning::default()))),
        })
    }

    fn get(&self) -> &dyn AngleFilter<T> {
        match self {
            Self::ConstantRate(filter) => filter.as_ref(),
            Self::ImpactAided(filter) => filter.as_ref(),
            Self::Twin(filter) => filter.as_ref(),
        }
    }

    fn get_mut(&mut self) -> &mut dyn AngleFilter<T> {
        match self {
            Self::ConstantRate(filter) => filter.as_mut(),
            Self::ImpactAided(filter) => filter.as_mut(),
            Self::Twin(filter) => filter.as_mut(),
        }
    }
}

impl<T: Real> AngleFilter<T> for AnyFilter<T> {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        self.get_mut().drive(at, command);
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<Innovation<T>> {
        self.get_mut().update_ldv(sample)
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<T> {
        self.get_mut().update_camera(frame)
    }

    fn estimate(&self, now: Time) -> Option<Estimate<T>> {
        self.get().estimate(now)
    }

    fn smoothed(&self, at: Time) -> Option<Estimate<T>> {
        self.get().smoothed(at)
    }

    fn health(&self, now: Time) -> Health {
        self.get().health(now)
    }
}
