//! The messages. Names carry units; bounds are checked where a value is used.

use controller::{LDV_SAMPLES_PER_TICK_MAX, Limits, Target};
use estimator::{CameraFrame, Instruments, LdvSample};
use motor_model::{Angle, OutOfBounds, Time};
use serde::{Deserialize, Serialize};

use crate::description::DescriptionDigests;
use crate::experiment::{ExperimentRecord, ExperimentsConfiguration, ResponseRecord};
use crate::forecast::ForecastAnswer;
use crate::identity::BoardIdentity;
use crate::jog::{Jog, JogReport};
use crate::limits::MoveLimitsRecord;
use crate::map_rows::{LearntRecord, MapEnd, MapFault, MapRows};
use crate::rate::RateConfiguration;
use crate::self_test::SelfTestReport;
use crate::tick_record::TickRecord;

/// From the host to the board.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum HostMessage {
    /// Begins the session of the header. The board stops driving, and drops its configuration and what a host has
    /// described: the description in force is the one that it keeps ([`HostMessage::Keep`]), or else the default one.
    Hello,
    /// The move to make once armed. Refused as a whole when a value is out of bounds, and while armed.
    Configure(Configuration),
    /// From now on the loop may drive.
    Arm,
    /// Drive off, not armed, faults cleared.
    Stop,
    /// A camera frame.
    Camera(CameraRecord),
    /// Vibrometer samples, oldest first.
    Ldv(LdvRecords),
    /// One tick of the loop, now: instead of the board's timer, where host and board go in lock step.
    Step,
    /// Asks for the counters.
    Count,
    /// What camera and vibrometer are, for the configurations that follow. Refused as a whole when a value is out of
    /// bounds, and while armed.
    Instruments(Instruments),
    /// A parameter of the motor's design, for the configurations that follow. Refused when there is no such parameter,
    /// or its value is out of bounds, and while armed.
    MotorParameter(MotorParameterRecord),
    /// A response map of the motor that was described begins, without rows: the one before it, or that of Table 1, is
    /// forgotten, and so is the configuration, which plans by it. Refused while armed.
    MapBegin,
    /// Rows of this map. Refused as a whole when a row is, and while armed.
    MapRows(MapRows),
    /// The map is complete: the configurations that follow plan by it. Refused when a row is missing.
    MapEnd(MapEnd),
    /// Asks what this move will take from angle zero, on the bench that was described; any filter gives the same
    /// answer. Nothing moves, and the configuration stays as it is. Refused while armed.
    Forecast(Configuration),
    /// The rate to hold once armed, instead of a move. Refused as a whole when a value is out of bounds, and while
    /// armed.
    ConfigureRate(RateConfiguration),
    /// Another target for the move under way, whose deadline begins anew; what was learnt of the motor is kept. A stop
    /// and another arming make the configured move again. Refused when a value is out of bounds, and unless a move is
    /// armed; the move then goes on as it is.
    Retarget(TargetRecord),
    /// The same with the angle at which the rotor is now as the target, and the tolerance as it is. Refused without a
    /// usable estimate as well.
    Hold,
    /// When the loop decides, and when its commands act ([`controller::LoopTiming`]), for the configurations that
    /// follow. Refused out of its bounds, and while armed.
    Timing {
        /// Ticks from the measurements of a tick until the command acts that they decide.
        latency_ticks: u8,
        /// Ticks from one decision to the next.
        decision_ticks: u8,
    },
    /// Asks what the board is.
    Identify,
    /// Keep the description in force over a loss of power: it is in force again after every start and in every session
    /// that begins, until a host describes another. Refused while armed, with a map that is incomplete or for another
    /// motor, and by a board that has no place for it. The processor may stand still for a tenth of a second, so the
    /// host sends nothing before the answer.
    Keep,
    /// Forget the description in force and the kept one: the default one is in force, and no move is configured.
    /// Refused while armed, and by a board that has no place for one; the host sends nothing before the answer.
    Forget,
    /// Asks which description is in force, and which one is kept. Refused while armed, since it takes longer than a
    /// tick, with a map that is incomplete or for another motor, and by a board that keeps nothing.
    Digest,
    /// A description of the bench begins: the default one is in force, of the default instruments, the motor of Table 1
    /// and its map, no latency, and a decision in every tick. No move is configured. What is kept stays. Refused while
    /// armed.
    DescriptionBegin,
    /// Drives by hand, at the frequencies of the motor that was described, without a filter. It ends with its duration,
    /// or by a stop; a silent host, missed deadlines or a failed amplifier latch as while armed. Another one replaces
    /// it, which keeps the drive on. The configuration is forgotten. Refused when a value is out of bounds, while armed
    /// and while latched. While it is on, all that is refused while armed is refused.
    Jog(Jog),
    /// Asks the board to look at itself for [`SelfTestReport::TICKS`] with the drive off, and to answer then. A stop, a
    /// jog or arming ends it without an answer. Refused while armed or jogged.
    SelfTest,
    /// Sets the angle from which targets and limits are counted from now on, and all angles that the board tells. A
    /// move or a rate under way goes on to the same place. [`HostMessage::Hello`] sets it to 0 of the camera's angle,
    /// and nothing else does.
    Zero {
        /// The camera's angle that is the zero, in units of 2^-32 turn, within 1000 turns; refused while armed or
        /// jogged. `None` for the angle at which the rotor is now; refused unless armed, and without a usable estimate.
        angle_units: Option<i64>,
    },
    /// Experiments once armed, instead of a move. Refused as a whole when a value is out of bounds, and while armed.
    ConfigureExperiments(ExperimentsConfiguration),
    /// Orders the next experiment. The order of the one under way once more is answered again, and changes nothing.
    /// Refused when a value is out of bounds, unless experiments are armed, and until the one before is over.
    Experiment(ExperimentRecord),
    /// Asks what the last experiment has shown. Refused unless experiments are armed, and until it is over.
    Response,
    /// What earlier moves have learnt of the motor, as a part of this map, before its end: a move by it begins with
    /// that. Refused when a factor is out of bounds, and while armed.
    MapLearnt(LearntRecord),
    /// Asks what the configured move has learnt of the motor until now; before a move is armed that is what the map
    /// says. A stop configures the move anew. Refused without a move.
    Learnt,
    /// How often the host needs a report, in every state. [`HostMessage::Hello`] sets it to
    /// [`REPORT_TICKS`](crate::REPORT_TICKS). Whatever it is, a report comes in the tick in which a move or an
    /// experiment changes its drive, and at a change of health or of the kind of phase, of those at most one in
    /// [`CHANGE_TICKS`](crate::CHANGE_TICKS) since the last report of any kind; the last one is never left out. Refused
    /// when it is out of bounds.
    ReportPeriod {
        /// Ticks from one report to the next, 1 to [`REPORT_TICKS_MAX`](crate::REPORT_TICKS_MAX), or 0 for those of
        /// changes alone. A board of that is silent for as long as the longest period, and no longer.
        ticks: u16,
    },
}

