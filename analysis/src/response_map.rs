//! Identification of the controller's response map ([`controller::response_map`]) from a sample of motors of the plant.
//!
//! Motors are drawn around the scene's design (keys `motor.`) and driven open loop at the design's frequencies, not at
//! their own resonances. A burst starts from rest, at the phase of the drive at which the burst before it ended.
//! [`REST_S`] of rest follow it:
//!
//! ```text
//! turn = mean over motors of a motor's mean        motors = standard deviation of those means
//! repeat = what a motor's own standard deviation stays below in four motors of five
//! coast = least squares of coast per rate at the cut
//! ```
//!
//! `repeat` is a quantile, not a mean: about one motor in a hundred sometimes turns by a very different angle, which
//! would dominate a mean.

mod value;

pub use value::{is_table_1, of_design, rounded};

use controller::PositionLoop;
use controller::response_map::Family;
use motor_model::{DriveCommand, DriveMode, MotorParams, Parameter};
use rayon::prelude::*;
use serde::Serialize;

use simulation::math::statistics::{Line, Spread, upper_quantile};
use simulation::runs::RunError;
use simulation::runs::simulate::steps_in;
use simulation::scene::{Scene, SceneError};
use simulation::world::plant::Plant;

/// The plant's step in s. With located impacts the turns are those of a step of 1 us.
const STEP_S: &str = "5e-6";
/// [`STEP_S`] as a number.
const STEP_LENGTH_S: f64 = 5e-6;
/// Steps in a tick of the controller.
const STEPS_PER_TICK: u32 = 2;
/// Time of rest after a burst: within it every rotor stops.
const REST_S: f64 = 0.06;
/// Repetitions of a burst by one motor.
const REPEATS: u32 = 5;
/// Repetitions of a cruise by one motor.
const CRUISE_REPEATS: u32 = 3;
/// Time of a cruise before its rate is measured.
const SPIN_UP_S: f64 = 0.15;
/// Time of a cruise. The drive then goes off.
const CRUISE_S: f64 = 0.4;

/// Amplitudes of walks to choose from: the first for Table 1.
const WALK_AMPLITUDES: [f32; 4] = [0.3, 0.2, 0.14, 0.1];
/// Spread of a fine burst in one motor, per spread over motors, below which learning the motor's factor pays.
const FINE_REPEAT_PART: f64 = 0.2;

/// A burst and its turns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BurstRow {
    /// Drive amplitude.
    pub amplitude: f32,
    /// Ticks for which the drive is on.
    pub ticks: u32,
    /// Mean turn over motors, clockwise positive.
    pub turn_mdeg: f64,
    /// Standard deviation of a motor's mean over motors.
    pub motors_mdeg: f64,
    /// Standard deviation from burst to burst of one motor.
    pub repeat_mdeg: f64,
}

impl BurstRow {
    /// Whether one motor repeats it far better than motors agree.
    fn is_fine(&self) -> bool {
        self.repeat_mdeg < FINE_REPEAT_PART * self.motors_mdeg
    }
}

/// A cruise, its rates and the coast after it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CruiseRow {
    /// The mode.
    #[serde(skip)]
    pub mode: DriveMode,
    /// Drive amplitude.
    pub amplitude: f32,
    /// Mean rate over motors, clockwise positive.
    pub rate_rad_s: f64,
    /// Standard deviation of a motor's rate over motors.
    pub rate_sd_rad_s: f64,
    /// Lag of a first-order rise.
    pub spin_up_s: f64,
    /// Coast per rate at the instant at which the drive goes off.
    pub coast_s: f64,
    /// Standard deviation of the coast about `coast_s` times the rate.
    pub coast_sd_mdeg: f64,
}

