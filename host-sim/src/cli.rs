//! The command line: one struct a subcommand, each a thin layer over a scene.
//!
//! A flag of its own is only a shorter name for a key, so it is checked, refused and hinted at like one. Errors of any kind
//! are one line on standard error and exit code 2.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, Parser, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};

use crate::error::CommandError;
use crate::export::OutputFolder;
use crate::instructions::{self, Board, Listing};
use crate::position;
use crate::positioning_trials::{self, Strategy};
use crate::record::Record;
use crate::scene::Scene;
use crate::simulate::{Report, Run, simulate};
use crate::{accuracy, estimate, export, filters, keys, pil, rate, reproduce, response_map, size};

/// A rotary micro-motor in simulation: open loop, published figures, closed loop.
#[derive(Debug, Parser)]
#[command(name = "host-sim", version, about)]
struct Cli {
    /// What to do; without it, the default scene's move in closed loop.
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run the motor under a constant drive and say how fast it turns.
    Simulate(SimulateArgs),
    /// Move the rotor to an angle in closed loop, and draw what happened.
    Position(PositionArgs),
    /// Simulate the published tables and figures again and set them side by side
    Reproduce(ReproduceArgs),
    /// Count the instructions of each operation on an emulated microcontroller.
    Instructions(InstructionsArgs),
    /// Run the firmware on an emulated microcontroller against the simulated motor, and compare it with the host bit by bit.
    Pil(PilArgs),
    /// Measure the firmware's flash, RAM and stack, and check what its loop calls.
    Size(SizeArgs),
    /// Set the twin's speed against its error, beside other integrators
    Accuracy(AccuracyArgs),
    /// Compare the filters with the truth of many drawn motors, beside a lower bound
    Estimate(EstimateArgs),
    /// Set what each filter costs against how far it is off
    Filters(FiltersArgs),
    /// Hold a rate in closed loop, or lead the rotor through a profile of rates
    Rate(RateArgs),
    /// Move many drawn motors to many targets, beside simpler strategies
    PositioningTrials(PositioningTrialsArgs),
    /// Identify what each drive does, for the controller
    ResponseMap(ResponseMapArgs),
    /// List every key that --set and scene files take.
    Keys,
}

/// How results are written to standard output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    /// For people.
    #[default]
    Text,
    /// For programs: one JSON value.
    Json,
}

/// Where the settings of a command come from.
#[derive(Debug, Default, Args)]
struct SceneArgs {
    /// Scene file in TOML
    #[arg(long, value_name = "FILE.toml")]
    scene: Option<PathBuf>,
    /// Set one key, over the scene file; repeatable. `host-sim keys` lists them
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Names the random numbers of the run
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    seed: Option<String>,
}

impl SceneArgs {
    /// The scene, with `flags` (key and value, if given) over everything else.
    fn load(&self, flags: &[(&str, &Option<String>)]) -> Result<Scene, CommandError> {
        let mut scene = Scene::load(self.scene.as_deref(), &self.set)?;
        for (key, value) in flags.iter().chain(&[("seed", &self.seed)]) {
            if let Some(value) = value {
                scene.set(key, value)?;
            }
        }
        Ok(scene)
    }
}

#[derive(Debug, Args)]
struct SimulateArgs {
    /// Mode to drive: b, c or off
    #[arg(long)]
    drive: Option<String>,
    /// Drive amplitude, 0 to 1
    #[arg(long, allow_negative_numbers = true)]
    amplitude: Option<String>,
    /// Simulated time in s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<String>,
    /// Time left out of the statistics in s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    settle: Option<String>,
    /// Length of a step in s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    step: Option<String>,
    /// Law of friction: paper or coulomb
    #[arg(long)]
    friction: Option<String>,
    /// When an impact is applied: at the `end_of_step`, or where it is `located`
    #[arg(long, value_name = "RULE")]
    impacts: Option<String>,
    /// Arithmetic of the motor: f32 or f64
    #[arg(long)]
    precision: Option<String>,
    /// Write the motion as CSV, a row every 50 us
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl SimulateArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load(&[
            ("simulate.drive", &self.drive),
            ("simulate.amplitude", &self.amplitude),
            ("simulate.duration_s", &self.duration),
            ("simulate.settle_s", &self.settle),
            ("simulate.step_s", &self.step),
            ("simulate.friction", &self.friction),
            ("simulate.impacts", &self.impacts),
            ("simulate.precision", &self.precision),
        ])?;
        let run = Run::from_scene(&scene)?;
        run.schedule()?;
        let mut record = self.out.as_deref().map(Record::create).transpose()?;
        let start = Instant::now();
        let summary = simulate(&run, &mut record)?;
        let report = Report::new(&run, &summary, start.elapsed().as_secs_f64());
        record.map_or(Ok(()), Record::publish)?;
        export::print(&match self.format {
            Format::Text => report.to_string(),
            Format::Json => report.json(),
        })
    }
}