/// From the board to the host.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum BoardMessage {
    /// Answer to [`HostMessage::Hello`].
    Welcome {
        /// Period of the loop.
        tick_nanos: u64,
    },
    /// The configuration of a move, of a rate or of experiments is taken.
    Configured,
    /// The loop may drive from now on.
    Armed,
    /// The drive is off and the loop is not armed.
    Stopped,
    /// What a tick did.
    Report(TickRecord),
    /// Answer to [`HostMessage::Count`].
    Counters(Counters),
    /// What is wrong; the drive is off unless the fault says otherwise.
    Fault(BoardFault),
    /// The description of the instruments, the parameter of the motor, or the part of the response map is taken.
    Described,
    /// Answer to [`HostMessage::Forecast`].
    Forecast(ForecastAnswer),
    /// Answer to [`HostMessage::Retarget`] and [`HostMessage::Hold`].
    Retargeted {
        /// The target that is moved to from now on, in units of 2^-32 turn.
        target_units: i64,
    },
    /// Answer to [`HostMessage::Identify`].
    Identity(BoardIdentity),
    /// The description in force is kept.
    Kept,
    /// The default description is in force, and none is kept.
    Forgotten,
    /// Answer to [`HostMessage::Digest`].
    Digests(DescriptionDigests),
    /// The drive is on by hand.
    Jogging,
    /// A jog was over with its duration, and the drive is off. One that ends otherwise is told by [`Self::Stopped`],
    /// [`Self::Welcome`] or a fault.
    Jogged(JogReport),
    /// Answer to [`HostMessage::SelfTest`].
    SelfTest(SelfTestReport),
    /// Answer to [`HostMessage::Zero`].
    Zeroed {
        /// The camera's angle that is the zero, in units of 2^-32 turn.
        angle_units: i64,
    },
    /// The experiment of that number is ordered, or under way, or over.
    ExperimentTaken {
        /// Its number.
        number: u16,
    },
    /// Answer to [`HostMessage::Response`].
    Response(ResponseRecord),
    /// Answer to [`HostMessage::Learnt`].
    Learnt(LearntRecord),
    /// Answer to [`HostMessage::ReportPeriod`].
    ReportPeriod {
        /// Ticks from one report to the next, as asked for.
        ticks: u16,
    },
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

