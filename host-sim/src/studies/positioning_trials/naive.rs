//! The program that a user would write first: a table of bursts of the nominal motor.

use controller::response_map::Family;
use motor_model::DriveCommand;

use crate::scene::Scene;
use crate::studies::StudyError;
use crate::studies::response_map::{Campaign, bursts_of};

/// A burst and its turn in the nominal motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// What is driven.
    pub command: DriveCommand,
    /// For how many ticks.
    pub ticks: u32,
    /// Mean turn in milli-degrees, clockwise positive.
    pub turn_mdeg: f64,
}

/// The table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    entries: Vec<Entry>,
}

impl Table {
    /// Every burst of the response map, as the nominal motor does it.
    ///
    /// # Errors
    /// When the model refuses the nominal motor: never.
    pub fn nominal() -> Result<Self, StudyError> {
        let mut scene = Scene::default();
        scene.set("plant.parameters", "nominal")?;
        let motors = Campaign::new(&scene, 4)?;
        let of_family = |family: Family| {
            let motors = &motors;
            bursts_of(family).into_iter().map(move |(amplitude, ticks)| {
                let turn_mdeg = motors.burst(family.mode(), amplitude, ticks).turn_mdeg;
                Entry { command: DriveCommand::saturating(family.mode(), amplitude), ticks, turn_mdeg }
            })
        };
        Ok(Self { entries: Family::ALL.into_iter().flat_map(of_family).collect() })
    }

    /// The entry that leaves least of `remaining_mdeg`.
    pub fn nearest(&self, remaining_mdeg: f64) -> Option<Entry> {
        let left = |entry: &Entry| (remaining_mdeg - entry.turn_mdeg).abs();
        self.entries.iter().min_by(|a, b| left(a).total_cmp(&left(b))).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_the_entry_that_leaves_least_is_taken() {
        let entry = |turn_mdeg| Entry { command: DriveCommand::OFF, ticks: 1, turn_mdeg };
        let table = Table { entries: vec![entry(-7.0), entry(-1.0), entry(5.0)] };
        for (remaining, turn) in [(-3.0, -1.0), (-5.0, -7.0), (3.0, 5.0), (1e3, 5.0)] {
            assert_eq!(table.nearest(remaining), Some(entry(turn)));
        }
        assert_eq!(Table::default().nearest(1.0), None);
    }
}
