//! A log replayed: what its instruments delivered, given to a filter tick by tick, as the loop of the run gave it.
//!
//! ```text
//! every tick:  the samples that arrived, the frame that arrived;  the estimate at its end;  the drive from then on
//! ```
//!
//! This is the order of [`controller::tick`], with its timing. The recorded filter at its recorded tuning computes the
//! recorded bits. It estimates in every tick, also where the loop of the run did not.

use std::ops::ControlFlow;
use std::path::Path;

use controller::{Decision, InFlight, LoopTiming};
use estimator::{AngleFilter as _, CameraFrame, Estimate, Health, Innovation, LdvSample};
use motor_model::{Angle, DriveCommand, Time};

use super::channels;
use super::error::LogError;
use super::reader::{self, LogHead, LogMessage, LogPart, LogReader};
use super::replay_sums::{ReplaySums, Replayed};
use simulation::runs::RunError;
use simulation::runs::closed_loop::timing;
use simulation::runs::filter::{self, AnyFilter};
use simulation::runs::record::{Observer, RunRecord, Task, Truth, verdict_word};
use simulation::scene::Scene;

/// Longest time between two messages of a log, in ns: a minute. A longer gap is taken for a damaged time.
const GAP_NANOS_MAX: u64 = 60_000_000_000;

/// What a tick of a log holds.
#[derive(Debug, Default)]
struct TickContent {
    ldv_samples: Vec<LdvSample>,
    camera_frame: Option<CameraFrame>,
    /// Verdict and innovation as recorded.
    innovation: Option<channels::Innovation>,
    truth: Option<Truth>,
    estimate: Option<Estimate<f32>>,
}

/// An estimate, and whether it may be used.
#[derive(Clone, Copy)]
struct Assessed {
    estimate: Option<Estimate<f32>>,
    health: Health,
}

impl Decision for Assessed {
    const UNDECIDED: Self = Self { estimate: None, health: Health::Waiting };

    fn applied(&self) -> DriveCommand {
        DriveCommand::OFF
    }
}

/// A filter that takes in a log.
struct Replay<'a, O> {
    filter: AnyFilter,
    timing: LoopTiming,
    /// Estimates for ticks to come, and their health.
    in_flight: InFlight<Assessed>,
    tick_nanos: u64,
    every: u64,
    /// The tick under way, by its end.
    now: Time,
    ticks: u64,
    content: TickContent,
    drive: DriveCommand,
    /// That of the tick before.
    last_drive: DriveCommand,
    sums: ReplaySums,
    observer: &'a mut O,
}

/// Replays the log at `path` through the filter of `scene`, which is that of the log or a changed one, and gives what
/// the filter computes to `observer` as records. With `strict` a damaged log is an error, otherwise it is replayed up
/// to the damage.
///
/// # Errors
/// When the log cannot be read, a key or value is refused, or `observer` ends the replay.
pub fn replay<O: Observer>(
    path: &Path,
    scene: &Scene,
    strict: bool,
    observer: &mut O,
) -> Result<Replayed, LogError> {
    let (head, mut reader) = reader::open(path)?;
    let filter = AnyFilter::of(scene).map_err(RunError::from)?;
    let recorded_filter = head.filter.clone();
    let LogHead { tick_nanos, every, .. } = head;
    let mut replay = Replay {
        filter,
        timing: timing(scene),
        in_flight: InFlight::new(),
        tick_nanos,
        every,
        now: Time::from_nanos(tick_nanos),
        ticks: 0,
        content: TickContent::default(),
        drive: DriveCommand::OFF,
        last_drive: DriveCommand::OFF,
        sums: ReplaySums::default(),
        observer,
    };
    let damage = match replay.run(&mut reader) {
        Err(damage @ LogError::Damaged { .. }) if !strict => Some(damage.to_string()),
        other => other.map(|()| None)?,
    };
    let names = (recorded_filter, filter::chosen(scene));
    Ok(replay.sums.figures(&head.command, names, replay.now, damage))
}

