//! The state machine that makes experiments in the loop: it drives, waits for rest, and measures.
//!
//! ```text
//!            +---------+   an experiment is ordered   +------------------------------+
//!       +--> |  Ready  | ---------------------------> | Sweeping, Cruising, Bursting |
//!       |    +---------+                              +------------------------------+
//!       |  at rest and measured                            |  its drive is over, or the estimate is lost
//!       |    +---------+ <---------------------------------+
//!       +--- | Resting |                   Ended: the time is over, the travel ends, the estimate is lost for too
//!            +---------+                    long or too often, or the rotor does not come to rest with the drive off
//! ```
//!
//! It begins in `Resting`, and drives nothing that is not ordered. Nothing allocates or panics, and a tick takes little
//! and bounded time: what to order next is decided elsewhere ([`super::Commissioning`]).

use estimator::{Estimate, Health, Instruments, LdvSample, Reason, ResonanceOffset};
use heapless::Vec;
use motor_model::{Angle, DriveCommand, DriveMode, Time};

use super::coasts::Coast;
use super::experiment::{Experiment, Response, TurnWindow, WINDOWS};
use super::result::CommissioningEnd;
use super::run_out::{Pending, Resting, Train};
use super::sweep::Sweep;
use crate::positioning::PositioningTuning;
use crate::response_map::direction;
use crate::settling_watch::WindowStart;
use crate::target::Travel;

/// Time in ns of a cruise before its rate is measured: the rotor spins up within it.
const SPIN_UP_NANOS: u64 = 150_000_000;
/// Least length in ns of the windows of a cruise.
const WINDOW_NANOS: u64 = 50_000_000;
/// Drives in a row that may be cut because the estimate is lost: two of each of the eight cruises of mode B. At some
/// drives a rotor that tilts is lost now and then, and at strong ones most of the time.
pub(super) const LOST_MAX: u8 = 16;
/// Standard deviations within which a rotor lies where it lay. A normal error exceeds them once in 1.7 million drives.
const UNMOVED_SIGMAS: f32 = 5.0;
/// Standard deviations in Hz of the offset of an experiment from the resonance, in modes B and C: those of the sweeps.
const FOUND_SD_HZ: [f32; 2] = [7.0, 20.0];

/// Tuning of the experiments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExperimentTuning {
    /// Time in ns after which they end.
    pub(super) time_max_nanos: u64,
    /// Angles between which the rotor may be driven, and the strongest drive.
    pub(super) travel: Travel,
    pub(super) amplitude_max: f32,
    /// Noise of the vibrometer in m/s; 0 without one.
    noise_m_s: f32,
    /// Length in ns of the windows of a cruise: at least ten frames.
    window_nanos: u64,
    /// As in [`PositioningTuning`].
    pub(super) settling_window_nanos: u64,
    pub(super) frame_wait_nanos: u64,
    pub(super) floor_rad2: f32,
    blind_max_nanos: u64,
}

impl ExperimentTuning {
    /// For `instruments`: a minute, any angle, full drive.
    pub fn new(instruments: &Instruments) -> Self {
        let positioning = PositioningTuning::new(instruments);
        #[expect(clippy::cast_possible_truncation, reason = "the controller computes in f32")]
        let noise_m_s = instruments.vibrometer.map_or(0.0, |vibrometer| vibrometer.noise_m_s) as f32;
        Self {
            time_max_nanos: 60_000_000_000,
            travel: Travel::FREE,
            amplitude_max: DriveCommand::AMPLITUDE_MAX,
            noise_m_s,
            window_nanos: WINDOW_NANOS.max(positioning.settling_window_nanos / 2),
            settling_window_nanos: positioning.settling_window_nanos,
            frame_wait_nanos: positioning.frame_wait_nanos,
            floor_rad2: positioning.floor_rad2,
            blind_max_nanos: positioning.blind_max_nanos,
        }
    }

    /// The same with another time in ns after which they end.
    #[must_use]
    pub fn with_time_max(self, time_max_nanos: u64) -> Self {
        Self { time_max_nanos, ..self }
    }
}

/// A cruise under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct CruiseRun {
    command: DriveCommand,
    along: f32,
    since: Time,
    /// The rotor before it.
    from: Angle,
    from_rad2: f32,
    window: Option<WindowStart>,
}

