//! The command line: one struct a subcommand, each a thin layer over a scene.
//!
//! A command's own flag for a setting is a shorter name of a key, so the same bounds and the same refusals hold for it.
//! Errors of any kind are one line on standard error and exit code 2, a change that `compare` was to refuse 1.

mod beside;
mod calibration;
mod closed_loop;
mod cluster;
mod commission;
mod compare;
mod count;
mod error;
mod estimation;
mod examples;
mod faults;
mod identification;
mod import;
pub mod in_process;
mod instruments;
mod interruption;
mod jog;
mod keys;
mod learning;
mod log_args;
mod microcontroller;
mod open_loop;
mod pil;
mod port_args;
mod progress;
mod publication;
mod readers;
mod recording;
mod replay;
mod report;
mod result_json;
mod results;
mod run;
mod scene_args;
mod scene_files;
mod shard;
mod shell;
mod stator;
mod sweep;
#[cfg(feature = "telemetry")]
mod telemetry;
mod twin;

pub use error::CommandError;

use std::path::PathBuf;
use std::process::ExitCode;

use anstyle::{AnsiColor, Style};
use clap::{Args, CommandFactory as _, FromArgMatches as _, Parser, Subcommand, ValueEnum};

use crate::scene_files::read_response_map;
use analysis::response_map;
use simulation::scene::Scene;

use self::stator::StatorArgs;
use calibration::CalibrateArgs;
use closed_loop::{PositionArgs, PositioningTrialsArgs, RateArgs, ResponseMapArgs};
use commission::CommissionArgs;
use compare::CompareArgs;
use estimation::{EstimateArgs, FiltersArgs};
use faults::FaultsArgs;
use identification::IdentifyArgs;
use import::ImportArgs;
use instruments::InstrumentsArgs;
use jog::{JogArgs, SelfTestArgs};
use keys::KeysArgs;
use microcontroller::{InstructionsArgs, PartsArgs, SizeArgs};
use open_loop::{ReproduceArgs, SimulateArgs};
use pil::PilArgs;
use recording::RecordArgs;
use replay::{ExplainArgs, ReplayArgs};
use results::ResultsArgs;
use run::RunArgs;
use scene_args::SceneArgs;
use scene_files::{InitArgs, SceneCommandArgs, ScenesArgs};
use shell::{CompletionsArgs, ManArgs};
use sweep::{MergeArgs, SweepArgs};
use twin::AccuracyArgs;

