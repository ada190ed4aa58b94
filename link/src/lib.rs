//! The protocol between host and microcontroller, and its frames. Every transport carries the same bytes.
//!
//! # In the order of the data
//!
//! - [`HostMessage`], [`BoardMessage`]: all that is sent.
//! - [`Configuration`]: which filter, which target, within which limits.
//! - [`TickRecord`]: what a tick of the loop did, every bit of it.
//! - [`RateConfiguration`]: which rate, for how long, within which limits. [`RatePhase`]: what becomes of it.
//! - [`ExperimentsConfiguration`], [`ExperimentRecord`], [`ResponseRecord`]: how long experiments may take and within
//!   which limits, which one is ordered, and what it has shown.
//! - [`HostMessage::ReportPeriod`]: how often the host needs a report.
//! - [`MapRows`], [`map_messages`]: a response map, a few rows in each frame; [`MapFault`]: why it is refused.
//! - [`LearntRecord`]: what moves have learnt of the motor, in and out.
//! - [`ForecastAnswer`]: what a move will take, or the tolerance that can be met instead.
//! - [`description_messages`], [`DescriptionDigest`]: what a board is told of its bench, and a digest of it;
//!   [`DescriptionDigests`]: which one is in force, and which one is kept.
//! - [`BoardIdentity`]: which loop the board was built of, and why it started.
//! - [`Jog`], [`JogReport`]: the drive by hand. [`SelfTestReport`]: what a board can tell of itself at rest. Both have
//!   [`VelocitySums`].
//! - [`numbering`]: the numbers of enumerations, both ways.
//! - [`frame`]: a message with its [`Header`], a CRC-32, and no zero byte but the last ([`encode`], [`decode`]).
//! - [`camera_frame`]: the short frames of the camera ([`encode_camera`]).
//! - [`Deframer`]: from received bytes to frames, in bounded memory.
//! - [`Sequence`]: whether a frame is new, repeated, late, or the first after a gap; [`BoardSequence`]: the same on a
//!   board, which takes short frames too.
//!
//! # Promises
//!
//! `no_std`, no allocation, no unsafe code, no panic. A frame is accepted whole or not at all: COBS, length, CRC,
//! version and message must all be right, and no byte may be left over.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | frame | one message on the wire, ended by a zero byte |
//! | record | a value of another crate as it goes over the wire |
//! | session | number that the host picks in its [`HostMessage::Hello`]; a frame of another session is refused |
//! | sequence | number of a frame within its session and direction |
//! | tick | period of the loop; the board's count of them is the time of both |
//! | COBS | consistent overhead byte stuffing: bytes without zeros, one byte longer in 254 |

#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing,
        clippy::cast_possible_truncation,
        clippy::naive_bytecount,
        reason = "a test fails by panicking, and need not be fast"
    )
)]

pub mod camera_frame;
mod deframer;
mod description;
mod experiment;
mod forecast;
pub mod frame;
mod identity;
mod jog;
mod limits;
mod map_rows;
mod message;
pub mod numbering;
mod observation;
mod rate;
mod report_period;
mod self_test;
mod sequence;
mod tick_record;

/// The README's example, which must compile and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

pub use camera_frame::{Expected, SHORT_FRAME_BYTES, encode_camera};
pub use deframer::Deframer;
pub use description::{
    DescriptionDigest, DescriptionDigests, KeptDescription, PART_BYTES_MAX, decode_part,
    description_messages, encode_part,
};
pub use experiment::{
    ExperimentDrive, ExperimentRecord, ExperimentsConfiguration, ResponseRecord, ShownRecord,
};
pub use forecast::{ForecastAnswer, ForecastRecord, UnreachableRecord};
pub use frame::{
    FRAME_BYTES_MAX, FrameError, Header, LINE_BAUD, VERSION, decode, decode_on_board, encode, encode_on_board,
};
pub use identity::{BoardIdentity, LOOP_DIGEST, ResetCause};
pub use jog::{Jog, JogReport};
pub use limits::MoveLimitsRecord;
pub use map_rows::{
    BurstRecord, CruiseRecord, LearntRecord, MAP_ROWS_MAX, MapEnd, MapFault, MapRows, map_messages, rows_of,
};
pub use message::{
    BoardFault, BoardMessage, CameraRecord, Configuration, Counters, FilterKind, HostMessage, LdvRecord,
    LdvRecords, MotorParameterRecord, SettingKey, TargetRecord,
};
pub use numbering::{Coded, Numbered, PhaseRecord};
pub use observation::{CameraAges, VelocitySums};
pub use rate::{RateConfiguration, RateLimitsRecord, RatePhase, RateRecord};
pub use report_period::{CHANGE_TICKS, REPORT_TICKS, REPORT_TICKS_MAX, checked_report_ticks};
pub use self_test::SelfTestReport;
pub use sequence::{Arrival, BoardSequence, Sequence};
pub use tick_record::{CommandRecord, EstimateRecord, InnovationRecord, TickRecord};
