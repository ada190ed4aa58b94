//! How far the filters are off the truth, phase by phase, beside a lower bound: `host-sim estimate`.
//!
//! Motors are drawn within Table 1's tolerances ([`simulation::world::plant`]) and driven through one [`timeline`] in
//! both modes. All [filters](simulation::runs::filter) and the genies run on the same frames and samples, every tick of
//! 10 us. Every 70 us their estimates are compared with the truth ([`comparison`]), and the errors are summed by phase
//! ([`analysis::filter_errors::error_sums`]). The scene's settings apply, above all those of the instruments.
//!
//! Filters that are told parts of the truth run beside, if some are asked for ([`told`]): what not knowing them costs.
//!
//! Rows whose name ends in `_smoothed` are of angle and rate [`simulation::runs::filter::SMOOTHER_LAG_MS`] ago, by a
//! filter's smoother. They have no innovations of their own.
//!
//! # What the figures mean
//!
//! | figure | meaning |
//! |---|---|
//! | rms, 99.9 % | of the error of the angle at the present, the camera's latency included |
//! | ANEES | mean of `e' P^-1 e / 2`, e: errors of angle and rate, P: the filter's covariance; 1 if P is right |
//! | ANEES of the angle, of the rate | mean square error of the angle or the rate alone, per its variance |
//! | NIS | mean square of the camera's innovations that were used, each per its variance; 1 if the variance is right |
//! | NIS of gap, of approach | the same of the two measurements that an impact makes of the twin's stator |
//! | whiteness | correlation of neighbouring normalised innovations: 0 in an optimal filter |
//! | good, degraded, unusable | shares of the time with that health of the filter |
//! | false valid | share of the time with good health and a wrong angle (below) |
//!
//! An angle is wrong if it is off by more than six of the filter's standard deviations and 50 milli-degrees.
//!
//! Bounds are two-sided, 95 %, of chi-square. The number of degrees of freedom is estimated from the runs
//! ([`consistency`]). Of a table of a hundred rows five would be outside if every filter were perfect.
//!
//! # What they cannot show
//!
//! At rest the rate is exactly zero when the stator has rung down. Its normalised error is 0 whatever its variance, and
//! ANEES is half of the angle's own, which is tested instead. The stop is mostly rest, and is tested by the upper bound
//! alone ([`consistency::ConsistencyTest`]).

mod beside_table;
pub mod consistency;
mod picture;
mod report;
mod row;
pub(crate) mod tables;
pub(crate) mod told_table;

use motor_model::DriveMode;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::studies::beside::Beside;
use crate::studies::shard::Shard;
use analysis::filter_errors::comparison::{self, ComparedRun, ComparedScope, names};
use analysis::filter_errors::error_sums::ErrorSums;
use analysis::filter_errors::rate_walk::RateWalk;
use analysis::filter_errors::timeline::{self, TimelinePhase};
use analysis::filter_errors::told::{self, ToldPart, ToldSet};
pub use row::{ConsistencyOfRuns, FilterErrorsRow};
use simulation::runs::RunError;
use simulation::runs::filter::FILTERS;
use simulation::runs::stated_errors::StatedErrors;
use simulation::scene::Scene;

/// The drives, with their names in the tables.
const DRIVES: [(DriveMode, &str); 2] = [(DriveMode::B, "b"), (DriveMode::C, "c")];

/// One filter over all phases of one drive, and what it costs.
#[derive(Clone, Debug)]
pub(crate) struct FilterTotal {
    filter: &'static str,
    drive: &'static str,
    stated: StatedErrors,
    /// Share of the time in which the health was good.
    good: f64,
    /// Time in ns that it takes in what a tick brings, on this machine, of the motor that takes least.
    tick_ns: f64,
}

/// The motors to be run, in both modes.
#[derive(Clone, Debug)]
pub struct FilterErrorsPlan {
    /// Numbers of the motors, and their scenes.
    motors: Vec<(u64, Scene)>,
    /// What filters are told, each of its own.
    told: Vec<ToldSet>,
    scope: ComparedScope,
}

/// A motor that was run in both modes, as it is written and read in parts of the study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ComparedMotor {
    /// Its place among all motors.
    pub number: u64,
    /// A run in each of the drives.
    runs: [ComparedRun; 2],
}

/// Motors are equal if their errors are: no two runs have the same cost.
impl PartialEq for ComparedMotor {
    fn eq(&self, other: &Self) -> bool {
        let sums = |motor: &Self| motor.runs.each_ref().map(|run| (run.sums.clone(), run.told.clone()));
        self.number == other.number && sums(self) == sums(other)
    }
}