/// A rotary micro-motor in simulation: open loop, published figures, closed loop.
#[derive(Debug, Parser)]
#[command(name = "host-sim", version, about)]
struct Cli {
    /// What to do; without a command, a move by 90 degrees of a motor that tilts, by its commissioned map
    #[command(subcommand)]
    command: Option<Command>,
    /// Print the result and errors alone: neither progress nor notes
    #[arg(long, short, global = true)]
    quiet: bool,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the nominal motor under a constant drive and say how fast it turns
    ///
    /// The motor is that of Table 1 with the keys `motor.` that the scene sets. Step, friction, impacts and precision
    /// are keys `simulate.`: there are neither instruments nor a controller, and the keys `plant.` are refused. The
    /// seed draws the drive's variation, not the motor; `position` runs the motor that the seed draws.
    Simulate(SimulateArgs),
    /// Move the rotor of a drawn motor to an angle in closed loop, and draw what happened
    ///
    /// The seed draws the motor around the design, which is Table 1 with the keys `motor.` that the scene sets. A key
    /// `plant.motor.` sets the true motor alone, and `--set plant.parameters=nominal` draws nothing. Step, friction and
    /// impacts are keys `plant.`. `simulate` runs the nominal motor with keys of its own.
    Position(PositionArgs),
    /// Measure the response map of a motor of which only the design is known, within a minute of its time
    ///
    /// Sweeps the drive's frequency, drives cruises and bursts, and measures what the rotor does through the
    /// instruments alone. The map that `position` plans by is the prior: each of its rows gets a factor by Bayes' rule.
    /// The map of this motor goes to map.toml, for `position --map`. A motor that is not fit for use is refused with
    /// the reason.
    Commission(CommissionArgs),
    /// Simulate the published tables and figures and compare them with the paper
    Reproduce(ReproduceArgs),
    /// Count the instructions of each operation on an emulated microcontroller
    Instructions(InstructionsArgs),
    /// Run the firmware on an emulated microcontroller with the simulated motor, beside the host bit by bit
    Pil(PilArgs),
    /// Make a move, or hold a rate, on a real board at a serial port: configure, arm, feed camera frames, watch, stop
    ///
    /// Exit code 0 with the drive off at the end, 2 when it was not made or did not end, 130 after Ctrl-C. The
    /// drive goes off in any case: by a stop that the board acknowledges, or by the board when the line is gone.
    Run(Box<RunArgs>),
    /// Turn the rotor of a real board by hand: one mode, one level, for at most a second, without camera or filter
    ///
    /// Says what the vibrometer saw, by how much a simulated motor turns under the same, and what the response map
    /// forecasts. The drive goes off with the duration, by Ctrl-C, and by the board alone 10 ms after the line is gone.
    Jog(JogArgs),
    /// Ask a real board what it can tell of itself while the rotor rests: a line for each finding, pass or fail
    ///
    /// Amplifier, ticks, stack, vibrometer and camera over a tenth of a second, with the drive off. Exit code 0 when
    /// all pass, 2 when one does not or there is no board.
    #[command(name = "self-test")]
    SelfTest(SelfTestArgs),
    /// Measure the firmware's flash, RAM and stack, and check what its loop calls
    Size(SizeArgs),
    /// Say which filter fits which microcontroller: flash, RAM, and the work of a tick
    Parts(PartsArgs),
    /// Measure speed and error of the twin, beside other integrators
    Accuracy(AccuracyArgs),
    /// Compare the filters with the truth of many drawn motors, beside a lower bound
    Estimate(EstimateArgs),
    /// Measure cost and error of each filter
    Filters(FiltersArgs),
    /// Hold a rate in closed loop, or follow a profile of rates
    Rate(RateArgs),
    /// Record the true motor, or its bare stator, under given drives: what the instruments deliver, in a log
    Record(RecordArgs),
    /// Identify a motor from recordings of it: its parameters with intervals, and what would tell the others
    Identify(IdentifyArgs),
    /// Run a log through any filter at any tuning, beside what was recorded
    Replay(ReplayArgs),
    /// Make a log of your own recording: tables of angles, velocities and drives
    Import(Box<ImportArgs>),
    /// Say in words what happened in a log: frames refused, restarts, health, phases, and why
    Explain(ExplainArgs),
    /// Set two results side by side, with what changed beyond noise
    Compare(CompareArgs),
    /// Calibrate a gyroscope on the rotor: scale factor and bias with their intervals, against the truth
    Calibrate(CalibrateArgs),
    /// Move many drawn motors to many targets, beside simpler strategies
    PositioningTrials(PositioningTrialsArgs),
    /// Move drawn motors under many cameras and vibrometers, each move beside what was promised before it
    Instruments(InstrumentsArgs),
    /// Move drawn motors while things go wrong at random times, and count what was trusted and should not have been
    Faults(FaultsArgs),
    /// Run a command at many points, given by ranges and lists of keys, and keep figures of each run
    ///
    /// A point has a value for each key of --over, and a figure is a number in what the command prints with `--format
    /// json`. Rows go to rows.parquet in the folder of --out. Its bytes are the same for any number of threads, parts
    /// and interruptions. A run that fails costs its own row: the table says why, and the summary counts it.
    Sweep(SweepArgs),
    /// Put together the parts of a sweep that --shard has made
    Merge(MergeArgs),
    /// Identify what each drive does, for the controller
    ResponseMap(ResponseMapArgs),
    /// Solve the stator by finite elements: frequencies, modal masses, mode shifts and bow from a drawing
    ///
    /// CalculiX solves it (`apt-get install calculix-ccx`). The drawing is the keys `stator.`. What follows for the
    /// motor is written to motor.toml, a scene that every command takes.
    Stator(StatorArgs),
    /// Write the pages of results from runs of today, or compare them
    Results(ResultsArgs),
    /// List the keys that --set and scene files take: all, or those that a command reads
    Keys(KeysArgs),
    /// Write a scene file to begin with: every key with unit, bounds, meaning and default, commented out
    Init(InitArgs),
    /// Print a scene: every key with its value, and where it comes from
    Scene(SceneCommandArgs),
    /// List the gallery: scenes that --scene takes by name, what to look at in each, and the command that shows it
    Scenes(ScenesArgs),
    /// Print the completions of a shell
    Completions(CompletionsArgs),
    /// Print the manual page, or write one for each command
    Man(ManArgs),
}

