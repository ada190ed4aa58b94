//! Baselines: simpler programs than the controller, on the same rig and filters.

use std::ops::ControlFlow;
use std::sync::Arc;

use controller::response_map::{ResponseMap, direction};
use controller::{Drive as _, Sense as _, TICK_NANOS, Target};
use estimator::{AngleFilter as _, CameraFrame, Estimate, Health};
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use super::burst_table::{BurstTable, TableBurst};
use simulation::runs::RunError;
use simulation::runs::filter::AnyFilter;
use simulation::runs::position::{MoveOutcome, MoveSums, MoveTick};
use simulation::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use simulation::scene::Scene;

/// The rule by which a baseline decides.
#[derive(Clone, Debug)]
pub enum BaselineRule {
    /// Approach by the mean coast, then bursts from a table, the camera averaged between them.
    BurstTable(BurstTable),
    /// Approach by the mean coast, and no more.
    CutOff,
    /// Full drive towards the target outside a dead band.
    BangBang,
}

/// Half width of the dead band in rad: 20 milli-degrees, about the error of an estimate of a moving rotor.
const DEAD_BAND_RAD: f32 = 3.5e-4;
/// Time in ns after which the bang-bang program stops, settled or not.
const BANG_BANG_DEADLINE_NANOS: u64 = 3_000_000_000;
/// Wait of the program with the table after a burst, in ns, until the stator has rung down.
const RINGDOWN_NANOS: u64 = 20_000_000;
/// Frames that it averages, far from the target and near.
const FRAMES: (u32, u32) = (100, 2000);
/// Distance from the target that counts as near, in milli-degrees.
const NEAR_MDEG: f64 = 20.0;
/// Distance from the target that counts as reached, in milli-degrees.
const REACHED_MDEG: f64 = 0.4;
/// Number of bursts after which it stops.
const BURSTS_MAX: u32 = 60;
/// Distance within which it begins with bursts instead of an approach, in rad: a degree.
const TABLE_RAD: f32 = 0.0175;

/// What a baseline does at present.
#[derive(Clone, Copy, Debug)]
enum BaselineState {
    WaitingForEstimate,
    Approaching(DriveMode),
    Stopping,
    Bursting { burst: TableBurst, since: Time },
    Averaging { from: Time, mean: FrameMean },
    Done,
}

/// The mean angle of frames, taken about the first of them.
#[derive(Clone, Copy, Debug, Default)]
struct FrameMean {
    first: Option<Angle>,
    sum_deg: f64,
    count: u32,
}

impl FrameMean {
    fn add(&mut self, frame: &CameraFrame) {
        let first = *self.first.get_or_insert(frame.angle);
        self.sum_deg += frame.angle.minus(first).wrapped().degrees();
        self.count += 1;
    }

    /// Target less mean in milli-degrees, within half a turn.
    fn remaining_mdeg(&self, target: Target) -> f64 {
        let off = target.angle().minus(self.first.unwrap_or_default()).wrapped().degrees();
        1e3 * (off - self.sum_deg / f64::from(self.count.max(1)))
    }
}

/// A rule on its way to a target.
struct BaselineProgram {
    rule: BaselineRule,
    /// The map of the motor's design: its mean coast.
    map: Arc<ResponseMap>,
    target: Target,
    state: BaselineState,
    bursts: u32,
}

