//! The open loop: one motor under one constant drive, observed while it runs, with statistics after it has settled:
//! `host-sim simulate`.

mod model;
mod report;
mod stator;
mod stepped_motor;
mod stepping;
mod tilt_statistics;

use motor_model::{
    DriveCommand, DriveMode, Freedom, FrictionLaw, ImpactRule, Mode, MotorParams, MotorSetup, TiltingParams,
    TiltingSetup, TiltingVariation,
};
use serde::Serialize;

use crate::math::plain_number::plain;
use crate::math::random_streams::{RandomSource, stream};
use crate::math::spectrum::SAMPLE_RATE_HZ;
use crate::runs::RunError;
use crate::scene::{RotorModel, Scene, SceneError};
use crate::world::plant::impact_rule;

pub use model::OpenLoopModel;
pub use report::{OpenLoopReport, drive_name, rule_name};
pub use stator::{StatorReport, simulate_stator};
pub use stepping::{FAST_APPROACH_M_S, MotorSample, Observer, OpenLoopSummary, simulate};
pub use tilt_statistics::TiltSummary;

/// Most steps of a run: a few minutes of computing.
const STEPS_MAX: f64 = 1e10;

/// Steps in a period of the fastest mode, at least: halfway between two of 8 steps a sine is off its chord by 8 % of
/// its amplitude at most, `1 - cos(pi / 8)`.
const STEPS_PER_PERIOD: f64 = 8.0;

/// Arithmetic of the motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// The microcontroller's.
    F32,
    /// The plant's.
    F64,
}

impl Precision {
    /// `f32` or `f64`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

/// The settings of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OpenLoopRun {
    /// The motor.
    pub params: MotorParams,
    /// How its rotor moves.
    pub rotor: RotorModel,
    /// What it has beside, if its rotor tilts.
    pub tilting: TiltingParams,
    /// The drive, from the first step to the last.
    pub drive: DriveCommand,
    /// Simulated time.
    pub duration_s: f64,
    /// Time left out of the statistics at the start.
    pub settle_s: f64,
    /// Length of a step.
    pub step_s: f64,
    /// How impacts are found.
    pub impact_rule: ImpactRule,
    /// What limits the tangential impulse.
    pub friction_law: FrictionLaw,
    /// Arithmetic of the motor.
    pub precision: Precision,
    /// Seed of the run's random numbers.
    pub seed: u64,
}

/// A run counted in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StepCounts {
    /// Steps in all.
    pub steps: u64,
    /// Steps before the statistics start.
    pub settle_steps: u64,
    /// Steps from one sample of the statistics to the next.
    pub sample_steps: u64,
}

