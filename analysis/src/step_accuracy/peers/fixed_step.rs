//! The fixed-step model on the ball on the vibrating plate: a motor whose parameters make it one.
//!
//! With a rotor of 1 ug on a stator of 1 kg the rotor's recoil on the plate is negligible (3e-9). Mode C starts in the
//! steady motion of its drive at resonance and stays in it. Modes A and B stay at rest. Both pairs of teeth move
//! together as one plate: the second pair's amplitude has the opposite sign of that in a motor. Without friction and
//! drag the ball does not turn.

use motor_model::{AmplitudeVariation, DriveCommand, DriveMode, Mode, Motor, MotorParams, Parameter, Real};

use super::super::method::{self, Measurement, StepMethod, step_recording};
use super::super::reference::state::ReferenceState;
use super::super::step_cost::TimedBatch;
use super::super::vibrating_plate::{START_M, VibratingPlate};
use simulation::runs::RunError;
use simulation::runs::simulate::steps_in;

const ROTOR_KG: f64 = 1e-9;
const STATOR_KG: f64 = 1.0;
/// Start of the drive's phase. Mode C at resonance lags by a quarter turn, so the plate moves as `sin(w t)`.
const PHASE_TURNS: f64 = 0.25;

/// Scales the second pair's amplitude by -1, so that in modes B and C it moves with the first pair.
const ONE_PLATE: AmplitudeVariation = AmplitudeVariation { pairs: [0.0, -2.0] };

/// Parameters of the motor that is a ball on a plate.
fn motor(plate: &VibratingPlate) -> Result<MotorParams, RunError> {
    let changes = [
        (Parameter::RotorMass, ROTOR_KG),
        (Parameter::StatorMass, STATOR_KG),
        (Parameter::Friction, 0.0),
        (Parameter::TangentialDrag, 0.0),
        (Parameter::VerticalDamping, plate.damping_per_s * ROTOR_KG),
    ];
    let changed = changes
        .into_iter()
        .try_fold(MotorParams::nominal(), |params, (parameter, value)| params.with(parameter, value));
    Ok(changed?)
}

/// State with the ball at rest at `start_m` and the plate in steady motion.
fn start(start_m: f64) -> Result<ReferenceState, RunError> {
    let [_, _, mode] = Mode::all(&MotorParams::nominal())?;
    let mut state = ReferenceState::default();
    state.height_m = start_m;
    state.phase_turns = PHASE_TURNS;
    state.modes.velocity_m_s.z = mode.antinode_amplitude_m * mode.natural_rad_s;
    Ok(state)
}

/// Times of the impacts of the ball from `start_m` up to `until_s`.
pub fn impacts(
    method: &StepMethod,
    plate: &VibratingPlate,
    start_m: f64,
    until_s: f64,
) -> Result<Vec<f64>, RunError> {
    let measurement = ImpactTimes { start: start(start_m)?, until_s, step_s: method.step_s };
    Ok(method.apply_to(&motor(plate)?, ONE_PLATE, &measurement)?)
}

/// Time to simulate `plate_s`, in s.
pub fn taken_s(method: &StepMethod, plate: &VibratingPlate, plate_s: f64) -> Result<f64, RunError> {
    let command = DriveCommand::full(DriveMode::C);
    let measurement =
        TimedBatch { start: start(START_M)?, command, settle_s: 0.0, time_s: plate_s, step_s: method.step_s };
    Ok(method.apply_to(&motor(plate)?, ONE_PLATE, &measurement)?)
}

/// Measures the times of the impacts of a ball.
struct ImpactTimes {
    start: ReferenceState,
    until_s: f64,
    step_s: f64,
}

impl Measurement for ImpactTimes {
    type Outcome = Vec<f64>;

    fn measure<T: Real>(&self, motor: &Motor<T>) -> Vec<f64> {
        let mut state = method::start(&self.start);
        let mut times_s = Vec::new();
        let steps = u32::try_from(steps_in(self.until_s, self.step_s)).unwrap_or(u32::MAX);
        for step in 1..=steps {
            let end_s = f64::from(step) * self.step_s;
            let command = DriveCommand::full(DriveMode::C);
            step_recording(motor, &mut state, command, |impact| times_s.push(end_s + impact.time_s));
        }
        times_s
    }
}
