//! Why a move or a rate on a real board was not made, or not ended.

use link::{BoardFault, FrameError, LINE_BAUD, VERSION};

use super::frame_text::FrameTextError;
use crate::board::BoardError;
use crate::report::OutputError;
use simulation::runs::RunError;

/// Why a move or a rate on a real board was not made, or not ended.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SerialError {
    /// There is no such port.
    #[error("there is no port {port}")]
    NoPort {
        /// Its name.
        port: String,
    },
    /// Another program has the port.
    #[error("port {port} is busy: another program has it open")]
    Busy {
        /// Its name.
        port: String,
    },
    /// The system refuses the port.
    #[error("port {port} cannot be opened: {reason}")]
    Unopened {
        /// Its name.
        port: String,
        /// The system's reason.
        reason: String,
    },
    /// Nothing answers.
    #[error("no board answers on {port} at {baud} baud within {waited_s} s")]
    NoAnswer {
        /// Name of the port.
        port: String,
        /// Its rate.
        baud: u32,
        /// The time waited.
        waited_s: f64,
    },
    /// The board has another version of the protocol.
    #[error("the board speaks protocol version {theirs}, this program version {VERSION}")]
    OtherVersion {
        /// The board's.
        theirs: u8,
    },
    /// The board's loop has another period.
    #[error("the board has ticks of {found} ns, this program of {expected} ns")]
    OtherTick {
        /// The board's.
        found: u64,
        /// This program's.
        expected: u64,
    },
    /// A message cannot be sent: a slip in the program.
    #[error("a message cannot be sent: {0}")]
    Unsendable(#[from] FrameError),
    /// The board refuses what was asked.
    #[error("the board refuses {what}: {fault}")]
    Refused {
        /// What was asked.
        what: &'static str,
        /// Its reason.
        fault: BoardFault,
    },
    /// The board answers something else, or does not answer.
    #[error("the board does not answer to {what} within {waited_s} s")]
    Unanswered {
        /// What was asked.
        what: &'static str,
        /// The time waited.
        waited_s: f64,
    },
    /// The board's clock is known less well than a filter can be told.
    #[error(
        "the board's clock is known to {bound_us:.0} us on this line: {key} = {:.6} is out of bounds, 0 to 0.01 s",
        1e-6 * error_us
    )]
    ClockUnknown {
        /// The key that would tell it.
        key: &'static str,
        /// Bound of its error in a run, in us of the board.
        bound_us: f64,
        /// Root mean square of that error, in us.
        error_us: f64,
    },
    /// The instruments need more than the line carries.
    #[error(
        "camera.frame_rate_hz = {frame_rate_hz} needs {needed_baud:.0} baud, bounds 0 to {most_hz:.0} Hz at {baud} baud"
    )]
    LineTooSlow {
        /// Frames a second.
        frame_rate_hz: f64,
        /// What they need.
        needed_baud: f64,
        /// What the line carries.
        most_hz: f64,
        /// The line's rate.
        baud: u32,
    },
    /// The simulated plant, which runs as far as the board has reported, would stand still.
    #[error("--report-every = {asked_s}: the simulated motor needs a report every {most_s} s")]
    RareReports {
        /// What was asked for, in s.
        asked_s: f64,
        /// What the plant needs, in s.
        most_s: f64,
    },
    /// The simulated plant has a vibrometer, whose samples the line does not carry.
    #[error(
        "ldv.installed = yes: a line of {baud} baud does not carry the samples of a simulated vibrometer"
    )]
    SimulatedVibrometer {
        /// The line's rate.
        baud: u32,
    },
    /// The line is gone.
    #[error(
        "port {port} was closed after {after_s:.3} s: {reason}; the board switches its drive off by itself"
    )]
    Disconnected {
        /// Name of the port.
        port: String,
        /// Time since arming by the host's clock.
        after_s: f64,
        /// The system's reason.
        reason: String,
    },
    /// The line takes nothing any more.
    #[error("port {port} took no byte for {waited_s} s; the board switches its drive off by itself")]
    Stuck {
        /// Name of the port.
        port: String,
        /// The time waited.
        waited_s: f64,
    },
    /// The board says nothing any more.
    #[error("the board was silent for {silent_s} s after {after_s:.3} s; {stopped}")]
    Silent {
        /// The time without a message.
        silent_s: f64,
        /// Time since arming, or since the jog or the self-test began, by the host's clock.
        after_s: f64,
        /// Whether the stop was acknowledged.
        stopped: Stopped,
    },
    /// The board has switched its drive off.
    #[error("the board stopped after {after_s:.3} s: {fault}; {stopped}")]
    Fault {
        /// Its reason.
        fault: BoardFault,
        /// Time since arming, or since the jog began, by the host's clock.
        after_s: f64,
        /// Whether the stop was acknowledged.
        stopped: Stopped,
    },
    /// A line of the source is refused.
    #[error("{error}; {stopped}")]
    Source {
        /// The line.
        error: FrameTextError,
        /// Whether the stop was acknowledged.
        stopped: Stopped,
    },
    /// The source has no more frames, and the run is not at its end.
    #[error("the source of camera frames ended {after_s:.3} s after arming, before the run did; {stopped}")]
    SourceEnded {
        /// Time since arming by the host's clock.
        after_s: f64,
        /// Whether the stop was acknowledged.
        stopped: Stopped,
    },
    /// Ctrl-C, or the system's request to end.
    #[error("interrupted; {stopped}")]
    Interrupted {
        /// Whether the stop was acknowledged.
        stopped: Stopped,
    },
    /// The scene is refused.
    #[error(transparent)]
    Run(#[from] RunError),
    /// What the board is told cannot be made of the scene.
    #[error(transparent)]
    Board(Box<BoardError>),
    /// The source cannot be read.
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Whether the board has acknowledged a stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stopped {
    /// It has.
    Acknowledged,
    /// It has not: the drive goes off when the board misses the host, after 10 ms of its time.
    Unacknowledged,
}

impl std::fmt::Display for Stopped {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Acknowledged => "the drive is off: the board has acknowledged the stop",
            Self::Unacknowledged => {
                "the board has not acknowledged the stop, and switches its drive off by itself"
            }
        })
    }
}

