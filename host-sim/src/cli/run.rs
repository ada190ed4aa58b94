//! `run`: a move or a rate on a real board at a serial port.

use std::io::IsTerminal as _;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::{Args, ValueHint};
use indicatif::ProgressBar;
use link::{KeptDescription, VERSION};

use super::closed_loop::promised_range;
use super::learning::{LearnArgs, NOT_REACHED};
use super::port_args::{PortArgs, identified};
use super::readers::{RUN_MOVE, RUN_RATE};
use super::report::Request;
use super::{Format, SceneArgs, progress, result_json};
use crate::board::serial::{
    BoardTask, ClockDoubt, FrameSource, IdentityFigures, Keeping, NextStep, Progress, ReportPeriod,
    SerialError, SerialRun, TaskFigures, Watcher,
};
use crate::cli::CommandError;
use crate::log::{Ending, LogError, LogOptions, LogRecorder};
use crate::report::files;
use simulation::runs::rate::PromisedRange;
use simulation::runs::record::{Observer as _, RunRecord};
use simulation::scene::Scene;

/// The flags that are names of keys.
const KEY_FLAGS: [&str; 6] = ["--to", "--tolerance", "--deg-s", "--duration", "--zero", "--filter"];

#[derive(Debug, Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    port: PortArgs,
    /// Where camera frames come from: `plant` for the simulated motor under the drive that the board reports, or lines:
    /// time in s, angle in degrees, residual. They come from standard input for `-`, from a program that listens for
    /// `tcp:HOST:PORT`, from a named pipe, or from a file: a recording, whose first frame is exposed on arming
    #[arg(long, value_name = "SOURCE", default_value = "plant")]
    camera: String,
    /// Target angle, clockwise positive
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    to: Option<String>,
    /// Go on in the same session once the target is held: to an angle, to `hold` the angle at which the rotor then is,
    /// or to count angles from there (`zero`). Given several times, these are steps one after the other. What the move
    /// has learnt stays, and its deadline begins anew with each target. Ctrl-C ends all of them
    #[arg(long, value_name = "DEG|hold|zero", allow_negative_numbers = true)]
    then: Vec<NextStep>,
    /// Hold a rate in deg/s instead of a move, clockwise positive
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    #[arg(conflicts_with_all = ["to", "tolerance", "then", "learn"])]
    deg_s: Option<String>,
    /// Time in s for which the rate is held
    #[arg(long, value_name = "S", allow_negative_numbers = true, requires = "deg_s")]
    duration: Option<String>,
    /// Distance from the target that counts as reached
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance: Option<String>,
    /// Angle of the camera from which target, limits and all angles of the run count
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    zero: Option<String>,
    /// Filter on the board: `constant_rate`, `impact_aided`, twin or best
    #[arg(long, value_name = "FILTER")]
    filter: Option<String>,
    /// Let the board keep the description of its bench over a loss of power: instruments, motor, latency and map. A
    /// board that keeps the very description of a run is not sent it again. With --learn it also keeps what the move
    /// has learnt
    #[arg(long, conflicts_with = "forget")]
    keep: bool,
    /// Let the board forget the description that it keeps, before the run
    #[arg(long)]
    forget: bool,
    /// Write all that the board reports to a log: .mcap for Foxglove, `PlotJuggler` and `host-sim explain`, .parquet or
    /// .csv for a table. Times count from arming by the board's clock
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    log: Option<PathBuf>,
    /// Time between two reports of the board, 0.001 to 0.1, or 0 for those of changes of drive, health and phase alone,
    /// which come at any period [default: 0.001 with --log or the simulated motor, else 0.02]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    report_every: Option<ReportPeriod>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    learning: LearnArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl RunArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let (task, reader) = match &self.deg_s {
            None => (BoardTask::Move, &RUN_MOVE),
            Some(_) => (BoardTask::Rate, &RUN_RATE),
        };
        let flags = [
            ("position.to_deg", &self.to),
            ("position.tolerance_deg", &self.tolerance),
            ("rate.deg_s", &self.deg_s),
            ("rate.duration_s", &self.duration),
            ("run.zero_deg", &self.zero),
            ("estimator.filter", &self.filter),
        ];
        let scene = self.learning.map.provide(self.scene.load_for(reader, &flags)?)?;
        let learning = self.learning.open()?;
        let interrupted = self.port.watch()?;
        let source = FrameSource::named(&self.camera);
        let reports = ReportPeriod::checked(self.report_every, &source, self.log.is_some())
            .map_err(|error| failed(error, None))?;
        let mut view = LiveView::new(self.log(&scene)?);
        if task == BoardTask::Rate {
            view.promised = Some(promised_range(&PromisedRange::of(&scene)?));
        }
        let run = SerialRun {
            port: &self.port.port,
            baud: self.port.baud(),
            scene: &scene,
            task,
            then: &self.then,
            keeping: self.keeping(),
            source: &source,
            reports,
            interrupted: &interrupted,
        };
        let run = run.run(&mut view);
        let log = view.end();
        let outcome = match run {
            Ok(outcome) => outcome,
            Err(error) => return Err(failed(error, log)),
        };
        let request = Request::of_scene("run", &scene).with_key_flags(&KEY_FLAGS);
        let json = result_json::of(&request, &[], &files::json_line(&outcome));
        let logged = match log {
            Some(log) => {
                let logged = log.finish(Ending::Whole(&json))?;
                #[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
                let megabytes = logged.bytes as f64 / 1e6;
                format!("log                {}, {megabytes:.1} MB\n", logged.path.display())
            }
            None => String::new(),
        };
        files::print(&self.format.of(format!("{outcome}{logged}"), json))?;
        // Not before: a map that cannot be written costs neither the log nor the result.
        let learnt_map = if let Some(learning) = learning {
            let reached = matches!(&outcome.task, TaskFigures::Move(made) if made.stopped.is_none());
            let learnt = outcome.learnt.ok_or("the board has not told what it has learnt");
            learning.publish(&scene, if reached { learnt } else { Err(NOT_REACHED) })?
        } else {
            None
        };
        // Until here the board keeps the map as it was before the move.
        match learnt_map.filter(|_| self.keep) {
            Some(map) => {
                let clock_error_us = outcome.session.description.clock_error_us;
                self.port.keep(&scene.with_response_map(map), clock_error_us)
            }
            None => Ok(()),
        }
    }

    /// What becomes of the description that the board keeps.
    fn keeping(&self) -> Keeping {
        match (self.keep, self.forget) {
            (true, _) => Keeping::Keep,
            (false, true) => Keeping::Forget,
            (false, false) => Keeping::Untouched,
        }
    }

    /// The log, if one was asked for. Ctrl-C ends the run, and the run the log.
    fn log(&self, scene: &Scene) -> Result<Option<LogRecorder>, LogError> {
        let Some(path) = &self.log else { return Ok(None) };
        // The board chooses the ticks: each that it reports is logged.
        let options = LogOptions { every: 1 };
        LogRecorder::create(path, options, "run", scene, Arc::new(AtomicBool::new(false))).map(Some)
    }
}

