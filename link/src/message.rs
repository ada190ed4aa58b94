//! All that is ever said. Numbers carry their unit; what a number means is checked where it is used.

use controller::LDV_SAMPLES_PER_TICK_MAX;
use estimator::{CameraFrame, LdvSample};
use motor_model::{Angle, Time};
use serde::{Deserialize, Serialize};

use crate::tick_record::TickRecord;

/// From the host to the board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[expect(clippy::large_enum_variant, reason = "there is no heap to put the samples on")]
pub enum HostMessage {
    /// Begins a session, that of the header. The board stops driving, forgets its configuration and wants to be armed
    /// anew.
    Hello,
    /// What to do once armed. Refused as a whole when out of bounds, and while armed.
    Configure(Configuration),
    /// From now on the loop may drive.
    Arm,
    /// Drive off, not armed, faults forgotten.
    Stop,
    /// A camera frame.
    Camera(CameraRecord),
    /// Vibrometer samples, oldest first.
    Ldv(LdvRecords),
    /// One tick of the loop, now: instead of the board's timer, where host and board go in lock step.
    Step,
    /// What became of the frames so far.
    Count,
}

/// From the board to the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum BoardMessage {
    /// Answer to [`HostMessage::Hello`].
    Welcome {
        /// Period of the loop.
        tick_nanos: u64,
    },
    /// It is configured.
    Configured,
    /// It is armed.
    Armed,
    /// It is stopped.
    Stopped,
    /// What a tick did.
    Report(TickRecord),
    /// Answer to [`HostMessage::Count`].
    Counters(Counters),
    /// What is wrong; the drive is off unless the fault says otherwise.
    Fault(BoardFault),
}

/// The filters that the board has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum FilterKind {
    /// [`estimator::ConstantRate`]
    ConstantRate,
    /// [`estimator::ImpactAided`]
    ImpactAided,
    /// [`estimator::TwinFilter`]
    Twin,
}

/// What the board needs to know of a move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// How it estimates.
    pub filter: FilterKind,
    /// Where to go, in degrees; bounds as in [`controller::Target::try_new`].
    pub target_deg: f64,
    /// How close is close enough, in degrees.
    pub tolerance_deg: f64,
    /// When to give up, in ns after arming.
    pub deadline_nanos: u64,
}

/// [`CameraFrame`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraRecord {
    /// When it was exposed, in ns of the board's time.
    pub exposed_nanos: u64,
    /// Angle within the turn, in units of 2^-32 turn.
    pub angle_units: i32,
}

impl From<CameraFrame> for CameraRecord {
    #[expect(clippy::cast_possible_truncation, reason = "an angle within the turn has 32 bits")]
    fn from(CameraFrame { exposed_at, angle }: CameraFrame) -> Self {
        Self { exposed_nanos: exposed_at.nanos(), angle_units: angle.wrapped().units() as i32 }
    }
}

impl From<CameraRecord> for CameraFrame {
    fn from(CameraRecord { exposed_nanos, angle_units }: CameraRecord) -> Self {
        Self { exposed_at: Time::from_nanos(exposed_nanos), angle: Angle::from_units(angle_units.into()) }
    }
}

/// [`LdvSample`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LdvRecord {
    /// When it was taken, in ns of the board's time.
    pub taken_nanos: u64,
    /// Vertical velocity in m/s; the filter refuses what is no velocity of a rotor.
    pub velocity_m_s: f32,
}

/// As many as one tick takes in.
pub type LdvRecords = heapless::Vec<LdvRecord, LDV_SAMPLES_PER_TICK_MAX>;

impl From<LdvSample> for LdvRecord {
    fn from(LdvSample { taken_at, velocity_m_s }: LdvSample) -> Self {
        Self { taken_nanos: taken_at.nanos(), velocity_m_s }
    }
}

impl From<LdvRecord> for LdvSample {
    fn from(LdvRecord { taken_nanos, velocity_m_s }: LdvRecord) -> Self {
        Self { taken_at: Time::from_nanos(taken_nanos), velocity_m_s }
    }
}

/// Key of a setting, as in a scene file.
pub type SettingKey = heapless::String<32>;

/// What is wrong.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
pub enum BoardFault {
    /// The host speaks another version of the protocol.
    #[error("the host speaks protocol version {theirs}, the board version {ours}")]
    Version {
        /// The host's.
        theirs: u8,
        /// The board's.
        ours: u8,
    },
    /// A frame of a session that the board does not know: it, or the host, has started anew. Say hello.
    #[error("the board knows no session {session}: it has started anew")]
    UnknownSession {
        /// The frame's session.
        session: u32,
    },
    /// Asked to arm or to step without a configuration, or to step without being armed.
    #[error("not configured and armed")]
    NotReady,
    /// A configuration came while armed; the loop goes on with the old one, driving.
    #[error("the configuration cannot be changed while armed")]
    Armed,
    /// A configuration with a value out of bounds; the old one is kept.
    #[error("{key} is out of bounds")]
    OutOfBounds {
        /// The setting.
        key: SettingKey,
    },
    /// The host was silent while the loop was armed. Latched: only [`HostMessage::Stop`] clears it.
    #[error("the host was silent: the drive is off until a stop")]
    HostSilent,
    /// Too many deadlines were missed while the loop was armed. Latched: only [`HostMessage::Stop`] clears it.
    #[error("deadlines were missed: the drive is off until a stop")]
    Overrun,
}

/// What became of the bytes that the board received, and how it fares.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Frames taken.
    pub taken: u32,
    /// Frames that were damaged or no message.
    pub damaged: u32,
    /// Frames that were too long.
    pub oversize: u32,
    /// Frames of another version.
    pub other_version: u32,
    /// Frames of a session that the board does not know.
    pub other_session: u32,
    /// Frames that came again.
    pub duplicates: u32,
    /// Frames that came after later ones, and were not used.
    pub late: u32,
    /// Frames that never came.
    pub lost: u32,
    /// Measurements dropped because more came than a tick takes in; the oldest go first.
    pub dropped: u32,
    /// Ticks that ended after their deadline while the loop was armed.
    pub overruns: u32,
    /// The most bytes that the stack has taken so far; 0 where nobody knows.
    pub stack_bytes_max: u32,
}
