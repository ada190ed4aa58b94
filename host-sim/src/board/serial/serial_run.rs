//! A task on a real board: from the first message to the acknowledged stop.

mod figures;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use controller::PositionLoop;
use estimator::CameraFrame;
use link::camera_frame::SHORT_AGE_NANOS;
use link::{BoardFault, BoardMessage, Header, HostMessage, LdvRecords, TickRecord};
use motor_model::{Angle, Time};

use super::SerialError;
use super::board_pace::BoardPace;
use super::description::{DescriptionFigures, Keeping, Preparation, prepare};
use super::error::Stopped;
use super::frame_source::FrameSource;
use super::frame_text::HostFrame;
use super::frames_on_line::{check_frames, latency_nanos};
use super::fresh_frames::FreshFrames;
use super::host_clock::{host_nanos, nanos, seconds};
use super::line_rate::LineLoad;
use super::next_step::NextStep;
use super::outcome::{IdentityFigures, SerialOutcome};
use super::plant::PlantInTheLoop;
use super::progress::Watcher;
use super::report_period::ReportPeriod;
use super::report_record::{ReportRecords, Reported};
use super::session::{BoardSession, Event};
use super::stamp_watch::StampWatch;
use super::task::{BoardTask, WatchedTask};
use super::time_questions::is_time_answer;
use super::told_clock;
use simulation::scene::Scene;

/// The board's time without a message of a board that has to speak after which the run is ended. Armed it reports every
/// 100 ms at least ([`link::REPORT_TICKS_MAX`]), and else it is asked.
pub const SILENCE_MAX: Duration = Duration::from_secs(1);
/// The board's time after which the host says that it is there, where there is no frame to send. A board that hears
/// nothing for 10 ms switches off.
pub(super) const KEEP_ALIVE: Duration = Duration::from_millis(4);
/// The board's time between two questions that set the clocks: the most.
const CLOCK_EVERY: Duration = Duration::from_millis(100);
/// The time between two questions per the time since the first one. The clock is carried on from one to the next by a
/// drift that is known from no longer a time.
const CLOCK_EVERY_PART: i64 = 4;
/// The board's time after which a question counts as lost.
const CLOCK_LOST: Duration = Duration::from_secs(1);
/// Questions for the time, one after the other, that begin a run: enough for two exchanges to be kept.
pub(super) const FIRST_QUESTIONS: u32 = 16;
/// Longest wait before the host looks at what is due.
pub(super) const LOOK_EVERY: Duration = Duration::from_millis(4);
/// Time between two pictures of the live view.
const PROGRESS_EVERY: Duration = Duration::from_millis(100);

/// A task on the board at a serial port.
#[derive(Clone, Copy, Debug)]
pub struct SerialRun<'a> {
    /// Name of the port.
    pub port: &'a str,
    /// Its rate in baud.
    pub baud: u32,
    /// Motor, instruments, filter, and target or rate.
    pub scene: &'a Scene,
    /// What of the scene is asked of the board.
    pub task: BoardTask,
    /// What the board does after a move, step by step.
    pub then: &'a [NextStep],
    /// What becomes of the description that the board keeps.
    pub keeping: Keeping,
    /// Where camera frames come from.
    pub source: &'a FrameSource,
    /// How often the board reports.
    pub reports: ReportPeriod,
    /// Set to end the run.
    pub interrupted: &'a AtomicBool,
}

