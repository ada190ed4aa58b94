//! What the microcontroller does, whatever the board: bytes from the host in, ticks of the loop, frames to the host out.
//!
//! ```text
//!            configure                arm                      host silent, deadlines missed
//!   +------+ --------> +------------+ -----> +---------------+ ----------------------------> +---------+
//!   | safe |           | configured |        | armed: driven |                               | latched |
//!   +------+ <-------- +------------+ <----- +---------------+                               +---------+
//!      ^      hello                     stop                             stop, hello              |
//!      +----------------------------------------------------------------------------------------- +
//! ```
//!
//! The loop may drive while armed, and in no other state. What latches stays until the host says stop or begins a new session: a link that comes
//! back does not set the motor going. The board's count of ticks is the time of both sides, from its start on.

mod inbox;
#[cfg(test)]
mod tests;

use core::mem;

use controller::{Drive, Limits, PositionLoop, PositioningTuning, Sense, Target};
use estimator::{CameraFrame, LdvSample};
use link::{
    Arrival, BoardFault, BoardMessage, Configuration, Counters, Deframer, FRAME_BYTES_MAX, FrameError,
    Header, HostMessage, Sequence, SettingKey, TickRecord, VERSION, decode, encode,
};
use motor_model::{DriveCommand, OutOfBounds, Time};

use crate::filter::Filter;
use crate::telemetry::{Entry, Standing, Telemetry};
use inbox::Inbox;

/// Ticks without a frame after which the host counts as silent: 10 ms, a hundred camera frames.
pub const SILENT_TICKS: u64 = 1000;

/// Deadlines missed in a row after which the drive goes off.
pub const OVERRUNS_MAX: u32 = 10;

/// Longest deadline of a move, in ns, and its key: a day.
const DEADLINE_MAX_S: f64 = 86_400.0;
const DEADLINE_KEY: &str = "position.deadline_s";

/// A configuration that was checked. Its filter is built here, in double precision, which takes longer than a tick: before the loop is armed.
#[derive(Debug)]
struct Move {
    configuration: Configuration,
    target: Target,
    tuning: PositioningTuning,
    /// Begins at arming.
    position_loop: PositionLoop<Filter>,
}

impl Move {
    /// Puts it into `place`, or leaves that as it was.
    fn put(place: &mut Option<Self>, configuration: Configuration) -> Result<(), OutOfBounds> {
        let Configuration { filter, target_deg, tolerance_deg, deadline_nanos } = configuration;
        let target = Target::try_new(target_deg, tolerance_deg)?;
        #[expect(clippy::cast_precision_loss, reason = "bounds are far below 2^53")]
        OutOfBounds::check(DEADLINE_KEY, deadline_nanos as f64 * 1e-9, 0.0, DEADLINE_MAX_S, "s")?;
        let limits = Limits { deadline_nanos, ..Limits::default() };
        let tuning = PositioningTuning { limits, ..PositioningTuning::default() };
        let filter = Filter::of(filter)?;
        let position_loop = PositionLoop::new(filter, target, tuning, Time::ZERO);
        *place = Some(Self { configuration, target, tuning, position_loop });
        Ok(())
    }
}

/// Where the move lies that was configured. Its filter is larger than a stack should carry: on a board this is a static.
#[derive(Debug, Default)]
pub struct MoveMemory(Option<Move>);

impl MoveMemory {
    /// No move.
    pub const fn new() -> Self {
        Self(None)
    }
}

/// What the loop may do.
#[derive(Debug)]
enum State {
    /// Not armed; the filter of a move that is configured has seen nothing.
    Safe,
    /// The move that is configured is under way.
    Armed,
    /// Not to be armed before a stop.
    Latched(BoardFault),
}

/// The host at the other end.
#[derive(Clone, Copy, Debug)]
struct Session {
    number: u32,
    incoming: Sequence,
    outgoing: u32,
}

/// The program, over an amplifier of the board.
#[derive(Debug)]
pub struct Application<'m, D> {
    amplifier: D,
    deframer: Deframer,
    counters: Counters,
    session: Option<Session>,
    configured: &'m mut MoveMemory,
    state: State,
    inbox: Inbox,
    ticks: u64,
    /// When a frame was last taken.
    heard_at: u64,
    overruns_in_a_row: u32,
    /// A fault that latched and was not yet told.
    news: Option<BoardFault>,
    telemetry: Telemetry,
    /// How deep the stack has been.
    stack_bytes_max: fn() -> u32,
}

/// Instruments and amplifier, as the loop sees them.
struct Ports<'a, D> {
    inbox: &'a mut Inbox,
    amplifier: &'a mut D,
}

impl<D> Sense for Ports<'_, D> {
    fn camera_frame(&mut self) -> Option<CameraFrame> {
        self.inbox.camera_frame()
    }

    fn ldv_sample(&mut self) -> Option<LdvSample> {
        self.inbox.ldv_sample()
    }
}

impl<D: Drive> Drive for Ports<'_, D> {
    fn drive(&mut self, command: DriveCommand) -> DriveCommand {
        self.amplifier.drive(command)
    }
}