/// How results are written to standard output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people.
    #[default]
    Text,
    /// For programs: one JSON value.
    Json,
}

impl Format {
    /// The result in this form, out of both.
    fn of(self, text: String, json: String) -> String {
        match self {
            Self::Text => text,
            Self::Json => json,
        }
    }
}

/// The response map by which the controller plans.
#[derive(Debug, Default, Args)]
struct MapArgs {
    /// Response map of the scene's design, as `response-map --out` writes it, or of its motor, as `commission` does;
    /// or the name `set_f_plant`, for the map that commissioning has made of that scene's motor. Without it: that of
    /// Table 1, or one that is made first for the design that the keys `motor.` describe
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

impl MapArgs {
    /// The map of the commissioned motor of the gallery's scene `name`.
    fn commissioned(name: &str) -> Self {
        Self { map: Some(name.into()) }
    }

    /// `scene` with its map.
    ///
    /// # Errors
    /// When the map's file is refused or is for another design, or no map can be made.
    fn provide(&self, scene: Scene) -> Result<Scene, CommandError> {
        if let Some(path) = &self.map {
            let scene = scene.with_response_map(read_response_map(path)?);
            scene.response_map()?;
            return Ok(scene);
        }
        if response_map::is_table_1(&scene) || scene.response_map().is_ok() {
            return Ok(scene);
        }
        progress::note(
            "making the response map of this design; `response-map --out` and `--map` make and take one",
        );
        let bar = progress::bar(0);
        let map = response_map::of_design(&scene, &|work| bar.inc(work), |work| bar.set_length(work))?;
        bar.finish_and_clear();
        Ok(scene.with_response_map(map))
    }
}

impl Command {
    fn execute(&self) -> Result<(), CommandError> {
        match self {
            Self::Simulate(args) => args.execute(),
            Self::Position(args) => args.execute(),
            Self::Commission(args) => args.execute(),
            Self::Reproduce(args) => args.execute(),
            Self::Instructions(args) => args.execute(),
            Self::Pil(args) => args.execute(),
            Self::Run(args) => args.execute(),
            Self::Jog(args) => args.execute(),
            Self::SelfTest(args) => args.execute(),
            Self::Size(args) => args.execute(),
            Self::Parts(args) => args.execute(),
            Self::Accuracy(args) => args.execute(),
            Self::Estimate(args) => args.execute(),
            Self::Filters(args) => args.execute(),
            Self::Rate(args) => args.execute(),
            Self::Record(args) => args.execute(),
            Self::Identify(args) => args.execute(),
            Self::Replay(args) => args.execute(),
            Self::Import(args) => args.execute(),
            Self::Explain(args) => args.execute(),
            Self::Compare(args) => args.execute(),
            Self::Calibrate(args) => args.execute(),
            Self::PositioningTrials(args) => args.execute(),
            Self::Instruments(args) => args.execute(),
            Self::Faults(args) => args.execute(),
            Self::Sweep(args) => args.execute(),
            Self::Merge(args) => args.execute(),
            Self::ResponseMap(args) => args.execute(),
            Self::Stator(args) => args.execute(),
            Self::Results(args) => args.execute(),
            Self::Keys(args) => args.execute(),
            Self::Init(args) => args.execute(),
            Self::Scene(args) => args.execute(),
            Self::Scenes(args) => args.execute(),
            Self::Completions(args) => args.execute(),
            Self::Man(args) => args.execute(),
        }
    }
}

/// The command line, with examples at the end of each help.
fn command_line() -> clap::Command {
    examples::added_to(Cli::command())
}

/// An error on standard error, its first word and `hint` in colour on a terminal, unless `NO_COLOR` is set.
fn complain(line: &str) {
    const ERROR: Style = AnsiColor::Red.on_default().bold();
    const HINT: Style = AnsiColor::Green.on_default();
    let text = line.strip_prefix("error:").map_or_else(
        || line.to_owned(),
        |rest| {
            format!(
                "{ERROR}error:{ERROR:#}{}",
                rest.replacen("; hint:", &format!("; {HINT}hint:{HINT:#}"), 1)
            )
        },
    );
    anstream::eprintln!("{text}");
}

/// Runs the command of this process: 0 when it did what was asked, 1 when `compare` found a change that it was to
/// refuse, 2 when it could not, 130 when it was interrupted.
pub fn main() -> ExitCode {
    let parsed = command_line().try_get_matches().and_then(|matches| Cli::from_arg_matches(&matches));
    let cli = match parsed {
        Ok(cli) => cli,
        // Help and version are no errors.
        Err(answer) if !answer.use_stderr() => answer.exit(),
        Err(error) => {
            let words: Vec<String> =
                std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
            complain(&usage_error(&error.render().to_string(), &words));
            return ExitCode::from(2);
        }
    };
    if cli.quiet {
        progress::be_quiet();
    }
    match cli.command.map_or_else(PositionArgs::first_run, |command| command.execute()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is_broken_pipe() => ExitCode::SUCCESS,
        Err(error) => {
            complain(&error.one_line());
            ExitCode::from(error.exit_code())
        }
    }
}

/// A usage error on one line: what is wrong, and the parser's tip or where to read on, for a command line of `words`.
fn usage_error(report: &str, words: &[impl AsRef<str>]) -> String {
    let mut paragraphs = report.split("\n\n").map(|paragraph| {
        let lines: Vec<&str> = paragraph.lines().map(str::trim).collect();
        lines.join(" ")
    });
    let what = paragraphs.next().unwrap_or_default();
    let tip = paragraphs.find_map(|paragraph| paragraph.strip_prefix("tip: ").map(str::to_owned));
    format!("{what}; hint: {}", tip.unwrap_or_else(|| where_to_read(words)))
}

/// The help of the command that `words` begin with, or that of all commands if they begin with none.
fn where_to_read(words: &[impl AsRef<str>]) -> String {
    let first = words.iter().map(AsRef::as_ref).find(|word| !word.starts_with('-'));
    match first.filter(|word| Cli::command().find_subcommand(word).is_some()) {
        Some(command) => format!("`host-sim {command} --help` lists its flags"),
        None => "`host-sim --help` lists commands and flags".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exact_usage_errors_are_one_line_with_a_hint() {
        for (arguments, expected) in [
            (
                vec!["host-sim", "simulate", "--drve", "b"],
                "error: unexpected argument '--drve' found; hint: a similar argument exists: '--drive'",
            ),
            (
                vec!["host-sim", "simulate", "--format", "xml"],
                "error: invalid value 'xml' for '--format <FORMAT>' [possible values: text, json]; hint: \
                 `host-sim simulate --help` lists its flags",
            ),
            (
                vec!["host-sim", "estimate", "--motors", "0"],
                "error: --motors = 0 is outside its bounds 1 to 10000; hint: `host-sim estimate --help` lists its",
            ),
            (
                vec!["host-sim", "--quiet", "filters", "--plants", "1.5"],
                "error: --motors = 1.5 is not a whole number, bounds 1 to 10000; hint: `host-sim filters --help`",
            ),
            (vec!["host-sim", "fly"], "error: unrecognized subcommand 'fly'; hint: `host-sim --help`"),
        ] {
            let report = Cli::try_parse_from(&arguments).unwrap_err().render().to_string();
            let line = usage_error(&report, &arguments[1..]);
            assert!(line.starts_with(expected) && line.lines().count() == 1, "{line}");
        }
    }

    #[test]
    fn exact_the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }

    /// A command has `--scene` if and only if the table of readers has the command, but for `sweep`.
    #[test]
    fn exact_commands_that_take_a_scene_are_readers() {
        let takes_scene =
            |command: &&clap::Command| command.get_arguments().any(|flag| flag.get_id() == "scene");
        let mut line = Cli::command();
        line.build();
        let mut takers: Vec<&str> =
            line.get_subcommands().filter(takes_scene).map(clap::Command::get_name).collect();
        // It reads what the command reads that it runs.
        takers.retain(|command| *command != "sweep");
        let mut readers = readers::READERS.map(|reader| reader.command);
        takers.sort_unstable();
        readers.sort_unstable();
        assert_eq!(takers, readers);
    }
}