impl SerialRun<'_> {
    /// Makes the move, holds the rate, or commissions the motor. The drive is off at the end, whatever the end is.
    ///
    /// # Errors
    /// When the line does not carry the scene's instruments, there is no board, it refuses the scene, or the run ends
    /// before its end.
    pub fn run(&self, watcher: &mut impl Watcher) -> Result<SerialOutcome, SerialError> {
        self.check_line()?;
        let source = self.source.find()?;
        let plant = match self.source {
            FrameSource::Plant => {
                Some(PlantInTheLoop::new(self.scene).map_err(simulation::runs::RunError::from)?)
            }
            _ => None,
        };
        let mut preparation =
            Preparation { reports: Some(self.reports), ..Preparation::of(self.task, self.scene)? };
        let zero = preparation.zero.unwrap_or_default();
        let task = self.task.watched(self.scene)?.followed_by(self.then);
        let mut session = BoardSession::open(self.port, self.baud)?;
        let identity = IdentityFigures::from(session.identity()?);
        watcher.board(&identity);
        if told_clock::is_asked(self.source, self.scene) {
            preparation = preparation.with_clock_error(told_clock::ask(&mut session)?);
        }
        // The plant's instants are by the board's clock.
        let camera = preparation.camera();
        let stamps = plant.as_ref().map_or_else(|| StampWatch::new(&camera), |_| StampWatch::none());
        let description = prepare(&mut session, preparation, self.keeping, |kept| watcher.kept(kept))?;
        session.check(self.interrupted)?;
        let ticks = session.arm().inspect_err(|_| {
            // It may be armed all the same, where the line has lost its answer.
            session.stop();
        })?;
        // Not before: what waits for an answer passes over the end of a source.
        let latency_nanos = latency_nanos(self.scene);
        source.forward_to(session.sender(), latency_nanos.cast_signed());
        let frames = FreshFrames::new(latency_nanos.saturating_add(SHORT_AGE_NANOS));
        let source = (plant, frames, stamps);
        let mut armed = ArmedRun::new(session, task, (identity, description), source, (ticks, zero));
        let ending = armed.watch(self.interrupted, watcher);
        armed.end(ending)
    }

    /// Refuses what the line cannot carry.
    fn check_line(&self) -> Result<(), SerialError> {
        let Self { baud, scene, .. } = *self;
        if *self.source == FrameSource::Plant && scene.choice("ldv.installed") == "yes" {
            return Err(SerialError::SimulatedVibrometer { baud });
        }
        check_frames(scene, baud)
    }
}

/// Why the watch has ended.
enum Ending {
    /// The board holds the target, has held the rate, its motor is commissioned, or it has given up.
    Over,
    /// Before that.
    Early(Early),
}

/// Why the watch has ended early.
enum Early {
    Interrupted,
    Silent,
    Fault(BoardFault),
    SourceFailed(super::frame_text::FrameTextError),
    SourceEnded,
    /// No stop can be sent.
    Lost(SerialError),
}

impl From<SerialError> for Early {
    fn from(error: SerialError) -> Self {
        Self::Lost(error)
    }
}

/// An armed board, and what is known of its run.
struct ArmedRun {
    session: BoardSession,
    identity: IdentityFigures,
    description: DescriptionFigures,
    plant: Option<PlantInTheLoop>,
    frames: FreshFrames,
    records: ReportRecords,
    armed_at: i64,
    begun_ticks: u64,
    /// The camera's angle from which the board counts.
    zero: Angle,
    task: WatchedTask,
    last: Option<(Time, Reported)>,
    pace: BoardPace,
    time_asked: i64,
    time_answers: u32,
    time_answered: bool,
    progress_at: i64,
    stamps: StampWatch,
    frames_sent: u64,
    frame_bytes: u64,
    frames_early: u64,
    reports: u64,
}

impl ArmedRun {
    fn new(
        mut session: BoardSession,
        task: WatchedTask,
        (identity, description): (IdentityFigures, DescriptionFigures),
        (plant, frames, stamps): (Option<PlantInTheLoop>, FreshFrames, StampWatch),
        (begun_ticks, zero): (u64, Angle),
    ) -> Self {
        let now = host_nanos();
        // Those of the run alone, without its preparation.
        session.load = [LineLoad::default(); 2];
        session.lost = 0;
        Self {
            session,
            identity,
            description,
            plant,
            frames,
            records: ReportRecords::new(Time::from_nanos(begun_ticks * PositionLoop::TICK_NANOS)),
            armed_at: now,
            begun_ticks,
            zero,
            task,
            last: None,
            pace: BoardPace::new(now, begun_ticks),
            time_asked: now,
            time_answers: 1,
            time_answered: true,
            progress_at: now,
            stamps,
            frames_sent: 0,
            frame_bytes: 0,
            frames_early: 0,
            reports: 0,
        }
    }

