//! A motor's parameters from recordings of it: `host-sim identify`.
//!
//! Impact by impact the motion is chaotic, and no simulation repeats a recording. What repeats is its statistics. So,
//! with [`analysis::identification`]:
//!
//! ```text
//! recordings ---> statistics s
//! prior ---> drawn motors, same drives, same instruments ---> statistics of each
//!            regressions: what tells a parameter, how it follows from the parameters
//! s, prior ---> posterior of the parameters that are told
//! ```
//!
//! Before anything is fitted, the regressions say what these recordings can tell ([`emulator::Summaries::expected`]): a
//! parameter whose standard deviation they are expected to leave above [`emulator::TOLD`] of the prior's gets an
//! infinite interval, and the recording of a short list that would tell it is named
//! ([`analysis::identification::candidates`]).
//!
//! The parameters that are not told are drawn with the others, so that what is not known of them widens every interval.
//! Whether the intervals hold what they promise is tried on motors drawn and forgotten (`calibration.rs`).

mod calibration;
mod error;
mod outcome;
mod picture;
mod recorded;
mod report;

pub use analysis::identification::parameters::Prior;
pub(crate) use calibration::page_values;
pub use calibration::{CalibratedParameter, Calibration, CalibrationPlan};
pub use error::IdentificationError;
pub use outcome::{Identification, IdentifiedParameter, MeasuredStatistic};
pub use recorded::Recorded;
pub(crate) use report::report;

use std::collections::BTreeMap;

use motor_model::math;

use crate::report::files;
use analysis::identification::candidates::{self, Advice};
use analysis::identification::emulator::{self, Emulator, TOLD, of_told, quadratic};
use analysis::identification::parameters::{self, Unknown};
use analysis::identification::posterior;
use analysis::identification::ridge::{Ridge, outputs};
use analysis::identification::statistics::{self, Statistic};
use analysis::identification::training::{self, DrawnMotor, Setting};
use simulation::math::statistics::Spread;
use simulation::scene::RotorModel;
use simulation::world::plant::Plant;

/// How much is computed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Motors that are drawn.
    pub motors: u64,
    /// Whether to look for recordings that would tell what these do not.
    pub advice: bool,
    /// Width of the prior, per the tolerance from which motors are drawn.
    pub prior_width: f64,
    /// Seed of the motors that are drawn.
    pub seed: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { motors: 1000, advice: true, prior_width: 1.5, seed: 1 }
    }
}

impl Effort {
    /// Motors on which each further recording is tried, of those that are drawn.
    fn motors_per_candidate(&self) -> u64 {
        (self.motors / 4).max(100).min(self.motors)
    }
}

/// What is to be identified, from which recordings.
#[derive(Clone, Debug)]
pub struct IdentificationPlan {
    recordings: Vec<Recorded>,
    settings: Vec<Setting>,
    unknowns: Vec<Unknown>,
    effort: Effort,
}

impl IdentificationPlan {
    /// From these recordings of one motor.
    ///
    /// # Errors
    /// When there is nothing to be told from one of them, one is given twice, or they are of different motors.
    pub fn new(mut recordings: Vec<Recorded>, effort: Effort) -> Result<Self, IdentificationError> {
        let Some(first) = recordings.first() else { return Err(IdentificationError::NoRecordings) };
        refuse_one_file_twice(&recordings)?;
        let (design, tilting) = (first.scene.motor_params(), first.scene.tilting_params());
        for other in &recordings {
            if other.scene.motor_params() != design || other.scene.tilting_params() != tilting {
                let paths = [first.path.clone(), other.path.clone()];
                return Err(IdentificationError::OtherDesign { paths });
            }
        }
        let rotor = rotor_of(&recordings)?;
        for recorded in &mut recordings {
            recorded.scene.set("plant.rotor", rotor.word())?;
        }
        refuse_two_motors(&recordings)?;
        let settings: Vec<Setting> =
            recordings.iter().zip(0..).map(|(recorded, place)| recorded.setting(place)).collect();
        for (recorded, setting) in recordings.iter().zip(&settings) {
            let of_stator = recorded.scene.choice("record.model") == "stator";
            if setting.parts.is_empty(of_stator) {
                let path = recorded.path.clone();
                return Err(if of_stator {
                    IdentificationError::NeitherRingDownNorSweep { path }
                } else {
                    IdentificationError::TooShort { path }
                });
            }
        }
        let unknowns = match recordings.first() {
            Some(first) => parameters::unknowns(&first.scene, effort.prior_width)?,
            None => Vec::new(),
        };
        Ok(Self { recordings, settings, unknowns, effort })
    }

