//! The plant: the motor to be controlled. The loop does not know its parameters.
//!
//! It has the same physics as the twin, but in `f64`, at a finer step and with parameters drawn around the design
//! (keys `motor.`) within Table 1's tolerances: an estimator tested on its own model looks better than it is. A key
//! `plant.motor.` sets a parameter of the true motor, whatever the design, or with `plant.parameters = "around_plant"`
//! the value around which it is drawn. The generator drives it at the resonances of
//! the *design*, wherever its own are.
//!
//! `plant.stator = "finite_elements"` gives the true motor a stator of the kept ensembles, whole (`kept_stators`).
//!
//! A scene chooses how the true rotor moves (`plant.rotor`): as the twin's, or tilting and shifting on its pin.
//!
//! Most of the time of a move the rotor is at rest, and a step in sustained contact costs ten times one in flight. With
//! the drive off and teeth on the rotor the plant may therefore take longer steps ([`Plant::with_rest_steps`]): the
//! same scheme, which in sustained contact is converged at 20 us (`tests/system/motor/law_sustained_contact.rs`).

mod height_only;
mod parameters;
mod tilting;
mod tooth_impact;

use motor_model::params::Parameter;
use motor_model::{
    AmplitudeVariation, Angle, DriveCommand, DriveTuning, FrictionLaw, ImpactRule, MotorParams,
    TiltingParams, TiltingVariation, Time,
};

use crate::math::random_streams::{self, RandomSource};
use crate::scene::SceneError;
use crate::scene::{RotorModel, Scene};
use crate::world::pose::{Pose, RotorTilt};
use crate::world::rotor_path::RotorPoint;
use height_only::HeightOnlyPlant;
use tilting::TiltingPlant;
pub use tooth_impact::ToothImpact;

/// The rule that a scene calls `word`.
pub fn impact_rule(word: &str) -> ImpactRule {
    if word == "located" { ImpactRule::Located } else { ImpactRule::EndOfStep }
}

/// What both kinds of motor are made of.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PlantSetup {
    step_s: f64,
    impact_rule: ImpactRule,
    friction_law: FrictionLaw,
    tuning: DriveTuning,
}

/// The motor, by how its rotor moves.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a run has one plant, which it steps a million times a second")]
enum PlantMotor {
    HeightOnly(HeightOnlyPlant),
    Tilting(Box<TiltingPlant>),
}

/// The motor under control, and its state.
#[derive(Clone, Debug)]
pub struct Plant {
    motor: PlantMotor,
    setup: PlantSetup,
    params: MotorParams,
    /// Relative change of the resonances.
    drift: f64,
    step_nanos_num: f64,
}

impl Plant {
    /// The plant that the scene's seed names, at rest at angle 0.
    ///
    /// # Errors
    /// When the model refuses the scene's parameters, or the scene sets a key that the rotor's model does not use.
    pub fn draw(scene: &Scene) -> Result<Self, SceneError> {
        let what = if scene.choice("plant.parameters") == "nominal" {
            "the value is the true motor's"
        } else {
            "the value is the true motor's, which the seed draws"
        };
        Self::drawn(scene).map_err(|refused| refused.following_in_motor(scene, what))
    }

    fn drawn(scene: &Scene) -> Result<Self, SceneError> {
        let (params, tilting) = parameters::of_true_motor(scene)?;
        let design = scene.motor_params();
        let step_s = scene.number("plant.step_s");
        let setup = PlantSetup {
            step_s,
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
        };
        let mut variation = random_streams::stream(scene.seed(), RandomSource::AmplitudeVariation);
        let motor = match RotorModel::of(scene)? {
            RotorModel::HeightOnly => {
                PlantMotor::HeightOnly(HeightOnlyPlant::new(&params, &setup, &mut variation)?)
            }
            RotorModel::Tilting(freedom) => PlantMotor::Tilting(Box::new(TiltingPlant::new(
                &params,
                &tilting,
                &setup,
                freedom,
                TiltingVariation::draw(&params, &tilting, &mut variation),
            )?)),
        };
        Ok(Self { motor, setup, params, drift: 0.0, step_nanos_num: step_s * 1e9 })
    }

