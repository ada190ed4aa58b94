//! The drive by hand on the board at a serial port: `host-sim jog`.

mod forecast;

use std::fmt;
use std::sync::atomic::AtomicBool;

use controller::{LoopTiming, PositionLoop, ResponseMap, TICK_NANOS};
use estimator::Instruments;
use link::{BoardMessage, HostMessage, Jog, JogReport, description_messages};
use motor_model::{Angle, DriveCommand, DriveMode, Time};
use serde::Serialize;

use super::SerialError;
use super::attendance::{Attendance, Seen, set_clocks};
use super::description::upload;
use super::error::Stopped;
use super::outcome::IdentityFigures;
use super::plant::PlantInTheLoop;
use super::session::BoardSession;
pub use forecast::JogForecast;
use simulation::math::count::real;
use simulation::runs::RunError;
use simulation::runs::record::mode_word;
use simulation::scene::Scene;

/// Ticks from the end of the drive in which the simulated rotor comes to rest: 0.3 s. From its highest rate it slides
/// for 25 ms, and the stator rings for less than a tenth of a second.
const REST_TICKS: u64 = 30_000;

/// Ticks by which the board may tell of the end later than it is: 0.1 s.
const LATE_TICKS_MAX: u64 = 10_000;

/// A drive by hand on the board at a serial port.
#[derive(Clone, Copy, Debug)]
pub struct SerialJog<'a> {
    /// Name of the port.
    pub port: &'a str,
    /// Its rate in baud.
    pub baud: u32,
    /// Motor and jog.
    pub scene: &'a Scene,
    /// Set to end it.
    pub interrupted: &'a AtomicBool,
}

impl SerialJog<'_> {
    /// Drives, and simulates the same. The drive is off at the end, whatever the end is.
    ///
    /// # Errors
    /// When the scene is refused, there is no board, it refuses the jog, or the jog ends before its end.
    pub fn run(&self, identified: impl FnOnce(&IdentityFigures)) -> Result<JogOutcome, SerialError> {
        let prepared = PreparedJog::of(self.scene)?;
        let mut session = BoardSession::open(self.port, self.baud)?;
        let board = IdentityFigures::from(session.identity()?);
        identified(&board);
        upload(&mut session, &prepared.description)?;
        let begun_ticks = set_clocks(&mut session)?;
        session.check(self.interrupted)?;
        // It is attended from the first moment on: an answer may take longer than the board goes on without its host.
        session.send(&HostMessage::Jog(prepared.jog))?;
        let (what, ticks_max) = ("the jog", prepared.ticks + LATE_TICKS_MAX);
        let attendance = Attendance { what, begun_ticks, ticks_max, interrupted: self.interrupted };
        let (report, stopped) = attendance.until(&mut session, |_, seen| {
            Ok(match seen {
                Seen::Message(BoardMessage::Jogged(report)) => Some(report),
                _ => None,
            })
        })?;
        Ok(prepared.outcome(&report, stopped, board))
    }
}

/// What is made of a scene before the board is asked.
pub(crate) struct PreparedJog {
    plant: PlantInTheLoop,
    jog: Jog,
    ticks: u64,
    /// What the board is told: the motor.
    description: Vec<HostMessage>,
    map: Option<ResponseMap>,
}

impl PreparedJog {
    /// Of the jog of `scene`.
    ///
    /// # Errors
    /// When the scene is refused.
    pub(crate) fn of(scene: &Scene) -> Result<Self, SerialError> {
        let jog = jog_of(scene);
        let (_, ticks) = jog.checked().map_err(RunError::from)?;
        let plant = PlantInTheLoop::new(scene).map_err(RunError::from)?;
        let map = scene.response_map().ok().map(|map| *map);
        // A jog needs neither instruments nor map.
        let description =
            description_messages(&scene.motor_params(), Instruments::default(), LoopTiming::default(), None)
                .collect();
        Ok(Self { plant, jog, ticks, description, map })
    }

