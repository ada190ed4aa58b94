//! What became of a move or a rate on a real board.

use std::fmt;

use controller::map_correction::LearntFactors;
use link::{BoardIdentity, Counters, LOOP_DIGEST, ResetCause};
use serde::Serialize;

use super::description::DescriptionFigures;
use simulation::runs::commission::CommissionedMotor;
use simulation::runs::rate::{PromisedRange, cannot_keep_up};

/// The board's clock beside the host's.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ClockFigures {
    /// Bound of the error of a time of the host as a time of the board, in us of the board.
    pub uncertainty_us: f64,
    /// By how much the board's clock runs faster than the host's, in ppm; `null` of a single exchange.
    pub drift_ppm: Option<f64>,
    /// Bound of the error of that, in ppm.
    pub drift_uncertainty_ppm: Option<f64>,
    /// The shortest time from a question to its answer, in us.
    pub round_trip_us: f64,
}

/// What the board is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IdentityFigures {
    /// Digest of its sources ([`link::LOOP_DIGEST`]) in sixteen digits: not every reader of JSON keeps 64
    /// bits of a number.
    pub loop_digest: String,
    /// Whether this program was built of the same.
    pub is_this_loop: bool,
    /// Why the board started.
    pub reset_cause: &'static str,
}

impl From<BoardIdentity> for IdentityFigures {
    fn from(BoardIdentity { loop_digest, reset_cause }: BoardIdentity) -> Self {
        let reset_cause = match reset_cause.value() {
            None | Some(ResetCause::Unknown) => "unknown",
            Some(ResetCause::Power) => "power",
            Some(ResetCause::Pin) => "pin",
            Some(ResetCause::Watchdog) => "watchdog",
            Some(ResetCause::Software) => "software",
            Some(ResetCause::Other) => "other",
            Some(ResetCause::Panic) => "panic",
            Some(ResetCause::Fault) => "fault",
        };
        let is_this_loop = loop_digest == LOOP_DIGEST;
        Self { loop_digest: format!("{loop_digest:016x}"), is_this_loop, reset_cause }
    }
}

impl IdentityFigures {
    /// What is to be known before the run: a loop that is not this program's, and a board whose program had stopped.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let other = (!self.is_this_loop).then(|| {
            format!(
                "the board's loop ({}) was built of other sources than this program's ({LOOP_DIGEST:016x}): it may not \
                 do what was simulated; flash the firmware of this checkout: firmware/BRINGUP.md",
                self.loop_digest
            )
        });
        let stopped = match self.reset_cause {
            "watchdog" => Some("the watchdog has restarted the board: its main loop had stopped".to_owned()),
            cause @ ("panic" | "fault") => Some(format!(
                "the board has started anew after a {cause} of its program: its log says where (firmware/BRINGUP.md)"
            )),
            _ => None,
        };
        other.into_iter().chain(stopped)
    }
}

/// The serial line over the run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LineFigures {
    /// Its rate.
    pub baud: u32,
    /// Mean share of the line to the board that was in use, 0 to 1.
    pub load_to_board: f64,
    /// The same from the board.
    pub load_from_board: f64,
    /// Camera frames sent.
    pub frames_sent: u64,
    /// Their bytes on the line.
    pub frame_bytes: u64,
    /// Camera frames that were exposed before the board was armed, and not sent.
    pub frames_early: u64,
    /// Camera frames that were older than the camera's latency and 10.3 ms while a newer one waited, and not sent.
    pub frames_old: u64,
    /// Reports received.
    pub reports: u64,
    /// Messages of the board that the line has lost or damaged, by the gaps in their sequence.
    pub lost_from_board: u64,
}

/// A target that was held, before the board moved on.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldFigures {
    /// Target in degrees, from the zero of then.
    pub target_deg: f64,
    /// When it had been held for as long as was asked, in s since arming by the board's clock.
    pub held_s: f64,
    /// The estimate of the angle then, in degrees.
    pub angle_deg: Option<f64>,
    /// True angle less target then, in milli-degrees; `null` with a real camera.
    pub error_true_mdeg: Option<f64>,
    /// Whether that was within the tolerance, by the truth where it is known, else by the estimate.
    pub ok: bool,
}

