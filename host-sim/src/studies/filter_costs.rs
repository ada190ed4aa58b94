//! `host-sim filters`: what each filter costs, beside how far it is off.
//!
//! Motors are drawn within Table 1's tolerances and driven at full strength from rest in both modes; what their instruments deliver is [recorded](mod@recording), and every
//! [`Variant`] of every [filter](crate::runs::filter) - in both precisions, with the vibrometer's samples at several rates - is [replayed](replay) over the same recordings.
//! The rate of the samples is also the step at which a filter that runs the twin steps it.
//!
//! | figure | meaning |
//! |---|---|
//! | rms | of the error of the angle at the present in steady motion, the camera's latency included |
//! | ns | of a camera update, a vibrometer update and a prediction on this machine; of all that 10 us of motor time bring together |
//! | instructions | the same on a Cortex-M4F, where the emulator counted them ([`crate::board::instructions`]) |
//!
//! In 10 us there come as many samples as the vibrometer's rate says, a tenth of a frame, and one prediction.

mod picture;
pub mod recording;
pub mod replay;
mod tables;

use motor_model::{DriveMode, OutOfBounds};
use rayon::prelude::*;
use serde::Serialize;

use crate::board::instructions::Listing;
use crate::runs::filter::{AnyFilter, FILTERS};
use crate::runs::simulate::Precision;
use crate::scene::Scene;
use crate::studies::StudyError;
use crate::studies::filter_errors::account::Account;
use recording::Recording;
use replay::Cost;

/// How often each cost is measured; the least counts.
pub const ROUNDS: u32 = 10;

/// The drives, with their names in the tables.
const DRIVES: [(DriveMode, &str); 2] = [(DriveMode::B, "b"), (DriveMode::C, "c")];

/// Rates of the vibrometer in Hz, the default's first.
const SAMPLE_RATES_HZ: [f64; 3] = [200e3, 100e3, 50e3];

/// A filter as it is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variant {
    /// Its name, as a scene picks it.
    pub filter: &'static str,
    /// Its arithmetic.
    pub precision: Precision,
    /// Rate of the vibrometer's samples in Hz.
    pub sample_rate_hz: f64,
}

/// One variant in one mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The filter.
    pub filter: &'static str,
    /// `f32` or `f64`.
    pub precision: Precision,
    /// Rate of the vibrometer's samples.
    pub ldv_sample_rate_hz: f64,
    /// The mode: b or c.
    pub drive: &'static str,
    /// Root mean square error of the angle at the present in steady motion.
    pub rms_angle_mdeg: f64,
    /// Root mean square error of the rate.
    pub rms_rate_rad_s: f64,
    /// What it takes on this machine.
    pub ns: Cost,
    /// What it takes on a Cortex-M4F, in instructions; counted for `f32` at the default rate.
    pub instructions: Option<Cost>,
    /// Motors.
    pub runs: u64,
}

/// Everything to be run.
#[derive(Clone, Debug)]
pub struct Plan {
    scenes: Vec<Scene>,
    /// How often each cost is measured; the least counts.
    rounds: u32,
}

/// What came out: rows by drive, then filter, precision and rate.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The rows.
    pub rows: Vec<Row>,
}

impl Variant {
    /// All, by filter, precision and rate.
    pub fn all() -> impl Iterator<Item = Self> {
        let rates = |filter, precision| {
            SAMPLE_RATES_HZ.map(|sample_rate_hz| Self { filter, precision, sample_rate_hz })
        };
        FILTERS.iter().flat_map(move |&filter| {
            [Precision::F32, Precision::F64].into_iter().flat_map(move |precision| rates(filter, precision))
        })
    }

    fn is(&self, row: &Row) -> bool {
        let same_rate = self.sample_rate_hz.total_cmp(&row.ldv_sample_rate_hz).is_eq();
        (self.filter, self.precision) == (row.filter, row.precision) && same_rate
    }
}

