//! [`controller::TickReport`] on the wire, to the last bit.

use controller::{PositioningPhase, StopReason};
use estimator::{Estimate, Health, Innovation, Reason, Rejection, Source, Verdict};
use motor_model::{DriveCommand, DriveMode};
use serde::{Deserialize, Serialize};

/// What a tick did. Variants are numbered in the order of their definitions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TickRecord {
    /// The estimate.
    pub estimate: Option<EstimateRecord>,
    /// Whether it may be used, as a number.
    pub health: u8,
    /// What became of the camera frame.
    pub camera: Option<InnovationRecord>,
    /// The command given.
    pub command: CommandRecord,
    /// The command applied.
    pub applied: CommandRecord,
    /// What positioning is doing, as a number.
    pub phase: u8,
    /// Since when the drive is on, in ns; 0 when off.
    pub since_nanos: u64,
}

/// [`Estimate`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateRecord {
    /// The instant in ns.
    pub at_nanos: u64,
    /// Angle in units of 2^-32 turn.
    pub angle_units: i64,
    /// Rate.
    pub rate_rad_s: f32,
    /// Variance of the angle.
    pub angle_rad2: f32,
    /// Covariance of angle and rate.
    pub angle_rate_rad2_s: f32,
    /// Variance of the rate.
    pub rate_rad2_s2: f32,
    /// Whether the rotor lies still.
    pub resting: bool,
}

/// [`Innovation`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InnovationRecord {
    /// Which instrument, as a number.
    pub source: u8,
    /// When it was taken, in ns.
    pub taken_nanos: u64,
    /// Measurement less prediction.
    pub innovation_rad: f32,
    /// Its predicted variance.
    pub variance_rad2: f32,
    /// What became of it, as a number.
    pub verdict: u8,
}

/// [`DriveCommand`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommandRecord {
    /// 0 off, 1 mode B, 2 mode C.
    pub mode: u8,
    /// Amplitude, 0 to 1.
    pub amplitude: f32,
    /// Offset from the mode's nominal frequency.
    pub frequency_offset_hz: f32,
}

impl From<DriveCommand> for CommandRecord {
    fn from(command: DriveCommand) -> Self {
        Self {
            mode: match command.mode() {
                None => 0,
                Some(DriveMode::B) => 1,
                Some(DriveMode::C) => 2,
            },
            amplitude: command.amplitude(),
            frequency_offset_hz: command.frequency_offset_hz(),
        }
    }
}

impl CommandRecord {
    /// The command; `None` when there is no such command.
    pub fn command(&self) -> Option<DriveCommand> {
        let Self { mode, amplitude, frequency_offset_hz } = *self;
        let mode = match mode {
            0 => return Some(DriveCommand::OFF),
            1 => DriveMode::B,
            2 => DriveMode::C,
            _ => return None,
        };
        DriveCommand::try_new(mode, amplitude).ok()?.with_frequency_offset(frequency_offset_hz).ok()
    }
}

fn of_estimate(estimate: Estimate<f32>) -> EstimateRecord {
    let Estimate { at, angle, rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2, resting } = estimate;
    EstimateRecord {
        at_nanos: at.nanos(),
        angle_units: angle.units(),
        rate_rad_s,
        angle_rad2,
        angle_rate_rad2_s,
        rate_rad2_s2,
        resting,
    }
}

fn of_innovation(innovation: Innovation<f32>) -> InnovationRecord {
    let Innovation { source, taken_at, innovation_rad, variance_rad2, verdict } = innovation;
    InnovationRecord {
        source: match source {
            Source::Camera => 0,
        },
        taken_nanos: taken_at.nanos(),
        innovation_rad,
        variance_rad2,
        verdict: match verdict {
            Verdict::Used => 0,
            Verdict::Restarted => 1,
            Verdict::Rejected(Rejection::OutOfHorizon) => 2,
            Verdict::Rejected(Rejection::Gate) => 3,
            Verdict::Rejected(Rejection::Repeated) => 4,
            Verdict::Rejected(Rejection::Duplicate) => 5,
            Verdict::Rejected(Rejection::Future) => 6,
            Verdict::Rejected(Rejection::Stuck) => 7,
        },
    }
}

fn of_health(health: Health) -> u8 {
    let reason = |reason| match reason {
        Reason::VibrometerSilent => 0,
        Reason::FramesRefused => 1,
        Reason::Uncertain => 2,
        Reason::VibrometerInverted => 3,
        Reason::CameraSilent => 4,
        Reason::CameraStuck => 5,
        Reason::NoiseMismatch => 6,
        Reason::ImpactsUnexplained => 7,
        Reason::VibrometerScale => 8,
        Reason::VibrometerErratic => 9,
    };
    match health {
        Health::Good => 0,
        Health::Waiting => 1,
        Health::Degraded(why) => 2 + 2 * reason(why),
        Health::Unusable(why) => 3 + 2 * reason(why),
    }
}