/// The errors of all filters.
#[derive(Clone, Debug)]
pub struct FilterErrors {
    /// By drive, then phase, then filter.
    pub rows: Vec<FilterErrorsRow>,
    /// Of the filters that were told parts of the truth: by drive, then phase, then what they were told.
    pub told: Vec<FilterErrorsRow>,
    /// The walk of the rate that the camera sees; `None` of no motor.
    pub(crate) walk: Option<RateWalk>,
    /// By drive, then filter.
    totals: Vec<FilterTotal>,
    /// Time that the rig takes for a second of motor time, on this machine, by drive.
    rig_s_per_s: [f64; 2],
    /// Numbers of the motors, in the order of each row's runs.
    numbers: Vec<u64>,
    /// The same study on other scenes.
    beside: Vec<Beside<Self>>,
}

impl FilterErrorsPlan {
    /// `motors` motors, named by the scene's seed and those that follow it.
    ///
    /// # Errors
    /// When the seeds do not suffice, or a scene is refused.
    pub fn new(scene: &Scene, motors: u64) -> Result<Self, RunError> {
        Self::of_part(scene, motors, Shard::ALL)
    }

    /// The motors of a part of them.
    ///
    /// # Errors
    /// When a scene is refused, or the part has no motor.
    pub fn of_part(scene: &Scene, motors: u64, part: Shard) -> Result<Self, RunError> {
        let numbers = part.numbers_of_some(motors, "motors")?;
        let scenes = numbers.into_iter().map(|number| Ok((number, scene.of_run(number)?)));
        let motors = scenes.collect::<Result<_, RunError>>()?;
        Ok(Self { motors, told: Vec::new(), scope: ComparedScope::default() })
    }

    /// The same to the end of the phase `last`: rows of later ones hold no errors.
    #[must_use]
    pub fn until(mut self, last: TimelinePhase) -> Self {
        self.scope.last = last;
        self
    }

    /// The same without genies, whose rows hold no errors.
    #[must_use]
    pub fn without_genies(mut self) -> Self {
        self.scope.genies = false;
        self
    }

    /// The same without smoothers, whose rows hold no errors.
    #[must_use]
    pub fn without_smoothers(mut self) -> Self {
        self.scope.smoothers = false;
        self
    }

    /// The same with filters beside that are told `parts` of the truth: twins that are told each part alone, all but
    /// each, and all, and an `impact_aided` that is told the sign of each kick.
    ///
    /// # Errors
    /// When the motors have no vibrometer that shows impacts: there is no filter then that could be told anything.
    pub fn with_told(mut self, parts: &[ToldPart]) -> Result<Self, RunError> {
        self.told = ToldSet::of_budget(parts);
        let scenes = self.motors.iter().filter(|_| !self.told.is_empty());
        for (_, scene) in scenes {
            told::check(scene)?;
        }
        Ok(self)
    }

    /// Simulated time of all runs: what progress is measured in.
    pub fn milliseconds(&self) -> u64 {
        let runs = DRIVES.len() * self.motors.len();
        timeline::end_nanos(self.scope.last) / 1_000_000 * u64::try_from(runs).unwrap_or(u64::MAX)
    }

    /// Runs everything, and calls `progress` with the milliseconds simulated.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<FilterErrors, RunError> {
        Ok(FilterErrors::of(&self.compared(progress)?))
    }

    /// Runs everything; the motors come in their order.
    ///
    /// # Errors
    /// When a run fails.
    pub fn compared(&self, progress: &(impl Fn(u64) + Sync)) -> Result<Vec<ComparedMotor>, RunError> {
        let places: Vec<(usize, usize)> = (0..DRIVES.len())
            .flat_map(|drive| (0..self.motors.len()).map(move |motor| (drive, motor)))
            .collect();
        // One thread's share is one run; the sums come back in the order of the list, and are added up in it.
        let runs: Result<Vec<ComparedRun>, RunError> = (places.par_iter().with_max_len(1))
            .map(|&(drive, motor)| {
                let (scene, mode) = (&self.motors[motor].1, DRIVES[drive].0);
                comparison::run(scene, mode, &self.told, self.scope, progress)
            })
            .collect();
        let mut in_b = runs?;
        let in_c = in_b.split_off(self.motors.len());
        let pairs = self.motors.iter().zip(in_b.into_iter().zip(in_c));
        Ok(pairs.map(|(&(number, _), (b, c))| ComparedMotor { number, runs: [b, c] }).collect())
    }
}