/// A burst under way, one of a train.
#[derive(Clone, Copy, Debug)]
pub(super) struct BurstRun {
    pub(super) since: Time,
    pub(super) train: Train,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Stage {
    Resting(Resting),
    Sweeping(Sweep),
    Cruising(CruiseRun),
    Bursting(BurstRun),
    Ready,
    Ended(CommissioningEnd),
}

/// What the experimenter is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExperimentPhase {
    /// Drive off: the rotor comes to rest, or is measured, or an order waits for an estimate.
    Resting,
    /// The drive's frequency is swept.
    Sweeping,
    /// Drive on, for a cruise.
    Cruising,
    /// Drive on, for a burst.
    Bursting,
    /// The response is there, and another experiment may be ordered.
    Ready,
    /// It is over, drive off.
    Ended(CommissioningEnd),
}

/// The state machine.
#[derive(Clone, Debug)]
pub struct Experimenter {
    pub(super) tuning: ExperimentTuning,
    started_at: Time,
    pub(super) stage: Stage,
    ordered: Option<Experiment>,
    /// Of the experiment that was ordered last.
    number: u16,
    pub(super) response: Option<Response>,
    windows: Vec<TurnWindow, WINDOWS>,
    blind_since: Option<Time>,
    /// Drives in a row that were cut because the estimate was lost.
    lost: u8,
    /// Where the resonances are, by the offsets of the experiments, and whether that is other than what was told.
    resonances: [ResonanceOffset<f32>; 2],
    moved: bool,
}

impl BurstRun {
    fn end(&self) -> Time {
        self.since.plus_nanos(self.train.burst_nanos())
    }
}

impl CruiseRun {
    /// Its direction.
    pub(super) fn along(&self) -> f32 {
        self.along
    }

    /// The estimate is lost at `now`.
    fn lost_at(&self, now: Time) -> Pending {
        let Self { along, from, from_rad2, since, .. } = *self;
        Pending::Lost { along, from, from_rad2, driven_s: now.seconds_since(since) }
    }
}

/// The drive of a cruise or a burst.
fn tuned(mode: DriveMode, amplitude: f32, offset_hz: f32) -> DriveCommand {
    DriveCommand::saturating(mode, amplitude).with_saturating_offset(offset_hz)
}

impl Experimenter {
    /// Experiments from `now` on, on a motor that may turn.
    pub fn new(tuning: ExperimentTuning, now: Time) -> Self {
        Self {
            tuning,
            started_at: now,
            stage: Stage::Resting(Resting::new(Pending::Nothing, now)),
            ordered: None,
            number: 0,
            response: None,
            windows: Vec::new(),
            blind_since: None,
            lost: 0,
            resonances: [ResonanceOffset::NONE; 2],
            moved: false,
        }
    }

    /// What it is doing.
    pub fn phase(&self) -> ExperimentPhase {
        match &self.stage {
            Stage::Resting(_) => ExperimentPhase::Resting,
            Stage::Sweeping(_) => ExperimentPhase::Sweeping,
            Stage::Cruising(_) => ExperimentPhase::Cruising,
            Stage::Bursting(_) => ExperimentPhase::Bursting,
            Stage::Ready if self.ordered.is_some() => ExperimentPhase::Resting,
            Stage::Ready => ExperimentPhase::Ready,
            Stage::Ended(end) => ExperimentPhase::Ended(*end),
        }
    }

    /// How many experiments were ordered.
    pub fn number(&self) -> u16 {
        self.number
    }

    /// What the last experiment has shown, once it is over.
    pub fn response(&self) -> Option<&Response> {
        self.response.as_ref().filter(|_| self.phase() == ExperimentPhase::Ready && self.number > 0)
    }

    /// Orders the next experiment, which begins with the next tick that has a good estimate. `false` where none can be
    /// ordered now: nothing changes then.
    #[must_use]
    pub fn order(&mut self, experiment: Experiment) -> bool {
        let is_ready = self.phase() == ExperimentPhase::Ready;
        if is_ready {
            (self.ordered, self.response) = (Some(experiment), None);
            self.number = self.number.wrapping_add(1);
        }
        is_ready
    }

    /// Takes a vibrometer sample.
    #[inline]
    pub fn hear(&mut self, sample: &LdvSample) {
        if let Stage::Sweeping(sweep) = &mut self.stage {
            sweep.hear(sample);
        }
    }

