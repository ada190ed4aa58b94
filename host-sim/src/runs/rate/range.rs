//! What a motor reaches at full drive, in open loop.

use motor_model::{DriveCommand, DriveMode, Time};
use serde::Serialize;

use super::SETTLE_S;
use crate::runs::RunError;
use crate::scene::Scene;
use crate::world::plant::Plant;

/// What a motor reaches at full drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateRange {
    /// Mean rate in mode B, clockwise, in deg/s.
    pub clockwise_deg_s: f64,
    /// Mean rate in mode C, counter-clockwise and so negative.
    pub counter_clockwise_deg_s: f64,
}

impl RateRange {
    /// Mean over this time, after [`SETTLE_S`]: since the rate ripples by a third, it scatters by some 2 %.
    const MEAN_OVER_S: f64 = 5.0;

    /// Of the motor of `scene`, by itself, with neither loop nor faults.
    ///
    /// # Errors
    /// When the model refuses the scene's parameters.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        let mean = |mode| {
            let mut plant = Plant::draw(scene)?;
            let mut run = |until_s: f64| {
                while plant.now().seconds_since::<f64>(Time::ZERO) < until_s {
                    plant.step(DriveCommand::full(mode));
                }
                plant.state().rotor.angle.angle()
            };
            let from = run(SETTLE_S);
            let until = run(SETTLE_S + Self::MEAN_OVER_S);
            Ok::<f64, RunError>(until.minus(from).degrees() / Self::MEAN_OVER_S)
        };
        Ok(Self { clockwise_deg_s: mean(DriveMode::B)?, counter_clockwise_deg_s: mean(DriveMode::C)? })
    }

    /// Whether it holds `rate_deg_s` on average.
    pub fn holds(self, rate_deg_s: f64) -> bool {
        (self.counter_clockwise_deg_s..=self.clockwise_deg_s).contains(&rate_deg_s)
    }
}