/// The identified map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentifiedResponseMap {
    /// Cruises by mode, weakest first.
    pub cruises: Vec<CruiseRow>,
    /// Bursts of each family, in the order of [`Family::ALL`].
    pub bursts: Vec<Vec<BurstRow>>,
    /// Correlation over motors of the turn by a step and of that by a walk, each in the middle of its family.
    pub step_walk_correlation: f64,
    /// The design of the motors.
    #[serde(skip)]
    pub design: MotorParams,
    /// Motors drawn.
    pub motors: u64,
    /// Seed of the first motor.
    pub seed: u64,
}

/// The bursts to identify in motors of a design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BurstPlan {
    /// Ticks of a cycle in modes B and C: 15.9 and 13.4 in Table 1.
    cycle_ticks: [f64; 2],
    /// Amplitude of walks.
    walk_amplitude: f32,
}

impl BurstPlan {
    /// For motors of `design` that walk at `walk_amplitude`.
    pub fn new(design: &MotorParams, walk_amplitude: f32) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "10,000 is exact")]
        let ticks = |parameter| 1e9 / design.get(parameter) / PositionLoop::TICK_NANOS as f64;
        let cycle_ticks = [Parameter::ModeBFrequency, Parameter::ModeCFrequency].map(ticks);
        Self { cycle_ticks, walk_amplitude }
    }

    /// How many bursts there are.
    fn bursts(&self) -> usize {
        Family::ALL.into_iter().map(|family| self.bursts_of(family).len()).sum()
    }

    /// `times` the whole number of ticks that is nearest to `cycles` of `mode`.
    fn ticks(&self, mode: DriveMode, cycles: f64, times: u32) -> u32 {
        let [b, c] = self.cycle_ticks;
        let ticks = cycles * if mode == DriveMode::B { b } else { c };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most some 10,000")]
        let whole = ticks.round() as u32;
        times * whole.max(1)
    }

    /// Amplitude and ticks of each burst of `family`: near whole cycles.
    pub fn bursts_of(&self, family: Family) -> Vec<(f32, u32)> {
        let mode = family.mode();
        let at = |cycles, amplitudes: &[f32]| {
            amplitudes.iter().map(|&amplitude| (amplitude, self.ticks(mode, cycles, 1))).collect::<Vec<_>>()
        };
        let long = |amplitude: f32, lengths: &[(f64, u32)]| {
            lengths.iter().map(|&(cycles, times)| (amplitude, self.ticks(mode, cycles, times))).collect()
        };
        let tens = [1, 2, 4, 8, 16, 32, 64].map(|times| (10.0, times));
        match family {
            Family::Step => {
                let mut steps =
                    at(2.0, &[0.05, 0.07, 0.1, 0.14, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0]);
                steps.extend(at(2.5, &[1.0]));
                steps
            }
            Family::Walk => long(self.walk_amplitude, &[&[(5.0, 1), (7.0, 1)], &tens[..]].concat()),
            Family::Stride => {
                let [ten, rest @ ..] = tens;
                long(1.0, &[&[ten, (14.0, 1)], &rest[..]].concat())
            }
            Family::Nudge => at(1.0, &[0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0]),
            Family::Throw => {
                let short = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0].map(|cycles| (cycles, 1));
                let rest = [(12.0, 2), (32.0, 1), (48.0, 1), (64.0, 1), (96.0, 1), (128.0, 1)];
                long(1.0, &[&short[..], &rest[..]].concat())
            }
        }
    }
}

/// Modes and amplitudes of the cruises.
fn cruises() -> Vec<(DriveMode, f32)> {
    let of = |mode, amplitudes: &[f32]| amplitudes.iter().map(|&a| (mode, a)).collect::<Vec<_>>();
    let mut all = of(DriveMode::B, &[0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]);
    all.extend(of(DriveMode::C, &[0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0]));
    all
}

/// A sample of motors, driven open loop.
#[derive(Clone, Debug)]
pub struct ResponseMapCampaign {
    design: MotorParams,
    plants: Vec<Plant>,
    seed: u64,
}