    fn watch(&mut self, interrupted: &AtomicBool, watcher: &mut impl Watcher) -> Ending {
        loop {
            match self.next(interrupted, watcher) {
                Ok(false) => {}
                Ok(true) => return Ending::Over,
                Err(early) => return Ending::Early(early),
            }
        }
    }

    /// Does what is due, and takes the next event; whether the run is over.
    fn next(&mut self, interrupted: &AtomicBool, watcher: &mut impl Watcher) -> Result<bool, Early> {
        if interrupted.load(Ordering::Relaxed) {
            return Err(Early::Interrupted);
        }
        let now = host_nanos();
        if now - self.session.last_heard > self.pace.host_nanos(SILENCE_MAX) {
            return Err(Early::Silent);
        }
        if now - self.session.last_sent >= self.pace.host_nanos(KEEP_ALIVE) {
            self.session.send(&HostMessage::Ldv(LdvRecords::new()))?;
        }
        if now - self.time_asked >= self.time_pause() {
            self.session.ask_time()?;
            (self.time_asked, self.time_answered) = (now, false);
        }
        if now - self.progress_at >= nanos(PROGRESS_EVERY) {
            let progress = self.progress(seconds(now - self.progress_at));
            self.progress_at = now;
            watcher.progress(&progress);
        }
        if let Some(message) = self.task.due(now) {
            self.session.send(&message)?;
        }
        let wait = if self.frames.is_waiting() { 0 } else { nanos(LOOK_EVERY) };
        let Some(event) = self.session.next_event_until(now + wait) else {
            if let Some(frame) = self.frames.take_waiting() {
                self.send_frame(frame)?;
            }
            return Ok(false);
        };
        match event {
            Event::Board { header, message: BoardMessage::Report(report), at_nanos, .. } => {
                self.pace.take(header.ticks, at_nanos);
                return self.report(header, &report, watcher);
            }
            Event::Board { header, message, at_nanos, .. } if is_time_answer(&message) => {
                self.pace.take(header.ticks, at_nanos);
                self.time_answers = self.time_answers.saturating_add(1);
                self.time_answered = true;
                if self.time_answers > FIRST_QUESTIONS {
                    self.stamps
                        .look(self.session.clock(), at_nanos)
                        .iter()
                        .for_each(|doubt| watcher.clock(doubt));
                }
            }
            // An order or a question that came twice, or too early: it is asked again.
            Event::Board { message: BoardMessage::Fault(BoardFault::NotInOrder), .. } => {}
            Event::Board { message: BoardMessage::Fault(fault), .. } => return Err(Early::Fault(fault)),
            Event::Board { message, .. } => self.answer(&message),
            Event::OtherVersion { theirs } => return Err(SerialError::OtherVersion { theirs }.into()),
            Event::Closed(reason) => return Err(self.session.closed(reason, Some(self.armed_at)).into()),
            Event::Frame(frame) => self.host_frame(&frame)?,
            Event::SourceEnded => return Err(Early::SourceEnded),
            Event::SourceFailed(error) => return Err(Early::SourceFailed(error)),
        }
        Ok(false)
    }

    /// Time by the host's clock, in ns, from a question that sets the clocks to the next one.
    fn time_pause(&self) -> i64 {
        if !self.time_answered {
            return self.pace.host_nanos(CLOCK_LOST);
        }
        if self.time_answers < FIRST_QUESTIONS {
            return 0;
        }
        let part = (self.time_asked - self.armed_at) / CLOCK_EVERY_PART;
        part.min(self.pace.host_nanos(CLOCK_EVERY))
    }

    /// Takes an answer that is none to what the run itself asks. Reports after a zero count from it.
    fn answer(&mut self, answer: &BoardMessage) {
        if let BoardMessage::Zeroed { angle_units } = answer {
            let before = std::mem::replace(&mut self.zero, Angle::from_units(*angle_units));
            self.task.zeroed(self.zero.minus(before));
        }
        self.task.take_answer(answer);
    }