impl BaselineProgram {
    fn decide(
        &mut self,
        now: Time,
        estimate: Option<&Estimate<f32>>,
        frame: Option<&CameraFrame>,
    ) -> DriveCommand {
        self.state = match (self.state, estimate) {
            (BaselineState::Done, _) | (BaselineState::WaitingForEstimate, None) => self.state,
            (BaselineState::Approaching(_) | BaselineState::Stopping, None) => BaselineState::Stopping,
            (BaselineState::WaitingForEstimate, Some(estimate)) => self.start(estimate),
            (BaselineState::Approaching(mode), Some(estimate)) => self.approach(mode, estimate),
            (BaselineState::Stopping, Some(estimate)) => self.stopped(now, estimate),
            (BaselineState::Bursting { burst, since }, _) => {
                if now.nanos_since(since) < u64::from(burst.ticks) * TICK_NANOS {
                    self.state
                } else {
                    BaselineState::Averaging {
                        from: now.plus_nanos(RINGDOWN_NANOS),
                        mean: FrameMean::default(),
                    }
                }
            }
            (BaselineState::Averaging { from, mean }, _) => self.average(now, from, mean, frame),
        };
        if matches!(self.rule, BaselineRule::BangBang) && now.nanos() > BANG_BANG_DEADLINE_NANOS {
            self.state = BaselineState::Done;
        }
        match self.state {
            BaselineState::Approaching(mode) => DriveCommand::full(mode),
            BaselineState::Bursting { burst, .. } => burst.command,
            _ => DriveCommand::OFF,
        }
    }

    fn remaining_rad(&self, estimate: &Estimate<f32>) -> f32 {
        self.target.angle().radians_since(estimate.angle)
    }

    fn start(&self, estimate: &Estimate<f32>) -> BaselineState {
        let remaining_rad = self.remaining_rad(estimate);
        let least_rad = match self.rule {
            BaselineRule::BurstTable(_) => TABLE_RAD,
            BaselineRule::CutOff | BaselineRule::BangBang => DEAD_BAND_RAD,
        };
        if remaining_rad.abs() < least_rad {
            BaselineState::Stopping
        } else {
            BaselineState::Approaching(if remaining_rad > 0.0 { DriveMode::B } else { DriveMode::C })
        }
    }

    fn approach(&self, mode: DriveMode, estimate: &Estimate<f32>) -> BaselineState {
        let direction = direction(mode);
        let remaining_rad = direction * self.remaining_rad(estimate);
        let coast_s = match self.rule {
            BaselineRule::BangBang => 0.0,
            BaselineRule::BurstTable(_) | BaselineRule::CutOff => {
                self.map.strongest_cruise(mode, 1.0).map_or(0.0, |cruise| cruise.coast_s)
            }
        };
        let coast_rad = (direction * estimate.rate_rad_s).max(0.0) * coast_s;
        if remaining_rad <= coast_rad { BaselineState::Stopping } else { BaselineState::Approaching(mode) }
    }

    fn stopped(&self, now: Time, estimate: &Estimate<f32>) -> BaselineState {
        match self.rule {
            // It goes on without a wait for rest.
            BaselineRule::BangBang if self.remaining_rad(estimate).abs() > DEAD_BAND_RAD => {
                self.start(estimate)
            }
            BaselineRule::BangBang | BaselineRule::CutOff if estimate.resting => BaselineState::Done,
            BaselineRule::BangBang | BaselineRule::CutOff => BaselineState::Stopping,
            BaselineRule::BurstTable(_) => {
                BaselineState::Averaging { from: now.plus_nanos(RINGDOWN_NANOS), mean: FrameMean::default() }
            }
        }
    }

    fn average(
        &mut self,
        now: Time,
        from: Time,
        mut mean: FrameMean,
        frame: Option<&CameraFrame>,
    ) -> BaselineState {
        if let Some(frame) = frame.filter(|frame| frame.exposed_at > from) {
            mean.add(frame);
        }
        let remaining_mdeg = mean.remaining_mdeg(self.target);
        let near = remaining_mdeg.abs() < NEAR_MDEG;
        if mean.count < if near { FRAMES.1 } else { FRAMES.0 } {
            return BaselineState::Averaging { from, mean };
        }
        self.bursts += 1;
        if remaining_mdeg.abs() <= REACHED_MDEG || self.bursts > BURSTS_MAX {
            return BaselineState::Done;
        }
        match &self.rule {
            BaselineRule::BurstTable(table) => match table.nearest(remaining_mdeg) {
                Some(burst) => BaselineState::Bursting { burst, since: now },
                None => BaselineState::Done,
            },
            BaselineRule::CutOff | BaselineRule::BangBang => BaselineState::Done,
        }
    }
}

