//! `host-sim estimate`: how far the filters are off the truth, phase by phase, beside a lower bound.
//!
//! Motors are drawn within Table 1's tolerances ([`crate::world::plant`]) and driven through one [`timeline`] in both modes. All [filters](crate::runs::filter) and the [`genie`]s
//! look on at the same frames and samples, every tick of 10 us; every 70 us their estimates are compared with the truth ([`run`]), phase
//! by phase ([`account`]). The scene's settings apply, those of the instruments above all.
//!
//! Rows named `_smoothed` are of angle and rate [`crate::runs::filter::SMOOTHER_LAG_MS`] ago, by a filter's smoother; they have no innovations of their own.
//!
//! # What the figures mean
//!
//! | figure | meaning |
//! |---|---|
//! | rms, 99.9 % | of the error of the angle at the present, the camera's latency included |
//! | ANEES | mean of `e' P^-1 e / 2` for the errors e of angle and rate and the covariance P that the filter gives: 1 if it knows itself. The angle's and the rate's own, each per its variance, stand beside it |
//! | NIS | mean square of the camera's innovations that were used, each per its variance: 1 likewise |
//! | whiteness | correlation of neighbouring normalised innovations: 0 in an optimal filter |
//! | good, degraded, unusable | shares of the time in which the filter's health was that |
//! | false valid | share of the time in which it was good and the angle wrong by more than six of the filter's standard deviations and 50 milli-degrees |
//!
//! Bounds are two-sided, 95 %, of chi-square, with as many degrees of freedom as the runs show there to be ([`consistency`]). Of a table of a hundred rows
//! five would be outside if every filter were perfect.
//!
//! # What they cannot show
//!
//! At rest the rate is exactly zero once the stator has rung down: its normalised error is 0 whatever its variance, and ANEES half of the angle's own, which is
//! judged in its place. The stop is mostly rest, and judged by the upper bound alone ([`consistency::Asked`]).

pub mod account;
pub mod consistency;
pub mod genie;
mod picture;
pub mod run;
mod tables;
pub mod timeline;

use motor_model::DriveMode;
use rayon::prelude::*;
use serde::Serialize;

use crate::scene::Scene;
use crate::studies::StudyError;
use account::Account;
use consistency::{Asked, correlation_bound, mean_square_bounds};
use run::{Accounts, names};
use timeline::Phase;

/// The drives, with their names in the tables.
const DRIVES: [(DriveMode, &str); 2] = [(DriveMode::B, "b"), (DriveMode::C, "c")];

/// One filter in one phase of one drive, over all plants.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The filter.
    pub filter: &'static str,
    /// The mode that the run is about: b or c.
    pub drive: &'static str,
    /// The phase.
    pub phase: &'static str,
    /// Root mean square error of the angle.
    pub rms_angle_mdeg: f64,
    /// What 99.9 % of the errors' magnitudes do not exceed.
    pub p999_angle_mdeg: f64,
    /// Root mean square error of the rate.
    pub rms_rate_rad_s: f64,
    /// `rms_angle_mdeg` per that of the genie that knows every kick.
    pub times_genie: f64,
    /// Mean normalised squared error of angle and rate together, per degree of freedom.
    pub anees: f64,
    /// Its 95 % bounds.
    pub anees_bounds: (f64, f64),
    /// Mean normalised squared error of the angle.
    pub angle_anees: f64,
    /// Its 95 % bounds.
    pub angle_anees_bounds: (f64, f64),
    /// Mean normalised squared error of the rate.
    pub rate_anees: f64,
    /// Mean normalised squared innovation of the camera; `null` if none was used.
    pub nis: f64,
    /// Its 95 % bounds.
    pub nis_bounds: (f64, f64),
    /// Correlation of neighbouring innovations.
    pub whiteness: f64,
    /// Its 95 % bound, either way.
    pub whiteness_bound: f64,
    /// Share of the measurements that were rejected.
    pub rejected: f64,
    /// How often the filter began anew, its start included, over all runs.
    pub restarts: u64,
    /// Share of the time without an estimate.
    pub missing: f64,
    /// Share of the time in which the health was good.
    pub good: f64,
    /// Share of the time in which it was degraded.
    pub degraded: f64,
    /// Share of the time in which the estimate was not to be used.
    pub unusable: f64,
    /// Share of the time in which the health was good and the angle wrong.
    pub false_valid: f64,
    /// Runs.
    pub runs: u64,
}

/// Everything to be run.
#[derive(Clone, Debug)]
pub struct Plan {
    runs: Vec<(DriveMode, Scene)>,
}

/// What came out: rows by drive, then phase, then filter.
#[derive(Clone, Debug)]
pub struct Estimation {
    /// The rows.
    pub rows: Vec<Row>,
}

