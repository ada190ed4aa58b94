//! The estimator that a scene picks.

use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Health, ImpactAided,
    ImpactAidedTuning, Innovation, LdvSample,
};
use motor_model::{DriveCommand, MotorParams, Real, Time};

use crate::scene::{Kind, Scene, Setting};

/// The filters by name, from the simplest to the richest.
pub const FILTERS: &[&str] = &["constant_rate", "impact_aided"];

/// The estimator's settings.
pub const SETTINGS: &[Setting] = &[Setting {
    key: "estimator.filter",
    unit: "",
    kind: Kind::Choice { default: "constant_rate", of: FILTERS },
    meaning: "filter of angle and rate: from the camera alone, or with the vibrometer's impacts",
}];

/// One of the filters, in the precision of the microcontroller unless another is asked for.
#[derive(Clone, Debug)]
pub enum AnyFilter<T = f32> {
    /// Camera only.
    ConstantRate(Box<ConstantRate<T>>),
    /// Camera, and impacts from the vibrometer.
    ImpactAided(Box<ImpactAided<T>>),
}

impl<T: Real> AnyFilter<T> {
    /// The filter of a scene.
    pub fn of(scene: &Scene) -> Self {
        Self::named(scene.choice("estimator.filter"))
    }

    /// The filter of this name; the simplest for any other word. What it knows of the motor is nominal.
    pub fn named(name: &str) -> Self {
        match name {
            "impact_aided" => {
                let tuning = ImpactAidedTuning::new(&MotorParams::nominal());
                Self::ImpactAided(Box::new(ImpactAided::new(&tuning)))
            }
            _ => Self::ConstantRate(Box::new(ConstantRate::new(&ConstantRateTuning::default()))),
        }
    }

    fn get(&self) -> &dyn AngleFilter<T> {
        match self {
            Self::ConstantRate(filter) => filter.as_ref(),
            Self::ImpactAided(filter) => filter.as_ref(),
        }
    }

    fn get_mut(&mut self) -> &mut dyn AngleFilter<T> {
        match self {
            Self::ConstantRate(filter) => filter.as_mut(),
            Self::ImpactAided(filter) => filter.as_mut(),
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

    fn health(&self, now: Time) -> Health {
        self.get().health(now)
    }
}
