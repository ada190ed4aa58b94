//! The fixed-step methods that are compared: the motor model with a rule of impacts, a precision and a step.

use motor_model::{
    AmplitudeVariation, DriveCommand, Impact, ImpactRule, Ledger, ModalState, Motor, MotorParams, MotorSetup,
    MotorState, OutOfBounds, Phase, Real, RotorState, SustainedFriction,
};
use serde::ser::{Serialize, SerializeStruct as _, Serializer};

use super::reference::state::ReferenceState;
use simulation::runs::simulate::{FAST_APPROACH_M_S, Precision, rule_name};

/// All steps that are compared.
pub const STEPS_S: [f64; 8] = [0.25e-6, 0.5e-6, 1e-6, 2e-6, 5e-6, 10e-6, 20e-6, 50e-6];
/// The step whose cost and error are held to the targets.
pub const TARGET_STEP_S: f64 = 10e-6;

/// A fixed-step method: rule of impacts, precision and step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepMethod {
    /// The rule that places an impact in a step.
    pub impact_rule: ImpactRule,
    /// Precision of the arithmetic.
    pub precision: Precision,
    /// Length of a step.
    pub step_s: f64,
}

/// Both rules in both precisions, each with all of `steps_s` in order.
pub fn step_methods(steps_s: &[f64]) -> Vec<StepMethod> {
    let mut all = Vec::new();
    for impact_rule in [ImpactRule::EndOfStep, ImpactRule::Located] {
        for precision in [Precision::F64, Precision::F32] {
            let row = |&step_s| StepMethod { impact_rule, precision, step_s };
            all.extend(steps_s.iter().map(row));
        }
    }
    all
}

/// An impact, and the rotor just after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpactRecord {
    /// Time since the start.
    pub time_s: f64,
    /// Vertical velocity of the rotor just after it.
    pub velocity_m_s: f64,
    /// Rate of the rotor just after it.
    pub rate_rad_s: f64,
}

/// A measurement on a motor of either precision.
pub trait Measurement {
    /// Its result.
    type Outcome;
    /// Makes the measurement.
    fn measure<T: Real>(&self, motor: &Motor<T>) -> Self::Outcome;
}

impl StepMethod {
    /// Makes `measurement` on the nominal motor with this `variation` of its tooth amplitudes.
    ///
    /// # Errors
    /// When the step is out of the model's bounds.
    pub fn apply<M: Measurement>(
        &self,
        variation: AmplitudeVariation,
        measurement: &M,
    ) -> Result<M::Outcome, OutOfBounds> {
        self.apply_to(&MotorParams::nominal(), variation, measurement)
    }

    /// Makes `measurement` on the motor of `params`.
    ///
    /// # Errors
    /// When step or parameters are out of the model's bounds.
    pub fn apply_to<M: Measurement>(
        &self,
        params: &MotorParams,
        variation: AmplitudeVariation,
        measurement: &M,
    ) -> Result<M::Outcome, OutOfBounds> {
        let setup =
            MotorSetup { impact_rule: self.impact_rule, variation, ..MotorSetup::with_step(self.step_s) };
        Ok(match self.precision {
            Precision::F32 => measurement.measure(&Motor::<f32>::try_new(params, &setup)?),
            Precision::F64 => measurement.measure(&Motor::<f64>::try_new(params, &setup)?),
        })
    }

    /// Such as `end of step, f64`.
    pub fn name(&self) -> String {
        format!("{}, {}", self.impacts().replace('_', " "), self.precision.name())
    }

    /// Whether it has this rule of impacts and this precision.
    pub fn is(&self, impact_rule: ImpactRule, precision: Precision) -> bool {
        (self.impact_rule, self.precision) == (impact_rule, precision)
    }

    /// Whether its step is `step_s`.
    pub fn has_step(&self, step_s: f64) -> bool {
        (self.step_s / step_s - 1.0).abs() < 1e-9
    }

    /// `located` or `end_of_step`.
    pub fn impacts(&self) -> &'static str {
        rule_name(self.impact_rule)
    }
}

/// The value of `model` in each row of JSON and CSV: no part of the motor is left out.
pub const MODEL: &str = "whole";

/// Serialized with the words that scenes use.
impl Serialize for StepMethod {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut fields = serializer.serialize_struct("StepMethod", 4)?;
        fields.serialize_field("model", MODEL)?;
        fields.serialize_field("impacts", self.impacts())?;
        fields.serialize_field("precision", self.precision.name())?;
        fields.serialize_field("step_s", &self.step_s)?;
        fields.end()
    }
}

/// The state of the reference in the variables and the precision of the model, its angle zero.
pub fn start<T: Real>(from: &ReferenceState) -> MotorState<T> {
    MotorState {
        phase: Phase::from_turns(from.phase_turns),
        modes: ModalState {
            displacement_m: from.modes.displacement_m.map(T::from_f64),
            velocity_m_s: from.modes.velocity_m_s.map(T::from_f64),
        },
        rotor: RotorState {
            height_m: T::from_f64(from.height_m),
            velocity_m_s: T::from_f64(from.velocity_m_s),
            rate_rad_s: T::from_f64(from.rate_rad_s),
            ..RotorState::default()
        },
        ..MotorState::default()
    }
}

/// Takes a step. Returns the number of its impacts faster than [`FAST_APPROACH_M_S`].
#[inline]
pub fn fast_impacts<T: Real>(motor: &Motor<T>, state: &mut MotorState<T>, command: DriveCommand) -> u32 {
    let fast = T::from_f64(FAST_APPROACH_M_S);
    motor.step(state, command).iter().map(|impact| u32::from(impact.approach_m_s > fast)).sum()
}

/// Takes a step. `record` gets every impact, with its time from the end of the step, negative or zero.
pub fn step_recording<T: Real>(
    motor: &Motor<T>,
    state: &mut MotorState<T>,
    command: DriveCommand,
    record: impl FnMut(ImpactRecord),
) {
    motor.step_with(state, command, &mut ImpactRecorder(record));
}

/// Records impacts through the model's energy ledger.
struct ImpactRecorder<W>(W);

impl<T: Real, W: FnMut(ImpactRecord)> Ledger<T> for ImpactRecorder<W> {
    fn motion(&mut self, _: &MotorState<T>, _: T, _: [T; 2]) {}

    fn impact(&mut self, _: &MotorState<T>, after: &MotorState<T>, impact: &Impact<T>) {
        (self.0)(ImpactRecord {
            time_s: -impact.before_end_s.to_f64(),
            velocity_m_s: after.rotor.velocity_m_s.to_f64(),
            rate_rad_s: after.rotor.rate_rad_s.to_f64(),
        });
    }

    fn lift(&mut self, _: T) {}

    fn sustained_contact(&mut self, _: [T; 2], _: [T; 2], _: [T; 2], _: &[SustainedFriction<T>; 2]) {}
}
