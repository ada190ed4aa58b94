//! Whether the intervals hold what they promise: motors are drawn, recorded, identified and compared with what they
//! were.
//!
//! Simulation-based calibration (Talts, Betancourt, Simpson, Vehtari, Gelman, arXiv 1804.06788, 2018): of a right
//! posterior the rank of the truth among L values of its sample is uniform over 0 to L, and a 90 % interval holds the
//! truth in 90 % of the motors. All motors are recorded under the same drives: one set of regressions serves all.

use rayon::prelude::*;
use serde::Serialize;

use super::outcome::interval;
use super::{Effort, IdentificationError};
use crate::report::document::{Block, Document, Table};
use crate::report::page::PlacedValue;
use analysis::identification::candidates;
use analysis::identification::emulator::Emulator;
use analysis::identification::parameters::{self, Unknown};
use analysis::identification::posterior::posterior;
use analysis::identification::training::{DrawnMotor, Setting, draw_motors};
use simulation::math::count::real;
use simulation::math::statistics::{Spread, binomial_bounds};
use simulation::runs::RunError;
use simulation::scene::Scene;

/// Ranks are from 0 to this.
const RANK_MAX: usize = 99;
/// Bins of the histogram of ranks.
pub const BINS: usize = 10;
/// What is recorded of the motor.
const OF_MOTOR: &str =
    "(b:1 for 0.1, off for 0.05, c:1 for 0.1, off for 0.05, b:0.5 for 0.1, off for 0.05) x2";
/// What is recorded of its bare stator.
const OF_STATOR: &str = "(b:1 for 0.03, off for 0.02, c:1 for 0.03, off for 0.02) x2";

/// Motors that are drawn, recorded and identified.
#[derive(Clone, Debug)]
pub struct CalibrationPlan {
    settings: Vec<Setting>,
    unknowns: Vec<Unknown>,
    rotor: &'static str,
    motors: u64,
    effort: Effort,
}

/// How often the intervals of a parameter hold the truth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CalibratedParameter {
    /// Key of the design.
    pub key: &'static str,
    /// Motors whose 90 % interval holds the truth.
    pub covered: u32,
    /// Motors.
    pub motors: u32,
    /// Of how many of a 90 % interval the number lies with 95 % probability.
    pub expected: (u32, u32),
    /// Mean standard deviation after the recordings per that before.
    pub narrowing: f64,
    /// Truth less mean of the posterior, in its standard deviations: mean and spread over the motors.
    pub error: Spread,
    /// Motors by the rank of the truth, in [`BINS`] bins.
    pub ranks: Vec<u32>,
}

/// The intervals of all parameters that are told.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Calibration {
    /// How the rotor moves.
    pub rotor: &'static str,
    /// The parameters that are told.
    pub parameters: Vec<CalibratedParameter>,
    /// Motors from which the regressions were learnt.
    pub learnt_from: u64,
}

/// A parameter of one motor.
struct Case {
    rank: usize,
    covered: bool,
    narrowing: f64,
    error: f64,
}

impl CalibrationPlan {
    /// `motors` motors of the design and the instruments of `scene`.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn new(scene: &Scene, motors: u64, effort: Effort) -> Result<Self, IdentificationError> {
        Self::under(scene, [OF_MOTOR, OF_STATOR], motors, effort)
    }

    /// The same under these schedules, of the motor and of its bare stator.
    pub(super) fn under(
        scene: &Scene,
        [of_motor_schedule, of_stator_schedule]: [&str; 2],
        motors: u64,
        effort: Effort,
    ) -> Result<Self, IdentificationError> {
        let unknowns = parameters::unknowns(scene, effort.prior_width)?;
        let mut of_motor = scene.clone();
        of_motor.set("record.model", "motor")?;
        of_motor.set("record.schedule", of_motor_schedule)?;
        let mut of_stator = candidates::instruments_of(scene, "stator")?;
        of_stator.set("record.model", "stator")?;
        of_stator.set("record.schedule", of_stator_schedule)?;
        let settings =
            vec![Setting::planned(of_motor, &unknowns, 0)?, Setting::planned(of_stator, &unknowns, 1)?];
        Ok(Self { settings, unknowns, rotor: scene.choice("plant.rotor"), motors, effort })
    }

    /// Number of motors that are recorded.
    pub fn work(&self) -> u64 {
        self.motors + self.effort.motors
    }

    /// Runs it; `done` is called after each motor.
    ///
    /// # Errors
    /// When the model refuses a motor.
    pub fn run(&self, done: &(impl Fn() + Sync)) -> Result<Calibration, RunError> {
        let Self { settings, unknowns, effort, .. } = self;
        let learnt_from = draw_motors(settings, unknowns, effort.seed, effort.motors, done)?;
        let mut found = Calibration { rotor: self.rotor, parameters: Vec::new(), learnt_from: effort.motors };
        let Some(emulator) = Emulator::learn(&learnt_from) else { return Ok(found) };
        let others = draw_motors(settings, unknowns, effort.seed + 1, self.motors, done)?;
        let cases: Vec<Vec<Case>> = others
            .par_iter()
            .enumerate()
            .map(|(number, motor)| cases(&emulator, unknowns, motor, number as u64))
            .collect();
        for (place, number) in emulator.told.iter().enumerate() {
            let of_all: Vec<&Case> = cases.iter().filter_map(|motor| motor.get(place)).collect();
            found.parameters.push(CalibratedParameter::of(unknowns[*number].key, &of_all));
        }
        Ok(found)
    }
}

