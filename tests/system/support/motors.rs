//! Motors and runs that several tests share.

use motor_model::{
    DriveCommand, DriveMode, Flight, ImpactRule, Impacts, Motor, MotorParams, MotorSetup, MotorState,
    Parameter, Real,
};

/// Table 1's motor with some parameters changed.
#[track_caller]
pub fn changed(changes: &[(Parameter, f64)]) -> MotorParams {
    changes.iter().fold(MotorParams::nominal(), |params, &(parameter, value)| {
        params.with(parameter, value).expect("within its bounds")
    })
}

/// A motor that the test knows to be valid.
#[track_caller]
pub fn motor<T: Real>(params: &MotorParams, setup: &MotorSetup) -> Motor<T> {
    Motor::try_new(params, setup).expect("a valid motor")
}

/// A command that the test knows to be valid.
#[track_caller]
pub fn command(mode: DriveMode, amplitude: f32, offset_hz: f32) -> DriveCommand {
    let command = DriveCommand::try_new(mode, amplitude).expect("a valid amplitude");
    command.with_frequency_offset(offset_hz).expect("a valid offset")
}

/// Impacts at the end of the step, and everything else as usual.
pub fn at_end_of_step(step_s: f64) -> MotorSetup {
    MotorSetup { impact_rule: ImpactRule::EndOfStep, ..MotorSetup::with_step(step_s) }
}

/// Impacts located inside the step, and everything else as usual.
pub fn located(step_s: f64) -> MotorSetup {
    MotorSetup { impact_rule: ImpactRule::Located, ..MotorSetup::with_step(step_s) }
}

/// Distance from 1 to the next number of this precision.
pub fn epsilon<T: Real>() -> f64 {
    if size_of::<T>() == 4 { f64::from(f32::EPSILON) } else { f64::EPSILON }
}

/// Whether no part of the motion is infinite or NaN.
pub fn is_finite<T: Real>(state: &MotorState<T>) -> bool {
    let (modes, rotor) = (&state.modes, &state.rotor);
    (modes.displacement_m.iter().chain(&modes.velocity_m_s))
        .chain([&rotor.height_m, &rotor.velocity_m_s, &rotor.rate_rad_s, &rotor.angle.residual_units()])
        .all(|value| value.to_f64().is_finite())
}

/// A count of steps that covers `time_s`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "tests run for seconds")]
pub fn steps_in(time_s: f64, step_s: f64) -> u32 {
    (time_s / step_s).round() as u32
}

/// A motor with what it takes to follow one step by hand.
#[derive(Clone)]
pub struct Bench<T: Real> {
    /// The motor under test.
    pub motor: Motor<T>,
    /// The rotor's flight over one of its steps.
    pub flight: Flight<T>,
    /// Where it is.
    pub state: MotorState<T>,
}

impl<T: Real> Bench<T> {
    /// At rest, the rotor on the teeth.
    #[track_caller]
    pub fn new(params: &MotorParams, setup: &MotorSetup) -> Self {
        Self {
            motor: motor(params, setup),
            flight: Flight::new(params, setup.step_s),
            state: MotorState::default(),
        }
    }

    /// Takes a step: the state just before its impacts, and the impacts.
    pub fn step(&mut self, command: DriveCommand) -> (MotorState<T>, Impacts<T>) {
        let mut before = self.state;
        if before.forcing.command() != command {
            before.forcing = self.motor.modes().forcing(command);
        }
        self.motor.modes().advance(&mut before.modes, &before.forcing, before.phase);
        self.flight.advance(&mut before.rotor);
        (before, self.motor.step(&mut self.state, command))
    }

    /// Runs for `time_s` and forgets the impacts.
    pub fn run(&mut self, command: DriveCommand, time_s: f64) {
        for _ in 0..steps_in(time_s, self.motor.step_s()) {
            self.motor.step(&mut self.state, command);
        }
    }

    /// Steps until something strikes, `steps_max` at most, and returns the steps taken and the impacts.
    #[track_caller]
    pub fn until_impact(&mut self, command: DriveCommand, steps_max: u32) -> (u32, Impacts<T>) {
        for step in 1..=steps_max {
            let impacts = self.motor.step(&mut self.state, command);
            if !impacts.is_empty() {
                return (step, impacts);
            }
        }
        panic!("nothing strikes within {steps_max} steps");
    }

    /// Rotor angle since zero in rad.
    pub fn angle_rad(&self) -> f64 {
        self.state.rotor.angle.angle().degrees().to_radians()
    }
}
