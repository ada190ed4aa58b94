//! `sweep` and `merge`: a command at many points, in one process or in parts.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use clap::builder::PossibleValue;
use clap::{Args, ValueEnum, ValueHint};

use super::cluster::{ClusterArgs, Scheduler, SweepJob};
use super::count::Count;
use super::publication::svg_files;
use super::readers::Reader;
use super::report::{ReportArgs, Request};
use super::shard::ShardParser;
use super::{Format, MapArgs, SceneArgs, interruption, progress};
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::report::files::{self, OutputFolder};
use crate::studies::shard::Shard;
use crate::studies::study_report::StudyCost;
use crate::studies::sweep::{
    self, Existing, LockedFolder, Sampling, SweepError, SweepPlan, SweepRequest, SweepSummary, SweptCommand,
    makes_a_row,
};
use simulation::math::count::real;

/// Time of this process from which on a sweep is refused, in s: a month.
const TOO_LONG_S: f64 = 30.0 * 86_400.0;
/// Time from which on a note says how long it will take, in s.
const LONG_S: f64 = 600.0;

/// Points of a random or Sobol sweep.
const POINTS: Count = Count(1..=1_000_000_000_000);

impl ValueEnum for SweptCommand {
    fn value_variants<'a>() -> &'a [Self] {
        &Self::ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(PossibleValue::new(self.name()))
    }
}

/// Where the points lie.
#[derive(Debug, Args)]
struct PointsArgs {
    /// Every value of each key with every value of the others; so it is unless another flag says otherwise
    #[arg(long, conflicts_with_all = ["random", "sobol"])]
    grid: bool,
    /// So many points, independent and uniform, named by the seed
    #[arg(long, value_name = "N", value_parser = POINTS, allow_negative_numbers = true, conflicts_with = "sobol")]
    random: Option<u64>,
    /// So many points of a Sobol sequence, shifted as the seed says: more even than random ones, best a power of 2
    #[arg(long, value_name = "N", value_parser = POINTS, allow_negative_numbers = true)]
    sobol: Option<u64>,
    /// N base points of Sobol's indices: which key decides. They take N (keys + 2) runs, N is best a power of 2
    #[arg(long, value_name = "N", value_parser = POINTS, allow_negative_numbers = true)]
    #[arg(conflicts_with_all = ["grid", "random", "sobol"])]
    indices: Option<u64>,
}

impl PointsArgs {
    fn sampling(&self) -> Sampling {
        match (self.random, self.sobol, self.indices) {
            (Some(points), ..) => Sampling::Random(points),
            (_, Some(points), _) => Sampling::Sobol(points),
            (.., Some(points)) => Sampling::Indices(points),
            _ => Sampling::Grid,
        }
    }
}

/// What becomes of a sweep that is in the folder.
#[derive(Debug, Args)]
struct ExistingArgs {
    /// Go on with the sweep that is in the folder, or begin it
    #[arg(long, conflicts_with = "force")]
    resume: bool,
    /// Write over the sweep that is in the folder
    #[arg(long)]
    force: bool,
}

impl ExistingArgs {
    fn existing(&self) -> Existing {
        match (self.resume, self.force) {
            (true, _) => Existing::Resume,
            (_, true) => Existing::Replace,
            _ => Existing::Refuse,
        }
    }
}