    /// The command for the tick at `now`, by the present estimate, which counts only if `health` allows.
    pub fn decide(&mut self, now: Time, estimate: Option<&Estimate<f32>>, health: Health) -> DriveCommand {
        if !matches!(self.stage, Stage::Ended(_)) {
            let wide = health == Health::Unusable(Reason::Uncertain);
            let usable = estimate.filter(|_| wide || !matches!(health, Health::Unusable(_)));
            if now.nanos_since(self.started_at) >= self.tuning.time_max_nanos {
                self.stage = Stage::Ended(CommissioningEnd::TimeOver);
            } else if let Some(estimate) = usable {
                if wide && self.is_blind_too_long(now) {
                    self.stage = Stage::Ended(CommissioningEnd::NoEstimate);
                    return self.command();
                }
                if !wide {
                    self.blind_since = None;
                }
                self.step(now, estimate, wide);
                self.end_at_travel(estimate);
            } else {
                self.wait(now);
            }
        }
        self.command()
    }

    /// No usable estimate. A sweep needs none; any other experiment ends. A cruise shows a rotor that has not turned at
    /// all, or the windows before the loss, but for the last one, at whose end the estimate may have been wrong, or
    /// nothing; a train shows nothing.
    fn wait(&mut self, now: Time) {
        if matches!(self.stage, Stage::Cruising(_) | Stage::Bursting(_)) {
            self.lost = self.lost.saturating_add(1);
        }
        if let Stage::Cruising(_) = self.stage {
            self.windows.pop();
            if !self.windows.is_empty() {
                self.lost = 0;
                let windows = self.windows.clone();
                self.response = Some(Response::Cruise { windows, coast: Coast::default(), to_rest_s: 0.0 });
            }
        }
        if self.is_blind_too_long(now) || self.lost > LOST_MAX {
            self.stage = Stage::Ended(CommissioningEnd::NoEstimate);
        } else if let Stage::Sweeping(_) = self.stage {
            self.sweep(now);
        } else {
            let pending = match &self.stage {
                Stage::Cruising(run) => run.lost_at(now),
                Stage::Resting(resting @ Resting { pending: Pending::Lost { .. }, .. }) => resting.pending,
                _ => Pending::Nothing,
            };
            self.stage = Stage::Resting(Resting::new(pending, now));
        }
    }

    /// Whether the camera has shown nothing for too long: there is no usable estimate, or a wide one.
    fn is_blind_too_long(&mut self, now: Time) -> bool {
        let since = *self.blind_since.get_or_insert(now);
        now.nanos_since(since) > self.tuning.blind_max_nanos
    }

    fn command(&self) -> DriveCommand {
        match &self.stage {
            Stage::Resting(_) | Stage::Ready | Stage::Ended(_) => DriveCommand::OFF,
            Stage::Sweeping(sweep) => sweep.command(),
            Stage::Cruising(run) => run.command,
            Stage::Bursting(run) => run.train.command(),
        }
    }

    fn step(&mut self, now: Time, estimate: &Estimate<f32>, wide: bool) {
        match self.stage {
            Stage::Resting(resting) => self.rest(resting, now, estimate, wide),
            Stage::Sweeping(_) => self.sweep(now),
            Stage::Cruising(run) => self.cruise(run, now, estimate),
            Stage::Bursting(run) => {
                if now >= run.end() {
                    self.stage = Stage::Resting(Resting::new(Pending::Turn(run.train), now));
                }
            }
            Stage::Ready => {
                if let Some(experiment) = self.ordered.take_if(|_| !wide) {
                    self.begin(experiment, now, estimate);
                }
            }
            Stage::Ended(_) => (),
        }
    }

    /// When the drive of the burst under way ends.
    pub(crate) fn burst_end(&self) -> Option<Time> {
        match &self.stage {
            Stage::Bursting(run) => Some(run.end()),
            _ => None,
        }
    }

    /// The offsets of the resonances, if they are other than what was last told here: for the filter.
    pub(crate) fn take_moved_resonances(&mut self) -> Option<[ResonanceOffset<f32>; 2]> {
        core::mem::take(&mut self.moved).then_some(self.resonances)
    }

    /// Takes the offset of an experiment for that of the resonance of its mode.
    fn retune(&mut self, experiment: &Experiment) {
        let [clockwise, counter_clockwise] = &mut self.resonances;
        let [sd_b_hz, sd_c_hz] = FOUND_SD_HZ;
        let (resonance, sd_hz) = match experiment.mode() {
            DriveMode::B => (clockwise, sd_b_hz),
            DriveMode::C => (counter_clockwise, sd_c_hz),
        };
        let found = ResonanceOffset { hz: experiment.offset_hz(), hz2: sd_hz * sd_hz };
        if !matches!(experiment, Experiment::Sweep { .. }) && (found.hz - resonance.hz).abs() > 0.0 {
            (*resonance, self.moved) = (found, true);
        }
    }