impl From<&controller::TickReport> for TickRecord {
    fn from(report: &controller::TickReport) -> Self {
        let controller::TickReport { estimate, health, camera, command, applied, phase } = *report;
        let (phase, since_nanos) = match phase {
            // Why is the health, which has a field of its own.
            PositioningPhase::Waiting(_) => (0, 0),
            // What is driven shows in the command.
            PositioningPhase::Cruise { cruise: _, since, progress: _ } => (1, since.nanos()),
            PositioningPhase::Burst { family: _, burst: _, since } => (2, since.nanos()),
            PositioningPhase::Settling => (3, 0),
            PositioningPhase::Holding => (4, 0),
            PositioningPhase::Stopped(StopReason::Cancelled) => (5, 0),
            PositioningPhase::Stopped(StopReason::TimedOut) => (6, 0),
            PositioningPhase::Stopped(StopReason::Stalled) => (7, 0),
            PositioningPhase::Stopped(StopReason::ModeInverted) => (8, 0),
            PositioningPhase::Stopped(StopReason::OutOfTravel) => (9, 0),
            PositioningPhase::Stopped(StopReason::TooManyDrives) => (10, 0),
            PositioningPhase::Stopped(StopReason::ModeBLost) => (11, 0),
            PositioningPhase::Stopped(StopReason::ModeCLost) => (12, 0),
        };
        Self {
            estimate: estimate.map(of_estimate),
            health: of_health(health),
            camera: camera.map(of_innovation),
            command: command.into(),
            applied: applied.into(),
            phase,
            since_nanos,
        }
    }
}

/// How many fields a report has.
pub const FIELDS: usize = 21;

impl TickRecord {
    /// Every field by name, bit by bit; `None` where its part of the report is absent.
    pub fn fields(&self) -> [(&'static str, Option<u64>); FIELDS] {
        let Self { estimate, health, camera, command, applied, phase, since_nanos } = *self;
        let bits = |value: f32| u64::from(value.to_bits());
        let of_estimate = |field: fn(&EstimateRecord) -> u64| estimate.as_ref().map(field);
        let of_estimate_bits = |field: fn(&EstimateRecord) -> f32| estimate.as_ref().map(field).map(bits);
        let of_camera = |field: fn(&InnovationRecord) -> u64| camera.as_ref().map(field);
        let of_camera_bits = |field: fn(&InnovationRecord) -> f32| camera.as_ref().map(field).map(bits);
        [
            ("estimate.at_nanos", of_estimate(|e| e.at_nanos)),
            ("estimate.angle_units", of_estimate(|e| e.angle_units.cast_unsigned())),
            ("estimate.rate_rad_s", of_estimate_bits(|e| e.rate_rad_s)),
            ("estimate.angle_rad2", of_estimate_bits(|e| e.angle_rad2)),
            ("estimate.angle_rate_rad2_s", of_estimate_bits(|e| e.angle_rate_rad2_s)),
            ("estimate.rate_rad2_s2", of_estimate_bits(|e| e.rate_rad2_s2)),
            ("estimate.resting", of_estimate(|e| e.resting.into())),
            ("health", Some(health.into())),
            ("camera.source", of_camera(|c| c.source.into())),
            ("camera.taken_nanos", of_camera(|c| c.taken_nanos)),
            ("camera.innovation_rad", of_camera_bits(|c| c.innovation_rad)),
            ("camera.variance_rad2", of_camera_bits(|c| c.variance_rad2)),
            ("camera.verdict", of_camera(|c| c.verdict.into())),
            ("command.mode", Some(command.mode.into())),
            ("command.amplitude", Some(bits(command.amplitude))),
            ("command.frequency_offset_hz", Some(bits(command.frequency_offset_hz))),
            ("applied.mode", Some(applied.mode.into())),
            ("applied.amplitude", Some(bits(applied.amplitude))),
            ("applied.frequency_offset_hz", Some(bits(applied.frequency_offset_hz))),
            ("phase", Some(phase.into())),
            ("since_nanos", Some(since_nanos)),
        ]
    }

    /// The first field in which the bits of two reports differ: its name and both values.
    pub fn difference(&self, other: &Self) -> Option<(&'static str, Option<u64>, Option<u64>)> {
        let pairs = self.fields().into_iter().zip(other.fields());
        pairs.map(|((name, ours), (_, theirs))| (name, ours, theirs)).find(|(_, ours, theirs)| ours != theirs)
    }
}
