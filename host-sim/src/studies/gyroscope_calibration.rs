//! Scale factor and bias of a gyroscope on the rotor, found in closed loop, against the truth: `host-sim calibrate`.
//!
//! In the order of the data:
//!
//! | module | what it is |
//! |---|---|
//! | `schedule` | the schedule: rests, and turns to either side at a staircase of rates |
//! | `pilot` | whether there is a pilot, and what is said of it |
//! | `plan` | the schedule that a pilot leads to |
//! | `turning` | the run of the motor under the rate controller; the reference is the angle of its estimator |
//! | [`simulation::world::instruments::gyroscope`] | samples of the rotor's true turn about its own axis |
//! | [`analysis::gyroscope_fit`] | scale factor, bias and what else is unknown, with their covariance |
//! | `calibration`, `outcome` | one calibration: its intervals, its fit, what became of it |
//! | `parts` | what each cause makes of the error, which only the simulation knows |
//! | `beside_table` | several scenes side by side |
//! | `needed_table` | calibrations that are as long as is needed |
//! | `budget` | the budget of the scale factor |
//! | `summary`, `tables`, `picture`, `report` | the figures over all calibrations, and what is shown of them |
//!
//! The reference is good to some 5 milli-degrees while the rotor turns and to 0.5 at rest. Every interval shares it
//! with the next. So the gyroscope's random walk limits a calibration of a minute: 0.15 deg/sqrt(h) are 19
//! milli-degrees in that time, or 1.2 deg/h of bias. The fit does not use the truth. It uses the gyroscope's data sheet
//! (its noise, not its errors) and the filter's variances.
//!
//! # Many calibrations
//!
//! The gyroscope does not act on the motor. So any number of gyroscopes can be simulated on one run of a motor.
//! Calibration `i` is of the gyroscope with serial `i / m` on motor `i mod m`. The `m` motors are named by the seed and
//! those that follow it. Calibrations on one motor share the error of the reference, a small part of the whole.

mod beside_table;
mod budget;
mod calibration;
mod needed_table;
mod outcome;
mod parts;
mod picture;
mod pilot;
mod plan;
mod report;
mod schedule;
mod summary;
mod tables;
mod turning;

use std::collections::BTreeSet;

use crate::studies::beside::Beside;
use crate::studies::shard::{Shard, run_each};
use calibration::Bench;
pub use calibration::Calibration;
pub(crate) use needed_table::page_value;
pub use outcome::CalibrationOutcome;
pub use pilot::with_pilot;
pub use plan::TurnPlan;
pub use schedule::TurnSchedule;
use simulation::math::allan_deviation;
use simulation::math::count::real;
use simulation::runs::RunError;
use simulation::runs::filter;
use simulation::scene::{Scene, SceneError};
use simulation::world::body_turn::BodyTurn;
use simulation::world::instruments::gyroscope::Gyroscope;
use simulation::world::instruments::gyroscope::noise::SECONDS_PER_HOUR;
pub use summary::CalibrationSummary;
use turning::TurningRun;

/// Length of the record at rest for the Allan deviation in the picture.
const AT_REST_S: f64 = 3600.0;

/// Calibrations to be made.
#[derive(Clone, Debug)]
pub struct CalibrationPlan {
    scene: Scene,
    schedule: TurnSchedule,
    /// Motors to be run: progress counts them.
    pub motors: u64,
    runs: u64,
    part: Shard,
}

/// All calibrations.
#[derive(Clone, Debug)]
pub struct Calibrations {
    /// The first, with its intervals and its fit.
    pub first: Calibration,
    /// Allan deviation of the first gyroscope, an hour at rest: span in s, deg/h of the samples, deg/h of the model.
    pub allan_deg_h: Vec<(f64, f64, f64)>,
    /// Length of the pilots in s; 0 for none.
    pub pilot_s: f64,
    /// The plan that the pilot of the first motor led to, if there is one.
    pub turn_plan: Option<TurnPlan>,
    /// All outcomes, that of the first included.
    pub outcomes: Vec<CalibrationOutcome>,
    /// Motors that they are spread over.
    pub motors: u64,
    /// The filter whose angle is the reference.
    pub filter: &'static str,
    /// Time that this machine took for a second of motor time, of the motor that took least.
    pub time_s_per_s: f64,
    /// The same study on other scenes.
    pub beside: Vec<Beside<Self>>,
    schedule: TurnSchedule,
}