    /// Takes a report; whether the run is over with it.
    fn report(
        &mut self,
        header: Header,
        record: &TickRecord,
        watcher: &mut impl Watcher,
    ) -> Result<bool, Early> {
        // One that was under way when the board was armed anew, or that has a number of another version.
        let Some(reported) = Reported::of(record).filter(|_| header.ticks >= self.begun_ticks) else {
            return Ok(false);
        };
        self.reports += 1;
        let at = Time::from_nanos(header.ticks * PositionLoop::TICK_NANOS);
        let (mut truth, mut impacts) = (None, Vec::new());
        if let Some(plant) = &mut self.plant {
            let since = reported.since.map(|since| self.records.since_begin(since));
            plant.follow(header.ticks - self.begun_ticks, reported.applied, since);
            (truth, impacts) = (plant.truth().map(|truth| truth.since(self.zero)), plant.take_impacts());
            let begun_nanos = self.begun_ticks * PositionLoop::TICK_NANOS;
            for frame in plant.take_frames() {
                let exposed_at = frame.exposed_at.plus_nanos(begun_nanos);
                self.take_frame(CameraFrame { exposed_at, ..frame })?;
            }
        }
        let mut flow = ControlFlow::Continue(());
        self.records.report(at, &reported, truth, &impacts, |record| {
            if flow.is_continue() {
                flow = watcher.record(record);
            }
        });
        let is_over = self.task.take(self.records.since_begin(at), &reported, truth);
        self.last = Some((at, reported));
        if flow.is_break() { Err(Early::Interrupted) } else { Ok(is_over) }
    }

    /// Takes a frame of the source. Frames from before the run are left out.
    fn host_frame(&mut self, frame: &HostFrame) -> Result<(), Early> {
        let Some(frame) = self.session.on_board(frame) else { return Ok(()) };
        if frame.exposed_at.nanos() < self.begun_ticks * PositionLoop::TICK_NANOS {
            self.frames_early += 1;
            return Ok(());
        }
        self.take_frame(frame)
    }

    /// Sends a frame. An old one waits until it is known whether there is a newer one.
    fn take_frame(&mut self, frame: CameraFrame) -> Result<(), Early> {
        let now_nanos = self.session.clock().map_or(0, |clock| clock.board_nanos(host_nanos()));
        self.frames.take(frame, now_nanos).map_or(Ok(()), |frame| self.send_frame(frame))
    }

    fn send_frame(&mut self, frame: CameraFrame) -> Result<(), Early> {
        let (frame, bytes) = self.session.send_camera(frame)?;
        self.frame_bytes += bytes as u64;
        self.records.sent(CameraFrame { angle: frame.angle.minus(self.zero).wrapped(), ..frame });
        self.frames_sent += 1;
        Ok(())
    }

    /// Stops the drive, and says what became of the run.
    fn end(mut self, ending: Ending) -> Result<SerialOutcome, SerialError> {
        let host_s = seconds(host_nanos() - self.armed_at);
        let early = match ending {
            Ending::Over => None,
            Ending::Early(Early::Lost(SerialError::Disconnected { port, reason, .. })) => {
                return Err(SerialError::Disconnected { port, reason, after_s: host_s });
            }
            Ending::Early(early) => Some(early),
        };
        // Before the stop, which configures the move anew.
        let alive_nanos = self.pace.host_nanos(KEEP_ALIVE);
        let learns = early.is_none() && self.task.learns();
        let learnt = if learns { self.session.learnt(alive_nanos) } else { None };
        let acknowledged = self.session.stop();
        let stopped = if acknowledged { Stopped::Acknowledged } else { Stopped::Unacknowledged };
        let after_s = host_s;
        match early {
            None => Ok(self.outcome(host_s, acknowledged, learnt)),
            Some(Early::Interrupted) => Err(SerialError::Interrupted { stopped }),
            Some(Early::Silent) => {
                let silent_s = (1e3 * seconds(self.pace.host_nanos(SILENCE_MAX))).round() / 1e3;
                Err(SerialError::Silent { silent_s, after_s, stopped })
            }
            Some(Early::Fault(fault)) => Err(SerialError::Fault { fault, after_s, stopped }),
            Some(Early::SourceFailed(error)) => Err(SerialError::Source { error, stopped }),
            Some(Early::SourceEnded) => Err(SerialError::SourceEnded { after_s, stopped }),
            Some(Early::Lost(error)) => Err(error),
        }
    }
}

#[cfg(all(test, unix))]
mod with_fake_board;
