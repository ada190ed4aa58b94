//! Commissioning: the response map of the motor in front of the controller, measured within a minute.
//!
//! The prior is a map of motors drawn around the design ([`crate::ResponseMap::table_1`]). Each of its rows keeps its
//! shape, and gets a factor by Bayes' rule from what this motor does.
//!
//! ```text
//!              what pays most: a sweep, a cruise or a burst            60 s over, or nothing pays
//!   +---------+ ------------------> +-------------------------------+
//!   | Resting |                     | Sweeping, Cruising, Bursting  |        Ended: the map, or why there is none
//!   | measure | <------------------ +-------------------------------+
//!   +---------+   the drive is off: turn, coast and time to rest are measured
//! ```
//!
//! | module | what it is |
//! |---|---|
//! | this one | the state machine: drives, waits for rest, measures |
//! | [`order`] | what to measure next |
//! | [`sweep`], [`resonance`] | the drive's frequency in steps, and the curve through the powers |
//! | [`evidence`], [`repeats`] | what was measured of each row |
//! | [`row_factors`], [`map_factors`] | the factors by Bayes' rule, and where the prior does not hold |
//! | [`commissioned_map`] | the map that follows |
//! | [`findings`] | what the prior's authors did not foresee, by tests |
//! | [`result`] | what commissioning gives out, and when a motor is not fit for use |
//! | [`quantiles`] | of the normal, Student's, chi-square and binomial laws |
//!
//! Nothing allocates or panics, and a tick takes bounded time. What is decided between two drives, the search of
//! [`order`] above all, takes longer than a tick of a small processor: the drive is then off and the rotor at rest.

pub mod commissioned_map;
pub mod evidence;
pub mod findings;
pub mod map_factors;
mod order;
mod quantiles;
pub mod repeats;
pub mod resonance;
pub mod result;
pub mod row_factors;
mod run_out;
pub mod sweep;
mod tick;

use estimator::{Estimate, Health, Instruments, Reason};
use motor_model::{DriveCommand, DriveMode, Time};

use crate::positioning::PositioningTuning;
use crate::response_map::{Burst, Cruise, Family, ResponseMap, direction};
use evidence::{CommissioningEvidence, MapRow};
use order::{Known, Next};
use resonance::Resonance;
pub use result::{Commissioned, CommissioningEnd, Unfit};
use run_out::{Pending, Resting};
use sweep::Sweep;
pub use tick::{CommissioningReport, CommissioningTick, tick_commissioning};

/// Time in ns of a cruise before its rate is measured: the rotor spins up within it.
const SPIN_UP_NANOS: u64 = 150_000_000;
/// Least length in ns of the windows of a cruise.
const WINDOW_NANOS: u64 = 50_000_000;
/// Windows of a run of a cruise.
const WINDOWS: u8 = 8;

/// Drives that may be cut because the estimate is lost. An assumption: a camera that is lost now and then.
const LOST_MAX: u8 = 8;

/// Tuning of commissioning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissioningTuning {
    /// The instruments.
    pub instruments: Instruments,
    /// Time in ns after which it ends with what it has.
    pub time_max_nanos: u64,
    /// Strongest drive, 0 to 1.
    pub amplitude_max: f32,
    /// Length in ns of the windows of a cruise: at least ten frames.
    window_nanos: u64,
    /// As in [`PositioningTuning`].
    settling_window_nanos: u64,
    frame_wait_nanos: u64,
    floor_rad2: f32,
    blind_max_nanos: u64,
}

impl CommissioningTuning {
    /// For `instruments`: a minute, at full drive.
    pub fn new(instruments: &Instruments) -> Self {
        let positioning = PositioningTuning::new(instruments);
        Self {
            instruments: *instruments,
            time_max_nanos: 60_000_000_000,
            amplitude_max: DriveCommand::AMPLITUDE_MAX,
            window_nanos: WINDOW_NANOS.max(positioning.settling_window_nanos / 2),
            settling_window_nanos: positioning.settling_window_nanos,
            frame_wait_nanos: positioning.frame_wait_nanos,
            floor_rad2: positioning.floor_rad2,
            blind_max_nanos: positioning.blind_max_nanos,
        }
    }
}

/// The beginning of a window of a cruise.
#[derive(Clone, Copy, Debug)]
struct Window {
    since: Time,
    angle: motor_model::Angle,
    angle_rad2: f32,
}

/// A cruise under way.
#[derive(Clone, Copy, Debug)]
struct CruiseRun {
    index: usize,
    cruise: Cruise,
    since: Time,
    window: Option<Window>,
    left: u8,
}

