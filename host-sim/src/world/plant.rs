//! The plant: the motor to be controlled. The loop does not know its parameters.
//!
//! It has the same physics as the twin, but in `f64`, at a finer step and with parameters drawn around the design
//! (keys `motor.`) within Table 1's tolerances: an estimator tested on its own model looks better than it is. A key
//! `plant.motor.` sets a parameter of the true motor, whatever the design. The generator drives it at the resonances of
//! the *design*, wherever its own are.
//!
//! Most of the time of a move the rotor is at rest, and a step in sustained contact costs ten times one in flight. With
//! the drive off and teeth on the rotor the plant may therefore take longer steps ([`Plant::with_rest_steps`]): the
//! same scheme, which in sustained contact is converged at 20 us (`tests/system/motor/law_sustained_contact.rs`).

use motor_model::params::Parameter;
use motor_model::{
    AmplitudeVariation, DriveCommand, DriveTuning, FrictionLaw, ImpactRule, Impacts, Motor, MotorParams,
    MotorSetup, MotorState, Time,
};

use crate::math::random_streams::{self, RandomSource};
use crate::scene::Scene;
use crate::scene::SceneError;
use crate::world::pose::Pose;

/// The rule that a scene calls `word`.
pub fn impact_rule(word: &str) -> ImpactRule {
    if word == "located" { ImpactRule::Located } else { ImpactRule::EndOfStep }
}

/// The motor under control, and its state.
#[derive(Clone, Debug)]
pub struct Plant {
    motor: Motor<f64>,
    setup: MotorSetup,
    /// The same motor in longer steps, for a rotor at rest on the teeth, and how many steps one of them is.
    rest_motor: Option<(Motor<f64>, u64)>,
    state: MotorState<f64>,
    params: MotorParams,
    step_nanos_num: f64,
}

impl Plant {
    /// The plant that the scene's seed names, at rest at angle 0.
    ///
    /// # Errors
    /// When the model refuses the scene's parameters.
    pub fn draw(scene: &Scene) -> Result<Self, SceneError> {
        let design = scene.motor_params();
        let around = match scene.choice("plant.parameters") {
            "drawn" => design.draw(&mut random_streams::stream(scene.seed(), RandomSource::PlantDraw)),
            _ => design,
        };
        // What the scene sets of the true motor is not drawn.
        let params = scene
            .plant_overrides()
            .try_fold(around, |params, (parameter, value)| params.with(parameter, value))?;
        let mut variation = random_streams::stream(scene.seed(), RandomSource::AmplitudeVariation);
        let step_s = scene.number("plant.step_s");
        let setup = MotorSetup {
            impact_rule: impact_rule(scene.choice("plant.impacts")),
            friction_law: if scene.choice("plant.friction") == "paper" {
                FrictionLaw::Paper
            } else {
                FrictionLaw::Coulomb
            },
            tuning: DriveTuning::Fixed {
                b_hz: design.get(Parameter::ModeBFrequency),
                c_hz: design.get(Parameter::ModeCFrequency),
            },
            variation: AmplitudeVariation::draw(&params, &mut variation),
            ..MotorSetup::with_step(step_s)
        };
        let motor = Motor::try_new(&params, &setup)?;
        let state = MotorState::default();
        Ok(Self { motor, setup, rest_motor: None, state, params, step_nanos_num: step_s * 1e9 })
    }

    /// The same plant, which can take `steps` steps as one while the drive is off and its rotor is on the teeth
    /// ([`Self::rest_step`]); 1 for none.
    ///
    /// # Errors
    /// When the model refuses a step of that length.
    pub fn with_rest_steps(mut self, steps: u64) -> Result<Self, SceneError> {
        #[expect(clippy::cast_precision_loss, reason = "a few steps")]
        let setup = MotorSetup { step_s: self.setup.step_s * steps as f64, ..self.setup };
        self.rest_motor = if steps > 1 { Some((Motor::try_new(&self.params, &setup)?, steps)) } else { None };
        Ok(self)
    }

