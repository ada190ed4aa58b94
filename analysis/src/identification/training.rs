//! Motors that are drawn from the prior and recorded as the motor in question was: the same drives, the same
//! instruments.

use rayon::prelude::*;

use super::measured::Measured;
use super::parameters::{Unknown, motor_scene};
use super::parts::Parts;
use super::statistics::statistics;
use simulation::math::random_streams::{RandomSource, stream};
use simulation::runs::RunError;
use simulation::runs::recording::DriveCourse;
use simulation::scene::Scene;

/// What is recorded of every motor.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Scene, of which only the true motor is another.
    pub scene: Scene,
    /// Drives.
    pub course: DriveCourse,
    /// What has statistics.
    pub parts: Parts,
    /// Place among the recordings of a motor: no two of them have the same noise.
    pub place: u64,
}

impl Setting {
    /// That of a recording of `scene` under `course`, which `measured` this.
    pub fn of(scene: Scene, course: DriveCourse, measured: &Measured, place: u64) -> Self {
        let parts = Parts::of(&course, measured);
        Self { scene, course, parts, place }
    }

    /// That of a recording by the keys `record.` of `scene`, which nobody has made yet.
    ///
    /// # Errors
    /// When the scene is refused.
    pub fn planned(scene: Scene, unknowns: &[Unknown], place: u64) -> Result<Self, RunError> {
        let course = DriveCourse::of(&scene.schedule("record.schedule"), &scene.motor_params())?;
        let means: Vec<f64> = unknowns.iter().map(|unknown| unknown.prior.mean()).collect();
        let measured = Measured::of_motor(&motor_scene(&scene, unknowns, &means, 0)?, &course)?;
        let parts = Parts::of(&course, &measured);
        Ok(Self { scene, course, parts, place })
    }
}

/// A motor that was drawn, and the statistics of its recordings.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawnMotor {
    /// Its parameters in standard deviations of the prior.
    pub standard: Vec<f64>,
    /// The statistics of all settings, one after the other.
    pub statistics: Vec<f64>,
}

impl DrawnMotor {
    /// The same motor with the statistics of further recordings of it.
    #[must_use]
    pub fn beside(&self, other: &Self) -> Self {
        let statistics = [&self.statistics[..], &other.statistics].concat();
        Self { standard: self.standard.clone(), statistics }
    }
}

/// Seeds of motors that are drawn, far from those that people give.
const FIRST_SEED: u64 = 0x1D00_0000_0000_0000;
/// Seeds of one motor's recordings.
const SEEDS_PER_MOTOR: u64 = 1024;

/// Motor `number` of the sample that `seed` names.
///
/// # Errors
/// When the model refuses a motor.
pub fn drawn_motor(
    settings: &[Setting],
    unknowns: &[Unknown],
    seed: u64,
    number: u64,
) -> Result<DrawnMotor, RunError> {
    let motor_seed = FIRST_SEED
        .wrapping_add(seed.wrapping_mul(1 << 40))
        .wrapping_add(number.wrapping_mul(SEEDS_PER_MOTOR));
    let mut draw = stream(motor_seed, RandomSource::IdentificationDraw);
    let values: Vec<f64> = unknowns.iter().map(|unknown| unknown.prior.draw(&mut draw)).collect();
    let mut found = Vec::new();
    for setting in settings {
        let own_seed = motor_seed.wrapping_add(setting.place);
        let scene = motor_scene(&setting.scene, unknowns, &values, own_seed)?;
        let measured = Measured::of_motor(&scene, &setting.course)?;
        found.extend(
            statistics(&scene, &setting.parts, &measured).into_iter().map(|statistic| statistic.value),
        );
    }
    let standard = unknowns.iter().zip(&values).map(|(unknown, value)| unknown.standard(*value)).collect();
    Ok(DrawnMotor { standard, statistics: found })
}

/// `count` motors of the sample that `seed` names, whatever the number of threads; `done` is called after each.
///
/// # Errors
/// When the model refuses a motor.
pub fn draw_motors(
    settings: &[Setting],
    unknowns: &[Unknown],
    seed: u64,
    count: u64,
    done: &(impl Fn() + Sync),
) -> Result<Vec<DrawnMotor>, RunError> {
    let drawn = (0..count).into_par_iter().map(|number| {
        let motor = drawn_motor(settings, unknowns, seed, number);
        done();
        motor
    });
    drawn.collect()
}