/// A move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Configuration {
    /// The filter to estimate by.
    pub filter: FilterKind,
    /// Target angle in degrees, clockwise positive; bounds as in [`controller::Target::try_new`].
    pub target_deg: f64,
    /// Tolerance to either side of the target, in degrees; bounds as in [`controller::Target::try_new`].
    pub tolerance_deg: f64,
    /// Time after arming at which the move is given up, in ns, at most a day.
    pub deadline_nanos: u64,
    /// The limits within which the motor is driven.
    pub limits: MoveLimitsRecord,
}

impl Configuration {
    /// The target, and the limits of the move.
    ///
    /// # Errors
    /// When target, tolerance, deadline or a limit is out of bounds, or the target outside of the travel.
    pub fn checked(&self) -> Result<(Target, Limits), OutOfBounds> {
        let target = Target::try_new(self.target_deg, self.tolerance_deg)?;
        let limits = self.limits.checked(self.deadline_nanos)?;
        if let Some((least_deg, greatest_deg)) = self.limits.travel_deg {
            OutOfBounds::check("position.to_deg", self.target_deg, least_deg, greatest_deg, "deg")?;
        }
        Ok((target, limits))
    }
}

/// A target on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TargetRecord {
    /// As in [`Configuration::target_deg`].
    pub target_deg: f64,
    /// As in [`Configuration::tolerance_deg`].
    pub tolerance_deg: f64,
}

/// A parameter of the motor on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotorParameterRecord {
    /// Its index in [`motor_model::Parameter::ALL`].
    pub index: u8,
    /// Its value, in the unit of its specification.
    pub value: f64,
}

/// [`CameraFrame`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CameraRecord {
    /// When it was exposed, in ns of the board's time.
    pub exposed_nanos: u64,
    /// Angle within the turn, in units of 2^-32 turn.
    pub angle_units: i32,
    /// Marks that the angle is from; 0 where none of the camera's was left out.
    pub marks_used: u8,
    /// [`CameraFrame::residual`].
    pub residual: u8,
}

impl From<CameraFrame> for CameraRecord {
    #[expect(clippy::cast_possible_truncation, reason = "an angle within the turn has 32 bits")]
    fn from(CameraFrame { exposed_at, angle, marks_used, residual }: CameraFrame) -> Self {
        let angle_units = angle.wrapped().units() as i32;
        Self { exposed_nanos: exposed_at.nanos(), angle_units, marks_used, residual }
    }
}