    /// One long step with the drive off, if the rotor is on the teeth and the plant has long steps; whether it was
    /// taken.
    pub fn rest_step(&mut self) -> bool {
        let Some((rest_motor, steps)) = &self.rest_motor else { return false };
        if self.state.in_contact == [false; 2] {
            return false;
        }
        rest_motor.step(&mut self.state, DriveCommand::OFF);
        // The long step was counted as one.
        self.state.steps += steps - 1;
        true
    }

    /// The state of the motor.
    pub fn state(&self) -> &MotorState<f64> {
        &self.state
    }

    /// How the rotor is shifted and tilted: the rotor of the height-only motor lies level and centred.
    #[inline]
    #[must_use]
    pub fn pose(&self) -> Pose {
        Pose::LEVEL
    }

    /// One step under `command`, and its impacts.
    pub fn step(&mut self, command: DriveCommand) -> Impacts<f64> {
        self.motor.step(&mut self.state, command)
    }

    /// Changes the rotor's rate at once: a jolt.
    pub fn jolt(&mut self, rate_rad_s: f64) {
        self.state.rotor.rate_rad_s += rate_rad_s;
    }

    /// Moves the resonances of modes B and C by the part `drift` away from those that were drawn, from now on. The
    /// drive keeps its frequencies.
    ///
    /// # Errors
    /// When the model refuses the frequencies; then they stay.
    pub fn detune(&mut self, drift: f64) -> Result<(), SceneError> {
        let mut params = self.params;
        for parameter in [Parameter::ModeBFrequency, Parameter::ModeCFrequency] {
            params = params.with(parameter, self.params.get(parameter) * (1.0 + drift))?;
        }
        let rest_motor = match &self.rest_motor {
            Some((_, steps)) => {
                #[expect(clippy::cast_precision_loss, reason = "a few steps")]
                let setup = MotorSetup { step_s: self.setup.step_s * *steps as f64, ..self.setup };
                Some((Motor::try_new(&params, &setup)?, *steps))
            }
            None => None,
        };
        self.motor = Motor::try_new(&params, &self.setup)?;
        self.rest_motor = rest_motor;
        Ok(())
    }

    /// The present, rounded to the nanosecond.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "2^53 steps are years"
    )]
    pub fn now(&self) -> Time {
        Time::from_nanos((self.state.steps as f64 * self.step_nanos_num).round() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(sets: &[&str]) -> Plant {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        Plant::draw(&Scene::load(None, &sets).unwrap()).unwrap()
    }

    /// The drive has the frequencies of the design, wherever the true motor's are.
    #[test]
    fn exact_the_drive_follows_the_design_and_not_the_motor() {
        for (set, b_hz, c_hz) in [
            ("motor.mode_b.frequency_hz=12000", 12_000.0, 7460.0),
            ("motor.mode_c.frequency_hz=14000", 6300.0, 14_000.0),
            ("plant.motor.mode_b.frequency_hz=6426", 6300.0, 7460.0),
        ] {
            assert_eq!(drawn(&[set]).setup.tuning, DriveTuning::Fixed { b_hz, c_hz }, "{set}");
        }
    }

    /// What the scene sets of the true motor is kept, everything else is drawn around the design as without it.
    #[test]
    fn exact_the_true_motor_is_drawn_around_the_design_but_for_what_is_set() {
        let (nominal, heavy) = (drawn(&[]), drawn(&["motor.rotor_mass_kg=184e-6"]));
        let off = drawn(&["plant.motor.rotor_mass_kg=184e-6"]);
        for parameter in Parameter::ALL {
            let [nominal, heavy, off] = [&nominal, &heavy, &off].map(|plant| plant.params.get(parameter));
            if parameter == Parameter::RotorMass {
                assert!((heavy / nominal / 4.0 - 1.0).abs() < 1e-12, "{heavy} {nominal}");
                assert!((heavy - 184e-6).abs() > 1e-9, "drawn");
                assert_eq!(off.to_bits(), 184e-6_f64.to_bits());
            } else {
                assert_eq!([heavy.to_bits(), off.to_bits()], [nominal.to_bits(); 2], "{parameter:?}");
            }
        }
    }
}
