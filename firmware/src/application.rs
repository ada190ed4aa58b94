//! The program of any board: it takes bytes from the host, runs ticks of the loop, and sends frames to the host.
//!
//! ```text
//!               configure                arm                     host silent, deadlines missed,
//!      +------+ --------> +------------+ -----> +---------------+ amplifier failed  +---------+
//!   +->| safe |           | configured |        | armed: driven | ----------------> | latched |
//!   |  +------+ <-------- +------------+ <----- +---------------+                   +---------+
//!   |    | ^      hello     |             stop                                         ^  |
//!   |    | | its end,       | jog                                                      |  |
//!   |    | | stop, hello    v                                                          |  |
//!   |    | +--- +------------------------+ the same                                    |  |
//!   |    +----> | jogged: driven by hand | --------------------------------------------+  |
//!   |     jog   +------------------------+                                                |
//!   |                                                                        stop, hello  |
//!   +-------------------------------------------------------------------------------------+
//! ```
//!
//! The drive may be on while the loop is armed or jogged, and in no other state. A jog forgets what was configured. A
//! latched fault stays until the host sends stop or begins a new session: a link that comes back does not start the
//! motor. The board counts ticks from its start; this count is the time of both sides.
//!
//! | module | what it is |
//! |---|---|
//! | this one | states, ticks and messages |
//! | `session` | frames in, frames out, and which of them count |
//! | `board_facts` | what the board tells of itself: its clock, its stack, its converter, why it started |
//! | `description` | what the host tells before a move: instruments, motor, map, configuration |
//! | `configured_move` | the bench as the host describes it, and the task that is configured on it |
//! | `configured_rate` | the rate, and its end |
//! | `configured_experiments`, `experiment` | the experiments, which the host orders one by one |
//! | `deadlines` | ticks that ended late, and ticks that were lost |
//! | `forecast` | what a move will take, asked before it is configured |
//! | `retarget`, `learnt` | another target for the move under way, and what it has learnt of the motor |
//! | `by_hand`, `observation` | the jog and the self-test, and what the board sees of its instruments meanwhile |
//! | `zero` | the angle from which all angles of the link are counted |
//! | `map_memory` | the response map, as it comes in parts |
//! | `kept` | the description over a loss of power |
//! | `reports` | which ticks are reported |
//! | `measurements`, `ports` | the queues of measurements until the next tick, and what a tick sees of the board |

mod board_facts;
mod by_hand;
#[cfg(feature = "commissioning")]
mod configured_experiments;
#[cfg(not(feature = "commissioning"))]
#[path = "application/no_experiments.rs"]
mod configured_experiments;
mod configured_move;
mod configured_rate;
mod deadlines;
mod description;
mod experiment;
mod forecast;
mod kept;
mod learnt;
mod map_memory;
mod measurements;
mod observation;
mod ports;
mod reports;
mod retarget;
mod session;
#[cfg(test)]
mod tests;
mod zero;

use core::mem;

use controller::PositionLoop;
use controller::resonance_tracker::ResonanceTracker;
use estimator::LdvSample;
use link::{
    BoardFault, BoardIdentity, BoardMessage, Counters, Deframer, HostMessage, LOOP_DIGEST, ResetCause,
    TickRecord,
};
use motor_model::{Angle, DriveCommand, Time};

use crate::design::DesignedDrive;
use crate::telemetry::{ArmingState, Entry, Telemetry};
pub use configured_move::MoveMemory;
use configured_move::{Asked, Bench};
pub use deadlines::OVERRUNS_MAX;
use kept::StoreRequest;
use measurements::MeasurementQueues;
use observation::Observation;
use ports::Ports;
use reports::Reports;
use session::Session;

/// The host is silent after this many ticks without a frame: 10 ms, a hundred camera frames.
pub const SILENT_TICKS: u64 = 1000;

/// The answer to a session that begins.
const WELCOME: BoardMessage = BoardMessage::Welcome { tick_nanos: PositionLoop::TICK_NANOS };

