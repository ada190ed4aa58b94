//! The closed loop: plant and instruments on one side, [`controller::tick`] on the other.
//!
//! ```text
//! every plant step:  the motor moves under the command applied; instruments that are due look at it
//! every 10 us:       tick: read what has arrived, estimate, decide, command
//! ```

use controller::{Drive, PositionLoop, PositioningTuning, Report, Sense, Target};
use estimator::{CameraFrame, LdvSample};
use motor_model::{Angle, DriveCommand, Time};

use crate::error::CommandError;
use crate::filter::AnyFilter;
use crate::instruments::{Camera, Ldv};
use crate::plant::Plant;
use crate::scene::Scene;

/// What the loop sees of the desk: two instruments and an amplifier.
#[derive(Clone, Debug)]
struct Desk {
    now: Time,
    camera: Camera,
    ldv: Ldv,
    command: DriveCommand,
}

impl Sense for Desk {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.camera.arrived(self.now)
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.ldv.read()
    }
}

impl Drive for Desk {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        self.command = command;
        command
    }
}

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

/// The state of affairs after a tick, with the truth that only the simulation knows.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// The instant.
    pub at: Time,
    /// The rotor's true angle.
    pub angle: Angle,
    /// The rotor's true rate in rad/s.
    pub rate_rad_s: f64,
    /// What the tick did.
    pub report: Report,
}

impl Moment {
    /// The instant in s since the start.
    pub fn seconds(&self) -> f64 {
        self.at.seconds_since(Time::ZERO)
    }

    /// Estimated less true angle in milli-degrees, once there is an estimate.
    pub fn estimate_error_mdeg(&self) -> Option<f64> {
        self.report.estimate.map(|estimate| 1e3 * estimate.angle.minus(self.angle).degrees())
    }
}

/// Plant, instruments and loop, ready to run.
#[derive(Clone, Debug)]
pub struct ClosedLoop {
    plant: Plant,
    desk: Desk,
    schedule: Schedule,
    position_loop: PositionLoop<AnyFilter>,
}

impl ClosedLoop {
    /// The loop of a scene.
    ///
    /// # Errors
    /// When the model refuses the plant, or the plant's step does not divide a period.
    pub fn new(scene: &Scene, target: Target, tuning: PositioningTuning) -> Result<Self, CommandError> {
        let schedule = Schedule::new(scene)?;
        let plant = Plant::draw(scene)?;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 1e8 ns")]
        let camera_nanos = (1e9 / scene.number("camera.frame_rate_hz")).round() as u64;
        let desk = Desk {
            now: Time::ZERO,
            camera: Camera::new(scene, camera_nanos),
            ldv: Ldv::new(scene),
            command: DriveCommand::OFF,
        };
        let position_loop = PositionLoop::new(AnyFilter::of(scene), target, tuning, Time::ZERO);
        Ok(Self { plant, desk, schedule, position_loop })
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// Runs to the end of the next tick.
    pub fn next_tick(&mut self) -> Moment {
        for _ in 0..self.schedule.tick {
            self.plant.step(self.desk.command);
            let (now, steps, rotor) = (self.plant.now(), self.plant.state().steps, self.plant.state().rotor);
            if steps.is_multiple_of(self.schedule.ldv) {
                self.desk.ldv.sample(now, rotor.velocity_m_s);
            }
            if steps.is_multiple_of(self.schedule.camera) {
                self.desk.camera.expose(now, rotor.angle.angle());
            }
        }
        self.desk.now = self.plant.now();
        let report = controller::tick(&mut self.position_loop, self.desk.now, &mut self.desk);
        let rotor = self.plant.state().rotor;
        Moment { at: self.desk.now, angle: rotor.angle.angle(), rate_rad_s: rotor.rate_rad_s, report }
    }
}