impl ResponseMapCampaign {
    /// Draws `motors` motors. The scene's seed is that of the first, each other has the next one.
    ///
    /// # Errors
    /// When a scene is refused.
    pub fn new(scene: &Scene, motors: u64) -> Result<Self, RunError> {
        let draw = |number: u64| {
            let mut drawn = scene.without_plant_overrides().of_run(number)?;
            drawn.set("plant.step_s", STEP_S)?;
            Plant::draw(&drawn)
        };
        let plants: Result<Vec<Plant>, SceneError> = (0..motors).map(draw).collect();
        Ok(Self { design: scene.motor_params(), plants: plants?, seed: scene.seed() })
    }

    /// The bursts to identify, with that amplitude of walks.
    pub fn plan(&self, walk_amplitude: f32) -> BurstPlan {
        BurstPlan::new(&self.design, walk_amplitude)
    }

    /// The strongest of [`WALK_AMPLITUDES`] at which a walk of 40 cycles repeats as a fine burst does; the weakest if
    /// none does.
    fn walk_amplitude(&self) -> f32 {
        let [strongest, .., weakest] = WALK_AMPLITUDES;
        let ticks = self.plan(strongest).ticks(DriveMode::C, 10.0, 4);
        let is_fine = |amplitude: &f32| self.burst(DriveMode::C, *amplitude, ticks).is_fine();
        WALK_AMPLITUDES.into_iter().find(is_fine).unwrap_or(weakest)
    }

    /// The unit of progress: motors times drives.
    pub fn work(&self) -> u64 {
        let drives = cruises().len() + self.plan(WALK_AMPLITUDES[0]).bursts();
        (drives * self.plants.len()) as u64
    }

    /// Identifies the whole map. `progress` gets the number of motors at each drive.
    pub fn run(&self, progress: &(impl Fn(u64) + Sync)) -> IdentifiedResponseMap {
        let plan = self.plan(self.walk_amplitude());
        let cruises = cruises().into_iter().map(|(mode, amplitude)| {
            progress(self.plants.len() as u64);
            self.cruise(mode, amplitude)
        });
        let cruises = cruises.collect();
        let bursts = |family: Family| {
            let row = |(amplitude, ticks)| {
                progress(self.plants.len() as u64);
                self.burst(family.mode(), amplitude, ticks)
            };
            plan.bursts_of(family).into_iter().map(row).collect()
        };
        IdentifiedResponseMap {
            cruises,
            bursts: Family::ALL.into_iter().map(bursts).collect(),
            step_walk_correlation: self.correlation(
                (0.3, plan.ticks(DriveMode::C, 2.0, 1)),
                (plan.walk_amplitude, plan.ticks(DriveMode::C, 10.0, 8)),
            ),
            design: self.design,
            motors: self.plants.len() as u64,
            seed: self.seed,
        }
    }

    /// Mean and spread of the turns of one burst by each motor, [`REPEATS`] turns each.
    fn turns_mdeg(&self, mode: DriveMode, amplitude: f32, ticks: u32) -> Vec<Spread> {
        let command = DriveCommand::saturating(mode, amplitude);
        let of_motor = |plant: &Plant| {
            let mut plant = plant.clone();
            // The rotor of a drawn motor starts slightly above the teeth.
            rest(&mut plant);
            let mut turn = || {
                let before = plant.rotor().angle;
                for _ in 0..ticks * STEPS_PER_TICK {
                    plant.step(command);
                }
                rest(&mut plant);
                1e3 * plant.rotor().angle.minus(before).degrees()
            };
            (0..REPEATS).map(|_| turn()).collect()
        };
        self.plants.par_iter().map(of_motor).collect()
    }

    /// Identifies one burst.
    pub fn burst(&self, mode: DriveMode, amplitude: f32, ticks: u32) -> BurstRow {
        let motors = self.turns_mdeg(mode, amplitude, ticks);
        let means: Spread = motors.iter().map(|motor| motor.mean).collect();
        let mut within: Vec<f64> = motors.iter().map(|motor| motor.sd).collect();
        let repeat_mdeg = upper_quantile(&mut within, 800).unwrap_or_default();
        BurstRow { amplitude, ticks, turn_mdeg: means.mean, motors_mdeg: means.sd, repeat_mdeg }
    }

