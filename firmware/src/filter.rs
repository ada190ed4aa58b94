//! The filter that a configuration selects, out of those that the program holds: `constant_rate` always, `impact_aided`
//! and `twin` by the features of their names where the part has time for them ([`crate::part_filters`]).

use estimator::{
    AngleFilter, CameraFrame, ConstantRate, ConstantRateTuning, Estimate, Health, ImpactInnovation,
    Innovation, Instruments, LdvSample, ResonanceOffset,
};
#[cfg(holds_twin)]
use estimator::{CheckedMotor, TwinFilter, TwinTuning};
#[cfg(holds_impact_aided)]
use estimator::{ImpactAided, ImpactAidedTuning};
use link::FilterKind;
use motor_model::{DriveCommand, MotorParams, OutOfBounds, Time};

/// The filter that a configuration selects.
///
/// Its tag is a byte of its own: four calls in each tick read it, and the compiler would hide it among 64 bits.
#[derive(Debug)]
#[repr(u8)]
#[cfg_attr(
    any(holds_impact_aided, holds_twin),
    expect(clippy::large_enum_variant, reason = "a program has one, and no heap")
)]
pub enum SelectedFilter {
    /// Camera only.
    ConstantRate(ConstantRate<f32>),
    /// Camera, and impacts from the vibrometer.
    #[cfg(holds_impact_aided)]
    ImpactAided(ImpactAided<f32>),
    /// Camera, and the twin driven by the vibrometer's impacts.
    #[cfg(holds_twin)]
    Twin(TwinFilter<f32>),
}

/// The same call to the filter of any variant.
macro_rules! forward {
    ($self:ident, $filter:ident => $call:expr) => {
        match $self {
            SelectedFilter::ConstantRate($filter) => $call,
            #[cfg(holds_impact_aided)]
            SelectedFilter::ImpactAided($filter) => $call,
            #[cfg(holds_twin)]
            SelectedFilter::Twin($filter) => $call,
        }
    };
}

impl SelectedFilter {
    /// Puts a filter without measurements in `place`, for a motor of `params` under `instruments`, and returns it.
    ///
    /// # Errors
    /// When the program does not hold it, or the model refuses the motor; `place` is then as before.
    // Each filter has a function of its own, which is not inlined: the stack then holds one filter, and not one of each
    // kind.
    pub fn build<'m>(
        place: &'m mut Option<Self>,
        kind: FilterKind,
        params: &MotorParams,
        instruments: &Instruments,
    ) -> Result<&'m mut Self, OutOfBounds> {
        match kind {
            FilterKind::ConstantRate => Ok(Self::build_constant_rate(place, params, instruments)),
            #[cfg(holds_impact_aided)]
            FilterKind::ImpactAided => Ok(Self::build_impact_aided(place, params, instruments)),
            #[cfg(holds_twin)]
            FilterKind::Twin => Self::build_twin(place, params, instruments),
            #[cfg(not(all(holds_impact_aided, holds_twin)))]
            absent => Err(OutOfBounds {
                key: "estimator.filter",
                value: f64::from(absent as u8),
                min: 0.0,
                max: 0.0,
                unit: "",
            }),
        }
    }

    #[inline(never)]
    fn build_constant_rate<'m>(
        place: &'m mut Option<Self>,
        params: &MotorParams,
        instruments: &Instruments,
    ) -> &'m mut Self {
        let tuning = ConstantRateTuning::for_motor(params, instruments);
        place.insert(Self::ConstantRate(ConstantRate::new(&tuning)))
    }

    #[cfg(holds_impact_aided)]
    #[inline(never)]
    fn build_impact_aided<'m>(
        place: &'m mut Option<Self>,
        params: &MotorParams,
        instruments: &Instruments,
    ) -> &'m mut Self {
        let tuning = ImpactAidedTuning::new(params, instruments);
        place.insert(Self::ImpactAided(ImpactAided::new(&tuning)))
    }

    #[cfg(holds_twin)]
    #[inline(never)]
    fn build_twin<'m>(
        place: &'m mut Option<Self>,
        params: &MotorParams,
        instruments: &Instruments,
    ) -> Result<&'m mut Self, OutOfBounds> {
        let tuning = TwinTuning::new(params, instruments);
        let motor = CheckedMotor::try_new(params)?;
        Ok(place.insert(Self::Twin(TwinFilter::new(&motor, &tuning))))
    }
}

impl AngleFilter<f32> for SelectedFilter {
    fn drive(&mut self, at: Time, command: DriveCommand) {
        forward!(self, filter => filter.drive(at, command));
    }

    fn retune(&mut self, offsets: &[ResonanceOffset<f32>; 2]) {
        forward!(self, filter => filter.retune(offsets));
    }

    fn update_ldv(&mut self, sample: &LdvSample) -> Option<ImpactInnovation<f32>> {
        forward!(self, filter => filter.update_ldv(sample))
    }

    fn update_camera(&mut self, frame: &CameraFrame) -> Innovation<f32> {
        forward!(self, filter => filter.update_camera(frame))
    }

    fn estimate(&self, now: Time) -> Option<Estimate<f32>> {
        forward!(self, filter => filter.estimate(now))
    }

    fn assess_for(&self, now: Time, instant: Time) -> (Option<Estimate<f32>>, Health) {
        forward!(self, filter => filter.assess_for(now, instant))
    }
}
