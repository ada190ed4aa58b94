//! The published tables and figures, simulated again and set side by side.
//!
//! [`published`] holds what the paper prints, [`campaign`] runs the same motors (paper's friction law, five seeds as it
//! did), [`verdict`] and [`trend`] judge, [`tables`] says it in text, Markdown and JSON, [`pictures`] draws it.

pub mod campaign;
pub mod pictures;
pub mod published;
pub mod tables;
pub mod trend;
pub mod verdict;

use serde::{Serialize, Serializer};

use crate::math::statistics::Spread;
use crate::studies::StudyError;
use campaign::{Campaign, Ensemble};
use motor_model::DriveMode;
use published::{CASES, Case, Figure, Place, Quantity, TRENDS, Trend};
use trend::Course;
use verdict::Comparison;

/// Step of every run unless the step itself is the subject.
pub const STEP_S: f64 = 1e-6;
/// Step that gives the paper's rates in mode B.
pub const COARSE_STEP_S: f64 = 10e-6;
/// Step below which mode B's rate no longer changes.
pub const CONVERGED_STEP_S: f64 = 0.1e-6;
/// Steps of the study of mode B, from the coarse to the converged.
pub const MODE_B_STEPS_S: [f64; 7] = [10e-6, 5e-6, 2e-6, 1e-6, 0.5e-6, 0.2e-6, 0.1e-6];

/// A published figure, ours, and the verdict.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Where the paper prints it.
    #[serde(serialize_with = "as_words")]
    pub place: Place,
    /// The motor, in words.
    pub case: &'static str,
    /// The quantity, in words.
    #[serde(serialize_with = "as_words")]
    pub quantity: Quantity,
    /// Its unit.
    pub unit: &'static str,
    /// Decimals with which the paper prints it.
    pub decimals: usize,
    /// Experiment: mean and standard deviation, where the paper gives them.
    pub experiment: Option<(f64, Option<f64>)>,
    /// Paper and ours.
    pub comparison: Comparison,
    /// Whether every seed turned the way its mode should.
    pub right_sense: bool,
    /// Mode B only: the same at [`COARSE_STEP_S`].
    pub coarse: Option<Comparison>,
    /// Mode B only: the same at [`CONVERGED_STEP_S`].
    pub converged: Option<Comparison>,
}

/// Mode B of Table 3 at one step.
#[derive(Clone, Debug, Serialize)]
pub struct StepRow {
    /// The step.
    pub step_s: f64,
    /// Collision frequency.
    pub collision_frequency_hz: Spread,
    /// Collision amplitude.
    pub collision_amplitude_mm_s: Spread,
    /// Rate.
    pub rate_rad_s: Spread,
}

/// A trend and its two courses.
#[derive(Clone, Debug, Serialize)]
pub struct TrendResult {
    /// Number of the paper's picture.
    pub picture: u8,
    /// What is varied.
    pub varied: &'static str,
    /// Frequency and rate.
    pub courses: Vec<Course>,
    /// What is varied, as data.
    #[serde(skip)]
    pub trend: Trend,
}

/// Everything that was simulated again.
#[derive(Clone, Debug, Serialize)]
pub struct Reproduction {
    /// Seeds of each motor.
    pub seeds: u64,
    /// Every printed figure.
    pub rows: Vec<Row>,
    /// Mode B against the step.
    pub mode_b_steps: Vec<StepRow>,
    /// Figs 10 and 11.
    pub trends: Vec<TrendResult>,
}

/// Serializes what can be displayed by its words.
fn as_words<S: Serializer>(value: &impl std::fmt::Display, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(value)
}

impl Row {
    /// `figure` of `case` beside the ensembles at the usual step and, for mode B, at the coarse and the converged one.
    fn new(case: &Case, figure: &Figure, ensemble: &Ensemble, others: Option<[&Ensemble; 2]>) -> Self {
        let Figure { quantity, paper, experiment } = *figure;
        let compared = |ensemble: &Ensemble| Comparison::new(quantity, paper, ensemble.spread(quantity));
        let [coarse, converged] = others.map_or([None, None], |both| both.map(|other| Some(compared(other))));
        Self {
            place: case.place,
            case: case.label,
            quantity,
            unit: quantity.unit(),
            decimals: paper.decimals(quantity),
            experiment: experiment.map(|printed| (printed.mean, printed.sd)),
            comparison: compared(ensemble),
            right_sense: ensemble.turns_the_right_way(),
            coarse,
            converged,
        }
    }
}