    /// What became of it.
    fn outcome(mut self, report: &JogReport, stopped: Stopped, board: IdentityFigures) -> JogOutcome {
        // What was applied: a board whose amplifier limits says so.
        let command = report.applied.command().unwrap_or(DriveCommand::OFF);
        let ticks = u64::from(report.ticks);
        JogOutcome {
            mode: mode_word(command),
            level: command.amplitude(),
            offset_hz: command.frequency_offset_hz(),
            duration_s: 1e-9 * real(ticks * TICK_NANOS),
            velocity: report.velocity.rms_m_s().map(|rms_m_s| VelocityFigures {
                samples: report.velocity.samples,
                largest_m_s: report.velocity.largest_m_s.into(),
                rms_m_s,
            }),
            simulated_deg: turned(&mut self.plant, command, ticks).degrees(),
            forecast: self.map.and_then(|map| JogForecast::of(&map, command, report.ticks)),
            stop_acknowledged: stopped == Stopped::Acknowledged,
            board,
        }
    }
}

/// The jog of a scene.
fn jog_of(scene: &Scene) -> Jog {
    let mode = if scene.choice("jog.mode") == "c" { DriveMode::C } else { DriveMode::B };
    #[expect(clippy::cast_possible_truncation, reason = "a command is f32: it goes to a microcontroller")]
    let [level, offset_hz] = ["jog.level", "jog.offset_hz"].map(|key| scene.number(key) as f32);
    let command = DriveCommand::saturating(mode, level).with_frequency_offset(offset_hz);
    // The bounds of the keys are those of a command.
    let command = command.unwrap_or(DriveCommand::OFF).into();
    Jog { command, duration_nanos: scene.nanos("jog.duration_s") }
}

/// A velocity as a board has added it up.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct VelocityFigures {
    /// Samples of the vibrometer.
    pub samples: u32,
    /// The largest magnitude in m/s.
    pub largest_m_s: f64,
    /// Root mean square in m/s.
    pub rms_m_s: f64,
}

/// A jog that was made, and what a simulated motor does under the same.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JogOutcome {
    /// The mode that the amplifier applied: B turns clockwise, C counter-clockwise.
    pub mode: &'static str,
    /// Amplitude of the drive.
    pub level: f32,
    /// Offset of its frequency in Hz.
    pub offset_hz: f32,
    /// Time for which it was on by the board's clock, in s.
    pub duration_s: f64,
    /// The vibrometer meanwhile; `null` of a board without.
    pub velocity: Option<VelocityFigures>,
    /// By how much the simulated motor turns under it, in degrees, clockwise positive.
    pub simulated_deg: f64,
    /// By how much the response map says that a motor of this design turns; `null` where it has no such drive.
    pub forecast: Option<JogForecast>,
    /// Whether the board has acknowledged the stop at the end.
    pub stop_acknowledged: bool,
    /// The board.
    pub board: IdentityFigures,
}

/// By how much the rotor of `plant`, which rests, turns under `command` for so many ticks.
fn turned(plant: &mut PlantInTheLoop, command: DriveCommand, ticks: u64) -> Angle {
    const BEGIN: u64 = 100;
    plant.follow(BEGIN, DriveCommand::OFF, None);
    let before = plant.truth();
    plant.follow(BEGIN + ticks, command, Some(Time::from_nanos(BEGIN * PositionLoop::TICK_NANOS)));
    // A change of which it is not told when it was is now.
    plant.follow(BEGIN + ticks, DriveCommand::OFF, None);
    plant.follow(BEGIN + ticks + REST_TICKS, DriveCommand::OFF, None);
    let angle =
        |truth: Option<simulation::runs::record::Truth>| truth.map_or(Angle::ZERO, |truth| truth.angle);
    angle(plant.truth()).minus(angle(before))
}