#[derive(Debug, Args)]
pub(super) struct SweepArgs {
    /// The command that runs at each point
    #[arg(long, value_name = "COMMAND", value_enum, default_value = "position")]
    of: SweptCommand,
    /// A key and its values: KEY=A,B,C or KEY=MIN..MAX, the range with :log, with a count for a grid, or with both;
    /// repeatable
    #[arg(long, value_name = "KEY=VALUES", required = true)]
    over: Vec<String>,
    #[command(flatten)]
    points: PointsArgs,
    /// A figure to keep: its path in the JSON of the command; repeatable. Without one the paths are listed
    #[arg(long, value_name = "PATH")]
    figure: Vec<String>,
    /// Runs of each point, with the seeds that follow that of the scene
    #[arg(long, value_name = "N", default_value = "1")]
    #[arg(value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    repeats: u64,
    /// Motors of a study at each point: gyroscopes of calibrate, moves of positioning-trials and faults
    #[arg(long, value_name = "N", default_value = "1")]
    #[arg(value_parser = Count(1..=10_000), allow_negative_numbers = true)]
    sample: u64,
    /// Make only the I-th of N parts of the rows; `host-sim merge` puts the parts together
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = ShardParser)]
    shard: Shard,
    #[command(flatten)]
    existing: ExistingArgs,
    /// Print what the sweep will cost here and on clusters of 1, 100 and 1000 nodes, without making it
    #[arg(long)]
    plan: bool,
    /// Cores of a node, for --plan [default: the threads of this machine]
    #[arg(long, value_name = "N", value_parser = Count(1..=100_000), allow_negative_numbers = true)]
    cores: Option<u64>,
    #[command(flatten)]
    cluster: ClusterArgs,
    /// Begin also what takes this machine longer than a month
    #[arg(long)]
    long: bool,
    /// Folder for rows.parquet, times.parquet and manifest.json
    #[arg(long, value_name = "DIR", default_value = "out/sweep", value_hint = ValueHint::DirPath)]
    out: PathBuf,
    /// How to print the summary
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl SweepArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let plan = self.planned()?;
        if self.plan {
            return self.print_cost(&plan);
        }
        if let Some(scheduler) = self.cluster.scheduler() {
            return self.submit(scheduler, &plan);
        }
        let begun = Instant::now();
        let report = self.report.open()?;
        let folder = LockedFolder::open(&self.out, &plan, self.shard, self.existing.existing())?;
        let summary = match folder.finished()? {
            Some(summary) => {
                progress::note("all rows were done already");
                summary
            }
            None => self.run(&plan, folder)?,
        };
        if self.shard == Shard::ALL {
            draw(&summary)?;
        }
        if let Some(file) = report {
            let wall_s = begun.elapsed().as_secs_f64();
            let cost = StudyCost { wall_s, threads: rayon::current_num_threads() };
            let request = Request::of_scene("sweep", plan.scene()).read_by(self.of.name());
            let page = summary.report(self.of.name()).page(request.scene, &|key| request.reads(key), cost);
            file.publish(&page, &request)?;
        }
        Ok(print(&summary, self.format)?)
    }

    /// Makes the rows that are not done.
    fn run(&self, plan: &SweepPlan, folder: LockedFolder) -> Result<SweepSummary, CommandError> {
        let rows = self.shard.range(plan.rows());
        // The first row may refuse all: nothing is written or replaced before.
        silence_panics();
        let first = plan.check_figures()?;
        self.admit_time(rows.end - rows.start, first.time_s)?;
        let mut folder = folder.begin(plan)?;
        let begun = rows.start + folder.done();
        let interrupted = Arc::new(AtomicBool::new(false));
        interruption::watch(&interrupted)
            .map_err(|source| OutputError::Unwritable { path: self.out.clone(), source })?;
        let bar = progress::bar(rows.end - rows.start);
        bar.set_position(folder.done());
        bar.reset_eta();
        // Row 0 is made already.
        let make = |number| if number == 0 { first.clone() } else { plan.make(number) };
        let end = sweep::rows_in_order(begun..rows.end, &interrupted, make, |row| {
            folder.append(plan, &row)?;
            bar.inc(1);
            Ok::<(), SweepError>(())
        })?;
        bar.finish_and_clear();
        if end < rows.end {
            let (done, rows) = (end - rows.start, rows.end - rows.start);
            return Err(SweepError::Interrupted { done, rows, folder: self.out.clone() }.into());
        }
        Ok(folder.finish()?)
    }

    fn planned(&self) -> Result<SweepPlan, CommandError> {
        let command = self.of.name();
        let scene = self.scene.load(command, &[])?;
        let scene = if self.of.plans() { self.map.provide(scene)? } else { scene };
        let request = SweepRequest {
            command: self.of,
            sample: self.sample,
            over: self.over.clone(),
            sampling: self.points.sampling(),
            repeats: self.repeats,
            figures: self.figure.clone(),
        };
        let reads = |command: SweptCommand, key: &str| Reader::named(command.name()).reads(key);
        Ok(SweepPlan::new(&scene, request, reads, &|key| Reader::named(command).admit(key))?)
    }

    fn print_cost(&self, plan: &SweepPlan) -> Result<(), CommandError> {
        silence_panics();
        plan.check_figures()?;
        let cost = plan.cost(self.cluster.cpus())?;
        let cores = self.cores.unwrap_or_else(|| rayon::current_num_threads() as u64);
        Ok(files::print(&self.format.of(cost.document(cores).text(), files::json_line(&cost)))?)
    }

    fn submit(&self, scheduler: Scheduler, plan: &SweepPlan) -> Result<(), CommandError> {
        silence_panics();
        plan.check_figures()?;
        let reader = Reader::named(self.of.name());
        let job = SweepJob {
            plan,
            words: self.words(),
            scene: plan.scene().text(&|key| reader.reads(key), true),
            out: &self.out,
            resume: self.existing.resume,
        };
        let submission = self.cluster.submit(scheduler, &job)?;
        Ok(files::print(&self.format.of(submission.text(), files::json_line(&submission)))?)
    }

    /// The command without its scene, its part and its folder.
    fn words(&self) -> Vec<String> {
        let mut words = vec!["sweep".to_owned(), format!("--of={}", self.of.name())];
        words.extend(self.over.iter().map(|over| format!("--over={over}")));
        words.extend(self.figure.iter().map(|figure| format!("--figure={figure}")));
        words.extend([format!("--repeats={}", self.repeats), format!("--sample={}", self.sample)]);
        words.extend(self.points.random.map(|points| format!("--random={points}")));
        words.extend(self.points.sobol.map(|points| format!("--sobol={points}")));
        words.extend(self.points.indices.map(|points| format!("--indices={points}")));
        words.extend(self.map.map.iter().map(|map| format!("--map={}", map.display())));
        words.push("--long".to_owned());
        words
    }

    /// Refuses what takes longer than a month, and says how long a long sweep takes; by the time of the first row.
    fn admit_time(&self, rows: u64, row_s: f64) -> Result<(), SweepError> {
        let threads = rayon::current_num_threads();
        let time_s = real(rows) * row_s / real(threads);
        if time_s > TOO_LONG_S && !self.long {
            return Err(SweepError::TooLong { rows, days: format!("{:.0}", time_s / 86_400.0), threads });
        }
        if time_s > LONG_S {
            progress::note(&format!(
                "{rows} rows will take about {:.1} h on {threads} threads, by the time of the first",
                time_s / 3600.0
            ));
        }
        Ok(())
    }
}