    fn begin(&mut self, experiment: Experiment, now: Time, estimate: &Estimate<f32>) {
        self.retune(&experiment);
        self.windows.clear();
        self.stage = match experiment {
            Experiment::Sweep { mode, amplitude } => {
                Stage::Sweeping(Sweep::new(mode, amplitude, self.tuning.noise_m_s, now))
            }
            Experiment::Cruise { mode, amplitude, offset_hz } => {
                let command = tuned(mode, amplitude, offset_hz);
                Stage::Cruising(CruiseRun {
                    command,
                    along: direction(mode),
                    since: now,
                    from: estimate.angle,
                    from_rad2: estimate.angle_rad2,
                    window: None,
                })
            }
            Experiment::Train { mode, amplitude, offset_hz, ticks, count } => {
                let command = tuned(mode, amplitude, offset_hz);
                let train = Train::new(command, direction(mode), ticks, count, estimate);
                Stage::Bursting(BurstRun { since: now, train })
            }
        };
    }

    fn sweep(&mut self, now: Time) {
        let Stage::Sweeping(sweep) = &mut self.stage else { return };
        if sweep.advance(now) {
            // As many as there is room for.
            let points = Vec::from_slice(sweep.points()).unwrap_or_default();
            self.response = Some(Response::Sweep { points });
            self.stage = Stage::Resting(Resting::new(Pending::Nothing, now));
        }
    }

    /// Drive on: window by window, then off.
    fn cruise(&mut self, mut run: CruiseRun, now: Time, estimate: &Estimate<f32>) {
        if now.nanos_since(run.since) < SPIN_UP_NANOS + self.tuning.frame_wait_nanos {
            return;
        }
        let start = WindowStart { at: now, angle: estimate.angle, angle_rad2: estimate.angle_rad2 };
        let window = *run.window.get_or_insert(start);
        if now.nanos_since(window.at) >= self.tuning.window_nanos {
            let window = TurnWindow {
                turned_rad: run.along * estimate.angle.radians_since::<f32>(window.angle),
                turned_rad2: window.angle_rad2 + estimate.angle_rad2,
                time_s: now.seconds_since(window.at),
            };
            // Never full here.
            let _ = self.windows.push(window);
            run.window = Some(start);
        }
        self.stage = if self.windows.is_full() {
            Stage::Resting(Resting::new(Pending::Coast { along: run.along, cut: *estimate }, now))
        } else {
            Stage::Cruising(run)
        };
    }

    /// The rotor lies still, and its angle is known: what the experiment has shown.
    pub(super) fn finish(&mut self, resting: &Resting, estimate: &Estimate<f32>) {
        let to_rest_s = resting.rest_time_s();
        match resting.pending {
            Pending::Nothing => {
                // Where there is none, the estimate was lost.
                self.response.get_or_insert(Response::Lost);
            }
            Pending::Lost { along, from, from_rad2, driven_s } => {
                let window = TurnWindow {
                    turned_rad: along * estimate.angle.radians_since::<f32>(from),
                    turned_rad2: from_rad2 + estimate.angle_rad2,
                    time_s: driven_s,
                };
                let limit_rad2 = UNMOVED_SIGMAS * UNMOVED_SIGMAS * window.turned_rad2;
                if window.turned_rad * window.turned_rad < limit_rad2 {
                    self.lost = 0;
                    self.response = Some(Response::Unmoved { window });
                } else {
                    // The windows before the loss, where there are any.
                    self.response.get_or_insert(Response::Lost);
                }
            }
            Pending::Coast { along, cut } => {
                let coast = Coast::between(along, &cut, estimate);
                let windows = self.windows.clone();
                self.lost = 0;
                self.response = Some(Response::Cruise { windows, coast, to_rest_s });
            }
            Pending::Turn(train) => {
                self.lost = 0;
                self.response = Some(Response::Train {
                    turned_rad: train.along * estimate.angle.radians_since::<f32>(train.from),
                    turned_rad2: train.from_rad2 + estimate.angle_rad2,
                    independent: train.independent,
                    to_rest_s,
                });
            }
        }
        self.stage = Stage::Ready;
    }
}