/// A burst under way, one of a train.
#[derive(Clone, Copy, Debug)]
struct BurstRun {
    family: Family,
    index: usize,
    burst: Burst,
    since: Time,
    train: run_out::Train,
}

#[derive(Clone, Copy, Debug)]
enum Stage {
    Resting(Resting),
    Sweeping(Sweep),
    Cruising(CruiseRun),
    Bursting(BurstRun),
    Ended(CommissioningEnd),
}

/// What commissioning is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommissioningStage {
    /// Drive off: the rotor comes to rest, or is measured.
    Resting,
    /// The drive's frequency is swept.
    Sweeping(DriveMode),
    /// A row of the map is driven.
    Driving(MapRow),
    /// It is over.
    Ended(CommissioningEnd),
}

/// The state machine.
#[derive(Clone, Copy, Debug)]
pub struct Commissioning {
    tuning: CommissioningTuning,
    started_at: Time,
    ended_at: Time,
    stage: Stage,
    evidence: CommissioningEvidence,
    unswept: [bool; 2],
    resonances: [Option<Resonance>; 2],
    swept: [Option<Sweep>; 2],
    blind_since: Option<Time>,
    /// Drives that were cut because the estimate was lost.
    lost: u8,
}

impl Commissioning {
    /// Commissioning from `now` on, of a motor that may turn.
    pub fn new(tuning: CommissioningTuning, now: Time) -> Self {
        Self {
            unswept: [tuning.instruments.vibrometer.is_some(); 2],
            tuning,
            started_at: now,
            ended_at: now,
            stage: Stage::Resting(Resting::new(Pending::Nothing, now)),
            evidence: CommissioningEvidence::default(),
            resonances: [None; 2],
            swept: [None; 2],
            blind_since: None,
            lost: 0,
        }
    }

    /// What it is doing.
    pub fn stage(&self) -> CommissioningStage {
        match &self.stage {
            Stage::Resting(_) => CommissioningStage::Resting,
            Stage::Sweeping(sweep) => CommissioningStage::Sweeping(sweep.mode()),
            Stage::Cruising(run) => CommissioningStage::Driving(MapRow::Cruise(run.index)),
            Stage::Bursting(run) => CommissioningStage::Driving(MapRow::Burst(run.family, run.index)),
            Stage::Ended(end) => CommissioningStage::Ended(*end),
        }
    }

    /// What was measured by now.
    pub fn evidence(&self) -> &CommissioningEvidence {
        &self.evidence
    }

    /// Takes a vibrometer sample.
    pub fn hear(&mut self, sample: &estimator::LdvSample) {
        if let Stage::Sweeping(sweep) = &mut self.stage {
            sweep.hear(sample);
        }
    }

    /// The command for the tick at `now`, by the present estimate, which counts only if `health` allows.
    pub fn decide(
        &mut self,
        prior: &ResponseMap,
        now: Time,
        estimate: Option<&Estimate<f32>>,
        health: Health,
    ) -> DriveCommand {
        if !matches!(self.stage, Stage::Ended(_)) {
            self.ended_at = now;
            let over = now.nanos_since(self.started_at) >= self.tuning.time_max_nanos;
            let wide = health == Health::Unusable(Reason::Uncertain);
            let usable = estimate.filter(|_| wide || !matches!(health, Health::Unusable(_)));
            if over {
                self.stage = Stage::Ended(CommissioningEnd::TimeOver);
            } else if let Some(estimate) = usable {
                self.blind_since = None;
                self.step(prior, now, estimate, wide);
            } else {
                self.wait(now);
            }
        }
        self.command()
    }

    /// No usable estimate. A sweep needs none; any other drive ends, and what it did is not measured.
    fn wait(&mut self, now: Time) {
        let since = *self.blind_since.get_or_insert(now);
        if matches!(self.stage, Stage::Cruising(_) | Stage::Bursting(_)) {
            self.lost = self.lost.saturating_add(1);
        }
        if now.nanos_since(since) > self.tuning.blind_max_nanos || self.lost > LOST_MAX {
            self.stage = Stage::Ended(CommissioningEnd::NoEstimate);
        } else if let Stage::Sweeping(_) = self.stage {
            self.sweep(now);
        } else {
            self.stage = Stage::Resting(Resting::new(Pending::Nothing, now));
        }
    }

