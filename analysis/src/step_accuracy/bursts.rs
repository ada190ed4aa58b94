//! Net displacement of short bursts from rest, as a positioning loop makes its last steps.
//!
//! The rotor rests on the teeth for 60 ms. The drive comes on at phase zero for a few cycles at 0.3 of full amplitude.
//! 60 ms later all is at rest again. A burst has whole cycles, but a model drives for whole steps. So the time is
//! rounded to a multiple of 20 us, or of the step if that is longer. The reference drives for the same time.

use motor_model::{
    AmplitudeVariation, Angle, DriveCommand, DriveMode, Motor, MotorParams, MotorState, Parameter, Real,
};
use serde::Serialize;

use super::method::{Measurement, StepMethod};
use super::reference::Reference;
use super::reference::state::ReferenceState;
use simulation::runs::RunError;
use simulation::runs::simulate::steps_in;

/// Time of rest before and after the drive.
const REST_S: f64 = 60e-3;
/// The time of a burst is a multiple of this, for steps up to it.
const GRID_S: f64 = 20e-6;
/// Amplitude of the drive.
const AMPLITUDE: f32 = 0.3;

/// A burst of whole cycles of a mode at 0.3 of full amplitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Burst {
    /// Mode driven.
    pub mode: DriveMode,
    /// Number of cycles.
    pub cycles: u8,
}

/// The bursts compared.
pub const BURSTS: [Burst; 4] = [
    Burst { mode: DriveMode::C, cycles: 2 },
    Burst { mode: DriveMode::C, cycles: 5 },
    Burst { mode: DriveMode::C, cycles: 10 },
    Burst { mode: DriveMode::B, cycles: 2 },
];

/// The error of one method in one burst.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BurstError {
    /// Time for which model and reference drive.
    pub on_s: f64,
    /// Net displacement of the reference, clockwise positive.
    pub converged_mdeg: f64,
    /// Error of the net displacement, relative to the reference's magnitude.
    pub relative: f64,
}

impl Burst {
    fn command(self) -> DriveCommand {
        DriveCommand::saturating(self.mode, AMPLITUDE)
    }

    /// Such as `C 0.3, 5 cycles`.
    pub fn name(self) -> String {
        format!("{:?} {AMPLITUDE}, {} cycles", self.mode, self.cycles)
    }

    /// Time of whole cycles.
    pub fn whole_cycles_s(self) -> f64 {
        let frequency = match self.mode {
            DriveMode::B => Parameter::ModeBFrequency,
            DriveMode::C => Parameter::ModeCFrequency,
        };
        f64::from(self.cycles) / MotorParams::nominal().get(frequency)
    }

    /// Time for which a model of this step drives.
    pub fn on_s(self, step_s: f64) -> f64 {
        let grid_s = GRID_S.max(step_s);
        (self.whole_cycles_s() / grid_s).round() * grid_s
    }

    /// Net displacement of the reference when it drives for `on_s`, in milli-degrees.
    ///
    /// # Errors
    /// When the reference stalls.
    pub fn converged_mdeg(self, on_s: f64) -> Result<f64, RunError> {
        let reference = Reference::nominal(&AmplitudeVariation::default())?;
        let mut state = ReferenceState::default();
        reference.run(&mut state, DriveCommand::OFF, REST_S, &mut ())?;
        let origin_rad = state.angle_rad;
        reference.run(&mut state, self.command(), on_s, &mut ())?;
        reference.run(&mut state, DriveCommand::OFF, REST_S, &mut ())?;
        Ok(1e3 * (state.angle_rad - origin_rad).to_degrees())
    }

    /// The error of `method` in this burst.
    ///
    /// # Errors
    /// When the reference stalls or the method's step is out of bounds.
    pub fn error(self, method: &StepMethod) -> Result<BurstError, RunError> {
        let on_s = self.on_s(method.step_s);
        let converged_mdeg = self.converged_mdeg(on_s)?;
        let run = BurstMeasurement { burst: self, on_s, step_s: method.step_s };
        let found_mdeg = method.apply(AmplitudeVariation::default(), &run)?;
        let relative = (found_mdeg - converged_mdeg) / converged_mdeg.abs();
        Ok(BurstError { on_s, converged_mdeg, relative })
    }
}

/// Measures the net displacement of a model in milli-degrees.
struct BurstMeasurement {
    burst: Burst,
    on_s: f64,
    step_s: f64,
}

impl Measurement for BurstMeasurement {
    type Outcome = f64;

    fn measure<T: Real>(&self, motor: &Motor<T>) -> f64 {
        let mut state = MotorState::default();
        let mut hold = |command, time_s: f64| {
            for _ in 0..steps_in(time_s, self.step_s) {
                motor.step(&mut state, command);
            }
            state.rotor.angle
        };
        let origin = hold(DriveCommand::OFF, REST_S);
        hold(self.burst.command(), self.on_s);
        let end = hold(DriveCommand::OFF, REST_S);
        let unit_deg = Angle::from_units(1).degrees();
        let residual_units = end.residual_units().to_f64() - origin.residual_units().to_f64();
        1e3 * (end.angle().minus(origin.angle()).degrees() + unit_deg * residual_units)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whole cycles, against figures that another program recorded.
    #[test]
    fn tool_bursts_of_whole_cycles_come_out_as_recorded() {
        for (burst, mdeg) in BURSTS.into_iter().zip([-1.131_416, -3.640_581, -7.824_877, 7.378_494]) {
            let found = burst.converged_mdeg(burst.whole_cycles_s()).unwrap();
            assert!((found - mdeg).abs() < 1e-6, "{burst:?}: {found}");
        }
    }

    #[test]
    fn exact_the_time_of_a_burst_is_whole_steps() {
        let two_of_c = BURSTS[0];
        for (step_s, on_s) in [(0.25e-6, 260e-6), (20e-6, 260e-6), (50e-6, 250e-6)] {
            assert!((two_of_c.on_s(step_s) - on_s).abs() < 1e-15, "{step_s}");
        }
    }
}
