//! One motor on the rig under the timeline's drive, and all filters and genies beside each other on the same frames and
//! samples.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::Instant;

use controller::{Drive as _, Sense as _};
use estimator::{AngleFilter as _, CameraFrame, Health, LdvSample};
use motor_model::{DriveCommand, DriveMode, Time};
use serde::{Deserialize, Serialize};

use super::error_sums::ErrorSums;
use super::genie::Genie;
use super::kicks::{FreeMotion, TrueMotion};
use super::phase_sums::{PhaseSums, add_innovation};
use super::rate_walk::RateWalk;
use super::timeline::{self, TimelinePhase};
use super::told::{ToldFilter, ToldSet, contacts_of};
use simulation::math::count::real;
use simulation::runs::RunError;
use simulation::runs::filter::{AnyFilter, FILTERS, SMOOTHER_LAG_MS};
use simulation::runs::tick_driver::{RigPorts, TickDriver, TickProgram};
use simulation::scene::Scene;
use simulation::world::instruments::Camera;
use simulation::world::plant::Plant;
use simulation::world::rig::PlantStep;

/// Genies: name, and the share to which each knows the kicks.
pub const GENIES: [(&str, f64); 3] = [("genie", 0.0), ("genie_10_percent", 0.1), ("genie_3_percent", 0.03)];

/// Smoothed estimates, [`SMOOTHER_LAG_MS`] later: name, and the filter's place in [`FILTERS`].
pub const SMOOTHED: [(&str, usize); 3] =
    [("constant_rate_smoothed", 0), ("impact_aided_smoothed", 1), ("twin_smoothed", 2)];

/// Ticks from one comparison of the estimates to the next. 7 is prime to the 10 ticks of a camera period, so that
/// frames of all ages occur.
const TICKS_PER_COMPARISON: u64 = 7;

/// Names of what is compared, in the order of the sums.
pub fn names() -> impl Iterator<Item = &'static str> {
    FILTERS.iter().copied().chain(SMOOTHED.iter().map(|of| of.0)).chain(GENIES.iter().map(|genie| genie.0))
}

/// How far a run goes, and what is compared beside the filters. Sums of what is left out are of no errors.
#[derive(Clone, Copy, Debug)]
pub struct ComparedScope {
    /// The last phase of the run.
    pub last: TimelinePhase,
    /// Whether genies run beside.
    pub genies: bool,
    /// Whether smoothers are compared.
    pub smoothers: bool,
}

impl Default for ComparedScope {
    fn default() -> Self {
        Self { last: TimelinePhase::Rest1S, genies: true, smoothers: true }
    }
}

/// What a run gives.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ComparedRun {
    /// The error sums of each of [`names`].
    pub sums: Vec<PhaseSums>,
    /// The same of filters that were told parts of the truth.
    pub told: Vec<(ToldSet, PhaseSums)>,
    /// The walk of the rate that its camera sees.
    pub walk: RateWalk,
    /// What the run cost.
    pub cost: RunCost,
}

/// Time that a run took on this machine.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RunCost {
    ticks: u64,
    /// Of the rig: plant, instruments, and the kicks for the genies.
    rig_s: f64,
    /// Of each filter: to take in what arrived in a tick.
    filters_s: [f64; FILTERS.len()],
}

impl RunCost {
    /// Time in s of a second of motor time.
    pub fn rig_s_per_s(&self) -> f64 {
        self.rig_s / (real(self.ticks) * TICK_S)
    }

    /// Time in ns of a tick of the filter at `place` in [`FILTERS`].
    pub fn filter_ns(&self, place: usize) -> f64 {
        1e9 * self.filters_s[place] / real(self.ticks)
    }
}