/// A run that panics fails its own row, which has the reason: nothing more is said of it on standard error.
fn silence_panics() {
    let told = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !makes_a_row() {
            told(panic);
        }
    }));
}

/// Writes the pictures beside the tables.
fn draw(summary: &SweepSummary) -> Result<(), OutputError> {
    OutputFolder::create(&summary.folder)?.publish(&svg_files(&summary.pictures())?)
}

fn print(summary: &SweepSummary, format: Format) -> Result<(), OutputError> {
    let text = || format!("{}Written to {}\n", summary.document().text(), summary.folder.display());
    files::print(&format.of(text(), summary.json()))
}

#[derive(Debug, Args)]
pub(super) struct MergeArgs {
    /// The folders of the parts, in any order
    #[arg(value_name = "DIR", required = true, value_hint = ValueHint::DirPath)]
    parts: Vec<PathBuf>,
    /// Folder for the whole
    #[arg(long, value_name = "DIR", default_value = "out/merged", value_hint = ValueHint::DirPath)]
    out: PathBuf,
    /// Write over the sweep that is in the folder
    #[arg(long)]
    force: bool,
    /// How to print the summary
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
}

impl MergeArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let existing = if self.force { Existing::Replace } else { Existing::Refuse };
        let summary = sweep::merge(&self.parts, &self.out, existing)?;
        draw(&summary)?;
        Ok(print(&summary, self.format)?)
    }
}
