//! The desk: a plant and the instruments that look at it.
//!
//! ```text
//! every plant step:  the motor moves under the command applied; instruments that are due look at it
//! ```

use controller::PositionLoop;
use estimator::{CameraFrame, LdvSample};
use motor_model::{DriveCommand, Impacts};

use crate::disturbance::Disturbance;
use crate::error::CommandError;
use crate::instruments::{Camera, Ldv};
use crate::plant::Plant;
use crate::scene::Scene;

/// How many plant steps lie between two events of each kind.
#[derive(Clone, Copy, Debug)]
struct Schedule {
    tick: u64,
    camera: u64,
    ldv: u64,
}

impl Schedule {
    fn new(scene: &Scene) -> Result<Self, CommandError> {
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
                Err(CommandError::Conflict {
                    conflict: format!(
                        "plant.step_s = {step_s:e} s does not divide the period of {what}, {period_s:e} s"
                    ),
                    hint: "a step of 1e-6, 5e-7 or 2.5e-7 s divides all default periods".to_owned(),
                })
            }
        };
        #[expect(clippy::cast_precision_loss, reason = "a period is far below 2^53 ns")]
        let tick_s = PositionLoop::TICK_NANOS as f64 * 1e-9;
        Ok(Self {
            tick: steps_in("the loop", tick_s)?,
            camera: steps_in("the camera", 1.0 / scene.number("camera.frame_rate_hz"))?,
            ldv: steps_in("the vibrometer", 1.0 / scene.number("ldv.sample_rate_hz"))?,
        })
    }
}

/// Plant and instruments.
#[derive(Clone, Debug)]
pub struct Desk {
    plant: Plant,
    camera: Camera,
    ldv: Ldv,
    schedule: Schedule,
    disturbance: Option<Disturbance>,
}

impl Desk {
    /// The desk of a scene.
    ///
    /// # Errors
    /// When the model refuses the plant, or the plant's step does not divide a period.
    pub fn new(scene: &Scene) -> Result<Self, CommandError> {
        let schedule = Schedule::new(scene)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1e8 ns")]
        let camera_nanos = (1e9 / scene.number("camera.frame_rate_hz")).round() as u64;
        Ok(Self {
            plant: Plant::draw(scene)?,
            camera: Camera::new(scene, camera_nanos, 1e9 * scene.number("plant.step_s")),
            ldv: Ldv::new(scene),
            schedule,
            disturbance: Disturbance::of(scene),
        })
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Plant steps from one tick of the loop to the next.
    pub fn steps_per_tick(&self) -> u64 {
        self.schedule.tick
    }

    /// One step of the plant under `command`, seen by the instruments that are due; its impacts.
    pub fn step(&mut self, command: DriveCommand) -> Impacts<f64> {
        let command = self.disturb(command);
        let impacts = self.plant.step(command);
        let (now, steps, rotor) = (self.plant.now(), self.plant.state().steps, self.plant.state().rotor);
        self.camera.look(rotor.angle.angle());
        if steps.is_multiple_of(self.schedule.ldv) {
            self.ldv.sample(now, rotor.velocity_m_s);
        }
        if steps.is_multiple_of(self.schedule.camera) {
            self.camera.expose(now, rotor.angle.angle());
        }
        impacts
    }

    /// What reaches the coil of `command`; jolts the rotor if it is time.
    #[inline]
    fn disturb(&mut self, command: DriveCommand) -> DriveCommand {
        let Some(disturbance) = &mut self.disturbance else { return command };
        let now = self.plant.now();
        if let Some(jolt_rad_s) = disturbance.jolt(now) {
            self.plant.jolt(jolt_rad_s);
        }
        disturbance.drive(now, command)
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
