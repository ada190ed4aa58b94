//! The rig: a plant and the instruments that look at it.
//!
//! ```text
//! every plant step:  the motor moves under the command applied; instruments that are due look at it
//! ```

use controller::PositionLoop;
use estimator::{CameraFrame, LdvSample};
use motor_model::{DriveCommand, Impacts, MotorState, Time};

use crate::scene::{Scene, SceneError};
use crate::world::faults::MotorFaults;
use crate::world::instruments::{Camera, Ldv};
use crate::world::plant::Plant;

/// How many plant steps lie between two events of each kind.
#[derive(Clone, Copy, Debug)]
struct EventSteps {
    tick: u64,
    camera: u64,
    ldv: u64,
    /// Steps that the plant may take as one at rest.
    rest: u64,
}

/// Longest step of a plant at rest in s: a period of the default vibrometer, and one step of sustained contact.
const REST_STEP_S: f64 = 5e-6;

impl EventSteps {
    fn new(scene: &Scene) -> Result<Self, SceneError> {
        let step_s = scene.number("plant.step_s");
        let steps_in = |what: &str, period_s: f64| {
            let steps = (period_s / step_s).round();
            if steps >= 1.0 && (steps * step_s - period_s).abs() < 1e-9 * period_s {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "at least 1, at most 1e7"
                )]
                Ok(steps as u64)
            } else {
                Err(SceneError::Conflict {
                    conflict: format!(
                        "plant.step_s = {step_s:e} s does not divide the period of {what}, {period_s:e} s"
                    ),
                    hint: "a step of 1e-6, 5e-7 or 2.5e-7 s divides all default periods".to_owned(),
                })
            }
        };
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let tick_s = PositionLoop::TICK_NANOS as f64 * 1e-9;
        let tick = steps_in("the loop", tick_s)?;
        let camera = steps_in("the camera", 1.0 / scene.number("camera.frame_rate_hz"))?;
        let ldv = steps_in("the vibrometer", 1.0 / scene.number("ldv.sample_rate_hz"))?;
        let between = divisor(tick, divisor(camera, ldv));
        #[expect(clippy::cast_precision_loss, reason = "a few steps")]
        let short = between as f64 * step_s <= REST_STEP_S * (1.0 + 1e-9);
        // A blurred frame is the mean over every step.
        let rest = if short && scene.number("camera.exposure_frames") <= 0.0 { between } else { 1 };
        Ok(Self { tick, camera, ldv, rest })
    }
}

/// Greatest common divisor.
const fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}

/// Plant and instruments.
#[derive(Clone, Debug)]
pub struct Rig {
    plant: Plant,
    camera: Camera,
    ldv: Ldv,
    event_steps: EventSteps,
    faults: Option<MotorFaults>,
}

impl Rig {
    /// The rig of a scene.
    ///
    /// # Errors
    /// When the model refuses the plant, or the plant's step does not divide a period.
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let event_steps = EventSteps::new(scene)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1e8 ns")]
        let camera_nanos = (1e9 / scene.number("camera.frame_rate_hz")).round() as u64;
        let plant = Plant::draw(scene)?.with_rest_steps(event_steps.rest)?;
        let faults = MotorFaults::of(scene);
        // What the model would refuse at the end of a drift is refused before the start.
        if let Some(faults) = &faults {
            plant.clone().detune(faults.drift())?;
        }
        Ok(Self {
            plant,
            camera: Camera::new(scene, camera_nanos, 1e9 * scene.number("plant.step_s")),
            ldv: Ldv::new(scene),
            event_steps,
            faults,
        })
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// One step of the plant under `command`, seen by the instruments that are due; its impacts.
    pub fn step(&mut self, command: DriveCommand) -> Impacts<f64> {
        let command = self.faulty(command);
        let impacts = self.plant.step(command);
        self.show();
        impacts
    }

    /// A tick of the loop under `command` in single steps, each shown to `observe`: the state before and its
    /// instant, the impacts, the plant after.
    pub fn tick_in_steps(
        &mut self,
        command: DriveCommand,
        mut observe: impl FnMut(&MotorState<f64>, Time, &Impacts<f64>, &Plant),
    ) {
        for _ in 0..self.event_steps.tick {
            let (before, at) = (*self.plant.state(), self.plant.now());
            let impacts = self.step(command);
            observe(&before, at, &impacts, &self.plant);
        }
    }

    /// A tick of the loop under `command`, seen by the instruments that are due. At rest the plant takes one step from
    /// one instant at which an instrument is due to the next.
    pub fn tick(&mut self, command: DriveCommand) {
        let end = self.plant.state().steps + self.event_steps.tick;
        while self.plant.state().steps < end {
            let command = self.faulty(command);
            let due = self.plant.state().steps.is_multiple_of(self.event_steps.rest);
            if !(due && command == DriveCommand::OFF && self.plant.rest_step()) {
                self.plant.step(command);
            }
            self.show();
        }
    }

    /// The instruments that are due look at the plant.
    fn show(&mut self) {
        let (now, steps, rotor) = (self.plant.now(), self.plant.state().steps, self.plant.state().rotor);
        self.camera.look(rotor.angle.angle());
        if steps.is_multiple_of(self.event_steps.ldv) {
            self.ldv.sample(now, rotor.velocity_m_s);
        }
        if steps.is_multiple_of(self.event_steps.camera) {
            self.camera.expose(now, rotor.angle.angle());
        }
    }

    /// The command that reaches the coil. Applies the jolt and the drift of the resonances when they are due.
    #[inline]
    fn faulty(&mut self, command: DriveCommand) -> DriveCommand {
        let Some(faults) = &mut self.faults else { return command };
        let now = self.plant.now();
        if let Some(jolt_rad_s) = faults.jolt(now) {
            self.plant.jolt(jolt_rad_s);
        }
        if let Some(drift) = faults.drifted(now) {
            // The end of the drift was accepted, so that every change before it is.
            self.plant.detune(drift).ok();
        }
        faults.drive(now, command)
    }

    /// The first camera frame that has arrived and was not yet read.
    pub fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.camera.arrived(self.plant.now())
    }

    /// The oldest vibrometer sample not yet read.
    pub fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv.read()
    }
}
