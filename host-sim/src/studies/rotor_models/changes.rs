//! What one change at a time does: each value that was not measured is changed alone, in the sets that meet the
//! experiment and at the paper's nominal values.

use serde::Serialize;

use super::measured::{MeasuredRun, cell};
use super::variants::{VARIANTS, Variant};
use crate::report::document::Table;
use simulation::scene::{Scene, SceneError};

/// Keys and the values that they take.
type Sets = &'static [(&'static str, &'static str)];

/// Changes that are made, one at a time, in each of some rotors.
#[derive(Clone, Copy, Debug)]
pub struct Changes {
    /// Indexes of the rotors in [`VARIANTS`].
    pub rotors: &'static [usize],
    /// What each change is called, and what it sets.
    pub changes: &'static [(&'static str, Sets)],
}

/// Changes of the sets with a tight hub.
pub const OF_SETS: Changes = Changes {
    rotors: &[3, 4],
    changes: &[
        ("none", &[]),
        ("tooth friction 0.05", &[("motor.friction", "0.05")]),
        ("tooth friction 0.08", &[("motor.friction", "0.08")]),
        ("tooth friction 0.25", &[("motor.friction", "0.25")]),
        ("tooth friction 0.4", &[("motor.friction", "0.4")]),
        ("friction law of the paper", &[("simulate.friction", "paper")]),
        ("clearance 4 um", &[("motor.hub.clearance_m", "4e-6")]),
        ("clearance 5 um", &[("motor.hub.clearance_m", "5e-6")]),
        ("clearance 10 um", &[("motor.hub.clearance_m", "10e-6")]),
        ("clearance 20 um", &[("motor.hub.clearance_m", "20e-6")]),
        ("clearance 50 um", &[("motor.hub.clearance_m", "50e-6")]),
        ("hub friction 0", &[("motor.hub.friction", "0")]),
        ("hub friction 0.2", &[("motor.hub.friction", "0.2")]),
        ("hub friction 0.6", &[("motor.hub.friction", "0.6")]),
        ("hub restitution 0.3", &[("motor.hub.restitution", "0.3")]),
        ("hub restitution 0.8", &[("motor.hub.restitution", "0.8")]),
        ("film damping 0.6 mN s/m", &[("motor.vertical_damping_n_s_per_m", "0.6e-3")]),
        ("film damping 3.6 mN s/m", &[("motor.vertical_damping_n_s_per_m", "3.6e-3")]),
        ("tilting modes at 2.5 kHz", &[("motor.stator_tilt.frequency_hz", "2500")]),
        ("tilting modes at 3 kHz", &[("motor.stator_tilt.frequency_hz", "3000")]),
        ("tilting modes at 4 kHz", &[("motor.stator_tilt.frequency_hz", "4000")]),
        ("damping of tilting modes 0.05", &[("motor.stator_tilt.damping_ratio", "0.05")]),
        ("rocking exponent 0", &[("motor.tooth_rocking_exponent", "0")]),
        ("mode shift -2.635 deg", &[("motor.mode_shift_deg", "-2.635")]),
        ("tooth amplitudes vary by 2 %", &[("motor.amplitude_variation", "0.02")]),
        ("tooth heights vary by 2 um", &[("motor.tooth_height_scatter_m", "2e-6")]),
        ("pin leans by 5 mrad", &[("motor.pin_slope_rad", "5e-3")]),
        ("hole 1 mm long", &[("motor.hub.length_m", "1e-3")]),
        ("hole 3 mm long", &[("motor.hub.length_m", "3e-3")]),
        ("ceiling at 20 um", &[("motor.ceiling.height_m", "20e-6")]),
        ("ceiling at 50 um", &[("motor.ceiling.height_m", "50e-6")]),
        (
            "ceiling at 50 um, friction 0.05",
            &[("motor.ceiling.height_m", "50e-6"), ("motor.ceiling.friction", "0.05")],
        ),
        ("drive 0.85", &[("simulate.amplitude", "0.85")]),
        ("drive 0.7", &[("simulate.amplitude", "0.7")]),
        ("drive 0.5", &[("simulate.amplitude", "0.5")]),
        ("drive 0.3", &[("simulate.amplitude", "0.3")]),
        ("no shift", &[("plant.rotor", "tilting_without_shift")]),
    ],
};