/// What became of a move.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MoveFigures {
    /// The targets before the last one.
    pub held_before: Vec<HeldFigures>,
    /// The last target in degrees, from the last zero.
    pub target_deg: f64,
    /// Tolerance in degrees.
    pub tolerance_deg: f64,
    /// The last estimate of the angle in degrees; `null` if there was none.
    pub final_angle_deg: Option<f64>,
    /// Standard deviation of that in milli-degrees.
    pub final_sd_mdeg: Option<f64>,
    /// True angle less target in milli-degrees, which only a simulated plant tells; `null` with a real camera.
    pub final_error_true_mdeg: Option<f64>,
    /// Why the move was given up; `null` if it was not.
    pub stopped: Option<String>,
    /// Whether every target was held, within the tolerance by the truth where that is known, else by the estimate.
    pub ok: bool,
}

/// What became of a rate. A mean is over the time in which the rotor followed, without the start.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RateFigures {
    /// Rate asked for in deg/s, clockwise positive.
    pub rate_deg_s: f64,
    /// Time for which it was asked for, in s.
    pub asked_s: f64,
    /// Time of the means in s; `null` if it was too short for any.
    pub measured_s: Option<f64>,
    /// Mean rate by the board's estimates, in deg/s.
    pub mean_deg_s: Option<f64>,
    /// True mean rate in deg/s, which only a simulated plant tells; `null` with a real camera.
    pub true_mean_deg_s: Option<f64>,
    /// True mean rate per the one asked for, less 1, in percent; `null` of a rate of 0 as well.
    pub mean_error_percent: Option<f64>,
    /// How often the estimate was seen to be lost; each time the reference begins anew where the rotor then is.
    pub reference_losses: u32,
    /// Why the rate was held no more; `null` if it was held to its end.
    pub stopped: Option<String>,
    /// The same in words.
    pub reason: Option<&'static str>,
    /// When that was, in s since arming.
    pub stopped_s: Option<f64>,
    /// Mean rate in deg/s, clockwise positive, in all the time behind, of a motor that did not keep up in the end;
    /// `null` of one that did.
    pub reached_deg_s: Option<f64>,
    /// The range that the map promised before the run.
    pub promised_reach: PromisedRange,
    /// Whether the rate was held to its end.
    pub ok: bool,
}

/// What became of what was asked of the board.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum TaskFigures {
    /// A move.
    Move(MoveFigures),
    /// A rate.
    Rate(RateFigures),
    /// A motor that was commissioned.
    Commission(Box<CommissionFigures>),
}

/// What became of the experiments on a motor.
#[derive(Clone, Debug, Serialize)]
pub struct CommissionFigures {
    /// How many experiments were made.
    pub experiments: u16,
    /// What has come of them.
    #[serde(skip)]
    pub motor: CommissionedMotor,
}

/// By what is told: of a motor that is its map.
impl PartialEq for CommissionFigures {
    fn eq(&self, other: &Self) -> bool {
        self.experiments == other.experiments && self.motor.commissioned.map == other.motor.commissioned.map
    }
}

/// Times, clocks and line of a run, whatever its task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SessionFigures {
    /// Time from arming to the last report, by the board's clock, in s.
    pub duration_s: f64,
    /// The same by the host's clock.
    pub host_s: f64,
    /// Whether the board has acknowledged the stop at the end.
    pub stop_acknowledged: bool,
    /// The board.
    pub board: IdentityFigures,
    /// What it was told of the bench, and keeps.
    pub description: DescriptionFigures,
    /// The clocks.
    pub clock: Option<ClockFigures>,
    /// The line.
    pub line: LineFigures,
    /// The board's counters at the end, since its start; `null` if it did not tell them. An armed board is not asked.
    pub counters: Option<CounterFigures>,
}

/// A run that has ended, with the drive off.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SerialOutcome {
    /// What became of what was asked.
    #[serde(flatten)]
    pub task: TaskFigures,
    /// Times, clocks and line.
    #[serde(flatten)]
    pub session: SessionFigures,
    /// What a move has learnt of the motor; `None` of another task, or if the board did not tell it.
    #[serde(skip)]
    pub learnt: Option<LearntFactors>,
}