impl<'m, D: Drive> Application<'m, D> {
    /// The program as it starts: drive off, no host.
    pub fn new(mut amplifier: D, memory: &'m mut MoveMemory) -> Self {
        amplifier.drive(DriveCommand::OFF);
        memory.0 = None;
        Self {
            amplifier,
            deframer: Deframer::default(),
            counters: Counters::default(),
            session: None,
            configured: memory,
            state: State::Safe,
            inbox: Inbox::default(),
            ticks: 0,
            heard_at: 0,
            overruns_in_a_row: 0,
            news: None,
            telemetry: Telemetry::default(),
            stack_bytes_max: || 0,
        }
    }

    /// The same, on a board that knows how many bytes its stack has taken at most.
    #[must_use]
    pub fn with_stack_gauge(self, stack_bytes_max: fn() -> u32) -> Self {
        Self { stack_bytes_max, ..self }
    }

    /// The amplifier.
    pub fn amplifier(&self) -> &D {
        &self.amplifier
    }

    /// The amplifier, to tell it what the board knows of it.
    pub fn amplifier_mut(&mut self) -> &mut D {
        &mut self.amplifier
    }

    /// Whether the loop may drive.
    pub fn is_armed(&self) -> bool {
        matches!(self.state, State::Armed)
    }

    /// What became of the bytes received.
    pub fn counters(&self) -> Counters {
        Counters {
            oversize: self.deframer.oversize,
            dropped: self.inbox.dropped,
            stack_bytes_max: (self.stack_bytes_max)(),
            ..self.counters
        }
    }

    /// Takes bytes from the host; every frame that answers goes to `send`.
    pub fn receive(&mut self, bytes: &[u8], send: &mut impl FnMut(&[u8])) {
        for &byte in bytes {
            let Some(frame) = self.deframer.push(byte) else { continue };
            let answer = match decode(frame) {
                Ok((header, message)) => self.hear(header, &message),
                Err(FrameError::Version { theirs }) => {
                    self.counters.other_version += 1;
                    Some(BoardMessage::Fault(BoardFault::Version { theirs, ours: VERSION }))
                }
                Err(_) => {
                    self.counters.damaged += 1;
                    None
                }
            };
            if let Some(answer) = answer {
                self.say(&answer, send);
            }
        }
    }

    /// Makes a frame of `message`.
    pub fn say(&mut self, message: &BoardMessage, send: &mut impl FnMut(&[u8])) {
        let (session, sequence) = match &mut self.session {
            Some(session) => {
                let sequence = session.outgoing;
                session.outgoing = sequence.wrapping_add(1);
                (session.number, sequence)
            }
            None => (0, 0),
        };
        let mut frame = [0; FRAME_BYTES_MAX];
        let header = Header { session, sequence, ticks: self.ticks };
        if let Some(frame) = encode(header, message, &mut frame).ok().and_then(|length| frame.get(..length)) {
            send(frame);
        }
    }

    /// One tick of the loop, every [`PositionLoop::TICK_NANOS`]; what it did, when armed.
    // Never inlined: `host-sim size` follows every call from here.
    #[inline(never)]
    pub fn tick(&mut self) -> Option<TickRecord> {
        self.ticks += 1;
        if self.is_armed() && self.ticks - self.heard_at > SILENT_TICKS {
            self.latch(BoardFault::HostSilent);
        }
        let report = self.run();
        let counters =
            Counters { oversize: self.deframer.oversize, dropped: self.inbox.dropped, ..self.counters };
        self.telemetry.note(self.ticks, self.standing(), report.as_ref(), &counters);
        report.as_ref().map(TickRecord::from)
    }

    /// What the loop does, if it is armed.
    fn run(&mut self) -> Option<controller::TickReport> {
        let Self { state, configured: MoveMemory(configured), inbox, amplifier, ticks, .. } = self;
        let (State::Armed, Some(Move { position_loop, .. })) = (state, configured) else {
            amplifier.drive(DriveCommand::OFF);
            return None;
        };
        let now = time(*ticks);
        Some(controller::tick(position_loop, now, &mut Ports { inbox, amplifier }))
    }

    fn standing(&self) -> Standing {
        match self.state {
            State::Safe => Standing::Safe,
            State::Armed => Standing::Armed,
            State::Latched(BoardFault::Overrun) => Standing::Overrun,
            State::Latched(_) => Standing::HostSilent,
        }
    }

    /// What the last tick has to tell, once, and the number of that tick.
    pub fn telemetry(&mut self) -> Option<(u64, Entry)> {
        self.telemetry.take().map(|entry| (self.ticks, entry))
    }

    /// The last tick took so many clocks of the timer.
    pub fn worked(&mut self, clocks: u32) {
        self.telemetry.worked(clocks);
    }

    /// Whether the last tick met its deadline. While armed a missed one is counted; [`OVERRUNS_MAX`] in a row switch the drive off for good.
    pub fn ended(&mut self, in_time: bool) {
        if in_time || !self.is_armed() {
            self.overruns_in_a_row = 0;
            return;
        }
        self.counters.overruns = self.counters.overruns.saturating_add(1);
        self.overruns_in_a_row += 1;
        if self.overruns_in_a_row >= OVERRUNS_MAX {
            self.latch(BoardFault::Overrun);
        }
    }

