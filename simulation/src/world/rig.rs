//! The rig: a plant and the instruments that look at it.
//!
//! ```text
//! every plant step:  the motor moves under the command applied;
//!                    the instruments see its path, and measure at the instants at which they are due
//! ```
//!
//! Instruments keep their own clocks ([`crate::world::event_clock`]). Only the loop's tick is a whole number of steps.

use controller::PositionLoop;
use estimator::{CameraFrame, LdvSample};
use motor_model::{DriveCommand, Time};

use crate::math::count::real;
use crate::scene::{Scene, SceneError};
use crate::world::faults::MotorFaults;
use crate::world::instruments::camera::{DeliveredFrame, MarkCounts};
use crate::world::instruments::{self, Camera, Ldv};
use crate::world::plant::Plant;
use crate::world::rotor_path::{RotorPath, RotorPoint};

/// Longest step of a plant at rest in s: a period of the default vibrometer, and one step of sustained contact.
const REST_STEP_S: f64 = 5e-6;

/// Steps of the plant in a tick of the loop.
pub(super) fn tick_steps(step_s: f64) -> Result<u64, SceneError> {
    #[expect(clippy::cast_precision_loss, reason = "10,000 ns")]
    let tick_s = PositionLoop::TICK_NANOS as f64 * 1e-9;
    let steps = (tick_s / step_s).round();
    if steps >= 1.0 && (steps * step_s - tick_s).abs() < 1e-9 * tick_s {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at least 1, at most 1e3"
        )]
        Ok(steps as u64)
    } else {
        Err(SceneError::Conflict {
            conflict: format!(
                "plant.step_s = {step_s:e} s does not divide the period of the loop, {tick_s:e} s"
            ),
            hint: "a step of 1e-6, 5e-7 or 2.5e-7 s does".to_owned(),
        })
    }
}

/// Steps that a plant at rest may take as one: the most that divide a tick and are not longer than [`REST_STEP_S`].
fn rest_steps(step_s: f64, tick_steps: u64) -> u64 {
    #[expect(clippy::cast_precision_loss, reason = "at most 1e3")]
    let short = |steps: &u64| *steps as f64 * step_s <= REST_STEP_S * (1.0 + 1e-9);
    (1..=tick_steps).filter(|steps| tick_steps.is_multiple_of(*steps)).filter(short).max().unwrap_or(1)
}

/// Refuses before the start what the model would refuse at the end of a drift, or of a hub that rubs.
fn check_faults(faults: &MotorFaults, plant: &Plant) -> Result<(), SceneError> {
    for drift in faults.extreme_drifts() {
        plant.clone().detune(drift)?;
    }
    faults.roughest_hub().map_or(Ok(()), |friction| plant.clone().rub(Some(friction)))
}

/// A step of the plant: the rotor before and after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantStep {
    /// Before.
    pub before: RotorPoint,
    /// After.
    pub after: RotorPoint,
    /// Whether the rotor met anything in it.
    pub met: bool,
    /// Whether the rotor met anything in it, or was in sustained contact before or after.
    pub touched: bool,
}

/// Plant and instruments.
#[derive(Clone, Debug)]
pub struct Rig {
    plant: Plant,
    camera: Camera,
    ldv: Ldv,
    tick_steps: u64,
    rest_steps: u64,
    /// Length of a long step, rounded down.
    rest_nanos: u64,
    /// The rotor at the end of the last step.
    seen: RotorPoint,
    /// When an instrument is to be shown the rotor next.
    due: Time,
    faults: MotorFaults,
}

