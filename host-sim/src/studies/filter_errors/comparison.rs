//! One motor on the rig under the timeline's drive, and all filters and genies beside each other on the same frames and
//! samples.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use controller::{Drive as _, Sense as _};
use estimator::{AngleFilter as _, CameraFrame, Health, Innovation, LdvSample};
use motor_model::{DriveCommand, DriveMode, Real, Time};

use super::error_sums::ErrorSums;
use super::genie::Genie;
use super::kicks::{FreeMotion, TrueMotion};
use super::timeline::{self, TimelinePhase};
use crate::runs::RunError;
use crate::runs::filter::{AnyFilter, FILTERS, SMOOTHER_LAG_MS};
use crate::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use crate::scene::Scene;
use crate::world::instruments::Camera;
use crate::world::rig::PlantStep;

/// Genies: name, and the share to which each knows the kicks.
pub(crate) const GENIES: [(&str, f64); 3] =
    [("genie", 0.0), ("genie_10_percent", 0.1), ("genie_3_percent", 0.03)];

/// Smoothed estimates, [`SMOOTHER_LAG_MS`] later: name, and the filter's place in [`FILTERS`].
pub const SMOOTHED: [(&str, usize); 2] = [("constant_rate_smoothed", 0), ("impact_aided_smoothed", 1)];

/// Ticks from one comparison of the estimates to the next. 7 is prime to the 10 ticks of a camera period, so that
/// frames of all ages occur.
const TICKS_PER_COMPARISON: u64 = 7;

/// The error sums of one filter, by phase.
pub(crate) type PhaseSums = [ErrorSums; TimelinePhase::ALL.len()];

/// Names of what is compared, in the order of the sums.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    FILTERS.iter().copied().chain(SMOOTHED.iter().map(|of| of.0)).chain(GENIES.iter().map(|genie| genie.0))
}