    fn command(&self) -> DriveCommand {
        match &self.stage {
            Stage::Resting(_) | Stage::Ended(_) => DriveCommand::OFF,
            Stage::Sweeping(sweep) => sweep.command(),
            Stage::Cruising(run) => DriveCommand::saturating(run.cruise.mode, run.cruise.amplitude),
            Stage::Bursting(run) => run.burst.command(run.family.mode()),
        }
    }

    fn step(&mut self, prior: &ResponseMap, now: Time, estimate: &Estimate<f32>, wide: bool) {
        match self.stage {
            Stage::Resting(resting) => self.rest(prior, resting, now, estimate, wide),
            Stage::Sweeping(_) => self.sweep(now),
            Stage::Cruising(run) => self.cruise(run, now, estimate),
            Stage::Bursting(run) => {
                if now.nanos_since(run.since) >= u64::from(run.burst.ticks) * crate::TICK_NANOS {
                    let pending = Pending::Turn { family: run.family, index: run.index, train: run.train };
                    self.stage = Stage::Resting(Resting::new(pending, now));
                }
            }
            Stage::Ended(_) => (),
        }
    }

    fn sweep(&mut self, now: Time) {
        let Stage::Sweeping(sweep) = &mut self.stage else { return };
        if sweep.advance(now) {
            let (mode, found) = (sweep.mode(), Resonance::of(sweep.mode(), sweep.points()));
            let index = usize::from(mode == DriveMode::C);
            if let Some(((unswept, resonance), swept)) =
                self.unswept.get_mut(index).zip(self.resonances.get_mut(index)).zip(self.swept.get_mut(index))
            {
                (*unswept, *resonance, *swept) = (false, found, Some(*sweep));
            }
            self.stage = Stage::Resting(Resting::new(Pending::Nothing, now));
        }
    }

    /// Drive on: window by window, then off.
    fn cruise(&mut self, mut run: CruiseRun, now: Time, estimate: &Estimate<f32>) {
        if now.nanos_since(run.since) < SPIN_UP_NANOS + self.tuning.frame_wait_nanos {
            return;
        }
        let begin = Window { since: now, angle: estimate.angle, angle_rad2: estimate.angle_rad2 };
        let window = *run.window.get_or_insert(begin);
        let along = direction(run.cruise.mode);
        if now.nanos_since(window.since) >= self.tuning.window_nanos {
            let turned_rad = along * estimate.angle.radians_since::<f32>(window.angle);
            let turned_rad2 = window.angle_rad2 + estimate.angle_rad2;
            let time_s = now.seconds_since::<f32>(window.since);
            self.evidence.add_window(run.index, &run.cruise, turned_rad, turned_rad2, time_s);
            run.window = Some(begin);
            run.left -= 1;
        }
        self.stage = if run.left > 0 {
            Stage::Cruising(run)
        } else {
            let pending = Pending::Coast {
                index: run.index,
                along,
                cut: estimate.angle,
                rate_rad_s: along * estimate.rate_rad_s,
            };
            Stage::Resting(Resting::new(pending, now))
        };
    }

    /// What is driven next, from rest.
    fn begin(&mut self, prior: &ResponseMap, now: Time, estimate: &Estimate<f32>) {
        let known = Known {
            prior,
            evidence: &self.evidence,
            unswept: self.unswept,
            amplitude_max: self.tuning.amplitude_max,
            instruments: &self.tuning.instruments,
        };
        self.stage = match known.next() {
            Next::Sweep(mode) => {
                let noise_m_s =
                    self.tuning.instruments.vibrometer.map_or(0.0, |vibrometer| vibrometer.noise_m_s);
                #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
                Stage::Sweeping(Sweep::new(mode, self.tuning.amplitude_max, noise_m_s as f32, now))
            }
            Next::Row(MapRow::Cruise(index)) => match prior.cruises().get(index) {
                Some(&cruise) => {
                    Stage::Cruising(CruiseRun { index, cruise, since: now, window: None, left: WINDOWS })
                }
                None => Stage::Ended(CommissioningEnd::Enough),
            },
            Next::Row(MapRow::Burst(family, index)) => match prior.bursts(family).get(index) {
                Some(burst) => {
                    let train = run_out::Train::new(order::train(family, burst), estimate);
                    Stage::Bursting(BurstRun { family, index, burst: *burst, since: now, train })
                }
                None => Stage::Ended(CommissioningEnd::Enough),
            },
            Next::Enough => Stage::Ended(CommissioningEnd::Enough),
        };
    }
}

#[cfg(test)]
mod tests;
