//! What the board at a serial port tells of itself, and what is to be thought of it: `host-sim self-test`.

mod findings;

use std::fmt;
use std::sync::atomic::AtomicBool;

use controller::PositionLoop;
use estimator::{CameraFrame, Instruments};
use link::{BoardMessage, HostMessage, SelfTestReport};
use motor_model::DriveCommand;
use serde::Serialize;

use super::SerialError;
use super::attendance::{Attendance, Seen, set_clocks};
use super::error::Stopped;
use super::frame_source::FrameSource;
use super::frames_on_line::{check_frames, latency_nanos};
use super::host_clock::host_nanos;
use super::outcome::IdentityFigures;
use super::plant::PlantInTheLoop;
use super::session::BoardSession;
pub use findings::Finding;
use findings::findings;
use simulation::runs::RunError;
use simulation::scene::Scene;
use simulation::world::instruments::assumed;

/// Ticks by which the answer may be later than the end of the test: 0.1 s.
const LATE_TICKS_MAX: u64 = 10_000;

/// The self-test of the board at a serial port.
#[derive(Clone, Copy, Debug)]
pub struct SerialSelfTest<'a> {
    /// Name of the port.
    pub port: &'a str,
    /// Its rate in baud.
    pub baud: u32,
    /// The instruments.
    pub scene: &'a Scene,
    /// Where camera frames come from.
    pub source: &'a FrameSource,
    /// Set to end it.
    pub interrupted: &'a AtomicBool,
}

impl SerialSelfTest<'_> {
    /// Lets the board look at itself, while it gets the frames of the camera. Nothing is driven.
    ///
    /// # Errors
    /// When the line does not carry the camera's frames, there is no board, or it does not answer. A finding that is
    /// not good is no error here.
    pub fn run(&self, identified: impl FnOnce(&IdentityFigures)) -> Result<SelfTestOutcome, SerialError> {
        let source = self.source.find()?;
        let PreparedSelfTest { mut plant, instruments } =
            PreparedSelfTest::of(self.scene, self.source, self.baud)?;
        let mut session = BoardSession::open(self.port, self.baud)?;
        let board = IdentityFigures::from(session.identity()?);
        identified(&board);
        let begun_ticks = set_clocks(&mut session)?;
        source.forward_to(session.sender(), latency_nanos(self.scene).cast_signed());
        session.send(&HostMessage::SelfTest)?;
        let (what, ticks_max) = ("the self-test", SelfTestReport::TICKS + LATE_TICKS_MAX);
        let attendance = Attendance { what, begun_ticks, ticks_max, interrupted: self.interrupted };
        let (report, stopped) = attendance.until(&mut session, |session, seen| {
            match seen {
                Seen::Message(BoardMessage::SelfTest(report)) => return Ok(Some(report)),
                Seen::Message(_) => {}
                Seen::Ticks(ticks) => send_plant(session, plant.as_mut(), begun_ticks, ticks)?,
                Seen::Frame(frame) => {
                    if let Some(frame) = session.on_board(&frame) {
                        session.send_camera(frame)?;
                    }
                }
            }
            Ok(None)
        })?;
        let clock_nanos = session.clock().map_or(0.0, |clock| clock.uncertainty_nanos(host_nanos()));
        let findings = findings(&report, &instruments, clock_nanos);
        Ok(SelfTestOutcome::new(findings, stopped, board))
    }
}

/// What is made of a scene before the board is asked.
pub(crate) struct PreparedSelfTest {
    plant: Option<PlantInTheLoop>,
    instruments: Instruments,
}

impl PreparedSelfTest {
    /// Of the instruments of `scene`, with camera frames of `source` on a line of this rate.
    ///
    /// # Errors
    /// When the scene is refused, or the line does not carry the frames.
    pub(crate) fn of(scene: &Scene, source: &FrameSource, baud: u32) -> Result<Self, SerialError> {
        check_frames(scene, baud)?;
        let plant = match source {
            FrameSource::Plant => Some(PlantInTheLoop::new(scene).map_err(RunError::from)?),
            _ => None,
        };
        Ok(Self { plant, instruments: assumed(scene) })
    }
}

/// Sends the frames of the simulated camera, before which a rotor rests, until the board's time.
fn send_plant(
    session: &mut BoardSession,
    plant: Option<&mut PlantInTheLoop>,
    begun_ticks: u64,
    ticks: u64,
) -> Result<(), SerialError> {
    let Some(plant) = plant else { return Ok(()) };
    plant.follow(ticks.saturating_sub(begun_ticks), DriveCommand::OFF, None);
    for frame in plant.take_frames() {
        let exposed_at = frame.exposed_at.plus_nanos(begun_ticks * PositionLoop::TICK_NANOS);
        session.send_camera(CameraFrame { exposed_at, ..frame })?;
    }
    Ok(())
}

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SelfTestOutcome {
    /// Whether all of it is good.
    pub ok: bool,
    /// What was found.
    pub findings: Vec<Finding>,
    /// Whether the board has acknowledged the stop at the end.
    pub stop_acknowledged: bool,
    /// The board.
    pub board: IdentityFigures,
}

impl SelfTestOutcome {
    fn new(findings: Vec<Finding>, stopped: Stopped, board: IdentityFigures) -> Self {
        let ok = findings.iter().all(|finding| finding.ok);
        Self { ok, findings, stop_acknowledged: stopped == Stopped::Acknowledged, board }
    }

    /// What was found and is not good.
    pub fn failed(&self) -> Vec<&'static str> {
        self.findings.iter().filter(|finding| !finding.ok).map(|finding| finding.of).collect()
    }
}

impl fmt::Display for SelfTestOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.findings.iter().try_for_each(|finding| writeln!(f, "{finding}"))
    }
}