/// What the loop may do.
#[derive(Debug)]
enum State {
    /// Not armed. If a task is configured, its filter has no measurement yet.
    Safe,
    /// Driven by hand. Nothing is configured.
    Jogging(DriveCommand),
    /// The configured task runs.
    Armed,
    /// Arming is refused until a stop.
    Latched(BoardFault),
}

/// The program, with the board's amplifier.
#[derive(Debug)]
pub struct Application<'m, D> {
    amplifier: D,
    deframer: Deframer,
    counters: Counters,
    session: Option<Session>,
    bench: Bench,
    memory: &'m mut MoveMemory,
    state: State,
    measurements: MeasurementQueues,
    /// What is seen of them in a jog or a self-test, until it is told.
    observation: Option<Observation>,
    /// The camera's angle from which all angles of the link are counted.
    zero: Angle,
    /// Ticks since the start, lost ones included: the time of both sides.
    elapsed_ticks: u64,
    /// `elapsed_ticks` when a frame was last accepted.
    last_frame_at: u64,
    overruns_in_a_row: u32,
    /// A fault that has latched and was not sent yet.
    latched_fault: Option<BoardFault>,
    telemetry: Telemetry,
    reports: Reports,
    /// Whether the host's [`HostMessage::Step`] makes the ticks, and no timer.
    in_lock_step: bool,
    /// The most bytes that the stack has taken, as far as is known.
    stack_bytes_max: u32,
    /// The bytes that there are for it; 0 where that is not known.
    stack_bytes: u32,
    reset_cause: ResetCause,
    /// Whether the program has a place for a kept description.
    has_store: bool,
    /// What the host waits for.
    store_request: Option<StoreRequest>,
    /// Whether the board has a converter for a vibrometer.
    has_converter: bool,
}

impl<'m, D: DesignedDrive> Application<'m, D> {
    /// The program as it starts: drive off, no host.
    pub fn new(mut amplifier: D, memory: &'m mut MoveMemory) -> Self {
        amplifier.switch_off();
        *memory = MoveMemory::new();
        Self {
            amplifier,
            deframer: Deframer::default(),
            counters: Counters::default(),
            session: None,
            bench: Bench::default(),
            memory,
            state: State::Safe,
            measurements: MeasurementQueues::default(),
            observation: None,
            zero: Angle::ZERO,
            elapsed_ticks: 0,
            last_frame_at: 0,
            overruns_in_a_row: 0,
            latched_fault: None,
            telemetry: Telemetry::default(),
            reports: Reports::default(),
            in_lock_step: true,
            stack_bytes_max: 0,
            stack_bytes: 0,
            reset_cause: ResetCause::Unknown,
            has_store: false,
            store_request: None,
            has_converter: false,
        }
    }

    /// The amplifier.
    pub fn amplifier(&self) -> &D {
        &self.amplifier
    }

    /// The amplifier, to update its state.
    pub fn amplifier_mut(&mut self) -> &mut D {
        &mut self.amplifier
    }

    /// Whether the loop may drive.
    pub fn is_armed(&self) -> bool {
        matches!(self.state, State::Armed)
    }

    /// Whether the drive may be on: by the loop, or by hand.
    pub fn is_driving(&self) -> bool {
        matches!(self.state, State::Armed | State::Jogging(_))
    }

    /// Counts of received frames, by what became of them, and of missed deadlines.
    pub fn counters(&self) -> Counters {
        Counters {
            oversize: self.deframer.oversize,
            dropped: self.measurements.dropped,
            stack_bytes_max: self.stack_bytes_max,
            ..self.counters
        }
    }

    /// Runs one tick of the loop, to be called every [`PositionLoop::TICK_NANOS`]; its report, when armed.
    pub fn tick(&mut self) -> Option<TickRecord> {
        self.tick_and_report(true)
    }