impl fmt::Display for JogOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { mode, level, offset_hz, duration_s, .. } = self;
        writeln!(f, "drive              mode {mode}, level {level}, {offset_hz:+} Hz, for {duration_s} s")?;
        match &self.velocity {
            Some(VelocityFigures { samples, largest_m_s, rms_m_s }) => writeln!(
                f,
                "vibrometer         {samples} samples, largest {:.3} mm/s, root mean square {:.3} mm/s",
                1e3 * largest_m_s,
                1e3 * rms_m_s
            )?,
            None => writeln!(f, "vibrometer         no sample")?,
        }
        writeln!(f, "simulated rotor    turned by {:+.4} deg", self.simulated_deg)?;
        match &self.forecast {
            Some(JogForecast { turn_deg, sd_deg }) => {
                writeln!(f, "response map       {turn_deg:+.4} deg, +- {sd_deg:.4} from motor to motor")?;
            }
            None => writeln!(f, "response map       has no such drive")?,
        }
        let acknowledged = if self.stop_acknowledged { "acknowledged" } else { "not acknowledged" };
        writeln!(f, "stop               {acknowledged}")
    }
}

#[cfg(test)]
mod tests {
    #[cfg(unix)]
    use link::LINE_BAUD;

    use super::*;
    #[cfg(unix)]
    use crate::board::serial::fake_board::FakeBoard;

    /// The keys of a scene are what the board is asked.
    #[test]
    fn exact_the_jog_of_a_scene() {
        let sets = ["jog.mode=c", "jog.level=0.25", "jog.duration_s=0.5", "jog.offset_hz=-30"];
        let scene = Scene::of_sets(&sets.map(str::to_owned)).unwrap();
        let (command, ticks) = jog_of(&scene).checked().unwrap();
        assert_eq!((command.mode(), command.amplitude(), ticks), (Some(DriveMode::C), 0.25, 50_000));
        assert!((command.frequency_offset_hz() + 30.0).abs() < 1e-6);
    }

    /// Ctrl-C before the drive has begun: the board is described the motor, and is not told to drive.
    #[cfg(unix)]
    #[test]
    fn law_a_jog_that_is_interrupted_before_it_begins_does_not_begin() {
        let (port, board) = FakeBoard::obedient();
        let (scene, interrupted) = (Scene::of_sets(&[]).unwrap(), AtomicBool::new(true));
        let jog = SerialJog { port: &port, baud: LINE_BAUD, scene: &scene, interrupted: &interrupted };
        let ended = jog.run(|_| ()).unwrap_err();
        assert!(matches!(ended, SerialError::Interrupted { stopped: Stopped::Acknowledged }), "{ended}");
        let (_board, heard) = board.join().unwrap();
        assert!(heard.len() > 2 && !heard.iter().any(|message| matches!(message, HostMessage::Jog(_))));
    }

    /// Within four standard deviations of the map of its design, and the other way in the other mode; nothing turns
    /// without a drive.
    #[test]
    fn law_the_simulated_rotor_turns_as_the_map_says() {
        let scene = Scene::of_sets(&["plant.step_s=2e-6".to_owned()]).unwrap();
        let map = scene.response_map().unwrap();
        for (mode, level, ticks) in [(DriveMode::B, 1.0, 20_000), (DriveMode::C, 1.0, 20_000)] {
            let command = DriveCommand::try_new(mode, level).unwrap();
            let mut plant = PlantInTheLoop::new(&scene).unwrap();
            let turned_deg = turned(&mut plant, command, ticks).degrees();
            let forecast = JogForecast::of(&map, command, 20_000).unwrap();
            assert!(
                (turned_deg - forecast.turn_deg).abs() <= 4.0 * forecast.sd_deg,
                "{turned_deg} {forecast:?}"
            );
            assert!(turned_deg * f64::from(controller::response_map::direction(mode)) > 0.0);
        }
        let mut plant = PlantInTheLoop::new(&scene).unwrap();
        assert!(turned(&mut plant, DriveCommand::OFF, 1000).degrees().abs() < 1e-6);
    }
}