impl<O: Observer> Replay<'_, O> {
    fn run(&mut self, reader: &mut LogReader) -> Result<(), LogError> {
        while let Some(part) = reader.next_part()? {
            let LogPart::Message(at, message) = part else { continue };
            if let Some(end) = end_of_tick(at, &message) {
                self.advance(end, reader)?;
            }
            self.take(at, message, reader)?;
        }
        self.end_tick()
    }

    /// Ends ticks until the one under way is that which ends at `end` or right after it.
    fn advance(&mut self, end: Time, reader: &mut LogReader) -> Result<(), LogError> {
        let last = self.now.nanos() - self.tick_nanos;
        if end.nanos() <= last {
            return Err(reader.damage("the log is not in order: a message arrives before the one before it"));
        }
        if end.nanos() - last > GAP_NANOS_MAX {
            return Err(reader.damage("a gap of more than a minute"));
        }
        while self.now < end {
            self.end_tick()?;
        }
        Ok(())
    }

    fn take(&mut self, at: Time, message: LogMessage, reader: &mut LogReader) -> Result<(), LogError> {
        let content = &mut self.content;
        match message {
            LogMessage::VibrometerSample(sample) => {
                content.ldv_samples.push(LdvSample { taken_at: at, velocity_m_s: sample.velocity_m_s });
            }
            LogMessage::CameraFrame(frame) => {
                if content.camera_frame.is_some() {
                    return Err(reader.damage("two frames in one tick"));
                }
                content.camera_frame = Some(CameraFrame {
                    exposed_at: at,
                    angle: Angle::from_units(frame.angle_units),
                    marks_used: u8::try_from(frame.marks_used).unwrap_or(u8::MAX),
                    residual: u8::try_from(frame.residual_steps).unwrap_or(u8::MAX),
                });
            }
            LogMessage::Innovation(innovation) => content.innovation = Some(innovation),
            LogMessage::Truth(truth) => {
                content.truth = Some(Truth {
                    angle: Angle::from_units(truth.angle_units),
                    own_axis_angle: Angle::from_degrees(truth.own_axis_angle_deg),
                    rate_rad_s: truth.rate_rad_s,
                    height_m: truth.height_m,
                    velocity_m_s: truth.velocity_m_s,
                    tilt: None,
                });
            }
            LogMessage::Estimate(estimate) => content.estimate = Some(recorded(at, &estimate)),
            LogMessage::Health(health) => self.sums.recorded_health(health.level),
            LogMessage::Drive(drive) => {
                self.drive = drive.command().ok_or_else(|| reader.damage("a drive that there is not"))?;
            }
            LogMessage::Impact(_)
            | LogMessage::Marks(_)
            | LogMessage::Tilt(_)
            | LogMessage::Reference(_)
            | LogMessage::Task(_) => {}
        }
        Ok(())
    }

    /// Gives the filter what the tick holds, and compares.
    fn end_tick(&mut self) -> Result<(), LogError> {
        let Self { filter, timing, in_flight, content, now, drive, sums, .. } = self;
        let LoopTiming { latency_ticks, decision_ticks } = *timing;
        for sample in &content.ldv_samples {
            filter.update_ldv(sample);
        }
        let innovation: Option<Innovation<f32>> =
            content.camera_frame.map(|frame| filter.update_camera(&frame));
        if let Some(innovation) = &innovation {
            let recorded = content.innovation.as_ref();
            let same = recorded.is_none_or(|recorded| {
                recorded.innovation_rad.to_bits() == innovation.innovation_rad.to_bits()
                    && recorded.variance_rad2.to_bits() == innovation.variance_rad2.to_bits()
                    && recorded.verdict == verdict_word(innovation)
            });
            sums.innovation(*now, innovation, recorded, same);
        }
        let instant = now.plus_nanos(self.tick_nanos * u64::from(latency_ticks));
        let (estimate, health) = filter.assess_for(*now, instant);
        in_flight.put(instant, |decision| *decision = Assessed { estimate, health });
        let Assessed { estimate, health } = *in_flight.acting(*now);
        let wanted =
            content.truth.is_some() || content.estimate.is_some() || self.ticks.is_multiple_of(self.every);
        if wanted {
            let truth = content.truth.map(|truth| truth.angle);
            sums.estimate(*now, estimate.as_ref(), health, content.estimate.as_ref(), truth);
        }
        // As the loop does.
        let period_nanos = self.tick_nanos * u64::from(decision_ticks);
        let is_of_period = self.ticks == 0 || now.nanos().is_multiple_of(period_nanos);
        if is_of_period || *drive != self.last_drive {
            filter.drive(*now, *drive);
        }
        self.last_drive = *drive;
        let record = RunRecord {
            at: *now,
            truth: content.truth,
            impacts: &[],
            ldv_samples: &content.ldv_samples,
            camera_frame: content.camera_frame,
            marked: None,
            innovation,
            estimate,
            health,
            asked: *drive,
            applied: *drive,
            task: Task::None,
        };
        if let ControlFlow::Break(()) = self.observer.observe(&record) {
            return Err(LogError::Ended);
        }
        self.now = self.now.plus_nanos(self.tick_nanos);
        self.ticks += 1;
        self.content.ldv_samples.clear();
        self.content = TickContent {
            ldv_samples: std::mem::take(&mut self.content.ldv_samples),
            ..TickContent::default()
        };
        Ok(())
    }
}

/// End of the tick that a message belongs to; `None` where it does not matter.
fn end_of_tick(at: Time, message: &LogMessage) -> Option<Time> {
    let after = |nanos: i64| Time::from_nanos(at.nanos().saturating_add_signed(nanos));
    match message {
        LogMessage::VibrometerSample(sample) => Some(after(sample.arrived_after_ns)),
        LogMessage::CameraFrame(frame) => Some(after(frame.arrived_after_ns)),
        LogMessage::Innovation(innovation) => Some(after(innovation.arrived_after_ns)),
        LogMessage::Truth(_) | LogMessage::Estimate(_) | LogMessage::Health(_) | LogMessage::Drive(_) => {
            Some(at)
        }
        LogMessage::Impact(_)
        | LogMessage::Marks(_)
        | LogMessage::Tilt(_)
        | LogMessage::Reference(_)
        | LogMessage::Task(_) => None,
    }
}

/// The estimate of a message.
fn recorded(at: Time, estimate: &channels::Estimate) -> Estimate<f32> {
    Estimate {
        at: Time::from_nanos(at.nanos().saturating_add_signed(estimate.age_ns.saturating_neg())),
        angle: Angle::from_units(estimate.angle_units),
        rate_rad_s: estimate.rate_rad_s,
        angle_rad2: estimate.angle_rad2,
        angle_rate_rad2_s: estimate.angle_rate_rad2_s,
        rate_rad2_s2: estimate.rate_rad2_s2,
        resting: estimate.resting,
    }
}