/// What stands on the page of results.
pub(crate) fn page_values(height_only: &Calibration, tilting: &Calibration) -> Vec<PlacedValue> {
    let share = |found: &Calibration| {
        let (covered, all) = found.coverage();
        format!("{:.1}", 100.0 * real(covered) / f64::max(real(all), 1.0))
    };
    let all = || height_only.parameters.iter().chain(&tilting.parameters);
    let number = |holds: fn(&CalibratedParameter) -> bool| {
        all().filter(|parameter| holds(parameter)).count().to_string()
    };
    let motors = height_only.parameters.first().map_or(0, |parameter| parameter.motors);
    vec![
        ("motors", motors.to_string()),
        ("learnt", height_only.learnt_from.to_string()),
        ("share_height_only", share(height_only)),
        ("share_tilting", share(tilting)),
        ("too_wide", number(|parameter| parameter.covered > parameter.expected.1)),
        ("too_narrow", number(|parameter| parameter.covered < parameter.expected.0)),
        ("told_height_only", height_only.parameters.len().to_string()),
        ("told_tilting", tilting.parameters.len().to_string()),
        ("table_height_only", height_only.table().markdown()),
        ("table_tilting", tilting.table().markdown()),
    ]
}

/// The parameters of one motor that are told.
fn cases(emulator: &Emulator, unknowns: &[Unknown], motor: &DrawnMotor, seed: u64) -> Vec<Case> {
    let sample = posterior(emulator, unknowns, &motor.statistics, seed);
    let case = |(place, number): (usize, &usize)| {
        let truth = motor.standard[*number];
        let mut values: Vec<f64> = sample.iter().map(|told| told[place]).collect();
        let spread: Spread = values.iter().copied().collect();
        values.sort_by(f64::total_cmp);
        let below = values.partition_point(|value| *value < truth);
        // Of L values that are spread evenly over the sample.
        let rank = below * (RANK_MAX + 1) / (values.len() + 1);
        let covered = interval(&values).is_some_and(|[low, high]| (low..=high).contains(&truth));
        Case { rank, covered, narrowing: spread.sd, error: (truth - spread.mean) / spread.sd }
    };
    emulator.told.iter().enumerate().map(case).collect()
}

impl CalibratedParameter {
    fn of(key: &'static str, cases: &[&Case]) -> Self {
        let mut ranks = vec![0; BINS];
        for case in cases {
            ranks[case.rank * BINS / (RANK_MAX + 1)] += 1;
        }
        let motors = u32::try_from(cases.len()).unwrap_or(u32::MAX);
        Self {
            key,
            covered: cases.iter().map(|case| u32::from(case.covered)).sum(),
            motors,
            expected: binomial_bounds(motors, 0.9),
            narrowing: cases.iter().map(|case| case.narrowing).collect::<Spread>().mean,
            error: cases.iter().map(|case| case.error).collect(),
            ranks,
        }
    }

    /// Pearson's chi-square of the histogram of ranks: of a right posterior about 9 +- 4.
    pub fn chi_square(&self) -> f64 {
        let expected = real(self.motors) / real(BINS);
        self.ranks.iter().map(|count| (real(*count) - expected) * (real(*count) - expected) / expected).sum()
    }
}

impl Calibration {
    /// Motors whose interval holds the truth, of all parameters, and how many there are.
    pub fn coverage(&self) -> (u32, u32) {
        let sum = |of: fn(&CalibratedParameter) -> u32| self.parameters.iter().map(of).sum();
        (sum(|parameter| parameter.covered), sum(|parameter| parameter.motors))
    }

    /// The coverage of each parameter.
    pub(crate) fn table(&self) -> Table {
        let mut table =
            Table::new(&["parameter", "covered", "95 % of", "left", "error, sd", "ranks, ten bins"]);
        for parameter in &self.parameters {
            let CalibratedParameter { key, covered, motors, expected: (low, high), narrowing, error, ranks } =
                parameter;
            let percent = |count: u32| format!("{:.1} %", 100.0 * real(count) / f64::max(real(*motors), 1.0));
            let ranks: Vec<String> = ranks.iter().map(u32::to_string).collect();
            table.push(vec![
                key.trim_start_matches("motor.").to_owned(),
                percent(*covered),
                format!("{} to {}", percent(*low), percent(*high)),
                format!("{:.2}", narrowing.max(0.0)),
                format!("{:+.2} +- {:.2}", error.mean, error.sd),
                ranks.join(" "),
            ]);
        }
        table
    }

    /// Everything that is said.
    pub fn document(&self) -> Document {
        let (covered, all) = self.coverage();
        let motors = self.parameters.first().map_or(0, |parameter| parameter.motors);
        let share = 100.0 * real(covered) / f64::max(real(all), 1.0);
        let said = format!(
            "Rotor {}, {motors} motors: 90 % intervals of {} parameters hold the truth in {share:.1} % of the cases.",
            self.rotor.replace('_', " "),
            self.parameters.len()
        );
        Document { blocks: vec![Block::Paragraph(said), Block::Table(self.table())] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The page counts the intervals that lie outside of their bounds, of either rotor; a bound itself is inside.
    #[test]
    fn exact_wide_and_narrow_intervals_are_counted() {
        let of = |rotor, covered: &[u32]| {
            let parameter = |&covered: &u32| CalibratedParameter {
                covered,
                motors: 200,
                expected: (171, 188),
                ..CalibratedParameter::of("motor.friction", &[])
            };
            Calibration { rotor, parameters: covered.iter().map(parameter).collect(), learnt_from: 1000 }
        };
        let values = page_values(&of("height_only", &[188, 170, 171]), &of("tilting", &[189, 180, 200]));
        let value = |name| values.iter().find(|(place, _)| *place == name).map(|(_, value)| value.as_str());
        assert_eq!((value("too_wide"), value("too_narrow")), (Some("2"), Some("1")));
    }
}
