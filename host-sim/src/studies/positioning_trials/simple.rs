//! Simpler programs than the controller, on the same rig and filters.

use std::ops::ControlFlow;

use controller::response_map::{direction, strongest_cruise};
use controller::{Drive as _, Sense as _, TICK_NANOS, Target};
use estimator::{AngleFilter as _, CameraFrame, Estimate, Health};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use super::naive::{Entry, Table};
use crate::runs::filter::AnyFilter;
use crate::runs::position::{MoveOutcome, MoveSums, MoveTick};
use crate::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use crate::scene::Scene;
use crate::studies::StudyError;

/// How a simple program decides.
#[derive(Clone, Debug)]
pub enum Rule {
    /// Approach by the mean coast, then bursts from a table, the camera averaged between them.
    Naive(Table),
    /// Approach by the mean coast, and no more.
    CutOff,
    /// Full drive towards the target outside a dead band.
    BangBang,
}

/// Half width of the dead band in rad: 20 milli-degrees, what an estimate of a moving rotor can tell.
const DEAD_BAND_RAD: f32 = 3.5e-4;
/// A bang-bang program that has not settled by then, in ns, is stopped where it is.
const PATIENCE_NANOS: u64 = 3_000_000_000;
/// What the naive program waits after a burst, in ns.
const CALM_NANOS: u64 = 20_000_000;
/// Frames that it averages far from the target, and near.
const FRAMES: (u32, u32) = (100, 2000);
/// Within this it counts as near, and within the other as there, in milli-degrees.
const NEAR_MDEG: f64 = 20.0;
const THERE_MDEG: f64 = 0.4;
/// Bursts after which it takes what it has.
const BURSTS_MAX: u32 = 60;
/// Where its table takes over from the approach, in rad: a degree.
const TABLE_RAD: f32 = 0.0175;

/// What the program is doing.
#[derive(Clone, Copy, Debug)]
enum State {
    Looking,
    Approaching(DriveMode),
    Stopping,
    Bursting { entry: Entry, since: Time },
    Averaging { from: Time, mean: Mean },
    Done,
}

/// Mean of frames about the first.
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    first: Option<Angle>,
    sum_deg: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, frame: &CameraFrame) {
        let first = *self.first.get_or_insert(frame.angle);
        self.sum_deg += frame.angle.minus(first).wrapped().degrees();
        self.count += 1;
    }

    /// Target less mean, in milli-degrees, within half a turn.
    fn remaining_mdeg(&self, target: Target) -> f64 {
        let off = target.angle().minus(self.first.unwrap_or_default()).wrapped().degrees();
        1e3 * (off - self.sum_deg / f64::from(self.count.max(1)))
    }
}

struct Program {
    rule: Rule,
    target: Target,
    state: State,
    bursts: u32,
}

impl Program {
    fn decide(
        &mut self,
        now: Time,
        estimate: Option<&Estimate<f32>>,
        frame: Option<&CameraFrame>,
    ) -> DriveCommand {
        self.state = match (self.state, estimate) {
            (State::Done, _) | (State::Looking, None) => self.state,
            (State::Approaching(_) | State::Stopping, None) => State::Stopping,
            (State::Looking, Some(estimate)) => self.start(estimate),
            (State::Approaching(mode), Some(estimate)) => self.approach(mode, estimate),
            (State::Stopping, Some(estimate)) => self.stopped(now, estimate),
            (State::Bursting { entry, since }, _) => {
                if now.nanos_since(since) < u64::from(entry.ticks) * TICK_NANOS {
                    self.state
                } else {
                    State::Averaging { from: now.plus_nanos(CALM_NANOS), mean: Mean::default() }
                }
            }
            (State::Averaging { from, mean }, _) => self.average(now, from, mean, frame),
        };
        if matches!(self.rule, Rule::BangBang) && now.nanos() > PATIENCE_NANOS {
            self.state = State::Done;
        }
        match self.state {
            State::Approaching(mode) => DriveCommand::full(mode),
            State::Bursting { entry, .. } => entry.command,
            _ => DriveCommand::OFF,
        }
    }

    fn remaining_rad(&self, estimate: &Estimate<f32>) -> f32 {
        self.target.angle().radians_since(estimate.angle)
    }

    fn start(&self, estimate: &Estimate<f32>) -> State {
        let remaining_rad = self.remaining_rad(estimate);
        let least_rad = match self.rule {
            Rule::Naive(_) => TABLE_RAD,
            Rule::CutOff | Rule::BangBang => DEAD_BAND_RAD,
        };
        if remaining_rad.abs() < least_rad {
            State::Stopping
        } else {
            State::Approaching(if remaining_rad > 0.0 { DriveMode::B } else { DriveMode::C })
        }
    }

