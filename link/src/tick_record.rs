//! [`controller::TickReport`], [`controller::RateReport`] and [`ExperimentReport`] on the wire, to the last bit.
//!
//! Each part of the report has a record of the same fields. Times are in ns since the board's start, angles in units
//! of 2^-32 turn, and an enumeration is its number ([`crate::numbering`]).

use controller::commissioning::ExperimentReport;
use controller::{PositioningPhase, RateReport, TickReport};
use estimator::{Estimate, Health, Innovation, Source, Verdict};
use motor_model::{Angle, DriveCommand, DriveMode};
use serde::{Deserialize, Serialize};

use crate::numbering::{Coded, PhaseRecord};
use crate::rate::{RatePhase, RateRecord};

/// What a tick of the loop did.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TickRecord {
    /// The estimate the decision was based on; `None` before the first camera frame.
    pub estimate: Option<EstimateRecord>,
    /// Whether it may be used.
    pub health: Coded<Health>,
    /// What became of the camera frame that arrived, if one did.
    pub camera: Option<InnovationRecord>,
    /// The command given.
    pub command: CommandRecord,
    /// The command really applied.
    pub applied: CommandRecord,
    /// What the controller is doing.
    pub phase: Coded<PhaseRecord>,
    /// When the cruise or burst under way began, in ns; 0 when there is none. Of a rate, since when the command is
    /// given.
    pub since_nanos: u64,
    /// What is asked of the rotor; `None` of a move.
    pub rate: Option<RateRecord>,
}

/// [`Estimate`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct EstimateRecord {
    /// The instant that it is for, in ns.
    pub at_nanos: u64,
    /// Angle in units of 2^-32 turn.
    pub angle_units: i64,
    /// Rate in rad/s, clockwise positive.
    pub rate_rad_s: f32,
    /// Variance of the angle in rad^2.
    pub angle_rad2: f32,
    /// Covariance of angle and rate in rad^2/s.
    pub angle_rate_rad2_s: f32,
    /// Variance of the rate in (rad/s)^2.
    pub rate_rad2_s2: f32,
    /// Whether the rotor is at rest.
    pub resting: bool,
}

/// [`Innovation`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct InnovationRecord {
    /// Which instrument.
    pub source: Coded<Source>,
    /// When it was taken, in ns.
    pub taken_nanos: u64,
    /// Measurement less prediction, in rad.
    pub innovation_rad: f32,
    /// Its predicted variance in rad^2.
    pub variance_rad2: f32,
    /// What became of it.
    pub verdict: Coded<Verdict>,
}

/// [`DriveCommand`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommandRecord {
    /// The mode; `None` is off.
    pub mode: Coded<Option<DriveMode>>,
    /// Amplitude, 0 to 1.
    pub amplitude: f32,
    /// Offset from the mode's nominal frequency, in Hz.
    pub frequency_offset_hz: f32,
}

impl From<DriveCommand> for CommandRecord {
    fn from(command: DriveCommand) -> Self {
        Self {
            mode: command.mode().into(),
            amplitude: command.amplitude(),
            frequency_offset_hz: command.frequency_offset_hz(),
        }
    }
}

impl CommandRecord {
    /// The command; `None` when there is no such command.
    pub fn command(&self) -> Option<DriveCommand> {
        let Self { mode, amplitude, frequency_offset_hz } = *self;
        match mode.value()? {
            None => Some(DriveCommand::OFF),
            Some(mode) => {
                DriveCommand::try_new(mode, amplitude).ok()?.with_frequency_offset(frequency_offset_hz).ok()
            }
        }
    }
}

impl From<Estimate<f32>> for EstimateRecord {
    fn from(estimate: Estimate<f32>) -> Self {
        let Estimate { at, angle, rate_rad_s, angle_rad2, angle_rate_rad2_s, rate_rad2_s2, resting } =
            estimate;
        Self {
            at_nanos: at.nanos(),
            angle_units: angle.units(),
            rate_rad_s,
            angle_rad2,
            angle_rate_rad2_s,
            rate_rad2_s2,
            resting,
        }
    }
}

impl From<Innovation<f32>> for InnovationRecord {
    fn from(innovation: Innovation<f32>) -> Self {
        let Innovation { source, taken_at, innovation_rad, variance_rad2, verdict } = innovation;
        Self {
            source: source.into(),
            taken_nanos: taken_at.nanos(),
            innovation_rad,
            variance_rad2,
            verdict: verdict.into(),
        }
    }
}

impl From<&TickReport> for TickRecord {
    fn from(report: &TickReport) -> Self {
        let TickReport { estimate, health, camera, command, applied, phase } = *report;
        let since_nanos = match phase {
            PositioningPhase::Cruise { since, .. }
            | PositioningPhase::Burst { since, .. }
            | PositioningPhase::Brake { since, .. } => since.nanos(),
            PositioningPhase::Waiting(_)
            | PositioningPhase::Settling(_)
            | PositioningPhase::Holding
            | PositioningPhase::Stopped(_) => 0,
        };
        Self {
            estimate: estimate.map(EstimateRecord::from),
            health: health.into(),
            camera: camera.map(InnovationRecord::from),
            command: command.into(),
            applied: applied.into(),
            phase: PhaseRecord::from(phase).into(),
            since_nanos,
            rate: None,
        }
    }
}