/// [`Counters`] as a result.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CounterFigures {
    /// Frames of the host that were damaged, too long, or never received.
    pub lost_or_damaged: u32,
    /// Measurements dropped because more arrived than a tick takes.
    pub dropped: u32,
    /// Ticks that ended after their deadline.
    pub overruns: u32,
    /// The most bytes of stack.
    pub stack_bytes_max: u32,
}

impl From<Counters> for CounterFigures {
    fn from(counters: Counters) -> Self {
        let Counters { damaged, oversize, lost, dropped, overruns, stack_bytes_max, .. } = counters;
        let lost_or_damaged = damaged.saturating_add(oversize).saturating_add(lost);
        Self { lost_or_damaged, dropped, overruns, stack_bytes_max }
    }
}

impl fmt::Display for HeldFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "held before        {:+.4} deg, until {:.4} s", self.target_deg, self.held_s)?;
        if let Some(error) = self.error_true_mdeg {
            write!(f, ", true error {error:+.3} mdeg")?;
        }
        writeln!(f, "{}", if self.ok { "" } else { ": not within the tolerance" })
    }
}

impl fmt::Display for MoveFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { target_deg, tolerance_deg, .. } = self;
        self.held_before.iter().try_for_each(|held| held.fmt(f))?;
        writeln!(f, "target             {target_deg:+.4} deg, tolerance {tolerance_deg} deg")?;
        match (self.final_angle_deg, self.final_sd_mdeg) {
            (Some(angle), Some(sd)) => writeln!(f, "estimated angle    {angle:+.5} deg +- {sd:.3} mdeg")?,
            _ => writeln!(f, "estimated angle    none: no camera frame was used")?,
        }
        if let Some(error) = self.final_error_true_mdeg {
            writeln!(f, "true error         {error:+.3} mdeg")?;
        }
        let verdict = match (&self.stopped, self.ok) {
            (Some(why), _) => format!("given up: {why}"),
            (None, true) => "on target".to_owned(),
            (None, false) => "not within the tolerance".to_owned(),
        };
        writeln!(f, "outcome            {verdict}")
    }
}

impl fmt::Display for RateFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "rate               {:+.2} deg/s for {} s", self.rate_deg_s, self.asked_s)?;
        match (self.mean_deg_s, self.measured_s) {
            (Some(mean), Some(measured_s)) => {
                writeln!(f, "mean rate          {mean:+.4} deg/s by the estimate over {measured_s:.2} s")?;
            }
            _ => writeln!(f, "mean rate          none: the rotor followed for too short a time")?,
        }
        if let Some(mean) = self.true_mean_deg_s {
            write!(f, "true mean rate     {mean:+.4} deg/s")?;
            let off = self.mean_error_percent.map(|percent| format!(": {percent:+.4} % off"));
            writeln!(f, "{}", off.unwrap_or_default())?;
        }
        if self.reference_losses > 0 {
            let losses = self.reference_losses;
            writeln!(f, "reference          begun anew {losses} times, since the estimate was lost")?;
        }
        writeln!(f, "by its map         {}", self.promised_reach)?;
        let verdict = match (self.reason, self.stopped_s) {
            (Some(why), Some(at_s)) => format!("drive off for good after {at_s:.3} s: {why}"),
            _ => self.reached_deg_s.map_or_else(|| "held to its end".to_owned(), cannot_keep_up),
        };
        writeln!(f, "outcome            {verdict}")
    }
}

impl fmt::Display for SerialOutcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.task {
            TaskFigures::Move(figures) => figures.fmt(f)?,
            TaskFigures::Rate(figures) => figures.fmt(f)?,
            TaskFigures::Commission(figures) => writeln!(f, "experiments        {}", figures.experiments)?,
        }
        self.session.fmt(f)
    }
}

