//! What each filter costs, beside how far it is off: `host-sim filters`.
//!
//! Motors are drawn within Table 1's tolerances and driven at full strength from rest in both modes. What their
//! instruments deliver is [recorded](analysis::filter_costs::recording). Every [`FilterVariant`] of every
//! [filter](simulation::runs::filter) is [replayed](analysis::filter_costs::replay) over the same recordings, in both
//! precisions and with the vibrometer's samples at several rates. A filter with a twin steps it at the rate of the
//! samples.
//!
//! | figure | meaning |
//! |---|---|
//! | rms | of the error of the angle at the present in steady motion, the camera's latency included |
//! | ns | of a camera update, a vibrometer update and a prediction on this machine, and of all of them in 10 us |
//! | instructions | the same on a Cortex-M4F, where the emulator counted them ([`crate::board::instructions`]) |
//!
//! In 10 us of motor time there are a tenth of a frame, one prediction, and samples at the rate of the vibrometer.

mod picture;
mod report;
mod tables;

use motor_model::DriveMode;
use rayon::prelude::*;
use serde::Serialize;

use crate::board::instructions::Listing;
use analysis::filter_costs::FilterVariant;
use analysis::filter_costs::recording::Recording;
use analysis::filter_costs::replay::{self, OperationCosts};
use analysis::filter_errors::error_sums::ErrorSums;
use simulation::runs::RunError;
use simulation::runs::filter::FILTERS;
use simulation::runs::simulate::Precision;
use simulation::scene::Scene;

/// How often each cost is measured; the least counts.
pub const ROUNDS: u32 = 10;

/// The drives, with their names in the tables.
const DRIVES: [(DriveMode, &str); 2] = [(DriveMode::B, "b"), (DriveMode::C, "c")];

/// Rates of the vibrometer in Hz, the default's first.
const SAMPLE_RATES_HZ: [f64; 3] = [200e3, 100e3, 50e3];

/// Error and costs of one variant in one mode.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FilterCostsRow {
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
    /// Costs on this machine in ns.
    pub ns: OperationCosts,
    /// Costs on a Cortex-M4F in instructions; counted for `f32` at the default rate.
    pub instructions: Option<OperationCosts>,
    /// Motors.
    pub runs: u64,
}

/// The motors to be run, in both modes.
#[derive(Clone, Debug)]
pub struct FilterCostsPlan {
    scenes: Vec<Scene>,
    /// How often each cost is measured; the least counts.
    rounds: u32,
}

/// Error and costs of every variant.
#[derive(Clone, Debug)]
pub struct FilterCosts {
    /// By drive, then filter, precision and rate.
    pub rows: Vec<FilterCostsRow>,
}

/// All variants, by filter and precision.
fn variants() -> Vec<FilterVariant> {
    let both =
        |&filter| [Precision::F32, Precision::F64].map(|precision| FilterVariant { filter, precision });
    FILTERS.iter().flat_map(both).collect()
}

impl FilterCostsPlan {
    /// `motors` motors, named by the scene's seed and those that follow it.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn new(scene: &Scene, motors: u64, rounds: u32) -> Result<Self, RunError> {
        let scenes: Result<_, _> = (0..motors).map(|number| scene.of_run(number)).collect();
        Ok(Self { scenes: scenes?, rounds })
    }

    /// Number of recordings to be made: progress counts them.
    pub fn recordings(&self) -> u64 {
        (self.scenes.len() * DRIVES.len() * SAMPLE_RATES_HZ.len()) as u64
    }

    /// Runs everything, and calls `progress` after each recording. `counts` are the instructions on the
    /// microcontroller, if they were counted.
    ///
    /// # Errors
    /// When a run fails.
    pub fn run(
        &self,
        counts: Option<&Listing>,
        progress: &(impl Fn() + Sync),
    ) -> Result<FilterCosts, RunError> {
        let variants = variants();
        let mut rows = Vec::new();
        for (mode, drive) in DRIVES {
            let mut of_drive = Vec::new();
            for rate_hz in SAMPLE_RATES_HZ {
                let sums = self.sums(mode, rate_hz, &variants, progress)?;
                let recording = recording(&self.scenes[0], mode, rate_hz)?;
                let costs = replay::costs(&variants, &recording, rate_hz, self.rounds)?;
                for (place, ((variant, sums), ns)) in variants.iter().zip(&sums).zip(costs).enumerate() {
                    let row = FilterCostsRow {
                        filter: variant.filter,
                        precision: variant.precision,
                        ldv_sample_rate_hz: rate_hz,
                        drive,
                        rms_angle_mdeg: sums.rms_angle_mdeg(),
                        rms_rate_rad_s: sums.rms_rate_rad_s(),
                        ns,
                        instructions: counts.and_then(|counts| instructions(variant, drive, rate_hz, counts)),
                        runs: self.scenes.len() as u64,
                    };
                    of_drive.push((place, row));
                }
            }
            // By filter and precision; the rows were made by the rate of the recording.
            of_drive.sort_by_key(|(place, _)| *place);
            rows.extend(of_drive.into_iter().map(|(_, row)| row));
        }
        Ok(FilterCosts { rows })
    }

    /// The error sums of each variant over all motors.
    fn sums(
        &self,
        mode: DriveMode,
        rate_hz: f64,
        variants: &[FilterVariant],
        progress: &(impl Fn() + Sync),
    ) -> Result<Vec<ErrorSums>, RunError> {
        let of_motor = |scene: &Scene| {
            let recording = recording(scene, mode, rate_hz)?;
            let sums: Result<Vec<ErrorSums>, _> = variants.iter().map(|v| v.error_sums(&recording)).collect();
            progress();
            Ok(sums?)
        };
        // One thread's share is one motor; the sums come back in the order of the list, and are added up in it.
        let of_motors: Result<Vec<Vec<ErrorSums>>, RunError> =
            self.scenes.par_iter().with_max_len(1).map(of_motor).collect();
        let mut total = vec![ErrorSums::default(); variants.len()];
        for sums in of_motors? {
            total.iter_mut().zip(&sums).for_each(|(total, error_sums)| total.absorb(error_sums));
        }
        Ok(total)
    }
}

fn recording(scene: &Scene, mode: DriveMode, rate_hz: f64) -> Result<Recording, RunError> {
    let mut scene = scene.clone();
    scene.set("ldv.sample_rate_hz", &rate_hz.to_string())?;
    Recording::make(&scene, mode)
}

/// The instructions of the operations of `variant` on the microcontroller; `None` where they were not counted.
fn instructions(
    variant: &FilterVariant,
    drive: &str,
    sample_rate_hz: f64,
    counts: &Listing,
) -> Option<OperationCosts> {
    let counted = variant.precision == Precision::F32 && sample_rate_hz >= SAMPLE_RATES_HZ[0];
    counted.then_some(())?;
    let mean =
        |operation: &str| Some(counts.find(&format!("{}_{drive}_{operation}", variant.filter))?.mean());
    let [frame, sample, prediction] = ["camera_frame", "vibrometer_sample", "prediction"].map(mean);
    Some(OperationCosts::new(frame?, sample?, prediction?, sample_rate_hz))
}
