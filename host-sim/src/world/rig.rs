//! The desk: a plant and the instruments that look at it.
//!
//! ```text
//! every plant step:  the motor moves under the command applied; instruments that are due look at it
//! ```

use controller::PositionLoop;
use estimator::{CameraFrame, LdvSample};
use motor_model::{DriveCommand, Impacts};

use crate::scene::Scene;
use crate::scene::SceneError;
use crate::world::faults::Disturbance;
use crate::world::instruments::{Camera, Ldv};
use crate::world::plant::Plant;

/// How many plant steps lie between two events of each kind.
#[derive(Clone, Copy, Debug)]
struct Schedule {
    tick: u64,
    camera: u64,
    ldv: u64,
    /// Steps that the plant may take at once.
    stride: u64,
}

/// Longest stride of a plant at rest in s: a period of the default vibrometer, and still one span of pressed contact.
const STRIDE_S: f64 = 5e-6;

impl Schedule {
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
        let short = between as f64 * step_s <= STRIDE_S * (1.0 + 1e-9);
        // A blurred frame is the mean over every step.
        let stride = if short && scene.number("camera.exposure_frames") <= 0.0 { between } else { 1 };
        Ok(Self { tick, camera, ldv, stride })
    }
}

/// Greatest common divisor.
const fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
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
    pub fn new(scene: &Scene) -> Result<Self, SceneError> {
        let schedule = Schedule::new(scene)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1e8 ns")]
        let camera_nanos = (1e9 / scene.number("camera.frame_rate_hz")).round() as u64;
        let plant = Plant::draw(scene)?.striding(schedule.stride)?;
        let disturbance = Disturbance::of(scene);
        // What the model refuses at the end of a drift is refused at the start.
        if let Some(disturbance) = &disturbance {
            plant.clone().detune(disturbance.drift())?;
        }
        Ok(Self {
            plant,
            camera: Camera::new(scene, camera_nanos, 1e9 * scene.number("plant.step_s")),
            ldv: Ldv::new(scene),
            schedule,
            disturbance,
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
        self.show();
        impacts
    }

    /// A tick of the loop under `command`, seen by the instruments that are due. A rotor at rest is stepped through in strides from one look to the next.
    pub fn tick(&mut self, command: DriveCommand) {
        let end = self.plant.state().steps + self.schedule.tick;
        while self.plant.state().steps < end {
            let command = self.disturb(command);
            let due = self.plant.state().steps.is_multiple_of(self.schedule.stride);
            if !(due && command == DriveCommand::OFF && self.plant.stride()) {
                self.plant.step(command);
            }
            self.show();
        }
    }

    /// The instruments that are due look at the plant.
    fn show(&mut self) {
        let (now, steps, rotor) = (self.plant.now(), self.plant.state().steps, self.plant.state().rotor);
        self.camera.look(rotor.angle.angle());
        if steps.is_multiple_of(self.schedule.ldv) {
            self.ldv.sample(now, rotor.velocity_m_s);
        }
        if steps.is_multiple_of(self.schedule.camera) {
            self.camera.expose(now, rotor.angle.angle());
        }
    }

    /// What reaches the coil of `command`; jolts the rotor if it is time.
    #[inline]
    fn disturb(&mut self, command: DriveCommand) -> DriveCommand {
        let Some(disturbance) = &mut self.disturbance else { return command };
        let now = self.plant.now();
        if let Some(jolt_rad_s) = disturbance.jolt(now) {
            self.plant.jolt(jolt_rad_s);
        }
        if let Some(drift) = disturbance.drifted(now) {
            // The end was accepted, so whatever lies before it is.
            self.plant.detune(drift).ok();
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