    /// The same plant, which can take `steps` steps as one while the drive is off and its rotor is on the teeth
    /// ([`Self::rest_step`]); 1 for none. A plant whose rotor tilts takes none.
    ///
    /// # Errors
    /// When the model refuses a step of that length.
    pub fn with_rest_steps(mut self, steps: u64) -> Result<Self, SceneError> {
        match &mut self.motor {
            PlantMotor::HeightOnly(motor) => motor.set_rest_steps(&self.params, &self.setup, steps)?,
            PlantMotor::Tilting(_) => {}
        }
        Ok(self)
    }

    /// One long step with the drive off, if the rotor is on the teeth and the plant has long steps; whether it was
    /// taken.
    pub fn rest_step(&mut self) -> bool {
        match &mut self.motor {
            PlantMotor::HeightOnly(motor) => motor.rest_step(),
            PlantMotor::Tilting(_) => false,
        }
    }

    /// The true motor's parameters.
    #[must_use]
    pub fn params(&self) -> &MotorParams {
        &self.params
    }

    /// The frequencies of the generator.
    #[must_use]
    pub fn tuning(&self) -> DriveTuning {
        self.setup.tuning
    }

    /// Steps taken.
    #[inline]
    #[must_use]
    pub fn steps(&self) -> u64 {
        match &self.motor {
            PlantMotor::HeightOnly(motor) => motor.state().steps,
            PlantMotor::Tilting(motor) => motor.state().steps,
        }
    }

    /// The rotor at present, as seen from above.
    #[inline]
    #[must_use]
    pub fn rotor(&self) -> RotorPoint {
        let at = self.now();
        match &self.motor {
            PlantMotor::HeightOnly(motor) => motor.rotor(at),
            PlantMotor::Tilting(motor) => motor.rotor(at),
        }
    }

    /// Tilt, shift and height of a rotor that tilts; `None` of one that does not.
    #[must_use]
    pub fn tilt(&self) -> Option<RotorTilt> {
        match &self.motor {
            PlantMotor::HeightOnly(_) => None,
            PlantMotor::Tilting(motor) => {
                let state = motor.state();
                Some(RotorTilt { pose: Pose::of_tilting(state, 0.0), height_m: state.rotor.height_m })
            }
        }
    }

    /// The integral of the rate about the rotor's own axis, clockwise positive: what a gyroscope on it turns by. It is
    /// the angle seen from above but for coning ([`crate::world::coning`]).
    #[must_use]
    pub fn own_axis_angle(&self) -> Angle {
        match &self.motor {
            PlantMotor::HeightOnly(motor) => motor.state().rotor.angle.angle(),
            PlantMotor::Tilting(motor) => motor.state().rotor.angle.angle(),
        }
    }

