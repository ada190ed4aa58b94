//! The table of bursts of the nominal motor, for the simplest program that positions by bursts.

use controller::response_map::Family;
use motor_model::DriveCommand;

use analysis::response_map::ResponseMapCampaign;
use simulation::runs::RunError;
use simulation::scene::Scene;

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
    /// Every burst of the scene's response map, in the nominal motor of its design.
    ///
    /// # Errors
    /// When the scene's map is for another design.
    pub fn of(scene: &Scene) -> Result<Self, RunError> {
        let mut exact = Scene::default();
        exact.set("plant.parameters", "nominal")?;
        for (parameter, value) in scene.motor_overrides() {
            exact.set(parameter.spec().key, &value.to_string())?;
        }
        let motors = ResponseMapCampaign::new(&exact, 4)?;
        let map = scene.response_map()?;
        let walk_amplitude = map.middle(Family::Walk).map_or(1.0, |walk| walk.amplitude);
        let of_family = |family: Family| {
            let motors = &motors;
            motors.plan(walk_amplitude).bursts_of(family).into_iter().map(move |(amplitude, ticks)| {
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
    use controller::ResponseMap;
    use motor_model::{DriveMode, MotorParams, Parameter};

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

    /// Two cycles of mode C at 7.46 kHz are 27 ticks, at 14 kHz 14.
    #[test]
    fn exact_bursts_are_those_of_the_scene_s_design() {
        let mut scene = Scene::default();
        let map = *scene.response_map().unwrap();
        let rows = Family::ALL.map(|family| map.bursts(family));
        for (hz, ticks) in [(7460.0, 27), (14_000.0, 14)] {
            let design = MotorParams::nominal().with(Parameter::ModeCFrequency, hz).unwrap();
            scene.set(Parameter::ModeCFrequency.spec().key, &hz.to_string()).unwrap();
            let own = ResponseMap::try_new(design, map.cruises(), rows, 0.0).unwrap();
            let table = BurstTable::of(&scene.clone().with_response_map(own)).unwrap();
            let step = &table.bursts[0];
            assert_eq!((step.command.mode(), step.ticks), (Some(DriveMode::C), ticks));
        }
    }
}