    /// The same, with a report where the host needs one, or of every tick.
    // Never inlined: `host-sim size` follows every call from here.
    #[inline(never)]
    pub fn tick_and_report(&mut self, of_every_tick: bool) -> Option<TickRecord> {
        self.elapsed_ticks += 1;
        if self.is_driving() && self.elapsed_ticks - self.last_frame_at > SILENT_TICKS {
            self.latch(BoardFault::HostSilent);
        }
        let is_armed = self.is_armed();
        if !is_armed {
            self.tick_by_hand();
        } else if self.amplifier.timing().decision_ticks > 1 && !of_every_tick && self.is_waiting() {
            self.reports.pass();
            return None;
        }
        let (tick, arming) = (self.elapsed_ticks, self.arming());
        let Self { memory, measurements, amplifier, deframer, counters, telemetry, .. } = self;
        let dropped = measurements.dropped;
        let ports = &mut Ports { measurements, amplifier };
        let mut report = None;
        if is_armed {
            report = memory.tick(time(tick), ports);
            match &mut report {
                Some(report) => report.count_from(self.zero),
                None => ports.amplifier.switch_off(),
            }
        }
        let counted = || Counters { oversize: deframer.oversize, dropped, ..*counters };
        telemetry.note(tick, arming, report.as_ref(), counted);
        let report = report?;
        if !self.reports.is_due(&report) && !of_every_tick {
            return None;
        }
        self.reports.told(&report);
        Some(TickRecord::from(&report))
    }

    fn is_waiting(&self) -> bool {
        self.memory.is_waiting(time(self.elapsed_ticks))
    }

    fn arming(&self) -> ArmingState {
        match self.state {
            State::Safe => ArmingState::Safe,
            State::Jogging(_) => ArmingState::Jogging,
            State::Armed => ArmingState::Armed,
            State::Latched(BoardFault::Overrun) => ArmingState::Overrun,
            State::Latched(BoardFault::AmplifierFailed) => ArmingState::AmplifierFailed,
            State::Latched(_) => ArmingState::HostSilent,
        }
    }

    /// The log entry of the last tick, once, and the number of that tick.
    pub fn telemetry(&mut self) -> Option<(u64, Entry)> {
        self.telemetry.take().map(|entry| (self.elapsed_ticks, entry))
    }

    /// Records that the last tick took so many clocks of the timer.
    pub fn record_duration(&mut self, clocks: u32) {
        self.telemetry.record_duration(clocks);
    }

    /// The amplifier has failed. Where the drive may be on, the board latches: no move is possible without it.
    pub fn stop_for_amplifier(&mut self) {
        if self.is_driving() {
            self.latch(BoardFault::AmplifierFailed);
        }
    }

    /// Takes a sample of a vibrometer at the board; the next tick uses it, unless nothing looks at measurements.
    pub fn push_ldv_sample(&mut self, sample: LdvSample) {
        if self.takes_measurements() {
            self.measurements.push_ldv_sample(sample);
        }
    }

    /// Whether a loop runs, or an observation. Else measurements would wait, and be dropped for newer ones.
    fn takes_measurements(&self) -> bool {
        self.is_armed() || self.observation.as_ref().is_some_and(|observation| !observation.is_over)
    }

    /// What the host does not know yet: the fault that has latched since the last call, or what a jog or a self-test
    /// that is over has seen.
    pub fn take_news(&mut self) -> Option<BoardMessage> {
        self.latched_fault.take().map(BoardMessage::Fault).or_else(|| self.take_observed())
    }

    fn latch(&mut self, fault: BoardFault) {
        self.amplifier.switch_off();
        self.latched_fault = Some(fault.clone());
        self.observation = None;
        self.state = State::Latched(fault);
    }

    /// Goes to the state safe. What was running is configured anew: its filter has no measurement. Where the bench has
    /// changed so that this is refused, nothing is configured.
    fn stop(&mut self) {
        self.amplifier.switch_off();
        let was_armed = !matches!(mem::replace(&mut self.state, State::Safe), State::Safe);
        self.measurements.clear();
        self.observation = None;
        self.overruns_in_a_row = 0;
        if let Some(configured) = self.memory.configured.as_ref().filter(|_| was_armed) {
            let asked = configured.asked();
            if !matches!(self.configure(asked), BoardMessage::Configured) {
                self.memory.configured = None;
            }
        }
    }