impl Plan {
    /// `plants` motors, named by the scene's seed and those that follow it.
    ///
    /// # Errors
    /// When the seeds do not suffice, or a scene is refused.
    pub fn new(scene: &Scene, plants: u64) -> Result<Self, StudyError> {
        let of_plant = |number: u64| {
            let mut drawn = scene.clone();
            // Beyond the last seed the first follows.
            drawn.set("seed", &scene.seed().wrapping_add(number).to_string())?;
            Ok(drawn)
        };
        let scenes: Result<Vec<Scene>, StudyError> = (0..plants).map(of_plant).collect();
        let scenes = scenes?;
        let runs = DRIVES.iter().flat_map(|(mode, _)| scenes.iter().map(|scene| (*mode, scene.clone())));
        Ok(Self { runs: runs.collect() })
    }

    /// Simulated time of all runs: what progress is measured in.
    pub fn milliseconds(&self) -> u64 {
        timeline::duration_nanos() / 1_000_000 * u64::try_from(self.runs.len()).unwrap_or(u64::MAX)
    }

    /// Runs everything, telling `progress` of the milliseconds simulated.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> Result<Estimation, StudyError> {
        // One thread's share is one run; the accounts come back in the order of the list, and are added up in it.
        let accounts: Result<Vec<Vec<Accounts>>, StudyError> = (self.runs.par_iter().with_max_len(1))
            .map(|(mode, scene)| run::run(scene, *mode, progress))
            .collect();
        let accounts = accounts?;
        let of_drives = DRIVES.iter().zip(accounts.chunks(self.runs.len() / DRIVES.len()));
        let rows = of_drives.flat_map(|((_, drive), runs)| rows_of_drive(drive, runs));
        Ok(Estimation { rows: rows.collect() })
    }
}

fn rows_of_drive(drive: &'static str, runs: &[Vec<Accounts>]) -> Vec<Row> {
    let of_phase = |phase: Phase| {
        let total = |filter: usize| {
            let mut total = Account::default();
            for run in runs {
                total.absorb(&run[filter][phase as usize]);
            }
            total
        };
        let totals: Vec<(&str, Account)> =
            names().enumerate().map(|(filter, name)| (name, total(filter))).collect();
        let genie = totals.iter().find(|(name, _)| *name == run::GENIES[0].0);
        let genie_mdeg = genie.map_or(f64::NAN, |(_, account)| account.rms_angle_mdeg());
        let row = |(filter, (name, account)): (usize, &(&'static str, Account))| {
            let each: Vec<&Account> = runs.iter().map(|run| &run[filter][phase as usize]).collect();
            Row::new((name, drive, phase.name()), account, &each, genie_mdeg)
        };
        totals.iter().enumerate().map(row).collect::<Vec<_>>()
    };
    Phase::ALL.into_iter().flat_map(of_phase).collect()
}

impl Row {
    fn new(
        (filter, drive, phase): (&'static str, &'static str, &'static str),
        account: &Account,
        runs: &[&Account],
        genie_mdeg: f64,
    ) -> Self {
        let ([good, degraded, unusable], false_valid) = account.health();
        let ([angle_anees, rate_anees, anees], (nis, whiteness)) =
            (account.normalised(), account.innovations());
        let bounds_of = |value: fn(&Account) -> f64| mean_square_bounds(runs.iter().map(|run| value(run)));
        Self {
            filter,
            drive,
            phase,
            rms_angle_mdeg: account.rms_angle_mdeg(),
            p999_angle_mdeg: account.p999_angle_mdeg(),
            rms_rate_rad_s: account.rms_rate_rad_s(),
            times_genie: account.rms_angle_mdeg() / genie_mdeg,
            anees,
            anees_bounds: bounds_of(|run| run.normalised()[2]),
            angle_anees,
            angle_anees_bounds: bounds_of(|run| run.normalised()[0]),
            rate_anees,
            nis,
            nis_bounds: bounds_of(|run| run.innovations().0),
            whiteness,
            whiteness_bound: correlation_bound(runs.iter().map(|run| run.innovations().1)),
            rejected: account.rejected(),
            restarts: account.restarts(),
            missing: account.missing(),
            good,
            degraded,
            unusable,
            false_valid,
            runs: runs.len() as u64,
        }
    }

    /// Whether the errors are as large as the filter says, as far as that can be asked.
    pub fn errors_within(&self, phase: Phase) -> bool {
        match Asked::of(phase) {
            Asked::Both => within(self.anees, self.anees_bounds),
            Asked::Angle => within(self.angle_anees, self.angle_anees_bounds),
            Asked::AtMost => self.anees <= self.anees_bounds.1,
        }
    }

    /// Whether the innovations are; so they are where there are none.
    pub fn innovations_within(&self) -> bool {
        self.nis.is_nan() || within(self.nis, self.nis_bounds)
    }

    /// Whether neighbouring innovations have nothing in common; so they have where there are none.
    pub fn innovations_white(&self) -> bool {
        self.whiteness.is_nan() || self.whiteness.abs() <= self.whiteness_bound
    }
}

fn within(value: f64, (low, high): (f64, f64)) -> bool {
    value >= low && value <= high
}

impl Estimation {
    /// The row of a filter.
    pub fn row(&self, filter: &str, drive: &str, phase: Phase) -> Option<&Row> {
        self.rows.iter().find(|row| (row.filter, row.drive, row.phase) == (filter, drive, phase.name()))
    }
}
