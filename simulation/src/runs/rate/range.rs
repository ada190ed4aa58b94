//! The range of a motor's rates, at full drive in open loop.

use motor_model::{DriveCommand, DriveMode, Time};
use serde::Serialize;

use super::SETTLE_S;
use crate::runs::RunError;
use crate::scene::Scene;
use crate::world::plant::Plant;

/// The mean rates of a motor at full drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RateRange {
    /// Mean rate in mode B, clockwise, in deg/s.
    pub clockwise_deg_s: f64,
    /// Mean rate in mode C, counter-clockwise and so negative.
    pub counter_clockwise_deg_s: f64,
}

impl RateRange {
    /// Time of the mean in s, after [`SETTLE_S`]. Since the rate ripples by a third, the mean scatters by some 2 %.
    const MEAN_OVER_S: f64 = 5.0;

    /// The range of the motor of `scene`, without loop and faults.
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
                plant.rotor().angle
            };
            let from = run(SETTLE_S);
            let until = run(SETTLE_S + Self::MEAN_OVER_S);
            Ok::<f64, RunError>(until.minus(from).degrees() / Self::MEAN_OVER_S)
        };
        Ok(Self { clockwise_deg_s: mean(DriveMode::B)?, counter_clockwise_deg_s: mean(DriveMode::C)? })
    }

    /// Whether `rate_deg_s` is within it.
    pub fn holds(self, rate_deg_s: f64) -> bool {
        (self.counter_clockwise_deg_s..=self.clockwise_deg_s).contains(&rate_deg_s)
    }
}
