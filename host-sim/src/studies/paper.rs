//! The printed tables and figures of the paper, simulated again and compared.
//!
//! | module | what it is |
//! |---|---|
//! | [`published`] | what the paper prints |
//! | [`runs`] | the same motors, with the paper's law of friction and five seeds |
//! | [`finite_element`] | the same motors with the stator that finite elements give |
//! | [`comparison`] | the rule for a printed figure |
//! | [`trend`] | the rule for a printed trend |
//! | [`reproduction`] | the result |
//! | [`tables`] | the result as text and Markdown |
//! | [`pictures`] | the result as pictures |
//! | `report` | the result as a report, with the rotors that tilt |

pub mod comparison;
pub mod finite_element;
pub mod pictures;
pub mod published;
mod report;
pub mod reproduction;
pub mod runs;
pub mod tables;
pub mod trend;

use motor_model::DriveMode;

use comparison::FigureComparison;
use finite_element::{OtherStator, ShiftedStator, StatorPart};
use published::{CASES, PaperSection, Quantity, TRENDS};
use reproduction::{FigureRow, PaperReproduction, SimulatedTrend, StepRow};
use runs::{COARSE_STEP_S, CONVERGED_STEP_S, Ensemble, PaperRuns, RunTime, STEP_S};
use simulation::runs::RunError;
use trend::TrendLine;

/// Steps at which mode B of Table 3 is simulated, from the coarse to the converged one.
const MODE_B_STEPS_S: [f64; 7] = [10e-6, 5e-6, 2e-6, 1e-6, 0.5e-6, 0.2e-6, 0.1e-6];

/// Every motor to be simulated: mode B of Table 3 from the converged step to the coarse one, [`CASES`], the cases of
/// mode B at the coarse and at the converged step, [`TRENDS`], and [`finite_element`].
#[derive(Clone, Debug)]
pub struct PaperPlan {
    seeds: u64,
    runs: PaperRuns,
}

impl PaperPlan {
    /// Every case, each motor with the seeds 1 to `seeds`.
    ///
    /// # Errors
    /// When a published motor is out of the model's bounds.
    pub fn new(seeds: u64) -> Result<Self, RunError> {
        let mut runs = PaperRuns::default();
        // The longest runs come first. So no thread still works on one of them when the others have ended.
        for step_s in MODE_B_STEPS_S.into_iter().rev() {
            runs.add(DriveMode::B, &[], step_s, seeds)?;
        }
        for case in CASES {
            runs.add(case.mode, case.changes, STEP_S, seeds)?;
        }
        for case in CASES.iter().filter(|case| case.mode == DriveMode::B) {
            for step_s in [COARSE_STEP_S, CONVERGED_STEP_S] {
                runs.add(case.mode, case.changes, step_s, seeds)?;
            }
        }
        for trend in &TRENDS {
            trend::add_runs(trend, &mut runs, STEP_S, seeds)?;
        }
        let stator = finite_element::stator()?;
        for case in finite_element::cases() {
            runs.add(case.mode, &finite_element::changes(case, &stator), STEP_S, seeds)?;
        }
        for part in &finite_element::PARTS {
            for mode in finite_element::MODES {
                runs.add(mode, &finite_element::part_of(&stator, part), STEP_S, seeds)?;
            }
        }
        for shift_deg in finite_element::SHIFTS_DEG {
            runs.add(DriveMode::C, &finite_element::with_shift(&stator, shift_deg), STEP_S, seeds)?;
        }
        Ok(Self { seeds, runs })
    }

    /// The same runs in so much time.
    #[must_use]
    pub fn within(mut self, time: RunTime) -> Self {
        self.runs = self.runs.within(time);
        self
    }

    /// Number of steps of all runs: the unit of progress.
    pub fn steps(&self) -> u64 {
        self.runs.steps()
    }

    /// Simulates everything. `progress` gets the number of steps of each run that has ended.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<PaperReproduction, RunError> {
        let mut ensembles = self.runs.run(progress)?.into_iter();
        let mut next = |count: usize| ensembles.by_ref().take(count).collect::<Vec<Ensemble>>();
        let steps = MODE_B_STEPS_S.into_iter().rev().zip(next(MODE_B_STEPS_S.len()));
        let steps = steps.map(|(step_s, ensemble)| StepRow {
            step_s,
            collision_frequency_hz: ensemble.spread(Quantity::CollisionFrequency),
            collision_amplitude_mm_s: ensemble.spread(Quantity::CollisionAmplitude),
            rate_rad_s: ensemble.spread(Quantity::Rate),
        });
        let mut rows = Vec::new();
        for (case, ensemble) in CASES.iter().zip(next(CASES.len())) {
            let others = if case.mode == DriveMode::B { next(2) } else { Vec::new() };
            rows.extend(case.figures.iter().map(|figure| FigureRow::new(case, figure, &ensemble, &others)));
        }
        let trends = TRENDS.iter().map(|trend| {
            let of_trend = next(trend::values(trend).count());
            let courses =
                trend.rises.iter().filter_map(|&rises| TrendLine::of(trend, rises, &of_trend)).collect();
            SimulatedTrend { picture: trend.picture, varied: trend.label, courses, trend: *trend }
        });
        let trends = trends.collect();
        let mut of_tables = rows.iter_mut().filter(|row| row.place != PaperSection::ToothAngle);
        for (case, ensemble) in finite_element::cases().zip(next(finite_element::cases().count())) {
            for (figure, row) in case.figures.iter().zip(of_tables.by_ref()) {
                let comparison =
                    FigureComparison::new(figure.quantity, figure.paper, ensemble.spread(figure.quantity));
                let right_sense = ensemble.turns_in_the_sense_of_its_mode();
                row.finite_element = Some(OtherStator { comparison, right_sense });
            }
        }
        let stator_parts = finite_element::PARTS.iter().filter_map(|(changed, _)| match &*next(2) {
            [b, c] => Some(StatorPart::new(changed, [b, c])),
            _ => None,
        });
        let stator_parts = stator_parts.collect();
        let shifts = finite_element::SHIFTS_DEG;
        let shifted =
            shifts.iter().zip(next(shifts.len())).map(|(&deg, ensemble)| ShiftedStator::new(deg, &ensemble));
        let shifted_stators = shifted.collect();
        Ok(PaperReproduction {
            seeds: self.seeds,
            time: self.runs.time(),
            rows,
            mode_b_steps: steps.rev().collect(),
            trends,
            stator_parts,
            shifted_stators,
        })
    }
}