    fn approach(&self, mode: DriveMode, estimate: &Estimate<f32>) -> State {
        let direction = direction(mode);
        let remaining_rad = direction * self.remaining_rad(estimate);
        let coast_s = match self.rule {
            Rule::BangBang => 0.0,
            Rule::Naive(_) | Rule::CutOff => strongest_cruise(mode, 1.0).map_or(0.0, |cruise| cruise.coast_s),
        };
        let coast_rad = (direction * estimate.rate_rad_s).max(0.0) * coast_s;
        if remaining_rad <= coast_rad { State::Stopping } else { State::Approaching(mode) }
    }

    fn stopped(&self, now: Time, estimate: &Estimate<f32>) -> State {
        match self.rule {
            // It does not wait for rest.
            Rule::BangBang if self.remaining_rad(estimate).abs() > DEAD_BAND_RAD => self.start(estimate),
            Rule::BangBang | Rule::CutOff if estimate.resting => State::Done,
            Rule::BangBang | Rule::CutOff => State::Stopping,
            Rule::Naive(_) => State::Averaging { from: now.plus_nanos(CALM_NANOS), mean: Mean::default() },
        }
    }

    fn average(&mut self, now: Time, from: Time, mut mean: Mean, frame: Option<&CameraFrame>) -> State {
        if let Some(frame) = frame.filter(|frame| frame.exposed_at > from) {
            mean.add(frame);
        }
        let remaining_mdeg = mean.remaining_mdeg(self.target);
        let near = remaining_mdeg.abs() < NEAR_MDEG;
        if mean.count < if near { FRAMES.1 } else { FRAMES.0 } {
            return State::Averaging { from, mean };
        }
        self.bursts += 1;
        if remaining_mdeg.abs() <= THERE_MDEG || self.bursts > BURSTS_MAX {
            return State::Done;
        }
        match &self.rule {
            Rule::Naive(table) => match table.nearest(remaining_mdeg) {
                Some(entry) => State::Bursting { entry, since: now },
                None => State::Done,
            },
            Rule::CutOff | Rule::BangBang => State::Done,
        }
    }
}

/// A simple program with its filter.
struct SimpleLoop {
    filter: AnyFilter,
    program: Program,
}

/// What it says of a tick.
struct SimpleReport {
    estimate: Option<Estimate<f32>>,
    applied: DriveCommand,
    holding: bool,
}

impl TickProgram for SimpleLoop {
    type Report = SimpleReport;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> SimpleReport {
        let Self { filter, program } = self;
        while let Some(sample) = ports.ldv_sample() {
            filter.update_ldv(&sample);
        }
        let frame = ports.camera_frame();
        if let Some(frame) = &frame {
            filter.update_camera(frame);
        }
        let estimate = filter.estimate(now);
        let usable = estimate.as_ref().filter(|_| !matches!(filter.health(now), Health::Unusable(_)));
        let applied = ports.drive(program.decide(now, usable, frame.as_ref()));
        filter.drive(now, applied);
        SimpleReport { estimate, applied, holding: matches!(program.state, State::Done) }
    }
}

/// Runs the move of `scene` by `rule`.
///
/// # Errors
/// When the scene is refused.
pub(super) fn run(scene: &Scene, rule: Rule) -> Result<MoveOutcome, StudyError> {
    let target = Target::try_new(scene.number("position.to_deg"), scene.number("position.tolerance_deg"))?;
    let program = Program { rule, target, state: State::Looking, bursts: 0 };
    let mut sums = MoveSums::new(target);
    let [hold_nanos, deadline_nanos] = ["position.hold_s", "position.deadline_s"].map(|key| scene.nanos(key));
    let mut driver = TickDriver::new(scene, SimpleLoop { filter: AnyFilter::of(scene)?, program })?;
    Ok(driver.run(|_, moment| {
        let SimpleReport { estimate, applied, holding } = moment.report;
        let step = MoveTick {
            at: moment.at,
            angle: moment.angle,
            rate_rad_s: moment.rate_rad_s,
            estimate,
            applied,
            holding,
        };
        sums.take(&step);
        let held = sums.held_nanos(moment.at) >= hold_nanos && holding;
        if held || moment.at.nanos() > deadline_nanos {
            ControlFlow::Break(sums.close(&step, scene))
        } else {
            ControlFlow::Continue(())
        }
    }))
}