#[derive(Debug, Default, Args)]
struct PositionArgs {
    /// Target angle, clockwise positive
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    to: Option<String>,
    /// Distance from the target that counts as reached
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance: Option<String>,
    /// Where to draw the move
    #[arg(long, value_name = "FILE.svg")]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl PositionArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let scene =
            self.scene.load(&[("position.to_deg", &self.to), ("position.tolerance_deg", &self.tolerance)])?;
        let path = self.out.clone().unwrap_or_else(|| PathBuf::from("out/position.svg"));
        if self.out.is_none() {
            OutputFolder::create(Path::new("out"))?;
        }
        let mut picture = export::Output::create(&path)?;
        let mut trace = position::Trace::default();
        let outcome = position::run(&scene, |moment| trace.take(moment))?;
        let svg = position::svg(&outcome, &trace)?;
        picture.write_all(svg.as_bytes()).map_err(|source| picture.unwritable(source))?;
        picture.publish()?;
        export::print(&match self.format {
            Format::Text => format!("{outcome}picture            {}\n", path.display()),
            Format::Json => outcome.json(),
        })
    }
}

#[derive(Debug, Args)]
struct RateArgs {
    /// Rate in deg/s, clockwise positive
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    deg_s: Option<String>,
    /// What to do with it: dwell, staircase or sweep
    #[arg(long)]
    profile: Option<String>,
    /// Length of the run in s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<String>,
    /// Where to draw the run
    #[arg(long, value_name = "FILE.svg")]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl RateArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load(&[
            ("rate.deg_s", &self.deg_s),
            ("rate.profile", &self.profile),
            ("rate.duration_s", &self.duration),
        ])?;
        let path = self.out.clone().unwrap_or_else(|| PathBuf::from("out/rate.svg"));
        if self.out.is_none() {
            OutputFolder::create(Path::new("out"))?;
        }
        let mut picture = export::Output::create(&path)?;
        let mut moments = Vec::new();
        let outcome = rate::run(&scene, |moment| moments.push(moment))?;
        let svg = rate::svg(&outcome, &moments)?;
        picture.write_all(svg.as_bytes()).map_err(|source| picture.unwritable(source))?;
        picture.publish()?;
        export::print(&match self.format {
            Format::Text => format!("{outcome}picture            {}\n", path.display()),
            Format::Json => outcome.json(),
        })
    }
}

#[derive(Debug, Args)]
struct PositioningTrialsArgs {
    /// Moves, each of a motor of its own
    #[arg(long, value_name = "N", default_value = "1000", allow_negative_numbers = true)]
    trials: String,
    /// Run the simpler strategies and the other filters as well, so many trials each
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    compare: Option<String>,
    /// Folder for positioning-trials.svg and trials.csv
    #[arg(long, value_name = "DIR", default_value = "out/positioning-trials")]
    out: PathBuf,
    /// Replace the section between `<!-- positioning:begin -->` and `<!-- positioning:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl PositioningTrialsArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let trials = positioning_trials::TRIALS.integer(&self.trials)?;
        let scene = self.scene.load(&[])?;
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            positioning_trials::SECTION.read(path)?;
        }
        let plan = positioning_trials::Plan::new(&scene, Strategy::Planned, trials)?;
        let others = match &self.compare {
            Some(count) => {
                positioning_trials::Plan::others(&scene, positioning_trials::TRIALS.integer(count)?)?
            }
            None => Vec::new(),
        };
        let folder = OutputFolder::create(&self.out)?;
        let work = plan.trials() + others.iter().map(positioning_trials::Plan::trials).sum::<u64>();
        let bar = ProgressBar::new(work).with_style(progress_style());
        let progress = |trials| bar.inc(trials);
        let trials = plan.run(&progress)?;
        let others: Result<Vec<_>, CommandError> = others.iter().map(|plan| plan.run(&progress)).collect();
        let measuring_s = positioning_trials::measuring_s(&scene);
        let report = positioning_trials::Report { trials, others: others?, measuring_s };
        bar.finish_and_clear();
        folder.publish(&[
            ("positioning-trials.svg".to_owned(), report.picture()?),
            ("trials.csv".to_owned(), report.csv()),
        ])?;
        if let Some(path) = &self.readme {
            positioning_trials::SECTION.write(path, &report.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", report.document().text(), self.out.display()),
            Format::Json => report.json(),
        })
    }
}