/// Everything to be simulated, and where its results will stand.
#[derive(Clone, Debug)]
pub struct Plan {
    seeds: u64,
    campaign: Campaign,
    cases: Vec<usize>,
    /// Of each mode B case, at the coarse and the converged step.
    other_steps: Vec<Option<[usize; 2]>>,
    mode_b_steps: Vec<usize>,
    trends: Vec<Vec<usize>>,
}

impl Plan {
    /// Every case with `seeds` seeds each.
    ///
    /// # Errors
    /// When a published motor is out of the model's bounds.
    pub fn new(seeds: u64) -> Result<Self, StudyError> {
        let mut campaign = Campaign::default();
        // The longest first, so that no thread is left alone with them at the end.
        let mode_b_steps: Result<_, _> = MODE_B_STEPS_S
            .iter()
            .rev()
            .map(|step_s| campaign.add(DriveMode::B, &[], *step_s, seeds))
            .collect();
        let cases: Result<_, _> =
            CASES.iter().map(|case| campaign.add(case.mode, case.changes, STEP_S, seeds)).collect();
        let other_steps: Result<_, _> = CASES
            .iter()
            .map(|case| {
                let mut at = |step_s| campaign.add(case.mode, case.changes, step_s, seeds);
                let is_mode_b = case.mode == DriveMode::B;
                Ok::<_, StudyError>(if is_mode_b {
                    Some([at(COARSE_STEP_S)?, at(CONVERGED_STEP_S)?])
                } else {
                    None
                })
            })
            .collect();
        let trends: Result<_, _> =
            TRENDS.iter().map(|trend| trend::plan(trend, &mut campaign, STEP_S, seeds)).collect();
        Ok(Self {
            seeds,
            cases: cases?,
            other_steps: other_steps?,
            mode_b_steps: mode_b_steps?,
            trends: trends?,
            campaign,
        })
    }

    /// Number of steps in all: what progress is measured in.
    pub fn steps(&self) -> u64 {
        self.campaign.steps()
    }

    /// Simulates everything, telling `progress` of the steps done.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<Reproduction, StudyError> {
        let ensembles = self.campaign.run(progress)?;
        let places = self.cases.iter().zip(&self.other_steps);
        let rows = CASES.iter().zip(places).flat_map(|(case, (&index, others))| {
            let others = others.map(|both| both.map(|other| &ensembles[other]));
            let row = |figure| Row::new(case, figure, &ensembles[index], others);
            case.figures.iter().map(row).collect::<Vec<_>>()
        });
        let steps =
            MODE_B_STEPS_S.iter().zip(self.mode_b_steps.iter().rev()).map(|(&step_s, &index)| StepRow {
                step_s,
                collision_frequency_hz: ensembles[index].spread(Quantity::CollisionFrequency),
                collision_amplitude_mm_s: ensembles[index].spread(Quantity::CollisionAmplitude),
                rate_rad_s: ensembles[index].spread(Quantity::Rate),
            });
        let trends = TRENDS.iter().zip(&self.trends).map(|(trend, indices)| {
            let of_trend: Vec<&Ensemble> = indices.iter().map(|&index| &ensembles[index]).collect();
            let courses =
                trend.rises.iter().filter_map(|&rises| Course::of(trend, rises, &of_trend)).collect();
            TrendResult { picture: trend.picture, varied: trend.label, courses, trend: *trend }
        });
        Ok(Reproduction {
            seeds: self.seeds,
            rows: rows.collect(),
            mode_b_steps: steps.collect(),
            trends: trends.collect(),
        })
    }
}

impl Reproduction {
    /// The reproduction as one JSON object on one line.
    pub fn json(&self) -> String {
        crate::report::files::json_line(self)
    }
}