    /// Number of motors that are drawn.
    pub fn work(&self) -> u64 {
        let candidates = if self.effort.advice { candidates::COUNT } else { 0 };
        self.effort.motors + candidates * self.effort.motors_per_candidate()
    }

    /// Identifies; `done` is called after each motor.
    ///
    /// # Errors
    /// When the model refuses a motor.
    pub fn run(&self, done: &(impl Fn() + Sync)) -> Result<Identification, IdentificationError> {
        let Self { recordings, settings, unknowns, effort } = self;
        let measured = measured_statistics(recordings, settings);
        let values: Vec<f64> = measured.iter().map(|statistic| statistic.value).collect();
        let motors = training::draw_motors(settings, unknowns, effort.seed, effort.motors, done)?;
        let learnt = Emulator::learn(&motors);
        let (first, _) = motors.split_at(motors.len() / 2);
        let expected = match &learnt {
            Some(emulator) => emulator.expected().to_vec(),
            None => emulator::Summaries::learn(first).expected,
        };
        let advice = self.advice(&motors, &expected, done)?;
        let sample = learnt
            .as_ref()
            .map(|emulator| posterior::posterior(emulator, unknowns, &values, effort.seed))
            .unwrap_or_default();
        let told = learnt.map(|emulator| emulator.told).unwrap_or_default();
        let parameters = unknowns.iter().enumerate().map(|(number, unknown)| {
            let place = told.iter().position(|told| *told == number);
            let sampled: Option<Vec<f64>> =
                place.map(|place| sample.iter().map(|told| unknown.value(told[place])).collect());
            IdentifiedParameter::new(
                unknown,
                expected[number],
                sampled.as_deref(),
                advice.get(number).cloned().flatten(),
            )
        });
        Ok(Identification {
            parameters: parameters.collect(),
            fit: fit(&motors, &told, &sample, &measured),
            sample: sample.iter().map(|one| values_of(unknowns, &told, one)).collect(),
            told,
            logs: recordings.iter().map(|recorded| recorded.path.display().to_string()).collect(),
            damage: recordings.iter().filter_map(|recorded| recorded.damage.clone()).collect(),
            rotor: rotor_of(recordings)?.word(),
            looked_further: effort.advice,
            motors: effort.motors,
            prior_width: effort.prior_width,
            seed: effort.seed,
        })
    }

    /// What would tell what these recordings do not; nothing if nobody asks.
    fn advice(
        &self,
        motors: &[DrawnMotor],
        expected: &[f64],
        done: &(impl Fn() + Sync),
    ) -> Result<Vec<Option<Advice>>, IdentificationError> {
        let none = Vec::new();
        if !self.effort.advice || expected.iter().all(|ratio| *ratio < TOLD) {
            return Ok(none);
        }
        let is_motor = |setting: &&Setting| setting.scene.choice("record.model") == "motor";
        let Some(setting) = self.settings.iter().find(is_motor).or(self.settings.first()) else {
            return Ok(none);
        };
        let count = usize::try_from(self.effort.motors_per_candidate()).unwrap_or(usize::MAX);
        let (tried, _) = motors.split_at(count.min(motors.len()));
        Ok(candidates::advice(&setting.scene, &self.unknowns, self.effort.seed, tried, done)?)
    }
}

/// Refuses a recording that was given twice: it would tell as much as two that are independent.
fn refuse_one_file_twice(recordings: &[Recorded]) -> Result<(), IdentificationError> {
    for (place, recorded) in recordings.iter().enumerate() {
        let twin = recordings[..place].iter().find(|other| files::is_same(&other.path, &recorded.path));
        if let Some(twin) = twin {
            let paths = [twin.path.clone(), recorded.path.clone()];
            return Err(IdentificationError::Twice { paths });
        }
    }
    Ok(())
}