impl FilterErrors {
    /// The errors over these motors, of one process or of several.
    pub fn of(motors: &[ComparedMotor]) -> Self {
        let of_drives: [Vec<&ComparedRun>; 2] =
            [0, 1].map(|drive| motors.iter().map(|motor| &motor.runs[drive]).collect());
        let each = || DRIVES.iter().zip(&of_drives);
        let least = |runs: &[&ComparedRun]| {
            runs.iter().map(|run| run.cost.rig_s_per_s()).fold(f64::INFINITY, f64::min)
        };
        Self {
            rows: each().flat_map(|((_, drive), runs)| rows_of_drive(drive, runs)).collect(),
            told: each().flat_map(|((_, drive), runs)| told_of_drive(drive, runs)).collect(),
            walk: motors.first().map(|motor| motor.runs[0].walk),
            totals: each().flat_map(|((_, drive), runs)| totals_of_drive(drive, runs)).collect(),
            rig_s_per_s: of_drives.each_ref().map(|runs| least(runs)),
            numbers: motors.iter().map(|motor| motor.number).collect(),
            beside: Vec::new(),
        }
    }
}

/// Each filter over all phases.
fn totals_of_drive(drive: &'static str, runs: &[&ComparedRun]) -> Vec<FilterTotal> {
    let total = |(place, filter): (usize, &&'static str)| {
        let mut sums = ErrorSums::default();
        runs.iter().flat_map(|run| &run.sums[place]).for_each(|of_phase| sums.absorb(of_phase));
        let costs_ns = runs.iter().map(|run| run.cost.filter_ns(place));
        FilterTotal {
            filter,
            drive,
            stated: sums.stated(),
            good: sums.health().0[0],
            tick_ns: costs_ns.fold(f64::INFINITY, f64::min),
        }
    };
    FILTERS.iter().enumerate().map(total).collect()
}

fn rows_of_drive(drive: &'static str, runs: &[&ComparedRun]) -> Vec<FilterErrorsRow> {
    let of_phase = |phase: TimelinePhase| {
        let total = |filter: usize| {
            let mut total = ErrorSums::default();
            for run in runs {
                total.absorb(&run.sums[filter][phase as usize]);
            }
            total
        };
        let totals: Vec<(&str, ErrorSums)> =
            names().enumerate().map(|(filter, name)| (name, total(filter))).collect();
        let genie = totals.iter().find(|(name, _)| *name == comparison::GENIES[0].0);
        let genie_mdeg = genie.map_or(f64::NAN, |(_, sums)| sums.rms_angle_mdeg());
        let row = |(filter, (name, sums)): (usize, &(&'static str, ErrorSums))| {
            let each: Vec<&ErrorSums> = runs.iter().map(|run| &run.sums[filter][phase as usize]).collect();
            FilterErrorsRow::new((name, drive, phase.name()), sums, &each, genie_mdeg)
        };
        totals.iter().enumerate().map(row).collect::<Vec<_>>()
    };
    TimelinePhase::ALL.into_iter().flat_map(of_phase).collect()
}

/// The filters that were told parts of the truth, in every phase.
fn told_of_drive(drive: &'static str, runs: &[&ComparedRun]) -> Vec<FilterErrorsRow> {
    let sets = runs.first().map_or(&[][..], |run| &run.told);
    let row = |phase: TimelinePhase, place: usize, set: &ToldSet| {
        let each: Vec<&ErrorSums> = runs.iter().map(|run| &run.told[place].1[phase as usize]).collect();
        let mut total = ErrorSums::default();
        for run in &each {
            total.absorb(run);
        }
        let genie_mdeg = f64::NAN;
        let row = FilterErrorsRow::new((set.filter(), drive, phase.name()), &total, &each, genie_mdeg);
        FilterErrorsRow { told: Some(set.name()), ..row }
    };
    let of_phase = |phase| sets.iter().enumerate().map(move |(place, (set, _))| row(phase, place, set));
    TimelinePhase::ALL.into_iter().flat_map(of_phase).collect()
}

impl FilterErrors {
    /// The same, with what was found on other scenes beside it.
    #[must_use]
    pub fn with_beside(mut self, mut beside: Vec<Beside<Self>>) -> Self {
        for other in &mut beside {
            let rows = other.found.rows.iter_mut().chain(&mut other.found.told);
            rows.for_each(|row| row.beside = Some(other.name.clone()));
        }
        self.beside = beside;
        self
    }

    /// The rows, then those of the scenes beside the first.
    fn all_rows(&self) -> impl Iterator<Item = &FilterErrorsRow> {
        let own = self.rows.iter().chain(&self.told);
        own.chain(self.beside.iter().flat_map(|other| other.found.rows.iter().chain(&other.found.told)))
    }

    /// The row of a filter.
    pub fn row(&self, filter: &str, drive: &str, phase: TimelinePhase) -> Option<&FilterErrorsRow> {
        self.rows.iter().find(|row| (row.filter, row.drive, row.phase) == (filter, drive, phase.name()))
    }
}