impl SerialError {
    /// What to try instead, where there is something to try.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::NoPort { .. } => "`ls /dev/ttyACM* /dev/ttyUSB*` lists the ports of Linux".to_owned(),
            Self::Busy { .. } => "end the terminal or the debugger that uses it".to_owned(),
            Self::Unopened { .. } => "on Linux the group dialout may use serial ports".to_owned(),
            Self::NoAnswer { .. } => {
                format!(
                    "see that the firmware is flashed and runs, and that --baud is its rate ({LINE_BAUD})"
                )
            }
            Self::OtherVersion { .. } => {
                "flash the firmware of this checkout: firmware/BRINGUP.md".to_owned()
            }
            Self::ClockUnknown { key, .. } => {
                format!("a line with shorter round trips, or --set {key}=0.01, by which the filter is too sure")
            }
            Self::LineTooSlow { most_hz, .. } => {
                format!(
                    "--set camera.frame_rate_hz={:.0}, or a greater --baud",
                    (most_hz / 100.0).floor() * 100.0
                )
            }
            Self::RareReports { .. } => {
                "leave it out; with frames of a camera (--camera) reports may be rarer".to_owned()
            }
            Self::SimulatedVibrometer { .. } => {
                "--set ldv.installed=no; with frames of a camera the board samples its own vibrometer"
                    .to_owned()
            }
            Self::Disconnected { .. } => "put the cable back and run the command again".to_owned(),
            Self::Stuck { .. } => "see that the board runs: a debugger may have halted it".to_owned(),
            Self::Silent { .. } => "the watchdog may have restarted the board: see its log".to_owned(),
            Self::SourceEnded { .. } => {
                "a recording has to be longer than the run; other sources count from arming on, by times of day"
                    .to_owned()
            }
            Self::Fault { fault: BoardFault::HostSilent, .. } => {
                "the host or the line was too slow: see the load, and --baud".to_owned()
            }
            Self::Fault { fault: BoardFault::Overrun, .. } => "--filter constant_rate takes less".to_owned(),
            Self::Fault { fault: BoardFault::AmplifierFailed, .. } => {
                "see the bridge, its supply and its over-current output; the next run tries again".to_owned()
            }
            Self::Refused { fault: BoardFault::OutOfBounds { key }, .. } => {
                format!("the firmware may be built without it, or {key} is out of its bounds")
            }
            Self::Refused { fault: BoardFault::KeepsNothing, .. } => {
                "this firmware is built without the feature keep: firmware/BRINGUP.md, the kept description"
                    .to_owned()
            }
            Self::Board(error) => return error.hint(),
            Self::Output(error) => return error.hint(),
            _ => return None,
        })
    }

    /// The exit code: 130 for an interruption, as shells have it, 2 otherwise.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Interrupted { .. }) { 130 } else { 2 }
    }
}

impl From<BoardError> for SerialError {
    fn from(error: BoardError) -> Self {
        Self::Board(Box::new(error))
    }
}
