//! What the twin's error is made of: the study of [`filter_errors`](super::filter_errors) with twins that are told
//! parts of the truth, on both rotors and with one, two and eight marks, for its page of results.

mod picture;
mod tables;

use rayon::prelude::*;

use super::filter_errors::{FilterErrors, FilterErrorsPlan};
use analysis::filter_errors::told::ToldPart;
use simulation::runs::RunError;
use simulation::scene::Scene;

/// Marks of the camera.
pub(crate) const MARKS: [u64; 3] = [1, 2, 8];

/// A rotor, and how many motors of it run in each mode.
#[derive(Clone, Debug)]
pub(crate) struct BudgetRotor {
    /// Its name in tables.
    pub(crate) name: &'static str,
    pub(crate) scene: Scene,
    pub(crate) motors: u64,
}

/// The budget of one rotor.
#[derive(Clone, Debug)]
pub(crate) struct RotorBudget {
    name: &'static str,
    motors: u64,
    /// One for each of [`MARKS`].
    found: Vec<FilterErrors>,
}

/// The budgets of all rotors.
#[derive(Clone, Debug)]
pub(crate) struct ErrorBudget {
    rotors: Vec<RotorBudget>,
}

impl ErrorBudget {
    /// Runs each rotor under each camera, told nothing, each part, all but each, and all.
    ///
    /// # Errors
    /// When a scene is refused or a run fails.
    pub(crate) fn of(rotors: &[BudgetRotor]) -> Result<Self, RunError> {
        let parts = &ToldPart::OF_TWIN;
        let of_marks = |rotor: &BudgetRotor, marks: u64| {
            let mut scene = rotor.scene.clone();
            scene.set("camera.marks", &marks.to_string())?;
            FilterErrorsPlan::new(&scene, rotor.motors)?.with_told(parts)?.run(&|_| ())
        };
        let of_rotor = |rotor: &BudgetRotor| {
            let found: Result<Vec<_>, RunError> =
                MARKS.par_iter().map(|&marks| of_marks(rotor, marks)).collect();
            Ok(RotorBudget { name: rotor.name, motors: rotor.motors, found: found? })
        };
        let rotors: Result<Vec<_>, RunError> = rotors.iter().map(of_rotor).collect();
        Ok(Self { rotors: rotors? })
    }
}
