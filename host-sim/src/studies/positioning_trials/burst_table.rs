//! The table of bursts of the nominal motor, for the simplest program that positions by bursts.

use controller::response_map::Family;
use motor_model::DriveCommand;

use crate::runs::RunError;
use crate::scene::Scene;
use crate::studies::response_map::ResponseMapCampaign;

/// Amplitude of walks, as in the response map of Table 1.
const WALK_AMPLITUDE: f32 = 0.3;

/// A burst, and how far it turns the nominal motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TableBurst {
    /// The drive.
    pub command: DriveCommand,
    /// Its length in ticks.
    pub ticks: u32,
    /// Mean turn in milli-degrees, clockwise positive.
    pub turn_mdeg: f64,
}

/// The bursts to choose from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BurstTable {
    bursts: Vec<TableBurst>,
}

impl BurstTable {
    /// Every burst of the response map, in the nominal motor.
    ///
    /// # Errors
    /// When the model refuses the nominal motor: never.
    pub fn nominal() -> Result<Self, RunError> {
        let mut scene = Scene::default();
        scene.set("plant.parameters", "nominal")?;
        let motors = ResponseMapCampaign::new(&scene, 4)?;
        let of_family = |family: Family| {
            let motors = &motors;
            motors.plan(WALK_AMPLITUDE).bursts_of(family).into_iter().map(move |(amplitude, ticks)| {
                let turn_mdeg = motors.burst(family.mode(), amplitude, ticks).turn_mdeg;
                TableBurst { command: DriveCommand::saturating(family.mode(), amplitude), ticks, turn_mdeg }
            })
        };
        Ok(Self { bursts: Family::ALL.into_iter().flat_map(of_family).collect() })
    }

    /// The burst whose turn is nearest to `remaining_mdeg`.
    pub fn nearest(&self, remaining_mdeg: f64) -> Option<TableBurst> {
        let left = |burst: &TableBurst| (remaining_mdeg - burst.turn_mdeg).abs();
        self.bursts.iter().min_by(|a, b| left(a).total_cmp(&left(b))).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_the_entry_that_leaves_least_is_taken() {
        let burst = |turn_mdeg| TableBurst { command: DriveCommand::OFF, ticks: 1, turn_mdeg };
        let table = BurstTable { bursts: vec![burst(-7.0), burst(-1.0), burst(5.0)] };
        for (remaining, turn) in [(-3.0, -1.0), (-5.0, -7.0), (3.0, 5.0), (1e3, 5.0)] {
            assert_eq!(table.nearest(remaining), Some(burst(turn)));
        }
        assert_eq!(BurstTable::default().nearest(1.0), None);
    }
}