/// Changes at the paper's nominal values.
pub const OF_NOMINAL: Changes = Changes {
    rotors: &[2],
    changes: &[
        ("none", &[]),
        ("clearance 5 um, hub friction 0.1", &[TIGHT, ("motor.hub.friction", "0.1")]),
        ("clearance 5 um, hub friction 0.6", &[TIGHT, ("motor.hub.friction", "0.6")]),
        ("clearance 5 um, tooth friction 0.04", &[TIGHT, ("motor.friction", "0.04")]),
        ("clearance 10 um", &[("motor.hub.clearance_m", "10e-6")]),
        ("clearance 50 um", &[("motor.hub.clearance_m", "50e-6")]),
        ("clearance 100 um", &[("motor.hub.clearance_m", "100e-6")]),
        ("hub friction 0.1", &[("motor.hub.friction", "0.1")]),
        ("hub friction 0.6", &[("motor.hub.friction", "0.6")]),
        ("tooth friction 0.04", &[("motor.friction", "0.04")]),
        ("hub restitution 0.3", &[("motor.hub.restitution", "0.3")]),
        ("hub restitution 0.8", &[("motor.hub.restitution", "0.8")]),
        ("tooth amplitudes vary by 5 %", &[("motor.amplitude_variation", "0.05")]),
        ("tooth heights vary by 5 um", &[("motor.tooth_height_scatter_m", "5e-6")]),
    ],
};

const TIGHT: (&str, &str) = ("motor.hub.clearance_m", "5e-6");

/// A rotor with one change, and its runs.
#[derive(Clone, Debug, Serialize)]
pub struct ChangedRotor {
    /// The rotor.
    pub rotor: &'static str,
    /// What was changed.
    pub change: &'static str,
    /// The runs in mode B and in mode C, one for each seed.
    pub runs: [Vec<MeasuredRun>; 2],
}

impl Changes {
    /// Every rotor with every change, in the order of [`collect`](Self::collect).
    fn each(&self) -> impl Iterator<Item = (&'static Variant, &'static str, Sets)> {
        let changes = self.changes;
        (self.rotors.iter())
            .flat_map(move |&rotor| changes.iter().map(move |(name, sets)| (&VARIANTS[rotor], *name, *sets)))
    }

    /// The scene of every rotor with every change.
    ///
    /// # Errors
    /// When one is refused, which a test excludes.
    pub fn scenes(&self) -> Result<Vec<Scene>, SceneError> {
        self.each()
            .map(|(rotor, _, sets)| {
                let mut scene = rotor.scene()?;
                for (key, value) in sets {
                    scene.set(key, value)?;
                }
                Ok(scene)
            })
            .collect()
    }

    /// The rotors from the runs of each, which `next` gives in turn.
    pub fn collect(&self, mut next: impl FnMut() -> [Vec<MeasuredRun>; 2]) -> Vec<ChangedRotor> {
        self.each()
            .map(|(rotor, change, _)| ChangedRotor { rotor: rotor.name, change, runs: next() })
            .collect()
    }
}

/// Every change and what it makes of both rates, and of collision frequency and amplitude in mode B.
pub fn table(rotors: &[ChangedRotor]) -> Table {
    let mut table = Table::new(&["rotor", "changed", "B rad/s", "collision Hz", "collision mm/s", "C rad/s"]);
    for changed in rotors {
        let [in_b, in_c] = &changed.runs;
        table.push(vec![
            changed.rotor.to_owned(),
            changed.change.to_owned(),
            cell(in_b, 2, |run| run.rate_rad_s),
            cell(in_b, 0, |run| run.collision_frequency_hz),
            cell(in_b, 1, |run| run.collision_amplitude_mm_s),
            cell(in_c, 2, |run| run.rate_rad_s),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_every_change_is_a_scene_and_finds_its_runs() {
        for changes in [&OF_SETS, &OF_NOMINAL] {
            let scenes = changes.scenes().unwrap();
            let mut taken = 0;
            let rotors = changes.collect(|| {
                taken += 1;
                [const { Vec::new() }; 2]
            });
            assert_eq!((taken, rotors.len()), (scenes.len(), changes.rotors.len() * changes.changes.len()));
            for ((rotor, change, sets), (scene, changed)) in changes.each().zip(scenes.iter().zip(&rotors)) {
                assert_eq!((changed.rotor, changed.change), (rotor.name, change));
                for (key, value) in sets {
                    let given: Result<f64, _> = value.parse();
                    match given {
                        Ok(number) => assert!((scene.number(key) - number).abs() <= 1e-12 * number.abs()),
                        Err(_) => assert_eq!(scene.choice(key), *value),
                    }
                }
            }
        }
    }
}