#[derive(Debug, Args)]
struct ResponseMapArgs {
    /// Motors drawn within the tolerances
    #[arg(long, value_name = "N", default_value = "200", allow_negative_numbers = true)]
    motors: String,
    /// Write the map as Rust source, as the controller keeps it
    #[arg(long, value_name = "FILE.rs")]
    write: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl ResponseMapArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let motors = response_map::MOTORS.integer(&self.motors)?;
        let scene = self.scene.load(&[])?;
        let file = self.write.as_deref().map(export::Output::create).transpose()?;
        let campaign = response_map::Campaign::new(&scene, motors)?;
        let bar = ProgressBar::new(campaign.work()).with_style(progress_style());
        let map = campaign.run(&|work| bar.inc(work));
        bar.finish_and_clear();
        if let Some(mut file) = file {
            file.write_all(map.source().as_bytes()).map_err(|source| file.unwritable(source))?;
            file.publish()?;
        }
        export::print(&match self.format {
            Format::Text => map.document().text(),
            Format::Json => map.json(),
        })
    }
}

#[derive(Debug, Args)]
struct ReproduceArgs {
    /// Folder for reproduce.md and its pictures
    #[arg(long, value_name = "DIR", default_value = "out/reproduce")]
    out: PathBuf,
    /// Runs of each motor, 2 to 1000; the paper made five
    #[arg(long, value_name = "N", default_value = "5", allow_negative_numbers = true)]
    seeds: String,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl ReproduceArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let seeds = reproduce::SEEDS.integer(&self.seeds)?;
        let folder = OutputFolder::create(&self.out)?;
        let plan = reproduce::Plan::new(seeds)?;
        // On standard error, and only if that is a terminal.
        let bar = ProgressBar::new(plan.steps()).with_style(progress_style());
        let reproduction = plan.run(&|steps| bar.inc(steps))?;
        bar.finish_and_clear();
        let document = reproduction.document();
        let mut files = reproduction.pictures()?;
        files.push(("reproduce.md".to_owned(), document.markdown()));
        folder.publish(&files)?;
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", document.text(), self.out.display()),
            Format::Json => reproduction.json(),
        })
    }
}

#[derive(Debug, Args)]
struct InstructionsArgs {
    /// Board to emulate
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Program to run, instead of building it
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// Write the counts as JSON, as tests/qemu keeps them
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

#[derive(Debug, Args)]
struct PilArgs {
    /// Board to emulate
    #[arg(long, value_enum, default_value_t)]
    board: Board,
    /// Target angle, clockwise positive
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    to: Option<String>,
    /// Program to run, instead of building it
    #[arg(long, value_name = "FILE")]
    elf: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl PilArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load(&[("position.to_deg", &self.to)])?;
        instructions::emulator::check()?;
        let elf = self.elf.clone().map_or_else(|| instructions::program::build("pil"), Ok)?;
        let mut processor = pil::Emulated::start(&elf, self.board)?;
        let run = pil::run(&scene, &mut processor)?;
        processor.finish()?;
        export::print(&match self.format {
            Format::Text => format!("{} (QEMU {})\n{run}", self.board.processor(), self.board.machine()),
            Format::Json => run.json(),
        })?;
        run.difference.map_or(Ok(()), |difference| Err(difference.into()))
    }
}