    /// So many ticks passed before the loop was armed, and so before the frame was heard that armed it.
    pub fn idle_ticks(&mut self, ticks: u64) {
        self.ticks += ticks;
        self.heard_at += ticks;
    }

    /// So many ticks never came: time goes on, and while armed each is an overrun.
    pub fn lost_ticks(&mut self, lost: u64) {
        self.ticks += lost;
        (0..lost.min(u64::from(OVERRUNS_MAX))).for_each(|_| self.ended(false));
    }

    /// Takes in a sample of a vibrometer at the board.
    pub fn hear_vibrometer(&mut self, sample: LdvSample) {
        self.inbox.put_ldv_sample(sample);
    }

    /// The fault that has just latched, once.
    pub fn news(&mut self) -> Option<BoardFault> {
        self.news.take()
    }

    fn latch(&mut self, fault: BoardFault) {
        self.amplifier.drive(DriveCommand::OFF);
        self.news = Some(fault.clone());
        self.state = State::Latched(fault);
    }

    /// Back to safe. A move that was under way can begin anew, with a filter that has seen nothing.
    fn stop(&mut self) {
        self.amplifier.drive(DriveCommand::OFF);
        let was_armed = !matches!(mem::replace(&mut self.state, State::Safe), State::Safe);
        self.inbox.clear();
        self.overruns_in_a_row = 0;
        if let Some(Move { configuration, .. }) = self.configured.0.as_ref().filter(|_| was_armed) {
            self.configure(*configuration);
        }
    }

    /// The answer to a frame, if it wants one.
    fn hear(&mut self, header: Header, message: &HostMessage) -> Option<BoardMessage> {
        let Header { session: number, sequence, .. } = header;
        match &mut self.session {
            Some(session) if session.number == number => match session.incoming.judge(sequence) {
                Arrival::New { lost } => self.counters.lost = self.counters.lost.saturating_add(lost),
                Arrival::Duplicate => {
                    self.counters.duplicates += 1;
                    return None;
                }
                Arrival::Late => {
                    self.counters.late += 1;
                    return None;
                }
            },
            _ if *message == HostMessage::Hello => {
                self.session = Some(Session { number, incoming: Sequence::after(sequence), outgoing: 0 });
            }
            _ => {
                self.counters.other_session += 1;
                return Some(BoardMessage::Fault(BoardFault::UnknownSession { session: number }));
            }
        }
        self.counters.taken = self.counters.taken.wrapping_add(1);
        self.heard_at = self.ticks;
        self.obey(message)
    }

    fn obey(&mut self, message: &HostMessage) -> Option<BoardMessage> {
        Some(match message {
            HostMessage::Hello => {
                self.configured.0 = None;
                self.stop();
                BoardMessage::Welcome { tick_nanos: PositionLoop::TICK_NANOS }
            }
            HostMessage::Configure(configuration) => self.configure(*configuration),
            HostMessage::Arm => self.arm(),
            HostMessage::Stop => {
                self.stop();
                BoardMessage::Stopped
            }
            HostMessage::Camera(frame) => {
                self.inbox.put_camera_frame((*frame).into());
                return None;
            }
            HostMessage::Ldv(samples) => {
                samples.iter().for_each(|&sample| self.inbox.put_ldv_sample(sample.into()));
                return None;
            }
            HostMessage::Step => match self.tick() {
                Some(report) => BoardMessage::Report(report),
                None => BoardMessage::Fault(self.fault()),
            },
            HostMessage::Count => BoardMessage::Counters(self.counters()),
        })
    }

    /// Why the loop is not armed.
    fn fault(&self) -> BoardFault {
        match &self.state {
            State::Latched(fault) => fault.clone(),
            State::Safe | State::Armed => BoardFault::NotReady,
        }
    }

    // Never inlined: what building a filter takes need not lie on the stack of every tick.
    #[inline(never)]
    fn configure(&mut self, configuration: Configuration) -> BoardMessage {
        if self.is_armed() {
            return BoardMessage::Fault(BoardFault::Armed);
        }
        match Move::put(&mut self.configured.0, configuration) {
            Ok(()) => BoardMessage::Configured,
            Err(error) => {
                let key = SettingKey::try_from(error.key).unwrap_or_default();
                BoardMessage::Fault(BoardFault::OutOfBounds { key })
            }
        }
    }

    fn arm(&mut self) -> BoardMessage {
        match (&self.state, &mut self.configured.0) {
            (State::Armed, _) => BoardMessage::Armed,
            (State::Safe, Some(Move { target, tuning, position_loop, .. })) => {
                position_loop.begin(*target, *tuning, time(self.ticks));
                self.state = State::Armed;
                BoardMessage::Armed
            }
            (State::Safe | State::Latched(_), _) => BoardMessage::Fault(self.fault()),
        }
    }
}

fn time(ticks: u64) -> Time {
    Time::from_nanos(ticks * PositionLoop::TICK_NANOS)
}