impl CalibrationPlan {
    /// `runs` calibrations over `motors` motors, at most one motor a calibration. The scene has a pilot as
    /// [`with_pilot`] says.
    ///
    /// # Errors
    /// When the schedule of the scene is refused.
    pub fn new(scene: &Scene, runs: u64, motors: u64) -> Result<Self, RunError> {
        let scene = with_pilot(scene)?;
        let schedule = TurnSchedule::of(&scene)?;
        Ok(Self { scene, schedule, motors: motors.min(runs), runs, part: Shard::ALL })
    }

    /// The same of the calibrations on a part of the motors alone.
    ///
    /// # Errors
    /// When it has no motor.
    pub fn part(self, part: Shard) -> Result<Self, RunError> {
        part.numbers_of_some(self.motors, "motors")?;
        Ok(Self { part, ..self })
    }

    /// Motors that this part runs: progress counts them.
    pub fn motors_of_part(&self) -> u64 {
        self.part.numbers(self.motors).len() as u64
    }

    /// Runs this part, and calls `progress` after each motor. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// When a scene is refused, or a run does not tell scale factor from bias.
    pub fn run(&self, progress: &(impl Fn() + Sync)) -> Result<Calibrations, RunError> {
        self.run_told(progress, &|_| ())
    }

    /// The same; `told` has the plan of the first motor once its pilot has turned.
    ///
    /// # Errors
    /// As of [`Self::run`].
    pub fn run_told(
        &self,
        progress: &(impl Fn() + Sync),
        told: &(impl Fn(&TurnPlan) + Sync),
    ) -> Result<Calibrations, RunError> {
        let numbers = self.part.numbers(self.motors);
        let first_motor = numbers.first().copied();
        let motor = |number: u64| {
            let mut scene = self.scene.of_run(number)?;
            let is_first = first_motor == Some(number);
            let told = |plan: &TurnPlan| {
                if is_first {
                    told(plan);
                }
            };
            let (turning, schedule, turn_plan) = TurnPlan::turn(&scene, &self.schedule, &told)?;
            let runs = (number..self.runs).step_by(usize::try_from(self.motors).unwrap_or(usize::MAX));
            let calibrations = runs.map(|run| self.calibrate(&mut scene, run, (&turning, &schedule)));
            let mut calibrations = calibrations.collect::<Result<Vec<_>, RunError>>()?;
            let outcomes: Vec<CalibrationOutcome> = calibrations.iter().map(|c| c.outcome.clone()).collect();
            let first = is_first.then(|| FirstCalibration {
                calibration: calibrations.swap_remove(0),
                schedule,
                turn_plan,
            });
            Ok::<_, RunError>((outcomes, first, turning.time_s_per_s))
        };
        let mut of_motors = run_each(numbers, motor, progress)?;
        let first = of_motors.first_mut().and_then(|(_, first, _)| first.take());
        // There is at least one motor, and the first has a run.
        let first = first.ok_or_else(not_told_apart)?;
        let time_s_per_s = of_motors.iter().map(|(_, _, time)| *time).fold(f64::INFINITY, f64::min);
        let mut outcomes: Vec<CalibrationOutcome> =
            of_motors.into_iter().flat_map(|(outcomes, ..)| outcomes).collect();
        outcomes.sort_by_key(|outcome| outcome.number);
        let motors = self.motors_of_part();
        Ok(Calibrations { motors, time_s_per_s, ..self.of(first, outcomes) })
    }

