//! The closed loop: plant and instruments on one side, [`controller::tick`] on the other.
//!
//! ```text
//! every 10 us:  the desk's plant moves under the command applied; then tick: read what has arrived, estimate, decide, command
//! ```

use controller::rate::RateHold;
use controller::{
    Drive, PositionLoop, Positioning, PositioningTuning, RateLoop, RateReport, Sense, Target, TickReport,
};
use estimator::{CameraFrame, LdvSample};
use motor_model::{Angle, DriveCommand, Time};

use crate::runs::RunError;
use crate::runs::filter::AnyFilter;
use crate::scene::Scene;
use crate::world::plant::Plant;
use crate::world::rig::Desk;

/// The measurements that a tick took in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Taken {
    /// The camera frame, if one had arrived.
    pub camera_frame: Option<CameraFrame>,
    /// Vibrometer samples, oldest first.
    pub ldv_samples: Vec<LdvSample>,
}

/// What the loop sees of the desk: two instruments and an amplifier.
#[derive(Clone, Debug)]
struct Ports {
    desk: Desk,
    command: DriveCommand,
    taken: Taken,
}

impl Sense for Ports {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.taken.camera_frame = self.desk.camera_frame();
        self.taken.camera_frame
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        let sample = self.desk.ldv_sample();
        self.taken.ldv_samples.extend(sample);
        sample
    }
}

impl Drive for Ports {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        self.command = command;
        command
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
    pub report: TickReport,
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
    ports: Ports,
    position_loop: PositionLoop<AnyFilter>,
}

impl ClosedLoop {
    /// The loop of a scene.
    ///
    /// # Errors
    /// When the model refuses the plant, or the plant's step does not divide a period.
    pub fn new(scene: &Scene, target: Target, tuning: PositioningTuning) -> Result<Self, RunError> {
        let ports = Ports { desk: Desk::new(scene)?, command: DriveCommand::OFF, taken: Taken::default() };
        let position_loop = PositionLoop::new(AnyFilter::of(scene)?, target, tuning, Time::ZERO);
        Ok(Self { ports, position_loop })
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        self.ports.desk.plant()
    }

    /// The decision, to look at.
    pub fn positioning(&self) -> &Positioning {
        self.position_loop.positioning()
    }

    /// What the last tick took in.
    pub fn taken(&self) -> &Taken {
        &self.ports.taken
    }

    /// Puts `command` in the place of the last tick's: another controller drives the plant.
    pub fn overrule(&mut self, command: DriveCommand) {
        self.ports.command = command;
    }

    /// Runs to the end of the next tick.
    pub fn next_tick(&mut self) -> Moment {
        self.ports.desk.tick(self.ports.command);
        self.ports.taken.camera_frame = None;
        self.ports.taken.ldv_samples.clear();
        let now = self.plant().now();
        let report = controller::tick(&mut self.position_loop, now, &mut self.ports);
        let rotor = self.plant().state().rotor;
        Moment { at: now, angle: rotor.angle.angle(), rate_rad_s: rotor.rate_rad_s, report }
    }
}

/// Plant, instruments and a loop that holds a rate, ready to run.
#[derive(Clone, Debug)]
pub struct ClosedRateLoop {
    ports: Ports,
    rate_loop: RateLoop<AnyFilter>,
}

impl ClosedRateLoop {
    /// The loop of a scene.
    ///
    /// # Errors
    /// When the model refuses the plant, or the plant's step does not divide a period.
    pub fn new(scene: &Scene, hold: RateHold) -> Result<Self, RunError> {
        let ports = Ports { desk: Desk::new(scene)?, command: DriveCommand::OFF, taken: Taken::default() };
        Ok(Self { ports, rate_loop: RateLoop::new(AnyFilter::of(scene)?, hold) })
    }

    /// The plant.
    pub fn plant(&self) -> &Plant {
        self.ports.desk.plant()
    }

    /// Runs to the end of the next tick; what the tick did.
    pub fn next_tick(&mut self) -> RateReport {
        self.ports.desk.tick(self.ports.command);
        let now = self.plant().now();
        controller::tick_rate(&mut self.rate_loop, now, &mut self.ports)
    }

    /// The filter, to look at.
    pub fn filter(&self) -> &AnyFilter {
        self.rate_loop.filter()
    }

    /// Replaces what is held; the filter goes on.
    pub fn follow(&mut self, hold: RateHold) {
        self.rate_loop.follow(hold);
    }
}