/// Refuses recordings of motors that a simulation drew apart. An import says nothing of its motor but the design.
fn refuse_two_motors(recordings: &[Recorded]) -> Result<(), IdentificationError> {
    let mut simulated = recordings.iter().filter(|recorded| recorded.command != "import");
    let Some(first) = simulated.next() else { return Ok(()) };
    let motor = Plant::draw(&first.scene)?;
    for other in simulated {
        if Plant::draw(&other.scene)?.params() != motor.params() {
            let paths = [first.path.clone(), other.path.clone()];
            return Err(IdentificationError::OtherMotor { paths });
        }
    }
    Ok(())
}

/// The rotor of the motor: one that tilts, if any recording says so.
fn rotor_of(recordings: &[Recorded]) -> Result<RotorModel, IdentificationError> {
    let mut rotor = RotorModel::HeightOnly;
    for recorded in recordings {
        let own = RotorModel::of(&recorded.scene)?;
        if own != RotorModel::HeightOnly {
            rotor = own;
        }
    }
    Ok(rotor)
}

/// The statistics of all recordings. One that several recordings have is named after its recording.
fn measured_statistics(recordings: &[Recorded], settings: &[Setting]) -> Vec<Statistic> {
    let of_each: Vec<Vec<Statistic>> = recordings
        .iter()
        .zip(settings)
        .map(|(recorded, setting)| {
            statistics::statistics(&recorded.scene, &setting.parts, &recorded.measured)
        })
        .collect();
    let mut times: BTreeMap<String, u32> = BTreeMap::new();
    for statistic in of_each.iter().flatten() {
        *times.entry(statistic.name.clone()).or_default() += 1;
    }
    let named = |(recorded, statistics): (&Recorded, Vec<Statistic>)| -> Vec<Statistic> {
        let apart = |Statistic { name, value }: Statistic| {
            let is_shared = times.get(&name).is_some_and(|times| *times > 1);
            let name = if is_shared { format!("{name}, {}", recorded.path.display()) } else { name };
            Statistic { name, value }
        };
        statistics.into_iter().map(apart).collect()
    };
    recordings.iter().zip(of_each).flat_map(named).collect()
}

/// The values of told parameters of which `standard` are in standard deviations.
fn values_of(unknowns: &[Unknown], told: &[usize], standard: &[f64]) -> Vec<f64> {
    let unknowns = told.iter().filter_map(|number| unknowns.get(*number));
    unknowns.zip(standard).map(|(unknown, standard)| unknown.value(*standard)).collect()
}

/// Each statistic as it was measured, beside what motors of the posterior show.
fn fit(
    motors: &[DrawnMotor],
    told: &[usize],
    sample: &[Vec<f64>],
    measured: &[Statistic],
) -> Vec<MeasuredStatistic> {
    if sample.is_empty() {
        return Vec::new();
    }
    let inputs: Vec<Vec<f64>> =
        motors.iter().map(|motor| quadratic(&of_told(told, &motor.standard))).collect();
    let ridge = Ridge::new(&inputs);
    let maps: Vec<_> = (0..measured.len())
        .map(|number| ridge.fit(&motors.iter().map(|motor| motor.statistics[number]).collect::<Vec<_>>()))
        .collect();
    let of_sample: Vec<_> = sample.iter().step_by(20).map(|told| outputs(&maps, &quadratic(told))).collect();
    let predicted = |(number, statistic): (usize, &Statistic)| {
        let mean: Spread = of_sample.iter().map(|outputs| outputs[number]).collect();
        let noise = maps[number].left_out_rms();
        let sd = math::sqrt(mean.sd * mean.sd + noise * noise);
        let name = statistic.name.clone();
        MeasuredStatistic { name, measured: statistic.value, predicted: mean.mean, sd }
    };
    measured.iter().enumerate().map(predicted).collect()
}

#[cfg(test)]
mod tests;