impl From<CameraRecord> for CameraFrame {
    fn from(CameraRecord { exposed_nanos, angle_units, marks_used, residual }: CameraRecord) -> Self {
        let angle = Angle::from_units(angle_units.into());
        Self { exposed_at: Time::from_nanos(exposed_nanos), angle, marks_used, residual }
    }
}

/// [`LdvSample`] on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LdvRecord {
    /// When it was taken, in ns of the board's time.
    pub taken_nanos: u64,
    /// Vertical velocity in m/s, upwards positive; the filter refuses what is no velocity of a rotor.
    pub velocity_m_s: f32,
}

/// As many samples as one tick fuses.
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
    /// A frame of a session that the board does not know: board or host has restarted. The host has to send
    /// [`HostMessage::Hello`].
    #[error("the board knows no session {session}: it has started anew")]
    UnknownSession {
        /// The frame's session.
        session: u32,
    },
    /// To arm or to step needs a configuration, and to step needs arming.
    #[error("not configured and armed")]
    NotReady,
    /// A configuration, a description, a jog or a self-test was asked for while armed; the loop goes on as it was,
    /// driving.
    #[error("this is refused while armed")]
    Armed,
    /// A configuration with a value out of bounds, or a filter that the board was built without; the old one is kept.
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
    /// A step was asked of a board whose own timer makes the ticks. The loop goes on.
    #[error("the board's own timer makes the ticks: it takes no steps")]
    Timed,
    /// The amplifier failed while the loop was armed, or its bridge was cut off by an over-current. Latched: only
    /// [`HostMessage::Stop`] clears it, and the next arming or jog tries the amplifier again.
    #[error("the amplifier failed, or an over-current cut it off: the drive is off until a stop")]
    AmplifierFailed,
    /// A response map is refused, or does not go with the motor. Rows that are refused leave those before them.
    #[error("response map: {0}")]
    Map(MapFault),
    /// A target was asked for, or what was learnt, in a task that has none. The task goes on.
    #[error("no move is under way: nothing else has a target, or learns of the motor")]
    NoMove,
    /// The angle of the rotor is not known well enough to be a target or a zero. The move goes on.
    #[error("there is no usable estimate of the angle")]
    NoEstimate,
    /// The board was built without a place for a description.
    #[error("the board has no place to keep a description")]
    KeepsNothing,
    /// The flash has failed, or the description has no room there. A description that was kept before still is, unless
    /// it was to be forgotten.
    #[error("the board's flash has failed, or has no room for the description")]
    NotStored,
    /// Something was asked that has to wait for the end of a jog. The jog goes on.
    #[error("the drive is on by hand")]
    Jogging,
    /// An experiment, or what one has shown, was asked for while there are none, or experiments of a board that was
    /// built without. What is armed goes on.
    #[error("no experiments are armed, or the board was built without them")]
    NoExperiments,
    /// The experiment under way has to be over first, or the order has another number than the next. It goes on.
    #[error("the experiment is not over, or the order is not the next")]
    NotInOrder,
}

/// Counts of received frames, of dropped measurements and of missed deadlines since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Frames accepted.
    pub taken: u32,
    /// Frames that were damaged or no message.
    pub damaged: u32,
    /// Frames that were too long.
    pub oversize: u32,
    /// Frames of another version.
    pub other_version: u32,
    /// Frames of a session that the board does not know.
    pub other_session: u32,
    /// Frames that were received twice.
    pub duplicates: u32,
    /// Frames that were received after later ones, and not used.
    pub late: u32,
    /// Frames that were never received, by the gaps in the sequence.
    pub lost: u32,
    /// Measurements dropped because more arrived than a tick fuses; the oldest are dropped.
    pub dropped: u32,
    /// Ticks that ended after their deadline while the loop was armed.
    pub overruns: u32,
    /// The most bytes of stack used until the last look at all of it, some 15 ms before; 0 where it is not measured.
    pub stack_bytes_max: u32,
}