impl OpenLoopRun {
    /// The run that a scene asks for.
    ///
    /// # Errors
    /// When the amplitude is out of bounds, which the scene's own bounds exclude, or the motor has no such modes.
    pub fn from_scene(scene: &Scene) -> Result<Self, RunError> {
        let drive = match scene.choice("simulate.drive") {
            "b" => Some(DriveMode::B),
            "c" => Some(DriveMode::C),
            _ => None,
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the command is f32: it goes to a microcontroller"
        )]
        let amplitude = scene.number("simulate.amplitude") as f32;
        let params = scene.motor_params();
        if OpenLoopModel::from_scene(scene)? == OpenLoopModel::Motor {
            Mode::all(&params).map_err(|refused| {
                SceneError::from(refused).following_in_motor(scene, "the value is the design's")
            })?;
        }
        Ok(Self {
            params,
            rotor: RotorModel::of(scene)?,
            tilting: scene.tilting_params(),
            drive: drive.map_or(Ok(DriveCommand::OFF), |mode| DriveCommand::try_new(mode, amplitude))?,
            duration_s: scene.number("simulate.duration_s"),
            settle_s: scene.number("simulate.settle_s"),
            step_s: scene.number("simulate.step_s"),
            impact_rule: impact_rule(scene.choice("simulate.impacts")),
            friction_law: match scene.choice("simulate.friction") {
                "paper" => FrictionLaw::Paper,
                _ => FrictionLaw::Coulomb,
            },
            precision: match scene.choice("simulate.precision") {
                "f32" => Precision::F32,
                _ => Precision::F64,
            },
            seed: scene.seed(),
        })
    }

    /// What to say of a step that is too long for the fastest mode; `None` of one that is not.
    ///
    /// # Errors
    /// When the motor has no such modes.
    pub fn note(&self) -> Result<Option<String>, RunError> {
        let fastest_rad_s =
            Mode::all(&self.params)?.iter().map(|mode| mode.natural_rad_s).fold(0.0, f64::max);
        let longest_s = core::f64::consts::TAU / (fastest_rad_s * STEPS_PER_PERIOD);
        Ok((self.step_s > longest_s).then(|| {
            format!(
                "simulate.step_s = {} s is too long for the fastest mode, {:.0} Hz: the rotor misses where the teeth \
                 are; steps of at most {:.2e} s follow it",
                plain(self.step_s),
                fastest_rad_s / core::f64::consts::TAU,
                // Rounded down.
                0.99 * longest_s
            )
        }))
    }

    /// The run in steps, if its times go together.
    ///
    /// # Errors
    /// When there are too many steps, or too few after settling for the statistics.
    pub fn step_counts(&self) -> Result<StepCounts, RunError> {
        let Self { duration_s, settle_s, step_s, .. } = *self;
        if duration_s / step_s > STEPS_MAX {
            return Err(SceneError::Conflict {
                conflict: format!(
                    "simulate.duration_s = {} s in steps of simulate.step_s = {} s are {:e} steps, \
                     more than {STEPS_MAX:e}",
                    plain(duration_s),
                    plain(step_s),
                    duration_s / step_s
                ),
                hint: format!(
                    "steps of at least {} s, or at most {} s of time",
                    plain(duration_s / STEPS_MAX),
                    plain(step_s * STEPS_MAX)
                ),
            }
            .into());
        }
        let counts = StepCounts {
            steps: steps_in(duration_s, step_s),
            settle_steps: steps_in(settle_s, step_s),
            sample_steps: steps_in(1.0 / SAMPLE_RATE_HZ, step_s).max(1),
        };
        let samples = |steps| steps / counts.sample_steps;
        if samples(counts.steps) < samples(counts.settle_steps) + 2 {
            let two_samples_s = 2.0 / self.sample_rate_hz(&counts);
            return Err(SceneError::Conflict {
                conflict: format!(
                    "simulate.settle_s = {} s leaves nothing of simulate.duration_s = {} s for the statistics",
                    plain(settle_s),
                    plain(duration_s)
                ),
                hint: format!(
                    "simulate.duration_s of at least {} s, two samples more than the settling",
                    plain(settle_s + two_samples_s)
                ),
            }.into());
        }
        Ok(counts)
    }

    /// Samples per second of the statistics: 20 kHz, or the nearest that whole steps make.
    #[expect(clippy::cast_precision_loss, reason = "at most 50,000 steps a sample")]
    pub fn sample_rate_hz(&self, counts: &StepCounts) -> f64 {
        let rate_hz = 1.0 / (counts.sample_steps as f64 * self.step_s);
        let is_nominal = (rate_hz / SAMPLE_RATE_HZ - 1.0).abs() < 1e-12;
        if is_nominal { SAMPLE_RATE_HZ } else { rate_hz }
    }

    /// How the motor of this run is set up.
    pub fn setup(&self) -> MotorSetup {
        let variation = motor_model::AmplitudeVariation::draw(
            &self.params,
            &mut stream(self.seed, RandomSource::AmplitudeVariation),
        );
        MotorSetup {
            impact_rule: self.impact_rule,
            friction_law: self.friction_law,
            variation,
            ..MotorSetup::with_step(self.step_s)
        }
    }

    /// How the motor of this run is set up if its rotor tilts.
    pub fn tilting_setup(&self) -> TiltingSetup {
        let variation = TiltingVariation::draw(
            &self.params,
            &self.tilting,
            &mut stream(self.seed, RandomSource::AmplitudeVariation),
        );
        let freedom = match self.rotor {
            RotorModel::HeightOnly => Freedom::HeightOnly,
            RotorModel::Tilting(freedom) => freedom,
        };
        TiltingSetup {
            impact_rule: self.impact_rule,
            friction_law: self.friction_law,
            variation,
            freedom,
            ..TiltingSetup::with_step(self.step_s)
        }
    }
}

/// The nearest whole number of steps in a time.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "times are positive and bounded; a cast saturates"
)]
pub fn steps_in(time_s: f64, step_s: f64) -> u64 {
    (time_s / step_s).round() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run_of(sets: &[&str]) -> OpenLoopRun {
        let mut scene = Scene::default();
        for set in sets {
            let (key, value) = set.split_once('=').unwrap();
            scene.set(key, value).unwrap();
        }
        OpenLoopRun::from_scene(&scene).unwrap()
    }

    #[test]
    fn exact_defaults() {
        let run = run_of(&[]);
        assert_eq!(run.drive, DriveCommand::full(DriveMode::C));
        assert_eq!((run.friction_law, run.precision, run.seed), (FrictionLaw::Coulomb, Precision::F64, 1));
        let counts = run.step_counts().unwrap();
        assert_eq!(counts, StepCounts { steps: 2_000_000, settle_steps: 500_000, sample_steps: 50 });
        assert!((run.sample_rate_hz(&counts) - 20_000.0).abs() < 1e-9);
    }

    /// 50 us is 16.67 steps of 3 us: 17 of them make 19,608 samples per second.
    #[test]
    fn exact_sample_rate_of_a_step_that_does_not_divide() {
        let run = run_of(&["simulate.step_s=3e-6"]);
        let counts = run.step_counts().unwrap();
        assert_eq!(counts.sample_steps, 17);
        assert!((run.sample_rate_hz(&counts) - 19_607.843_137).abs() < 1e-5);
    }

    #[test]
    fn exact_times_that_clash_are_refused_with_numbers_that_work() {
        let refused = run_of(&["simulate.settle_s=2"]).step_counts().unwrap_err().one_line();
        assert_eq!(
            refused,
            "error: simulate.settle_s = 2 s leaves nothing of simulate.duration_s = 2 s for the statistics; \
             hint: simulate.duration_s of at least 2.0001 s, two samples more than the settling"
        );
        assert!(run_of(&["simulate.settle_s=2", "simulate.duration_s=2.0001"]).step_counts().is_ok());

        let refused = run_of(&["simulate.step_s=1e-9", "simulate.duration_s=100"])
            .step_counts()
            .unwrap_err()
            .one_line();
        assert!(refused.contains("1e11 steps, more than 1e10"), "{refused}");
        assert!(refused.ends_with("hint: steps of at least 1e-8 s, or at most 10 s of time"), "{refused}");
        assert!(run_of(&["simulate.step_s=1e-8", "simulate.duration_s=100"]).step_counts().is_ok());
    }
}