/// Runs the motor of `scene` under `mode` within `scope`, with a filter beside for each set of `told`, and calls
/// `progress` every simulated millisecond.
///
/// # Errors
/// When the scene is refused.
pub fn run(
    scene: &Scene,
    mode: DriveMode,
    told: &[ToldSet],
    scope: ComparedScope,
    progress: &impl Fn(u64),
) -> Result<ComparedRun, RunError> {
    let mut driver = TickDriver::new(scene, FilterComparison::new(scene, mode, told, scope)?)?;
    let command = driver.program_mut().enter(Time::ZERO);
    driver.overrule(command);
    let end_nanos = timeline::end_nanos(scope.last);
    let mut ticks = 0;
    driver.run(|_, moment| {
        ticks += 1;
        if ticks % TICKS_PER_MS == 0 {
            progress(1);
        }
        let over = moment.at.nanos() >= end_nanos;
        if over { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    let FilterComparison { sums, told, cost, .. } = driver.into_program();
    let told = told.into_iter().map(|filter| (filter.set, filter.sums)).collect();
    Ok(ComparedRun { sums, told, walk: RateWalk::of(scene), cost })
}

const TICKS_PER_MS: u64 = 100;

/// A tick in s.
const TICK_S: f64 = 1e-5;

#[expect(clippy::cast_possible_truncation, reason = "200")]
const LAG_TICKS: usize = (SMOOTHER_LAG_MS * TICKS_PER_MS) as usize;

/// All filters and genies on the same frames and samples, and the error sums of each.
struct FilterComparison {
    mode: DriveMode,
    phase: Option<TimelinePhase>,
    free_motion: FreeMotion,
    filters: Vec<AnyFilter>,
    genies: Vec<Genie>,
    told: Vec<ToldFilter>,
    smoothers: bool,
    /// Of the filters, then of their smoothers, then of the genies.
    sums: Vec<PhaseSums>,
    /// The truth of the last ticks, the newest last, over the lag of the smoothers.
    truths: VecDeque<TrueMotion>,
    ticks: u64,
    cost: RunCost,
    /// When the last tick ended, by the clock of this machine.
    ended: Option<Instant>,
    /// What arrived in a tick.
    samples: Vec<LdvSample>,
    frames: Vec<CameraFrame>,
}

impl FilterComparison {
    fn new(scene: &Scene, mode: DriveMode, told: &[ToldSet], scope: ComparedScope) -> Result<Self, RunError> {
        let camera_rad2 = Camera::variance_rad2(scene);
        let genie = |&(_, share): &(_, f64)| Genie::new(share, camera_rad2, scene.seed());
        Ok(Self {
            mode,
            phase: None,
            free_motion: FreeMotion::default(),
            filters: FILTERS.iter().map(|name| AnyFilter::named(name, scene)).collect::<Result<_, _>>()?,
            genies: GENIES.iter().filter(|_| scope.genies).map(genie).collect(),
            told: told.iter().map(|set| ToldFilter::new(set, scene)).collect::<Result<_, _>>()?,
            smoothers: scope.smoothers,
            sums: names().map(|_| PhaseSums::default()).collect(),
            truths: VecDeque::new(),
            ticks: 0,
            cost: RunCost::default(),
            ended: None,
            samples: Vec::new(),
            frames: Vec::new(),
        })
    }

    /// Begins the tick at `now`: gives the filters its drive, and interrupts the sums where a phase begins.
    fn enter(&mut self, now: Time) -> DriveCommand {
        let (command, phase) = timeline::at(now, self.mode);
        self.filters.iter_mut().for_each(|filter| filter.drive(now, command));
        self.told.iter_mut().for_each(|told| told.filter_mut().drive(now, command));
        if phase != self.phase {
            self.phase = phase;
            let told = self.told.iter_mut().flat_map(|told| &mut told.sums);
            self.sums.iter_mut().flatten().chain(told).for_each(ErrorSums::interrupt);
        }
        command
    }

    /// Gives what has arrived to every filter, then to every genie.
    fn take(&mut self, ports: &mut RigPorts) {
        self.samples.clear();
        self.samples.extend(std::iter::from_fn(|| ports.ldv_sample()));
        self.frames.clear();
        self.frames.extend(std::iter::from_fn(|| ports.camera_frame()));
        let (filters, genies) = self.sums.split_at_mut(self.filters.len() + SMOOTHED.len());
        let mut begun = Instant::now();
        for ((filter, sums), taken_s) in self.filters.iter_mut().zip(filters).zip(&mut self.cost.filters_s) {
            for sample in &self.samples {
                if let (Some(innovation), Some(phase)) = (filter.update_ldv(sample), self.phase) {
                    sums[phase as usize].impact(&innovation);
                }
            }
            for frame in &self.frames {
                add_innovation(sums, self.phase, &filter.update_camera(frame));
            }
            let ended = Instant::now();
            *taken_s += (ended - begun).as_secs_f64();
            begun = ended;
        }
        for told in &mut self.told {
            told.take(&self.samples, &self.frames, self.phase);
        }
        for frame in &self.frames {
            for (genie, sums) in self.genies.iter_mut().zip(&mut *genies) {
                add_innovation(sums, self.phase, &genie.update_camera(frame));
            }
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
        let old_enough = self.smoothers && self.truths.len() > LAG_TICKS;
        if let Some(then) = self.truths.front().filter(|_| old_enough) {
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
        for told in &mut self.told {
            let (estimate, health) = (told.filter().estimate(at), told.filter().health(at));
            told.sums[phase as usize].estimate(estimate.as_ref(), health, angle, rate_rad_s);
        }
        for (genie, sums) in self.genies.iter().zip(genies) {
            let sums = &mut sums[phase as usize];
            // It has no health of its own: what it says is right by its construction.
            match genie.estimate() {
                Some(estimate) => sums.estimate(Some(&estimate), Health::Good, angle, rate_rad_s),
                None => sums.no_estimate(),
            }
        }
    }
}

impl TickProgram for FilterComparison {
    type Report = ();

    /// The genies are given every kick, the filters that are told something every contact.
    const OBSERVES_STEPS: bool = true;

    fn step(&mut self, step: &PlantStep, plant: &Plant) {
        if !self.told.is_empty() {
            let contacts = contacts_of(step, plant);
            self.told.iter_mut().for_each(|told| contacts.iter().for_each(|contact| told.tell(contact)));
        }
        if self.genies.is_empty() {
            return;
        }
        let [before, after] = [&step.before, &step.after].map(TrueMotion::of);
        let genies = &mut self.genies;
        self.free_motion.step(&before, &after, step.touched, |kick| {
            for genie in genies.iter_mut() {
                genie.give(&kick);
            }
        });
    }

    fn tick(&mut self, now: Time, ports: &mut RigPorts) {
        self.cost.ticks += 1;
        self.cost.rig_s += self.ended.map_or(0.0, |ended| ended.elapsed().as_secs_f64());
        let truth = TrueMotion { at: now, ..TrueMotion::of(&ports.plant().rotor()) };
        let genies = &mut self.genies;
        self.free_motion.close(&truth, |kick| genies.iter_mut().for_each(|genie| genie.give(&kick)));
        self.keep_truth(truth);
        self.take(ports);
        self.ticks += 1;
        if let Some(phase) = self.phase.filter(|_| self.ticks.is_multiple_of(TICKS_PER_COMPARISON)) {
            self.compare(phase, &truth);
        }
        ports.drive(self.enter(now));
        self.ended = Some(Instant::now());
    }
}