/// The error of a run that did not end, with what is kept of it.
fn failed(error: SerialError, log: Option<LogRecorder>) -> CommandError {
    let kept = match log.map(|log| log.finish(Ending::Interrupted)) {
        Some(Err(LogError::Interrupted { kept })) => format!("; {kept}"),
        Some(Err(error)) => return error.into(),
        Some(Ok(_)) | None => String::new(),
    };
    CommandError::Serial { error: Box::new(error), kept }
}

/// Time between two lines where standard error is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(1);

/// Shows a run on standard error while it goes on, and logs it.
pub(super) struct LiveView {
    log: Option<LogRecorder>,
    /// What is said before a rate, once a board has answered: nothing on this side refuses it any more.
    promised: Option<String>,
    /// A few lines that are drawn anew, on a terminal.
    lines: Option<ProgressBar>,
    printed: Option<Instant>,
}

impl LiveView {
    pub(super) fn new(log: Option<LogRecorder>) -> Self {
        let lines = std::io::stderr().is_terminal().then(progress::lines);
        Self { log, promised: None, lines, printed: None }
    }

    /// Ends the view, and gives the log back.
    pub(super) fn end(self) -> Option<LogRecorder> {
        if let Some(lines) = self.lines {
            lines.finish_and_clear();
        }
        self.log
    }
}

impl Watcher for LiveView {
    fn board(&mut self, identity: &IdentityFigures) {
        self.promised.take().iter().for_each(|promised| progress::note(promised));
        identified(identity);
    }

    fn kept(&mut self, kept: KeptDescription) {
        if let KeptDescription::OtherVersion { version } = kept {
            progress::note(&format!(
                "note: the board keeps a description of protocol version {version}, not {VERSION}, and does not use it"
            ));
        }
    }

    fn clock(&mut self, doubt: &ClockDoubt) {
        let note = format!("note: {doubt}");
        match &self.lines {
            Some(lines) => lines.println(note),
            None => progress::note(&note),
        }
    }

    fn record(&mut self, record: &RunRecord) -> ControlFlow<()> {
        self.log.observe(record)
    }

    fn progress(&mut self, now: &Progress) {
        if let Some(lines) = &self.lines {
            lines.set_message(now.lines());
        } else if self.printed.is_none_or(|printed| printed.elapsed() >= LINE_EVERY) {
            self.printed = Some(Instant::now());
            progress::note(&now.to_string());
        }
    }
}