    /// Height of the rotor in m above that of a rotor at rest on teeth at rest; of its mass centre.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        match &self.motor {
            PlantMotor::HeightOnly(motor) => motor.state().rotor.height_m,
            PlantMotor::Tilting(motor) => motor.state().rotor.height_m,
        }
    }

    /// Heights of the four teeth's tops in m above teeth at rest, counter-clockwise from the first one.
    #[must_use]
    pub fn tooth_heights_m(&self) -> [f64; 4] {
        match &self.motor {
            PlantMotor::HeightOnly(motor) => {
                let [first, second] = motor.tooth_heights_m();
                [first, second, first, second]
            }
            PlantMotor::Tilting(motor) => motor.tooth_heights_m(),
        }
    }

    /// What the true motor has beside [`Self::params`] if its rotor tilts; `None` if it does not.
    #[must_use]
    pub fn tilting_params(&self) -> Option<&TiltingParams> {
        match &self.motor {
            PlantMotor::HeightOnly(_) => None,
            PlantMotor::Tilting(motor) => Some(motor.params()),
        }
    }

    /// Amplitudes of the true motor's pairs of teeth; `None` if its rotor tilts, and each tooth has its own.
    #[must_use]
    pub fn amplitude_variation(&self) -> Option<&AmplitudeVariation> {
        match &self.motor {
            PlantMotor::HeightOnly(motor) => Some(motor.variation()),
            PlantMotor::Tilting(_) => None,
        }
    }

    /// Whether the rotor is in sustained contact with anything.
    #[must_use]
    pub fn in_contact(&self) -> bool {
        match &self.motor {
            PlantMotor::HeightOnly(motor) => motor.state().in_contact != [false; 2],
            PlantMotor::Tilting(motor) => !motor.state().in_contact.is_empty(),
        }
    }

    /// One step under `command`; whether the rotor met anything in it.
    #[inline]
    pub fn step(&mut self, command: DriveCommand) -> bool {
        match &mut self.motor {
            PlantMotor::HeightOnly(motor) => motor.step(command),
            PlantMotor::Tilting(motor) => motor.step(command),
        }
    }

    /// The impacts of teeth in the last step, in the order of time.
    #[must_use]
    pub fn tooth_impacts(&self) -> Vec<ToothImpact> {
        match &self.motor {
            PlantMotor::HeightOnly(motor) => {
                let (rate_rad_s, impacts) = motor.struck();
                tooth_impact::of_pairs(&self.params, rate_rad_s, impacts)
            }
            PlantMotor::Tilting(motor) => {
                let (rate_rad_s, contacts) = motor.struck();
                tooth_impact::of_teeth(&self.params, rate_rad_s, contacts)
            }
        }
    }

    /// The same for a rotor that sticks: it moves up and down, and does not turn about its axis.
    pub fn step_stuck(&mut self, command: DriveCommand) -> bool {
        match &mut self.motor {
            PlantMotor::HeightOnly(motor) => motor.step_stuck(command),
            PlantMotor::Tilting(motor) => motor.step_stuck(command),
        }
    }

    /// Changes the rotor's rate at once: a jolt.
    pub fn jolt(&mut self, rate_rad_s: f64) {
        match &mut self.motor {
            PlantMotor::HeightOnly(motor) => motor.jolt(rate_rad_s),
            PlantMotor::Tilting(motor) => motor.jolt(rate_rad_s),
        }
    }

    /// Moves the resonances of modes B and C by the part `drift` away from those that were drawn, from now on. The
    /// drive keeps its frequencies.
    ///
    /// # Errors
    /// When the model refuses the frequencies; then they stay.
    pub fn detune(&mut self, drift: f64) -> Result<(), SceneError> {
        let params = self.detuned(drift)?;
        match &mut self.motor {
            PlantMotor::HeightOnly(motor) => motor.rebuild(&params, &self.setup)?,
            PlantMotor::Tilting(motor) => motor.rebuild(&params, &self.setup)?,
        }
        self.drift = drift;
        Ok(())
    }

    fn detuned(&self, drift: f64) -> Result<MotorParams, SceneError> {
        let mut params = self.params;
        for parameter in [Parameter::ModeBFrequency, Parameter::ModeCFrequency] {
            params = params.with(parameter, self.params.get(parameter) * (1.0 + drift))?;
        }
        Ok(params)
    }

    /// Gives the hub this coefficient of friction from now on, or its own for `None`.
    ///
    /// # Errors
    /// When the rotor has no hub, or the model refuses the friction; then it stays.
    pub fn rub(&mut self, friction: Option<f64>) -> Result<(), SceneError> {
        let params = self.detuned(self.drift)?;
        match &mut self.motor {
            PlantMotor::Tilting(motor) if motor.has_hub() => motor.rub(friction, &params, &self.setup),
            _ => Err(SceneError::Conflict {
                conflict: "a fault hub:rub, and a rotor without a hub".to_owned(),
                hint: "plant.rotor=tilting has one".to_owned(),
            }),
        }
    }

    /// The present, rounded to the nanosecond.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "2^53 steps are years"
    )]
    pub fn now(&self) -> Time {
        Time::from_nanos((self.steps() as f64 * self.step_nanos_num).round() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::statistics::Spread;

    fn drawn(sets: &[&str]) -> Plant {
        let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
        Plant::draw(&Scene::of_sets(&sets).unwrap()).unwrap()
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

    /// A value that nobody has set is refused with what was set of its mode: of the true motor or of its design.
    #[test]
    fn exact_a_refusal_names_what_was_set() {
        for (sets, said) in [
            (
                &["plant.motor.mode_a.frequency_hz=1"][..],
                "; hint: the value is the true motor's, which the seed draws; it or its bounds follow from \
                 plant.motor.mode_a.frequency_hz = 1.0",
            ),
            (
                &["motor.mode_a.frequency_hz=1", "plant.parameters=nominal"],
                "; hint: the value is the true motor's; it or its bounds follow from motor.mode_a.frequency_hz = 1.0",
            ),
        ] {
            let sets: Vec<String> = sets.iter().map(|&set| set.to_owned()).collect();
            let refused = Plant::draw(&Scene::of_sets(&sets).unwrap()).unwrap_err().one_line();
            assert!(refused.starts_with("error: motor.mode_a.damping_n_s_per_m = 0.02"), "{refused}");
            assert!(refused.ends_with(said), "{refused}");
        }
    }

    /// Drawn around what the scene sets of the true motor: everything has the values of a design that has them set.
    #[test]
    fn exact_the_true_motor_is_drawn_around_what_is_set() {
        let (of_design, of_plant) = (
            drawn(&["motor.friction=0.15"]),
            drawn(&["plant.motor.friction=0.15", "plant.parameters=around_plant"]),
        );
        for parameter in Parameter::ALL {
            let [of_design, of_plant] = [&of_design, &of_plant].map(|plant| plant.params.get(parameter));
            assert_eq!(of_design.to_bits(), of_plant.to_bits(), "{parameter:?}");
        }
        assert!((of_plant.params.get(Parameter::Friction) - 0.15).abs() > 1e-6, "drawn");
        // The hub's clearance too: of 7 um it is 4.9 to 9.1, and another for each seed.
        let clearance_m = |seed: u64| {
            let sets =
                ["plant.rotor=tilting", "plant.motor.hub.clearance_m=7e-6", "plant.parameters=around_plant"];
            let plant = drawn(&[&sets[..], &[&format!("seed={seed}")]].concat());
            match &plant.motor {
                PlantMotor::Tilting(motor) => motor.clearance_m(),
                PlantMotor::HeightOnly(_) => panic!("a rotor that tilts"),
            }
        };
        let (one, other) = (clearance_m(1), clearance_m(2));
        assert!([one, other].iter().all(|c| (4.9e-6..=9.1e-6).contains(c)), "{one:e} {other:e}");
        assert!((one - other).abs() > 1e-8, "{one:e} {other:e}");
    }

    /// A tolerance that is set is two standard deviations of the true motors about their design, and cuts them off
    /// there. Of 200 motors the standard deviation, then 0.8796 of half of it, is known to a twentieth: four of these
    /// either way, and as many of the mean.
    #[test]
    fn law_motors_are_drawn_within_the_tolerances_that_are_set() {
        let friction = |seed: u64| {
            let sets = ["motor.friction=0.3", "plant.tolerance.motor.friction=0.02", &format!("seed={seed}")];
            drawn(&sets).params.get(Parameter::Friction)
        };
        let values: Vec<f64> = (0..200).map(friction).collect();
        assert!(values.iter().all(|value| (0.28..=0.32).contains(value)), "{values:?}");
        let spread: Spread = values.into_iter().collect();
        let sd = 0.8796 * 0.01;
        assert!(
            (spread.mean - 0.3).abs() < 4.0 * sd / 14.1 && (spread.sd / sd - 1.0).abs() < 0.2,
            "{spread:?}"
        );
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