    /// Executes a message of the session; the answer, if it has one.
    fn execute(&mut self, message: &HostMessage) -> Option<BoardMessage> {
        Some(match message {
            HostMessage::Hello => {
                self.forget_description();
                self.zero = Angle::ZERO;
                self.reports = Reports::default();
                self.stop();
                if self.has_store {
                    return self.ask_store(StoreRequest::Restore);
                }
                WELCOME
            }
            HostMessage::Configure(configuration) => self.configure(Asked::Move(*configuration)),
            HostMessage::ConfigureRate(configuration) => self.configure(Asked::Rate(*configuration)),
            HostMessage::ConfigureExperiments(asked) => self.configure(Asked::Experiments(*asked)),
            HostMessage::Experiment(order) => self.experiment(Some(order)),
            HostMessage::Response => self.experiment(None),
            HostMessage::Learnt => self.learnt(),
            HostMessage::DescriptionBegin
            | HostMessage::Instruments(_)
            | HostMessage::MotorParameter(_)
            | HostMessage::Timing { .. }
            | HostMessage::MapBegin
            | HostMessage::MapRows(_)
            | HostMessage::MapLearnt(_)
            | HostMessage::MapEnd(_) => return self.describe_by(message),
            HostMessage::Keep => return self.ask_store(StoreRequest::Keep),
            HostMessage::Forget => return self.ask_store(StoreRequest::Forget),
            HostMessage::Digest => return self.ask_store(StoreRequest::Digest),
            HostMessage::Arm => self.arm(),
            HostMessage::Stop => {
                self.stop();
                BoardMessage::Stopped
            }
            HostMessage::Camera(frame) => {
                if self.takes_measurements() {
                    self.measurements.push_camera_frame((*frame).into());
                }
                return None;
            }
            HostMessage::Ldv(samples) => {
                samples.iter().for_each(|&sample| self.push_ldv_sample(sample.into()));
                return None;
            }
            HostMessage::Step if !self.in_lock_step => BoardMessage::Fault(BoardFault::Timed),
            HostMessage::Step => match self.tick() {
                Some(report) => BoardMessage::Report(report),
                None => self.take_observed().unwrap_or_else(|| BoardMessage::Fault(self.fault())),
            },
            HostMessage::Count => BoardMessage::Counters(self.counters()),
            HostMessage::Identify => BoardMessage::Identity(BoardIdentity {
                loop_digest: LOOP_DIGEST,
                reset_cause: self.reset_cause.into(),
            }),
            HostMessage::Forecast(question) => self.forecast(*question),
            HostMessage::Retarget(target) => self.retarget(Some(*target)),
            HostMessage::Hold => self.retarget(None),
            HostMessage::Jog(jog) => self.jog(jog),
            HostMessage::SelfTest => return self.self_test(),
            HostMessage::Zero { angle_units } => self.set_zero(*angle_units),
            HostMessage::ReportPeriod { ticks } => self.set_report_period(*ticks),
        })
    }

    /// The reason why the loop is not armed.
    fn fault(&self) -> BoardFault {
        match &self.state {
            State::Latched(fault) => fault.clone(),
            State::Jogging(_) => BoardFault::Jogging,
            State::Safe | State::Armed => BoardFault::NotReady,
        }
    }

    fn arm(&mut self) -> BoardMessage {
        let MoveMemory { configured, map, tracker, in_flight, .. } = &mut *self.memory;
        match (&self.state, configured, map.map()) {
            (State::Armed, ..) => BoardMessage::Armed,
            (State::Safe, Some(configured), Ok(map)) => {
                configured.begin(map, self.zero, time(self.elapsed_ticks));
                *tracker = Some(ResonanceTracker::of(map));
                *in_flight = configured.no_decisions();
                in_flight.clear();
                self.reports.begin();
                self.state = State::Armed;
                BoardMessage::Armed
            }
            (State::Safe | State::Jogging(_) | State::Latched(_), ..) => BoardMessage::Fault(self.fault()),
        }
    }
}

fn time(ticks: u64) -> Time {
    Time::from_nanos(ticks * PositionLoop::TICK_NANOS)
}