#[derive(Debug, Args)]
struct SizeArgs {
    /// Replace the section between `<!-- size:begin -->` and `<!-- size:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl SizeArgs {
    fn execute(&self) -> Result<(), CommandError> {
        if let Some(path) = &self.readme {
            size::SECTION.read(path)?;
        }
        instructions::emulator::check()?;
        let report = size::Report::measure(instructions::program::build)?;
        if let Some(path) = &self.readme {
            size::SECTION.write(path, &report.markdown())?;
        }
        export::print(&match self.format {
            Format::Text => report.to_string(),
            Format::Json => report.json(),
        })?;
        let complaints = report.complaints();
        if complaints.is_empty() { Ok(()) } else { Err(CommandError::Oversize(complaints)) }
    }
}

#[derive(Debug, Args)]
struct AccuracyArgs {
    /// Folder for accuracy.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/accuracy")]
    out: PathBuf,
    /// Seconds instead of minutes: every figure, none of them sharp
    #[arg(long)]
    quick: bool,
    /// Replace the section between `<!-- accuracy:begin -->` and `<!-- accuracy:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

#[derive(Debug, Args)]
struct EstimateArgs {
    /// Motors drawn within the tolerances, each run in both modes
    #[arg(long, value_name = "N", default_value = "100", allow_negative_numbers = true)]
    plants: String,
    /// Folder for estimate.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/estimate")]
    out: PathBuf,
    /// Replace the section between `<!-- estimate:begin -->` and `<!-- estimate:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl EstimateArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let plants = estimate::PLANTS.integer(&self.plants)?;
        let scene = self.scene.load(&[])?;
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            estimate::SECTION.read(path)?;
        }
        let plan = estimate::Plan::new(&scene, plants)?;
        let folder = OutputFolder::create(&self.out)?;
        let bar = ProgressBar::new(plan.milliseconds()).with_style(progress_style());
        let estimation = plan.run(&|milliseconds| bar.inc(milliseconds))?;
        bar.finish_and_clear();
        folder.publish(&[
            ("estimate.svg".to_owned(), estimation.picture()?),
            ("table.csv".to_owned(), estimation.csv()?),
        ])?;
        if let Some(path) = &self.readme {
            estimate::SECTION.write(path, &estimation.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", estimation.document().text(), self.out.display()),
            Format::Json => estimation.json(),
        })
    }
}

#[derive(Debug, Args)]
struct FiltersArgs {
    /// Motors drawn within the tolerances, each run in both modes
    #[arg(long, value_name = "N", default_value = "20", allow_negative_numbers = true)]
    plants: String,
    /// Leave the microcontroller's instructions out: neither the cross compiler nor the emulator is needed then
    #[arg(long)]
    host_only: bool,
    /// Folder for filters.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/filters")]
    out: PathBuf,
    /// Replace the section between `<!-- filters:begin -->` and `<!-- filters:end -->` in this file
    #[arg(long, value_name = "FILE")]
    readme: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl FiltersArgs {
    /// How often each cost is measured.
    const ROUNDS: u32 = 10;

    fn execute(&self) -> Result<(), CommandError> {
        let plants = filters::PLANTS.integer(&self.plants)?;
        let scene = self.scene.load(&[])?;
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            filters::SECTION.read(path)?;
        }
        let plan = filters::Plan::new(&scene, plants, Self::ROUNDS)?;
        let folder = OutputFolder::create(&self.out)?;
        let counts = if self.host_only { None } else { Some(count_instructions(None, Board::M4)?) };
        let bar = ProgressBar::new(plan.recordings()).with_style(progress_style());
        let comparison = plan.run(counts.as_ref(), &|| bar.inc(1))?;
        bar.finish_and_clear();
        folder.publish(&[
            ("filters.svg".to_owned(), comparison.picture()?),
            ("table.csv".to_owned(), comparison.csv()?),
        ])?;
        if let Some(path) = &self.readme {
            filters::SECTION.write(path, &comparison.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", comparison.document().text(), self.out.display()),
            Format::Json => comparison.json(),
        })
    }
}

/// What the program prints that counts, run on `board`: that in `elf`, or one built for it.
fn count_instructions(elf: Option<&Path>, board: Board) -> Result<Listing, CommandError> {
    instructions::emulator::check()?;
    let elf = elf.map_or_else(|| instructions::program::build("instructions"), |elf| Ok(elf.to_owned()))?;
    Ok(Listing::parse(&instructions::emulator::run(&elf, board)?)?)
}