impl fmt::Display for SessionFigures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { duration_s, host_s, .. } = self;
        writeln!(
            f,
            "time taken         {duration_s:.4} s of the board's clock, {host_s:.3} s of the host's"
        )?;
        let acknowledged = if self.stop_acknowledged { "acknowledged" } else { "not acknowledged" };
        writeln!(f, "stop               {acknowledged}")?;
        let sources = if self.board.is_this_loop { "this program's sources" } else { "other sources" };
        writeln!(f, "firmware           of {sources}, started by: {}", self.board.reset_cause)?;
        let DescriptionFigures { sent, kept, filter, .. } = self.description;
        writeln!(f, "filter             {filter}")?;
        let description = match (sent, kept) {
            (true, false) => "sent to the board",
            (true, true) => "sent to the board, which keeps it",
            (false, _) => "kept by the board, and not sent",
        };
        writeln!(f, "description        {description}")?;
        if let Some(clock) = &self.clock {
            write!(f, "clock              known to {:.0} us", clock.uncertainty_us)?;
            if let (Some(drift), Some(bound)) = (clock.drift_ppm, clock.drift_uncertainty_ppm) {
                write!(f, ", drift {drift:+.0} +- {bound:.0} ppm")?;
            }
            write!(f, ", round trip {:.0} us", clock.round_trip_us)?;
            match self.description.clock_error_us {
                0 => writeln!(f)?,
                told_us => writeln!(f, "; the filter is told of {told_us} us rms")?,
            }
        }
        let line = &self.line;
        writeln!(
            f,
            "line               {} baud, {:.0} % in use to the board, {:.0} % from it",
            line.baud,
            100.0 * line.load_to_board,
            100.0 * line.load_from_board
        )?;
        write!(f, "frames             {} sent", line.frames_sent)?;
        if line.frames_early > 0 {
            write!(f, ", {} left out from before the run", line.frames_early)?;
        }
        if line.frames_old > 0 {
            write!(f, ", {} left out, since newer ones waited", line.frames_old)?;
        }
        write!(f, "; {} reports", line.reports)?;
        if line.lost_from_board > 0 {
            write!(f, ", {} messages of the board lost or damaged", line.lost_from_board)?;
        }
        writeln!(f)?;
        let Some(counters) = self.counters else { return Ok(()) };
        let CounterFigures { lost_or_damaged, dropped, overruns, stack_bytes_max } = counters;
        writeln!(
            f,
            "board              {overruns} overruns, {lost_or_damaged} frames lost or damaged, {dropped} measurements \
             dropped, {stack_bytes_max} bytes of stack"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(loop_digest: u64, reset_cause: ResetCause) -> IdentityFigures {
        BoardIdentity { loop_digest, reset_cause: reset_cause.into() }.into()
    }

    /// A board of other sources, and one that its watchdog has restarted, are told of; others are not.
    #[test]
    fn exact_what_is_said_of_a_board_before_the_run() {
        let warnings = |figures: IdentityFigures| figures.warnings().collect::<Vec<_>>();
        for quiet in [ResetCause::Unknown, ResetCause::Power, ResetCause::Pin, ResetCause::Software] {
            assert!(warnings(figures(LOOP_DIGEST, quiet)).is_empty(), "{quiet:?}");
        }
        let [stopped] = &warnings(figures(LOOP_DIGEST, ResetCause::Watchdog))[..] else { panic!("one") };
        assert!(stopped.starts_with("the watchdog has restarted the board"), "{stopped}");
        for (cause, of) in [(ResetCause::Panic, "a panic"), (ResetCause::Fault, "a fault")] {
            let [crashed] = &warnings(figures(LOOP_DIGEST, cause))[..] else { panic!("one") };
            assert!(crashed.starts_with(&format!("the board has started anew after {of} of")), "{crashed}");
        }
        let [other] = &warnings(figures(LOOP_DIGEST ^ 1, ResetCause::Power))[..] else { panic!("one") };
        assert!(other.starts_with(&format!("the board's loop ({:016x}) was ", LOOP_DIGEST ^ 1)), "{other}");
    }

    #[test]
    fn exact_digest_in_json() {
        let json = serde_json::to_value(figures(0xab, ResetCause::Power)).unwrap();
        assert_eq!(json["loop_digest"], "00000000000000ab");
        assert_eq!((&json["is_this_loop"], &json["reset_cause"]), (&false.into(), &"power".into()));
    }
}
