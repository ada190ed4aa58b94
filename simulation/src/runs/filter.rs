//! The estimator that a scene picks.

use estimator::{
    AngleFilter, CameraFrame, CheckedMotor, ConstantRate, ConstantRateTuning, Estimate, Health, ImpactAided,
    ImpactAidedTuning, ImpactInnovation, Innovation, Instruments, LdvSample, ResonanceOffset, TwinFilter,
    TwinTuning,
};
use motor_model::{DriveCommand, MotorParams, OutOfBounds, Real, Time};

use crate::runs::late_interrupts;
use crate::scene::Scene;
pub use crate::scene::keys::estimator::FILTERS;
use crate::world::instruments::assumed;

/// The filter that a scene picks, by name: `best` is the best that the assumed instruments allow.
pub fn chosen(scene: &Scene) -> &'static str {
    match scene.choice("estimator.filter") {
        "best" => assumed(scene).best_filter().name(),
        name => name,
    }
}

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
    /// The filter of a scene's loop. It is told by how much the board's interrupts, and with them the drive, are late
    /// at most.
    ///
    /// # Errors
    /// When the model refuses the motor.
    pub fn of(scene: &Scene) -> Result<Self, OutOfBounds> {
        let late_s = scene.number(late_interrupts::KEY);
        Self::of_drive(chosen(scene), &scene.motor_params(), &assumed(scene), late_s)
    }

    /// The filter of this name, the simplest for any other word: for the design of the motor and the instruments that
    /// `scene` describes, and a drive that acts on time.
    ///
    /// # Errors
    /// When the model refuses the motor.
    pub fn named(name: &str, scene: &Scene) -> Result<Self, OutOfBounds> {
        Self::new(name, &scene.motor_params(), &assumed(scene))
    }

    /// The same for a motor of `design` under `instruments`.
    ///
    /// # Errors
    /// When the model refuses the motor.
    pub fn new(name: &str, design: &MotorParams, instruments: &Instruments) -> Result<Self, OutOfBounds> {
        Self::of_drive(name, design, instruments, 0.0)
    }

    /// The same with a drive that acts up to `late_s` later than it is told.
    fn of_drive(
        name: &str,
        design: &MotorParams,
        instruments: &Instruments,
        late_s: f64,
    ) -> Result<Self, OutOfBounds> {
        Ok(match name {
            "twin" => Self::Twin(Box::new(TwinFilter::new(
                &CheckedMotor::try_new(design)?,
                &TwinTuning { drive_late_s: T::from_f64(late_s), ..TwinTuning::new(design, instruments) },
            ))),
            "impact_aided" => {
                Self::ImpactAided(Box::new(ImpactAided::new(&ImpactAidedTuning::new(design, instruments))))
            }
            _ => Self::ConstantRate(Box::new(ConstantRate::new(&ConstantRateTuning::for_motor(
                design,
                instruments,
            )))),
        })
    }
}

/// Not generic: the filters are compiled once in each precision, with this crate and its optimisation.
macro_rules! angle_filter_in {
    ($precision:ty) => {
        impl AnyFilter<$precision> {
            fn get(&self) -> &dyn AngleFilter<$precision> {
                match self {
                    Self::ConstantRate(filter) => filter.as_ref(),
                    Self::ImpactAided(filter) => filter.as_ref(),
                    Self::Twin(filter) => filter.as_ref(),
                }
            }

            fn get_mut(&mut self) -> &mut dyn AngleFilter<$precision> {
                match self {
                    Self::ConstantRate(filter) => filter.as_mut(),
                    Self::ImpactAided(filter) => filter.as_mut(),
                    Self::Twin(filter) => filter.as_mut(),
                }
            }
        }

        impl AngleFilter<$precision> for AnyFilter<$precision> {
            fn drive(&mut self, at: Time, command: DriveCommand) {
                self.get_mut().drive(at, command);
            }

            fn retune(&mut self, offsets: &[ResonanceOffset<$precision>; 2]) {
                self.get_mut().retune(offsets);
            }

            fn update_ldv(&mut self, sample: &LdvSample) -> Option<ImpactInnovation<$precision>> {
                self.get_mut().update_ldv(sample)
            }

            fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<$precision> {
                self.get_mut().update_camera(frame)
            }

            fn estimate(&self, now: Time) -> Option<Estimate<$precision>> {
                self.get().estimate(now)
            }

            fn smoothed(&self, at: Time) -> Option<Estimate<$precision>> {
                self.get().smoothed(at)
            }

            fn assess_for(&self, now: Time, instant: Time) -> (Option<Estimate<$precision>>, Health) {
                self.get().assess_for(now, instant)
            }
        }
    };
}

angle_filter_in!(f32);
angle_filter_in!(f64);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_the_best_filter_is_that_of_the_assumed_instruments() {
        for (sets, name) in [
            (&[][..], "twin"),
            (&["ldv.installed=no"], "constant_rate"),
            (&["estimator.assumed.ldv.installed=no"], "constant_rate"),
            (&["estimator.filter=impact_aided"], "impact_aided"),
            (&["ldv.installed=no", "estimator.filter=twin"], "twin"),
        ] {
            let sets: Vec<String> = sets.iter().map(|&set: &&str| set.to_owned()).collect();
            assert_eq!(chosen(&Scene::of_sets(&sets).unwrap()), name, "{sets:?}");
        }
    }
}