/// Runs the motor of `scene` under `mode`, and calls `progress` every simulated millisecond.
///
/// # Errors
/// When the scene is refused.
pub(crate) fn run(
    scene: &Scene,
    mode: DriveMode,
    progress: &impl Fn(u64),
) -> Result<Vec<PhaseSums>, RunError> {
    let mut driver = TickDriver::new(scene, FilterComparison::new(scene, mode)?)?;
    let command = driver.program_mut().enter(Time::ZERO);
    driver.overrule(command);
    let mut ticks = 0;
    driver.run(|_, moment| {
        ticks += 1;
        if ticks % TICKS_PER_MS == 0 {
            progress(1);
        }
        let over = moment.at.nanos() >= timeline::duration_nanos();
        if over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    Ok(driver.into_program().sums)
}

const TICKS_PER_MS: u64 = 100;

#[expect(clippy::cast_possible_truncation, reason = "200")]
const LAG_TICKS: usize = (SMOOTHER_LAG_MS * TICKS_PER_MS) as usize;

/// All filters and genies on the same frames and samples, and the error sums of each.
struct FilterComparison {
    mode: DriveMode,
    phase: Option<TimelinePhase>,
    free_motion: FreeMotion,
    filters: Vec<AnyFilter>,
    genies: Vec<Genie>,
    /// Of the filters, then of their smoothers, then of the genies.
    sums: Vec<PhaseSums>,
    /// The truth of the last ticks, the newest last, over the lag of the smoothers.
    truths: VecDeque<TrueMotion>,
    ticks: u64,
}

impl FilterComparison {
    fn new(scene: &Scene, mode: DriveMode) -> Result<Self, RunError> {
        let camera_rad2 = Camera::variance_rad2(scene);
        let genie = |&(_, share): &(_, f64)| Genie::new(share, camera_rad2, scene.seed());
        Ok(Self {
            mode,
            phase: None,
            free_motion: FreeMotion::default(),
            filters: FILTERS.iter().map(|name| AnyFilter::named(name, scene)).collect::<Result<_, _>>()?,
            genies: GENIES.iter().map(genie).collect(),
            sums: names().map(|_| PhaseSums::default()).collect(),
            truths: VecDeque::new(),
            ticks: 0,
        })
    }

    /// Begins the tick at `now`: gives the filters its drive, and interrupts the sums where a phase begins.
    fn enter(&mut self, now: Time) -> DriveCommand {
        let (command, phase) = timeline::at(now, self.mode);
        self.filters.iter_mut().for_each(|filter| filter.drive(now, command));
        if phase != self.phase {
            self.phase = phase;
            self.sums.iter_mut().flatten().for_each(ErrorSums::interrupt);
        }
        command
    }

    fn take_ldv(&mut self, sample: &LdvSample) {
        for (filter, sums) in self.filters.iter_mut().zip(&mut self.sums) {
            if let Some(innovation) = filter.update_ldv(sample) {
                add_innovation(sums, self.phase, &innovation);
            }
        }
    }

    fn take_frame(&mut self, frame: &CameraFrame) {
        let (filters, genies) = self.sums.split_at_mut(self.filters.len() + SMOOTHED.len());
        for (filter, sums) in self.filters.iter_mut().zip(filters) {
            add_innovation(sums, self.phase, &filter.update_camera(frame));
        }
        for (genie, sums) in self.genies.iter_mut().zip(genies) {
            add_innovation(sums, self.phase, &genie.update_camera(frame));
        }
    }

    /// Keeps the truth of a tick's end for the smoothers.
    fn keep_truth(&mut self, now: TrueMotion) {
        if self.truths.len() > LAG_TICKS {
            self.truths.pop_front();
        }
        self.truths.push_back(now);
    }

    /// Compares every estimate with the truth.
    fn compare(&mut self, phase: TimelinePhase, now: &TrueMotion) {
        let TrueMotion { at, angle, rate_rad_s, .. } = *now;
        let (filters, others) = self.sums.split_at_mut(self.filters.len());
        let (smoothed, genies) = others.split_at_mut(SMOOTHED.len());
        if let Some(then) = self.truths.front().filter(|_| self.truths.len() > LAG_TICKS) {
            for ((_, place), sums) in SMOOTHED.iter().zip(smoothed) {
                let filter = &self.filters[*place];
                let (estimate, health) = (filter.smoothed(then.at), filter.health(at));
                sums[phase as usize].estimate(estimate.as_ref(), health, then.angle, then.rate_rad_s);
            }
        }
        for (filter, sums) in self.filters.iter().zip(filters) {
            let (estimate, health) = (filter.estimate(at), filter.health(at));
            sums[phase as usize].estimate(estimate.as_ref(), health, angle, rate_rad_s);
        }
        for (genie, sums) in self.genies.iter().zip(genies) {
            sums[phase as usize].estimate(genie.estimate().as_ref(), Health::Good, angle, rate_rad_s);
        }
    }
}

impl TickProgram for FilterComparison {
    type Report = ();

    /// The genies are given every kick.
    const OBSERVES_STEPS: bool = true;

    fn step(&mut self, step: &PlantStep) {
        let [before, after] = [&step.before, &step.after].map(TrueMotion::of);
        let genies = &mut self.genies;
        self.free_motion.step(&before, &after, step.touched, |kick| {
            for genie in genies.iter_mut() {
                genie.give(&kick);
            }
        });
    }

    fn tick(&mut self, now: Time, ports: &mut RigPorts) {
        let truth = TrueMotion { at: now, ..TrueMotion::of(&ports.plant().rotor()) };
        let genies = &mut self.genies;
        self.free_motion.close(&truth, |kick| genies.iter_mut().for_each(|genie| genie.give(&kick)));
        self.keep_truth(truth);
        while let Some(sample) = ports.ldv_sample() {
            self.take_ldv(&sample);
        }
        while let Some(frame) = ports.camera_frame() {
            self.take_frame(&frame);
        }
        self.ticks += 1;
        if let Some(phase) = self.phase.filter(|_| self.ticks.is_multiple_of(TICKS_PER_COMPARISON)) {
            self.compare(phase, &truth);
        }
        ports.drive(self.enter(now));
    }
}

fn add_innovation<T: Real>(sums: &mut PhaseSums, phase: Option<TimelinePhase>, innovation: &Innovation<T>) {
    if let Some(phase) = phase {
        sums[phase as usize].innovation(innovation);
    }
}
