//! A plant whose rotor tilts over four teeth, and shifts on its pin.
//!
//! It takes no long steps at rest: on teeth of unequal height the rotor rocks.
//!
//! The model's angle is that about the rotor's own axis. What a camera sees from above, and what a target is for, is
//! the angle round the vertical: it has what the axis swept by coning as well ([`crate::world::coning`]).

use motor_model::{
    Angle, DriveCommand, Freedom, MotorParams, TiltingContact, TiltingContacts, TiltingMotor,
    TiltingParameter, TiltingParams, TiltingSetup, TiltingState, TiltingVariation, Time,
};

use super::PlantSetup;
use crate::scene::SceneError;
use crate::world::coning::solid_angle;
use crate::world::pose::Pose;
use crate::world::rotor_path::RotorPoint;

/// The motor and its state.
#[derive(Clone, Debug)]
pub(super) struct TiltingPlant {
    motor: TiltingMotor<f64>,
    tilting: TiltingParams,
    freedom: Freedom,
    variation: TiltingVariation,
    state: TiltingState<f64>,
    /// Friction of the hub without a fault.
    own_hub_friction: f64,
    /// Solid angle that the rotor's axis has swept, counter-clockwise, in rad.
    swept_rad: f64,
    /// Rate before the last step in which the rotor met anything, and what it met; nothing after a step without.
    struck: (f64, TiltingContacts<f64>),
}

impl TiltingPlant {
    /// A motor with these parameters.
    pub(super) fn new(
        params: &MotorParams,
        tilting: &TiltingParams,
        setup: &PlantSetup,
        freedom: Freedom,
        variation: TiltingVariation,
    ) -> Result<Self, SceneError> {
        Ok(Self {
            motor: motor(params, tilting, setup, freedom, variation)?,
            tilting: *tilting,
            freedom,
            variation,
            state: TiltingState::default(),
            own_hub_friction: tilting.get(TiltingParameter::HubFriction),
            swept_rad: 0.0,
            struck: (0.0, TiltingContacts::new()),
        })
    }

    #[inline]
    pub(super) fn state(&self) -> &TiltingState<f64> {
        &self.state
    }

    pub(super) fn rotor(&self, at: Time) -> RotorPoint {
        let rotor = &self.state.rotor;
        let half_thickness_m = 0.5 * self.tilting.get(TiltingParameter::RotorThickness);
        RotorPoint {
            at,
            angle: rotor.angle.angle().minus(Angle::from_degrees(self.swept_rad.to_degrees())),
            rate_rad_s: rotor.rate_rad_s,
            velocity_m_s: rotor.velocity_m_s,
            height_m: rotor.height_m,
            pose: Pose::of_tilting(&self.state, half_thickness_m),
        }
    }

    pub(super) fn params(&self) -> &TiltingParams {
        &self.tilting
    }

    /// Heights of the four teeth.
    pub(super) fn tooth_heights_m(&self) -> [f64; 4] {
        let TiltingState { modes, stator_tilt, .. } = &self.state;
        self.motor.teeth().each_ref().map(|tooth| tooth.height(modes, stator_tilt))
    }

    #[inline]
    pub(super) fn step(&mut self, command: DriveCommand) -> bool {
        let before = self.state.tilt.slope;
        let rate_rad_s = self.state.rotor.rate_rad_s;
        let contacts = self.motor.step(&mut self.state, command);
        let met = !contacts.is_empty();
        if met {
            self.struck = (rate_rad_s, contacts);
        } else {
            self.struck.1.clear();
        }
        self.swept_rad += solid_angle(before.into(), self.state.tilt.slope.into());
        met
    }

    /// See [`super::Plant::tooth_impacts`].
    pub(super) fn struck(&self) -> (f64, &[TiltingContact<f64>]) {
        (self.struck.0, &self.struck.1)
    }

    /// See [`super::Plant::step_stuck`].
    pub(super) fn step_stuck(&mut self, command: DriveCommand) -> bool {
        let angle = self.state.rotor.angle;
        let met = self.step(command);
        (self.state.rotor.angle, self.state.rotor.rate_rad_s) = (angle, 0.0);
        met
    }

    /// Whether the rotor shifts on a pin.
    pub(super) fn has_hub(&self) -> bool {
        self.freedom == Freedom::Full
    }

    /// See [`super::Plant::rub`].
    pub(super) fn rub(
        &mut self,
        friction: Option<f64>,
        params: &MotorParams,
        setup: &PlantSetup,
    ) -> Result<(), SceneError> {
        let own = self.own_hub_friction;
        self.tilting = self.tilting.with(TiltingParameter::HubFriction, friction.unwrap_or(own))?;
        self.rebuild(params, setup)
    }

    /// Radial clearance between hole and pin.
    #[cfg(test)]
    pub(super) fn clearance_m(&self) -> f64 {
        self.tilting.get(TiltingParameter::HubClearance)
    }

    pub(super) fn jolt(&mut self, rate_rad_s: f64) {
        self.state.rotor.rate_rad_s += rate_rad_s;
    }

    /// The same motor with other parameters, from now on; its teeth and its pin stay.
    pub(super) fn rebuild(&mut self, params: &MotorParams, setup: &PlantSetup) -> Result<(), SceneError> {
        self.motor = motor(params, &self.tilting, setup, self.freedom, self.variation)?;
        Ok(())
    }
}

/// A motor of these parameters, in steps `steps` times as long as those of the plant.
fn motor(
    params: &MotorParams,
    tilting: &TiltingParams,
    setup: &PlantSetup,
    freedom: Freedom,
    variation: TiltingVariation,
) -> Result<TiltingMotor<f64>, SceneError> {
    let PlantSetup { step_s, impact_rule, friction_law, tuning } = *setup;
    let setup = TiltingSetup {
        impact_rule,
        friction_law,
        tuning,
        variation,
        freedom,
        ..TiltingSetup::with_step(step_s)
    };
    Ok(TiltingMotor::try_new(params, tilting, &setup)?)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use motor_model::DriveMode;

    use super::*;
    use crate::scene::Scene;
    use crate::world::plant::Plant;

    /// In both modes the angle seen from above is that about the rotor's own axis, less half of the area that the
    /// slopes sweep, to the fourth order of the tilt.
    #[test]
    fn dual_the_angle_seen_has_the_area_that_the_slopes_sweep() {
        for (mode, seed) in [(DriveMode::B, 1), (DriveMode::C, 2)] {
            let sets = ["plant.rotor=tilting".to_owned(), format!("seed={seed}")];
            let mut plant = Plant::draw(&Scene::of_sets(&sets).unwrap()).unwrap();
            let (mut area, mut tilt_max, mut before) = (0.0, 0.0_f64, [0.0; 2]);
            for _ in 0..100_000 {
                plant.step(DriveCommand::full(mode));
                let slope = plant.rotor().pose.slope;
                area += 0.5 * (before[0] * slope[1] - before[1] * slope[0]);
                tilt_max = tilt_max.max(plant.rotor().pose.tilt_rad());
                before = slope;
            }
            let swept: f64 = plant.own_axis_angle().minus(plant.rotor().angle).radians_since(Angle::ZERO);
            assert!(tilt_max > 1e-3, "{tilt_max}");
            // Units of 2^-32 turn, and what a steeper slope sweeps less.
            let allowed = 2.0 * TAU / 4_294_967_296.0 + tilt_max * tilt_max * 0.1 * TAU;
            assert!((swept - area).abs() < allowed, "{mode:?}: {swept:e} {area:e}");
        }
    }
}