    /// Correlation over motors of two bursts of mode C.
    fn correlation(&self, one: (f32, u32), other: (f32, u32)) -> f64 {
        let [one, other] = [one, other].map(|(a, t)| self.turns_mdeg(DriveMode::C, a, t));
        let points: Vec<_> = one.iter().zip(&other).map(|(x, y)| (x.mean, y.mean)).collect();
        Line::through(&points).map_or(0.0, |line| line.correlation)
    }

    /// Identifies one cruise.
    pub fn cruise(&self, mode: DriveMode, amplitude: f32) -> CruiseRow {
        let command = DriveCommand::saturating(mode, amplitude);
        let motors: Vec<Vec<CruiseRun>> = self
            .plants
            .par_iter()
            .map(|plant| {
                let mut plant = plant.clone();
                (0..CRUISE_REPEATS).map(|_| CruiseRun::of(&mut plant, command)).collect()
            })
            .collect();
        let mean =
            |runs: &[CruiseRun], of: fn(&CruiseRun) -> f64| runs.iter().map(of).collect::<Spread>().mean;
        let rates: Spread = motors.iter().map(|runs| mean(runs, |run| run.rate_rad_s)).collect();
        let lag = |runs: &Vec<CruiseRun>| {
            let rate = mean(runs, |run| run.rate_rad_s);
            SPIN_UP_S - mean(runs, |run| run.spun_up_rad) / rate
        };
        let lags: Spread = motors.iter().map(lag).collect();
        let all: Vec<&CruiseRun> = motors.iter().flatten().collect();
        let sum = |of: fn(&CruiseRun) -> f64| all.iter().map(|run| of(run)).sum::<f64>();
        let coast_s = sum(|run| run.cut_rad_s * run.coast_rad) / sum(|run| run.cut_rad_s * run.cut_rad_s);
        let left: Spread = all.iter().map(|run| run.coast_rad - coast_s * run.cut_rad_s).collect();
        CruiseRow {
            mode,
            amplitude,
            rate_rad_s: rates.mean,
            rate_sd_rad_s: rates.sd,
            spin_up_s: lags.mean.clamp(1e-3, SPIN_UP_S),
            coast_s,
            coast_sd_mdeg: 1e3 * left.sd.to_degrees(),
        }
    }
}

/// One cruise of one motor: angle turned in the spin-up, mean rate after it, rate at the cut, coast after it.
struct CruiseRun {
    spun_up_rad: f64,
    rate_rad_s: f64,
    cut_rad_s: f64,
    coast_rad: f64,
}

impl CruiseRun {
    fn of(plant: &mut Plant, command: DriveCommand) -> Self {
        let mut turn = |time_s: f64, command| {
            let before = plant.rotor().angle;
            run_for(plant, time_s, command);
            plant.rotor().angle.minus(before).degrees().to_radians()
        };
        let spun_up_rad = turn(SPIN_UP_S, command);
        let rate_rad_s = turn(CRUISE_S - SPIN_UP_S, command) / (CRUISE_S - SPIN_UP_S);
        let cut_rad_s = plant.rotor().rate_rad_s;
        let before = plant.rotor().angle;
        rest(plant);
        rest(plant);
        let coast_rad = plant.rotor().angle.minus(before).degrees().to_radians();
        Self { spun_up_rad, rate_rad_s, cut_rad_s, coast_rad }
    }
}

fn run_for(plant: &mut Plant, time_s: f64, command: DriveCommand) {
    for _ in 0..steps_in(time_s, STEP_LENGTH_S) {
        plant.step(command);
    }
}

fn rest(plant: &mut Plant) {
    run_for(plant, REST_S, DriveCommand::OFF);
}