impl From<&RateReport> for TickRecord {
    fn from(report: &RateReport) -> Self {
        let RateReport { estimate, health, camera, command, applied, wanted_rad_s, reference, since, .. } =
            *report;
        Self {
            estimate: estimate.map(EstimateRecord::from),
            health: health.into(),
            camera: camera.map(InnovationRecord::from),
            command: command.into(),
            applied: applied.into(),
            phase: PhaseRecord::Rate(RatePhase::from(report)).into(),
            since_nanos: since.nanos(),
            rate: Some(RateRecord { wanted_rad_s, reference_units: reference.map(Angle::units) }),
        }
    }
}

impl From<&ExperimentReport> for TickRecord {
    fn from(report: &ExperimentReport) -> Self {
        let ExperimentReport { estimate, health, camera, command, applied, phase } = *report;
        Self {
            estimate: estimate.map(EstimateRecord::from),
            health: health.into(),
            camera: camera.map(InnovationRecord::from),
            command: command.into(),
            applied: applied.into(),
            phase: PhaseRecord::Experiment(phase).into(),
            since_nanos: 0,
            rate: None,
        }
    }
}

impl TickRecord {
    /// Number of fields.
    pub const FIELDS: usize = 23;

    /// Every field by name, with its bits; `None` where its part of the report is absent.
    pub fn fields(&self) -> [(&'static str, Option<u64>); Self::FIELDS] {
        let Self { estimate, health, camera, command, applied, phase, since_nanos, rate } = *self;
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
            ("health", Some(health.number().into())),
            ("camera.source", of_camera(|c| c.source.number().into())),
            ("camera.taken_nanos", of_camera(|c| c.taken_nanos)),
            ("camera.innovation_rad", of_camera_bits(|c| c.innovation_rad)),
            ("camera.variance_rad2", of_camera_bits(|c| c.variance_rad2)),
            ("camera.verdict", of_camera(|c| c.verdict.number().into())),
            ("command.mode", Some(command.mode.number().into())),
            ("command.amplitude", Some(bits(command.amplitude))),
            ("command.frequency_offset_hz", Some(bits(command.frequency_offset_hz))),
            ("applied.mode", Some(applied.mode.number().into())),
            ("applied.amplitude", Some(bits(applied.amplitude))),
            ("applied.frequency_offset_hz", Some(bits(applied.frequency_offset_hz))),
            ("phase", Some(phase.number().into())),
            ("since_nanos", Some(since_nanos)),
            ("rate.wanted_rad_s", rate.map(|rate| bits(rate.wanted_rad_s))),
            ("rate.reference_units", rate.and_then(|rate| rate.reference_units).map(i64::cast_unsigned)),
        ]
    }

    /// The first field in which the bits of two reports differ: its name and both values.
    pub fn difference(&self, other: &Self) -> Option<(&'static str, Option<u64>, Option<u64>)> {
        let pairs = self.fields().into_iter().zip(other.fields());
        pairs.map(|((name, ours), (_, theirs))| (name, ours, theirs)).find(|(_, ours, theirs)| ours != theirs)
    }
}

#[cfg(test)]
mod tests {
    use estimator::{Reason, Rejection};
    use motor_model::Time;

    use super::*;

    /// The bytes of a report, by hand: numbers are one byte, floats four, a time below 128 ns one, and `None` is 0.
    #[test]
    fn exact_bytes_of_a_report() {
        let camera = Innovation {
            source: Source::Camera,
            taken_at: Time::from_nanos(5),
            innovation_rad: 1.0,
            variance_rad2: 2.0,
            verdict: Verdict::Rejected(Rejection::Gate),
        };
        let report = TickReport {
            estimate: None,
            health: Health::Degraded(Reason::FramesRefused),
            camera: Some(camera),
            command: DriveCommand::full(DriveMode::C),
            applied: DriveCommand::OFF,
            phase: PositioningPhase::Holding,
        };
        let mut bytes = [0; 64];
        let bytes = postcard::to_slice(&TickRecord::from(&report), &mut bytes).unwrap();
        let expected: [&[u8]; 7] = [
            &[0, 4],
            &[1, 0, 5, 0, 0, 0x80, 0x3f, 0, 0, 0, 0x40, 3],
            &[2, 0, 0, 0x80, 0x3f, 0, 0, 0, 0],
            &[0, 0, 0, 0, 0, 0, 0, 0, 0],
            &[4],
            &[0],
            &[0],
        ];
        assert!(expected.iter().copied().flatten().eq(bytes.iter()), "{bytes:?}");
        assert_eq!(postcard::from_bytes::<TickRecord>(bytes).unwrap().health.value(), Some(report.health));
    }
}