impl Plan {
    /// `plants` motors, named by the scene's seed and those that follow it.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn new(scene: &Scene, plants: u64, rounds: u32) -> Result<Self, StudyError> {
        let drawn = |number: u64| {
            let mut drawn = scene.clone();
            // Beyond the last seed the first follows.
            drawn.set("seed", &scene.seed().wrapping_add(number).to_string())?;
            Ok(drawn)
        };
        let scenes: Result<_, StudyError> = (0..plants).map(drawn).collect();
        Ok(Self { scenes: scenes?, rounds })
    }

    /// Recordings that will be made: what progress is measured in.
    pub fn recordings(&self) -> u64 {
        (self.scenes.len() * DRIVES.len() * SAMPLE_RATES_HZ.len()) as u64
    }

    /// Runs everything, telling `progress` of each recording done with. `counts` are those of the microcontroller, if there are any.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(
        &self,
        counts: Option<&Listing>,
        progress: &(impl Fn() + Sync),
    ) -> Result<Comparison, StudyError> {
        let mut rows = Vec::new();
        for (mode, drive) in DRIVES {
            for rate_hz in SAMPLE_RATES_HZ {
                let variants: Vec<Variant> =
                    Variant::all().filter(|v| v.sample_rate_hz.total_cmp(&rate_hz).is_eq()).collect();
                let accounts = self.accounts(mode, rate_hz, &variants, progress)?;
                let recording = recording(&self.scenes[0], mode, rate_hz)?;
                let costs = replay::costs(&variants, &recording, self.rounds)?;
                for ((variant, account), ns) in variants.iter().zip(&accounts).zip(costs) {
                    let instructions = counts.and_then(|counts| variant.instructions(drive, counts));
                    let runs = self.scenes.len() as u64;
                    rows.push(Row::new(variant, drive, account, ns, instructions, runs));
                }
            }
        }
        // By filter and precision rather than by the rate that a recording has.
        let place = |row: &Row| {
            let drive = DRIVES.iter().position(|(_, drive)| *drive == row.drive);
            (drive, Variant::all().position(|variant| variant.is(row)))
        };
        rows.sort_by_key(place);
        Ok(Comparison { rows })
    }

    /// What the errors of each variant add up to, over all motors.
    fn accounts(
        &self,
        mode: DriveMode,
        rate_hz: f64,
        variants: &[Variant],
        progress: &(impl Fn() + Sync),
    ) -> Result<Vec<Account>, StudyError> {
        let of_motor = |scene: &Scene| {
            let recording = recording(scene, mode, rate_hz)?;
            let accounts: Result<Vec<Account>, _> = variants.iter().map(|v| v.account(&recording)).collect();
            progress();
            Ok(accounts?)
        };
        // One thread's share is one motor; the accounts come back in the order of the list, and are added up in it.
        let of_motors: Result<Vec<Vec<Account>>, StudyError> =
            self.scenes.par_iter().with_max_len(1).map(of_motor).collect();
        let mut total = vec![Account::default(); variants.len()];
        for accounts in of_motors? {
            total.iter_mut().zip(&accounts).for_each(|(total, account)| total.absorb(account));
        }
        Ok(total)
    }
}

fn recording(scene: &Scene, mode: DriveMode, rate_hz: f64) -> Result<Recording, StudyError> {
    let mut scene = scene.clone();
    scene.set("ldv.sample_rate_hz", &rate_hz.to_string())?;
    Recording::make(&scene, mode)
}

impl Variant {
    /// What the errors in steady motion add up to.
    ///
    /// # Errors
    /// As of [`AnyFilter::named`].
    pub fn account(&self, recording: &Recording) -> Result<Account, OutOfBounds> {
        Ok(match self.precision {
            Precision::F32 => replay::account(AnyFilter::<f32>::named(self.filter)?, recording),
            Precision::F64 => replay::account(AnyFilter::<f64>::named(self.filter)?, recording),
        })
    }

    /// The instructions of its operations on the microcontroller; `None` where they were not counted.
    fn instructions(&self, drive: &str, counts: &Listing) -> Option<Cost> {
        let counted =
            self.precision == Precision::F32 && self.sample_rate_hz.total_cmp(&SAMPLE_RATES_HZ[0]).is_eq();
        let mean = |operation: &str| {
            let name = format!("{}_{drive}_{operation}", self.filter);
            counts
                .counts
                .iter()
                .find(|count| count.operation == name)
                .map(crate::board::instructions::Count::mean)
        };
        counted.then_some(())?;
        Some(Cost::new(
            mean("camera_frame")?,
            mean("vibrometer_sample")?,
            mean("prediction")?,
            self.sample_rate_hz,
        ))
    }
}

impl Row {
    fn new(
        variant: &Variant,
        drive: &'static str,
        account: &Account,
        ns: Cost,
        instructions: Option<Cost>,
        runs: u64,
    ) -> Self {
        Self {
            filter: variant.filter,
            precision: variant.precision,
            ldv_sample_rate_hz: variant.sample_rate_hz,
            drive,
            rms_angle_mdeg: account.rms_angle_mdeg(),
            rms_rate_rad_s: account.rms_rate_rad_s(),
            ns,
            instructions,
            runs,
        }
    }
}
