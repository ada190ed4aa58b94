//! What is known in the middle of a run, and who sees it.

use std::fmt;
use std::ops::ControlFlow;

use link::KeptDescription;

use super::outcome::IdentityFigures;
use super::stamp_watch::ClockDoubt;
use simulation::runs::record::RunRecord;

/// What the board is to reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// An angle.
    Angle {
        /// The target in degrees.
        target_deg: f64,
    },
    /// A rate.
    Rate {
        /// The rate in deg/s.
        rate_deg_s: f64,
    },
    /// The map of the motor.
    Map {
        /// Experiments that were ordered by now.
        experiments: u16,
    },
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Angle { target_deg } => write!(f, "target {target_deg:+.4} deg"),
            Self::Rate { rate_deg_s } => write!(f, "rate {rate_deg_s:+.2} deg/s"),
            Self::Map { experiments } => write!(f, "experiment {experiments}"),
        }
    }
}

/// What is known in the middle of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
    /// Time since arming by the board's clock, in s.
    pub at_s: f64,
    /// Estimated angle and its standard deviation, in degrees; `None` before the first frame.
    pub angle_deg: Option<(f64, f64)>,
    /// What the board is to reach.
    pub goal: Goal,
    /// What the controller does.
    pub phase: String,
    /// Whether the estimate may be used.
    pub health: String,
    /// The drive: off, B or C, and its amplitude from 0 to 1.
    pub drive: (&'static str, f32),
    /// Reports received.
    pub reports: u64,
    /// Share of the line to the board and from it that was in use since the last time.
    pub load: [f64; 2],
    /// Bound of the error of the board's clock, in us of the board.
    pub clock_us: Option<f64>,
    /// Root mean square error of that clock, as the board's filter is told, in us.
    pub clock_told_us: u16,
}

impl Progress {
    /// The same in a few lines, for a terminal.
    pub fn lines(&self) -> String {
        let [to, from] = self.load.map(|load| 100.0 * load);
        let told = match self.clock_told_us {
            0 => String::new(),
            told_us => format!(" (filter: {told_us} us rms)"),
        };
        let clock = self.clock_us.map_or_else(String::new, |us| format!(", clock +- {us:.0} us{told}"));
        let (mode, amplitude) = self.drive;
        format!(
            "time {:9.3} s   {}   {}\nphase {}, health {}, drive {mode} {:.0} %\n\
             line to the board {to:.0} %, from it {from:.0} %, {} reports{clock}",
            self.at_s,
            self.angle(),
            self.goal,
            self.phase,
            self.health,
            100.0 * amplitude,
            self.reports
        )
    }

    fn angle(&self) -> String {
        let angle = |(angle, sd): (f64, f64)| format!("angle {angle:+10.4} deg +- {:.1} mdeg", 1e3 * sd);
        self.angle_deg.map_or_else(|| "angle not known".to_owned(), angle)
    }
}

/// On one line.
impl fmt::Display for Progress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.lines().replace('\n', ", "))
    }
}

/// Sees a run while it goes on.
pub trait Watcher {
    /// Takes what the board is, before it is told anything.
    fn board(&mut self, identity: &IdentityFigures);

    /// Takes what the board kept before it was told anything.
    fn kept(&mut self, kept: KeptDescription);

    /// Takes a record. [`ControlFlow::Break`] ends the run as an interruption does.
    fn record(&mut self, record: &RunRecord) -> ControlFlow<()>;

    /// Takes that the board's clock is known less well than the camera's time stamps, once.
    fn clock(&mut self, doubt: &ClockDoubt);

    /// Takes what is known, ten times a second.
    fn progress(&mut self, progress: &Progress);
}
