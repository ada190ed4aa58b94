//! What the board sees of its instruments while no loop takes their measurements: during a jog and a self-test.

use estimator::LdvSample;
use link::{CameraAges, VelocitySums};
use motor_model::{DriveCommand, Time};

use super::measurements::MeasurementQueues;

/// What is observed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Observed {
    /// The drive by hand.
    Jog,
    /// The board itself, at rest.
    SelfTest,
}

/// Measurements and ticks, added up until it is over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    pub(super) of: Observed,
    /// The number of its last tick.
    pub(super) last_tick: u64,
    /// Whether that tick has passed. It is then kept until it is told.
    pub(super) is_over: bool,
    pub(super) ticks: u32,
    pub(super) late_ticks: u32,
    pub(super) velocity: VelocitySums,
    pub(super) camera: CameraAges,
    /// What the amplifier applied in the last of them.
    pub(super) applied: DriveCommand,
}

impl Observation {
    /// An observation of `ticks` ticks, after tick `now`.
    pub(super) fn begin(of: Observed, now: u64, ticks: u64) -> Self {
        Self {
            of,
            last_tick: now + ticks,
            is_over: false,
            ticks: 0,
            late_ticks: 0,
            velocity: VelocitySums::default(),
            camera: CameraAges::default(),
            applied: DriveCommand::OFF,
        }
    }

    /// Adds a tick at `now`, with what has arrived until then.
    pub(super) fn take(&mut self, measurements: &mut MeasurementQueues, now: Time) {
        self.ticks = self.ticks.saturating_add(1);
        while let Some(LdvSample { velocity_m_s, .. }) = measurements.ldv_sample() {
            self.velocity.add(velocity_m_s);
        }
        while let Some(frame) = measurements.camera_frame() {
            self.camera.add(now.nanos().wrapping_sub(frame.exposed_at.nanos()).cast_signed());
        }
    }
}
