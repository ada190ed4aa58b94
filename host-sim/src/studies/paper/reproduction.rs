//! The result of the study: each printed figure beside the simulated one, mode B against the step, and the trends.

use serde::Serialize;

use super::comparison::FigureComparison;
use super::finite_element::{OtherStator, ShiftedStator, StatorPart};
use super::published::{PaperSection, PublishedCase, PublishedFigure, PublishedTrend, Quantity, as_words};
use super::runs::{Ensemble, RunTime};
use super::trend::TrendLine;
use simulation::math::statistics::Spread;

/// A published figure beside the simulated one.
#[derive(Clone, Debug, Serialize)]
pub struct FigureRow {
    /// Where the paper prints it.
    #[serde(serialize_with = "as_words")]
    pub place: PaperSection,
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
    /// The paper's figure and ours at the usual step.
    pub comparison: FigureComparison,
    /// Whether every run turned in the sense of its mode.
    pub right_sense: bool,
    /// Mode B only: the comparison at [`super::runs::COARSE_STEP_S`].
    pub coarse: Option<FigureComparison>,
    /// Mode B only: the comparison at [`super::runs::CONVERGED_STEP_S`].
    pub converged: Option<FigureComparison>,
    /// Tables 2 and 3: the comparison with the stator of finite elements.
    pub finite_element: Option<OtherStator>,
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
    /// Mean rate of the rotor.
    pub rate_rad_s: Spread,
}

/// A trend of the paper, simulated again.
#[derive(Clone, Debug, Serialize)]
pub struct SimulatedTrend {
    /// Number of the paper's picture.
    pub picture: u8,
    /// What is varied.
    pub varied: &'static str,
    /// Collision frequency and rate against the parameter.
    pub courses: Vec<TrendLine>,
    /// The published trend.
    #[serde(skip)]
    pub trend: PublishedTrend,
}

/// All figures that were simulated again.
#[derive(Clone, Debug, Serialize)]
pub struct PaperReproduction {
    /// Runs of each motor.
    pub seeds: u64,
    /// The time of each run, unless it is the full one.
    #[serde(skip_serializing_if = "RunTime::is_full")]
    pub time: RunTime,
    /// Every printed figure.
    pub rows: Vec<FigureRow>,
    /// Mode B against the step.
    pub mode_b_steps: Vec<StepRow>,
    /// Figs 10 and 11.
    pub trends: Vec<SimulatedTrend>,
    /// Both modes of Table 3 with groups of the values of the stator of finite elements.
    pub stator_parts: Vec<StatorPart>,
    /// Mode C of Table 3 with that stator and the mode shifts that finite elements leave open.
    pub shifted_stators: Vec<ShiftedStator>,
}

impl FigureRow {
    /// `figure` of `case` beside the runs at the usual step.
    /// `others` holds the runs at the coarse and at the converged step, if there are any.
    pub fn new(
        case: &PublishedCase,
        figure: &PublishedFigure,
        ensemble: &Ensemble,
        others: &[Ensemble],
    ) -> Self {
        let PublishedFigure { quantity, paper, experiment } = *figure;
        let compared =
            |ensemble: &Ensemble| FigureComparison::new(quantity, paper, ensemble.spread(quantity));
        Self {
            place: case.place,
            case: case.label,
            quantity,
            unit: quantity.unit(),
            decimals: paper.decimals(quantity),
            experiment: experiment.map(|printed| (printed.mean, printed.sd)),
            comparison: compared(ensemble),
            right_sense: ensemble.turns_in_the_sense_of_its_mode(),
            coarse: others.first().map(compared),
            converged: others.get(1).map(compared),
            finite_element: None,
        }
    }
}