    /// Calibrations that were made in parts on the motors of `scene`. The first is made again, for its picture.
    ///
    /// # Errors
    /// When the scene is refused, or is another than that of the parts.
    pub fn merged(scene: &Scene, outcomes: Vec<CalibrationOutcome>) -> Result<Calibrations, RunError> {
        let seeds: BTreeSet<u64> = outcomes.iter().map(|outcome| outcome.seed).collect();
        let plan = Self::new(scene, outcomes.len() as u64, seeds.len() as u64)?;
        let (turning, schedule, turn_plan) = TurnPlan::turn(&plan.scene, &plan.schedule, &|_| ())?;
        let calibration = plan.calibrate(&mut plan.scene.clone(), 0, (&turning, &schedule))?;
        let first = FirstCalibration { calibration, schedule, turn_plan };
        if outcomes.first() != Some(&first.calibration.outcome) {
            return Err(SceneError::Conflict {
                conflict: "the parts do not begin with the first calibration of this scene".to_owned(),
                hint: "give all parts, and the scene and the seed with which they were made".to_owned(),
            }
            .into());
        }
        Ok(plan.of(first, outcomes))
    }

    /// The calibrations with `outcomes`, and what the scene says of them.
    fn of(&self, first: FirstCalibration, outcomes: Vec<CalibrationOutcome>) -> Calibrations {
        let FirstCalibration { calibration, schedule, turn_plan } = first;
        Calibrations {
            first: calibration,
            pilot_s: self.scene.number("calibrate.pilot_s"),
            turn_plan,
            allan_deg_h: at_rest(&self.scene),
            outcomes,
            motors: self.motors,
            filter: filter::chosen(&self.scene),
            schedule,
            // Parts are of other machines, whose time says nothing of this one.
            time_s_per_s: f64::NAN,
            beside: Vec::new(),
        }
    }

    /// The calibration of the gyroscope of `run` on its motor.
    fn calibrate(
        &self,
        scene: &mut Scene,
        run: u64,
        (turning, schedule): (&TurningRun, &TurnSchedule),
    ) -> Result<Calibration, RunError> {
        turning.check()?;
        let serial = self.scene.integer("gyroscope.serial") + run / self.motors;
        scene.set("gyroscope.serial", &serial.to_string())?;
        let mut gyroscope = Gyroscope::new(scene);
        let bench = Bench::new(scene, schedule, turning);
        Calibration::of(&mut gyroscope, (run, serial), &bench).ok_or_else(not_told_apart)
    }
}

/// The first calibration, with what its motor did.
struct FirstCalibration {
    calibration: Calibration,
    schedule: TurnSchedule,
    turn_plan: Option<TurnPlan>,
}

fn not_told_apart() -> RunError {
    SceneError::Conflict {
        conflict: "this run does not tell scale factor from bias".to_owned(),
        hint: "it needs intervals of different rates without saturation, and a gyroscope or a camera with noise: see \
            calibrate. and gyroscope. in `host-sim keys`"
            .to_owned(),
    }
    .into()
}

/// Allan deviation of the scene's gyroscope at rest: span in s, deg/h of the samples, deg/h of the model.
fn at_rest(scene: &Scene) -> Vec<(f64, f64, f64)> {
    let mut gyroscope = Gyroscope::new(scene);
    let noise = gyroscope.noise();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 3.6e7")]
    let count = (AT_REST_S / noise.period_s) as usize;
    let still = BodyTurn::default();
    let angles: Vec<f64> = (0..count)
        .scan(0.0, |angle_deg, _| {
            *angle_deg += gyroscope.sample(&still).turned_deg;
            Some(*angle_deg)
        })
        .collect();
    let of = |samples: usize| {
        let span_s = real(samples) * noise.period_s;
        let seen = allan_deviation::deviation_deg_s(&angles, noise.period_s, samples)?;
        Some((span_s, SECONDS_PER_HOUR * seen, SECONDS_PER_HOUR * noise.allan_deviation_deg_s(span_s)))
    };
    allan_deviation::spans(angles.len(), 8).into_iter().filter_map(of).collect()
}
