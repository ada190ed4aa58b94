//! A plant whose rotor moves up and down and turns: the height-only motor of the paper.

use motor_model::{
    AmplitudeVariation, DriveCommand, Impact, Impacts, Motor, MotorParams, MotorSetup, MotorState, Time,
};
use rand_pcg::Pcg64;

use super::PlantSetup;
use crate::math::count::real;
use crate::scene::SceneError;
use crate::world::pose::Pose;
use crate::world::rotor_path::RotorPoint;

/// The motor and its state.
#[derive(Clone, Debug)]
pub(super) struct HeightOnlyPlant {
    motor: Motor<f64>,
    variation: AmplitudeVariation,
    /// The same motor in longer steps, for a rotor at rest on the teeth, and how many steps one of them is.
    rest_motor: Option<(Motor<f64>, u64)>,
    state: MotorState<f64>,
    /// Rate before the last step in which teeth struck, and their impacts; none after a step without.
    struck: (f64, Impacts<f64>),
}

/// A motor of these parameters, in steps `steps` times as long as those of the plant.
fn motor(
    params: &MotorParams,
    setup: &PlantSetup,
    variation: AmplitudeVariation,
    steps: u64,
) -> Result<Motor<f64>, SceneError> {
    let PlantSetup { step_s, impact_rule, friction_law, tuning } = *setup;
    let setup = MotorSetup {
        impact_rule,
        friction_law,
        tuning,
        variation,
        ..MotorSetup::with_step(step_s * real(steps))
    };
    Ok(Motor::try_new(params, &setup)?)
}

impl HeightOnlyPlant {
    /// A motor with these parameters, and teeth as `draw` has them.
    pub(super) fn new(
        params: &MotorParams,
        setup: &PlantSetup,
        draw: &mut Pcg64,
    ) -> Result<Self, SceneError> {
        let variation = AmplitudeVariation::draw(params, draw);
        let motor = motor(params, setup, variation, 1)?;
        Ok(Self {
            motor,
            variation,
            rest_motor: None,
            state: MotorState::default(),
            struck: (0.0, Impacts::new()),
        })
    }

    /// See [`super::Plant::with_rest_steps`].
    pub(super) fn set_rest_steps(
        &mut self,
        params: &MotorParams,
        setup: &PlantSetup,
        steps: u64,
    ) -> Result<(), SceneError> {
        let long = || motor(params, setup, self.variation, steps);
        self.rest_motor = if steps > 1 { Some((long()?, steps)) } else { None };
        Ok(())
    }

    /// See [`super::Plant::rest_step`].
    pub(super) fn rest_step(&mut self) -> bool {
        let Some((rest_motor, steps)) = &self.rest_motor else { return false };
        if self.state.in_contact == [false; 2] {
            return false;
        }
        rest_motor.step(&mut self.state, DriveCommand::OFF);
        // The long step was counted as one.
        self.state.steps += steps - 1;
        true
    }

    pub(super) fn variation(&self) -> &AmplitudeVariation {
        &self.variation
    }

    #[inline]
    pub(super) fn state(&self) -> &MotorState<f64> {
        &self.state
    }

    #[inline]
    pub(super) fn rotor(&self, at: Time) -> RotorPoint {
        let rotor = &self.state.rotor;
        RotorPoint {
            at,
            angle: rotor.angle.angle(),
            rate_rad_s: rotor.rate_rad_s,
            velocity_m_s: rotor.velocity_m_s,
            height_m: rotor.height_m,
            pose: Pose::LEVEL,
        }
    }

    /// Heights of both pairs of teeth.
    pub(super) fn tooth_heights_m(&self) -> [f64; 2] {
        self.motor.teeth().each_ref().map(|pair| pair.height(&self.state.modes))
    }

    #[inline]
    pub(super) fn step(&mut self, command: DriveCommand) -> bool {
        let rate_rad_s = self.state.rotor.rate_rad_s;
        let impacts = self.motor.step(&mut self.state, command);
        let met = !impacts.is_empty();
        if met {
            self.struck = (rate_rad_s, impacts);
        } else {
            self.struck.1.clear();
        }
        met
    }

    /// See [`super::Plant::tooth_impacts`].
    pub(super) fn struck(&self) -> (f64, &[Impact<f64>]) {
        (self.struck.0, &self.struck.1)
    }

    /// See [`super::Plant::step_stuck`].
    pub(super) fn step_stuck(&mut self, command: DriveCommand) -> bool {
        let angle = self.state.rotor.angle;
        let met = self.step(command);
        (self.state.rotor.angle, self.state.rotor.rate_rad_s) = (angle, 0.0);
        met
    }

    pub(super) fn jolt(&mut self, rate_rad_s: f64) {
        self.state.rotor.rate_rad_s += rate_rad_s;
    }

    /// The same motor with other parameters, from now on; its teeth stay.
    pub(super) fn rebuild(&mut self, params: &MotorParams, setup: &PlantSetup) -> Result<(), SceneError> {
        let rest_motor = match &self.rest_motor {
            Some((_, steps)) => Some((motor(params, setup, self.variation, *steps)?, *steps)),
            None => None,
        };
        self.motor = motor(params, setup, self.variation, 1)?;
        self.rest_motor = rest_motor;
        Ok(())
    }
}