/// A baseline with its filter. Its commands act at once, whatever the latency of the scene.
struct BaselineLoop {
    filter: AnyFilter,
    program: BaselineProgram,
}

/// What a baseline reports of a tick.
struct BaselineReport {
    estimate: Option<Estimate<f32>>,
    applied: DriveCommand,
    holding: bool,
}

impl TickProgram for BaselineLoop {
    type Report = BaselineReport;

    fn tick(&mut self, now: Time, ports: &mut RigPorts) -> BaselineReport {
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
        BaselineReport { estimate, applied, holding: matches!(program.state, BaselineState::Done) }
    }
}

/// Runs the move of `scene` by `rule`.
///
/// # Errors
/// When the scene is refused.
pub(super) fn run(scene: &Scene, rule: BaselineRule) -> Result<MoveOutcome, RunError> {
    let target = Target::try_new(scene.number("position.to_deg"), scene.number("position.tolerance_deg"))?;
    let map = scene.response_map()?;
    let program = BaselineProgram { rule, map, target, state: BaselineState::WaitingForEstimate, bursts: 0 };
    let mut sums = MoveSums::new(target);
    let [hold_nanos, deadline_nanos] = ["position.hold_s", "position.deadline_s"].map(|key| scene.nanos(key));
    let mut driver = TickDriver::new(scene, BaselineLoop { filter: AnyFilter::of(scene)?, program })?;
    Ok(driver.run(|_, moment| {
        let BaselineReport { estimate, applied, holding } = moment.report;
        let tick = MoveTick {
            at: moment.at,
            angle: moment.angle,
            rate_rad_s: moment.rate_rad_s,
            tilt: moment.tilt,
            estimate,
            applied,
            holding,
            loop_state: None,
        };
        sums.add(&tick);
        let held = sums.held_nanos(moment.at) >= hold_nanos && holding;
        if held || moment.at.nanos() > deadline_nanos {
            ControlFlow::Break(sums.outcome(&tick, scene))
        } else {
            ControlFlow::Continue(())
        }
    }))
}

#[cfg(test)]
mod tests {
    use controller::response_map::Family;

    use super::*;

    /// At 10 rad/s the motors of Table 1 coast for 0.11 rad, and those of a map of three times the coast for 0.33: at
    /// 0.2 rad from the target the first are still driven, and the second are not.
    #[test]
    fn exact_the_cut_off_leaves_the_coast_of_its_map() {
        let table_1 = ResponseMap::table_1();
        let mut cruises = table_1.cruises().to_vec();
        for cruise in &mut cruises {
            cruise.coast_s *= 3.0;
        }
        let bursts = Family::ALL.map(|family| table_1.bursts(family));
        let far = ResponseMap::try_new(*table_1.design(), &cruises, bursts, 0.0).unwrap();
        for (map, drives) in [(*table_1, true), (far, false)] {
            let program = BaselineProgram {
                rule: BaselineRule::CutOff,
                map: Arc::new(map),
                target: Target::try_new(f64::to_degrees(0.2), 1e-3).unwrap(),
                state: BaselineState::WaitingForEstimate,
                bursts: 0,
            };
            let estimate = Estimate {
                at: Time::ZERO,
                angle: Angle::ZERO,
                rate_rad_s: 10.0,
                angle_rad2: 1e-6,
                angle_rate_rad2_s: 0.0,
                rate_rad2_s2: 1e-2,
                resting: false,
            };
            let approaches =
                matches!(program.approach(DriveMode::B, &estimate), BaselineState::Approaching(_));
            assert_eq!(approaches, drives);
        }
    }
}