impl InstructionsArgs {
    fn execute(&self) -> Result<(), CommandError> {
        let file = self.out.as_deref().map(export::Output::create).transpose()?;
        let listing = count_instructions(self.elf.as_deref(), self.board)?;
        let report = instructions::Report::new(self.board, listing)?;
        if let Some(mut file) = file {
            file.write_all(report.json().as_bytes()).map_err(|source| file.unwritable(source))?;
            file.publish()?;
        }
        export::print(&match self.format {
            Format::Text => report.to_string(),
            Format::Json => report.json(),
        })
    }
}

impl AccuracyArgs {
    fn execute(&self) -> Result<(), CommandError> {
        // What cannot be written is refused before the computing.
        if let Some(path) = &self.readme {
            accuracy::readme::SECTION.read(path)?;
        }
        let folder = OutputFolder::create(&self.out)?;
        let plan = if self.quick { accuracy::Plan::quick() } else { accuracy::Plan::full() };
        let accuracy = plan.run()?;
        folder.publish(&[
            ("accuracy.svg".to_owned(), accuracy.picture()?),
            ("table.csv".to_owned(), accuracy.csv()?),
        ])?;
        if let Some(path) = &self.readme {
            accuracy::readme::SECTION.write(path, &accuracy.readme_section())?;
        }
        export::print(&match self.format {
            Format::Text => format!("{}Written to {}\n", accuracy.document().text(), self.out.display()),
            Format::Json => accuracy.json(),
        })
    }
}

fn progress_style() -> ProgressStyle {
    let template = "{bar:40} {percent:>3} %, {eta} to go";
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl Command {
    fn execute(&self) -> Result<(), CommandError> {
        match self {
            Self::Simulate(args) => args.execute(),
            Self::Position(args) => args.execute(),
            Self::Reproduce(args) => args.execute(),
            Self::Instructions(args) => args.execute(),
            Self::Pil(args) => args.execute(),
            Self::Size(args) => args.execute(),
            Self::Accuracy(args) => args.execute(),
            Self::Estimate(args) => args.execute(),
            Self::Filters(args) => args.execute(),
            Self::Rate(args) => args.execute(),
            Self::PositioningTrials(args) => args.execute(),
            Self::ResponseMap(args) => args.execute(),
            Self::Keys => export::print(&keys::table()),
        }
    }
}

/// Runs the command of this process: 0 when it did what was asked, 2 when it could not.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        // Help and version are no errors.
        Err(answer) if !answer.use_stderr() => answer.exit(),
        Err(error) => {
            eprintln!("{}", usage_error(&error.render().to_string()));
            return ExitCode::from(2);
        }
    };
    match cli.command.unwrap_or_else(|| Command::Position(PositionArgs::default())).execute() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is_broken_pipe() => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}", error.one_line());
            ExitCode::from(2)
        }
    }
}

/// A usage error on one line: what is wrong, and the parser's tip or where to read on.
fn usage_error(report: &str) -> String {
    let mut paragraphs = report.split("\n\n").map(|paragraph| {
        let lines: Vec<&str> = paragraph.lines().map(str::trim).collect();
        lines.join(" ")
    });
    let what = paragraphs.next().unwrap_or_default();
    let tip = paragraphs.find_map(|paragraph| paragraph.strip_prefix("tip: ").map(str::to_owned));
    format!(
        "{what}; hint: {}",
        tip.unwrap_or_else(|| "`host-sim --help` lists commands and flags".to_owned())
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn exact_usage_errors_are_one_line_with_a_hint() {
        for (arguments, expected) in [
            (
                vec!["host-sim", "simulate", "--drve", "b"],
                "error: unexpected argument '--drve' found; hint: a similar argument exists: '--drive'",
            ),
            (
                vec!["host-sim", "simulate", "--format", "xml"],
                "error: invalid value 'xml' for '--format <FORMAT>'",
            ),
            (vec!["host-sim", "fly"], "error: unrecognized subcommand 'fly'; hint: `host-sim --help`"),
        ] {
            let report = Cli::try_parse_from(arguments).unwrap_err().render().to_string();
            let line = usage_error(&report);
            assert!(line.starts_with(expected) && line.lines().count() == 1, "{line}");
        }
    }

    #[test]
    fn exact_the_command_line_is_well_formed() {
        Cli::command().debug_assert();
    }
}
