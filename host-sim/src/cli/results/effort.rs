//! How much is simulated for the pages of results: all of it, or enough to fill every place.

use crate::cli::CommandError;
use crate::studies::stator::sweeps::SweepEffort;
use crate::studies::step_accuracy;
use simulation::scene::Scene;

/// How much is simulated for the pages.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Runs of each motor of the paper.
    pub(super) paper_seeds: u64,
    /// Stators that are solved.
    pub(super) stator: SweepEffort,
    /// Runs of each rotor and mode, and rotors drawn over what was not measured.
    pub(super) rotor_seeds: u64,
    pub(super) rotors_drawn: u64,
    /// Whether rotors with one change at a time run as well.
    pub(super) rotor_changes: bool,
    /// Motors in each mode, for the filters' errors.
    pub(super) error_motors: u64,
    /// Motors in each mode, for what the twin's error is made of: height only, and tilting.
    pub(super) budget_motors: [u64; 2],
    /// Motors in each mode, for the filters' costs.
    pub(super) cost_motors: u64,
    /// Moves.
    pub(super) trials: u64,
    /// Moves by each other strategy and filter.
    pub(super) compared_trials: u64,
    /// Moves by what each part has time for.
    pub(super) part_trials: u64,
    /// Motors that hold rates at each latency.
    pub(super) latency_motors: u64,
    /// Moves at each tolerance, of the height-only rotor and of one that tilts.
    pub(super) tolerance_trials: [u32; 2],
    /// Motors that are commissioned and moved: height only, and of each scene that tilts.
    pub(super) commissioned_motors: [u64; 2],
    /// Motors of each bench of instruments, and what the names of the benches contain.
    pub(super) grid_motors: u64,
    pub(super) grid_benches: &'static str,
    /// Moves with faults.
    pub(super) faulty_runs: u64,
    /// Gyroscopes.
    pub(super) calibrations: u64,
    /// Motors that are identified, and motors to learn from, of each rotor.
    pub(super) identified: u64,
    pub(super) learnt_from: u64,
    /// Of the scenes with a rotor that tilts: how many are shown, motors in each mode for the filters' errors, moves,
    /// gyroscopes, and motors that these are spread over.
    pub(super) tilting_scenes: usize,
    pub(super) tilting_error_motors: u64,
    pub(super) tilting_trials: u64,
    pub(super) tilting_calibrations: u64,
    pub(super) tilting_gyroscope_motors: u64,
    /// Gyroscopes of each scene that are calibrated for as long as is needed, motors that these are spread over, and
    /// the longest motor time in s.
    pub(super) needed_calibrations: [u64; 2],
    pub(super) needed_longest_s: f64,
    /// Motors in each mode for the filters' errors where they are drawn around a set, with two marks.
    pub(super) drawn_error_motors: u64,
    /// Time of a plan of calibration, and of a rate, in s; as the scene says unless it is given.
    pub(super) time_s: Option<&'static str>,
    pub(super) step_accuracy: fn() -> step_accuracy::StepAccuracyPlan,
}

impl Effort {
    /// As many runs as the paper made; 40 motors bound an ANEES to 6 % of 1; of 10,000 moves the worst thousandth is
    /// ten; of 200 intervals the covered share is known to 1.5 %; of 2,000 runs each fault
    /// among 26 comes in about a hundred. A second of a motor that tilts takes five to ten times as long, so that there
    /// are as many of them as ten minutes of a processor allow on each page.
    pub(super) const FULL: Self = Self {
        paper_seeds: 5,
        stator: SweepEffort::FULL,
        rotor_seeds: 8,
        rotors_drawn: 200,
        rotor_changes: true,
        error_motors: 40,
        budget_motors: [24, 8],
        cost_motors: 20,
        trials: 10_000,
        compared_trials: 200,
        part_trials: 200,
        latency_motors: 4,
        tolerance_trials: [400, 20],
        commissioned_motors: [100, 10],
        grid_motors: 20,
        grid_benches: "",
        faulty_runs: 10_000,
        calibrations: 200,
        identified: 200,
        learnt_from: 1000,
        tilting_scenes: usize::MAX,
        tilting_error_motors: 8,
        drawn_error_motors: 50,
        tilting_trials: 50,
        tilting_calibrations: 30,
        tilting_gyroscope_motors: 3,
        needed_calibrations: [20, 2],
        needed_longest_s: 400.0,
        time_s: None,
        step_accuracy: step_accuracy::StepAccuracyPlan::full,
    };

    /// Enough to fill every place of a page.
    pub(super) const QUICK: Self = Self {
        paper_seeds: 2,
        stator: SweepEffort::QUICK,
        rotor_seeds: 2,
        rotors_drawn: 4,
        rotor_changes: false,
        error_motors: 2,
        budget_motors: [1, 1],
        cost_motors: 1,
        trials: 20,
        compared_trials: 2,
        part_trials: 2,
        latency_motors: 1,
        tolerance_trials: [2, 0],
        commissioned_motors: [1, 0],
        grid_motors: 1,
        grid_benches: "30,000 frames/s",
        faulty_runs: 5,
        calibrations: 2,
        identified: 4,
        learnt_from: 60,
        tilting_scenes: 1,
        tilting_error_motors: 1,
        drawn_error_motors: 1,
        tilting_trials: 1,
        tilting_calibrations: 1,
        tilting_gyroscope_motors: 1,
        needed_calibrations: [1, 1],
        needed_longest_s: 20.0,
        time_s: Some("6"),
        step_accuracy: step_accuracy::StepAccuracyPlan::quick,
    };

    /// The scene that the pages are of.
    ///
    /// # Errors
    /// When a setting is refused: never, unless its bounds are changed.
    pub(super) fn scene(&self) -> Result<Scene, CommandError> {
        let mut scene = Scene::default();
        if let Some(time_s) = self.time_s {
            scene.set("calibrate.duration_s", time_s)?;
            scene.set("rate.duration_s", time_s)?;
        }
        Ok(scene)
    }
}