impl Rig {
    /// The rig of a scene.
    ///
    /// # Errors
    /// When the model refuses the plant, the plant's step does not divide the loop's period, or settings of the
    /// instruments do not go together.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let step_s = scene.number("plant.step_s");
        let tick_steps = tick_steps(step_s)?;
        let rest_steps = rest_steps(step_s, tick_steps);
        instruments::check(scene)?;
        let plant = Plant::draw(scene)?.with_rest_steps(rest_steps)?;
        let faults = MotorFaults::of(scene);
        check_faults(&faults, &plant)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 10,000 ns")]
        let rest_nanos = (1e9 * step_s * real(rest_steps) + 1e-6) as u64;
        let (seen, due) = (plant.rotor(), Time::ZERO);
        let (camera, ldv) = (Camera::new(scene), Ldv::new(scene));
        Ok(Self { plant, camera, ldv, tick_steps, rest_steps, rest_nanos, seen, due, faults })
    }

    /// Takes the faults of `scene` from now on. Otherwise `scene` is the rig's own, and all that differs of its faults
    /// comes after now: the run is then that of `scene` from the start.
    ///
    /// # Errors
    /// When the rig or the model refuses a fault; then all is as it was.
    pub fn change_faults(&mut self, scene: &Scene) -> Result<(), SceneError> {
        instruments::check(scene)?;
        let faults = MotorFaults::of(scene);
        check_faults(&faults, &self.plant)?;
        self.faults.change(faults, self.plant.now());
        self.camera.change_faults(scene);
        self.ldv.change_faults(scene);
        Ok(())
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// One step of the plant under `command`, seen by the instruments that are due.
    pub fn step(&mut self, command: DriveCommand) -> PlantStep {
        let before = self.plant.rotor();
        let was_in_contact = self.plant.in_contact();
        let command = self.faulty(command);
        let met = self.step_plant(command);
        self.show(met);
        let touched = met || was_in_contact || self.plant.in_contact();
        PlantStep { before, after: self.seen, met, touched }
    }

    /// A tick of the loop under `command` in single steps, each shown to `observe` with the plant after it.
    pub fn tick_in_steps(&mut self, command: DriveCommand, observe: &mut dyn FnMut(&PlantStep, &Plant)) {
        self.run_in_steps(self.tick_steps, command, observe);
    }

    /// The same over so many steps of the plant.
    pub fn run_in_steps(
        &mut self,
        steps: u64,
        command: DriveCommand,
        observe: &mut dyn FnMut(&PlantStep, &Plant),
    ) {
        for _ in 0..steps {
            let step = self.step(command);
            observe(&step, &self.plant);
        }
    }

    /// Steps of the plant in a tick.
    pub fn tick_steps(&self) -> u64 {
        self.tick_steps
    }

    /// From now on the vibrometer is sampled so many steps of the plant later than its samples are stamped.
    pub fn sample_late(&mut self, steps: u64) {
        self.ldv.sample_late(steps * PositionLoop::TICK_NANOS / self.tick_steps);
        self.due = self.camera.due().min(self.ldv.due());
    }

    /// A tick of the loop under `command`, seen by the instruments that are due. At rest the plant takes long steps,
    /// where the vibrometer, which sees the ringing teeth, is not due within one.
    ///
    /// Every step in which the rotor meets anything is shown to `observe_impact`; long steps are not.
    // Not generic: the steps of the plant are compiled once, with this crate.
    pub fn tick(&mut self, command: DriveCommand, observe_impact: &mut dyn FnMut(&PlantStep)) {
        self.run(self.tick_steps, command, observe_impact);
    }

    /// The same over so many steps of the plant.
    pub fn run(&mut self, steps: u64, command: DriveCommand, observe_impact: &mut dyn FnMut(&PlantStep)) {
        let end = self.plant.steps() + steps;
        while self.plant.steps() < end {
            let command = self.faulty(command);
            let before = self.seen;
            let fits = self.plant.steps() + self.rest_steps <= end;
            let long = command == DriveCommand::OFF && fits && self.may_rest() && self.plant.rest_step();
            let met = !long && self.step_plant(command);
            self.show(met);
            if met {
                observe_impact(&PlantStep { before, after: self.seen, met, touched: true });
            }
        }
    }

    /// Whether a long step may begin. In one the rotor moves as it would without a fault that holds it.
    fn may_rest(&self) -> bool {
        self.plant.steps().is_multiple_of(self.rest_steps)
            && !self.is_held()
            && self.ldv.due() >= self.seen.at.plus_nanos(self.rest_nanos)
    }

    /// Whether a fault holds the rotor.
    #[inline]
    fn is_held(&self) -> bool {
        !self.faults.are_none() && self.faults.holds(self.plant.now())
    }

    /// One step of the plant.
    #[inline]
    fn step_plant(&mut self, command: DriveCommand) -> bool {
        if self.is_held() { self.plant.step_stuck(command) } else { self.plant.step(command) }
    }

    /// Shows the last step, in which the rotor met something or not, to the instruments that are due.
    #[inline]
    fn show(&mut self, met: bool) {
        let until = self.plant.rotor();
        if until.at >= self.due {
            let struck = met && !self.plant.in_contact();
            let path = RotorPath { from: self.seen, until, struck };
            if until.at >= self.ldv.due() {
                self.ldv.follow(&path);
            }
            if until.at >= self.camera.due() {
                self.camera.follow(&path);
            }
            self.due = self.camera.due().min(self.ldv.due());
        }
        self.seen = until;
    }

    /// The command that reaches the coil. Applies the jolt and the drift of the resonances when they are due.
    #[inline]
    fn faulty(&mut self, command: DriveCommand) -> DriveCommand {
        if self.faults.are_none() {
            return command;
        }
        let now = self.plant.now();
        if let Some(jolt_rad_s) = self.faults.jolt(now) {
            self.plant.jolt(jolt_rad_s);
        }
        if let Some(drift) = self.faults.drifted(now) {
            // The extremes of the drift were accepted, so that every change between them is.
            self.plant.detune(drift).ok();
        }
        if self.faults.hub_changes(now) {
            // The roughest was accepted, and its own is the scene's.
            self.plant.rub(self.faults.hub_friction(now)).ok();
        }
        self.faults.drive(now, command)
    }

    /// How many of the camera's pictures were not made of all marks; `None` of a single mark.
    pub fn mark_counts(&self) -> Option<MarkCounts> {
        self.camera.mark_counts()
    }

    /// The first camera frame that has arrived and was not yet read.
    pub fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.camera.arrived(self.plant.now())
    }

    /// The same, with what its marks showed.
    pub fn delivered_frame(&mut self) -> Option<DeliveredFrame> {
        self.camera.delivered(self.plant.now())
    }

    /// The oldest vibrometer sample not yet read.
    pub fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv.read()
    }
}

#[cfg(test)]
mod tests;
