//! `simulate` and `reproduce`: the motor under a given drive.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use super::count::Count;
use super::publication::{Findings, PublicationArgs};
use super::report::{ReportArgs, Request};
use super::{Format, SceneArgs, progress, result_json};
use crate::cli::CommandError;
use crate::report::files;
use crate::run_reports::open_loop::samples_csv::SamplesCsv;
use crate::run_reports::open_loop::{OpenLoopTrace, close_up, html_report};
use crate::studies::open_loop::{self, OpenLoopResult};
use crate::studies::paper::runs::RunTime;
use crate::studies::{paper, rotor_models};
use simulation::runs::simulate::{OpenLoopModel, OpenLoopRun};
use simulation::scene::SceneError;

#[derive(Debug, Args)]
pub(super) struct SimulateArgs {
    /// What is simulated: motor, stator (without a rotor) or averaged (mean rate and random deviations)
    #[arg(long)]
    model: Option<String>,
    /// How the rotor moves: `height_only`, tilting or `tilting_without_shift`
    #[arg(long)]
    rotor: Option<String>,
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
    report: ReportArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

/// Flags of `simulate` that are names of keys.
const KEY_FLAGS: [&str; 10] = [
    "--model",
    "--rotor",
    "--drive",
    "--amplitude",
    "--duration",
    "--settle",
    "--step",
    "--friction",
    "--impacts",
    "--precision",
];

impl SimulateArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load(
            "simulate",
            &[
                ("simulate.model", &self.model),
                ("plant.rotor", &self.rotor),
                ("simulate.drive", &self.drive),
                ("simulate.amplitude", &self.amplitude),
                ("simulate.duration_s", &self.duration),
                ("simulate.settle_s", &self.settle),
                ("simulate.step_s", &self.step),
                ("simulate.friction", &self.friction),
                ("simulate.impacts", &self.impacts),
                ("simulate.precision", &self.precision),
            ],
        )?;
        let run = OpenLoopRun::from_scene(&scene)?;
        let is_motor = OpenLoopModel::from_scene(&scene)? == OpenLoopModel::Motor;
        let refused = [("--out", self.out.is_some()), ("--report", self.report.is_asked_for())];
        if let Some((flag, _)) = refused.into_iter().find(|(_, given)| *given && !is_motor) {
            let conflict = format!("simulate.model = {} has no {flag}", scene.choice("simulate.model"));
            let hint = "its few figures are printed, --format json has them all; simulate.model=motor has it";
            return Err(SceneError::Conflict { conflict, hint: hint.to_owned() }.into());
        }
        if is_motor {
            // What is refused is refused before the file is made.
            run.step_counts()?;
            run.note()?.into_iter().for_each(|note| progress::note(&note));
        }
        let request = Request::of_scene("simulate", &scene).with_key_flags(&KEY_FLAGS);
        let record = self.out.as_deref().map(SamplesCsv::create).transpose()?;
        let report_file = self.report.open()?;
        let trace = report_file.as_ref().map(|_| OpenLoopTrace::of(&run));
        let mut observers = (record, trace);
        let result = open_loop::run(&scene, &mut observers)?;
        let (record, trace) = observers;
        record.map_or(Ok(()), SamplesCsv::publish)?;
        if let (Some(file), Some(trace), OpenLoopResult::Motor(report)) = (report_file, trace, &result) {
            file.publish(&html_report(report, &scene, &trace, &close_up(&run)?), &request)?;
        }
        let json = result_json::of(&request, &[], &result.json());
        Ok(files::print(&self.format.of(result.to_string(), json))?)
    }
}

#[derive(Debug, Args)]
pub(super) struct ReproduceArgs {
    /// Folder for reproduce.md, rotors.md and their pictures
    #[arg(long, value_name = "DIR", default_value = "out/reproduce")]
    out: PathBuf,
    /// Runs of each of the paper's motors and of each rotor, each run with a seed of its own; the paper made five
    #[arg(long, value_name = "N", default_value = "5", value_parser = Count(2..=1000), allow_negative_numbers = true)]
    seeds: u64,
    /// Rotors drawn over what was not measured
    #[arg(
        long, value_name = "N", default_value = "40", value_parser = Count(0..=100_000), allow_negative_numbers = true
    )]
    drawn: u64,
    /// Also change one value at a time, in sets F and G and at the paper's values: 91 more rotors
    #[arg(long)]
    changes: bool,
    /// Runs of 0.3 s instead of 2 s: every figure, none of them sharp
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    publication: PublicationArgs,
}

/// The paper's motors, and beside them the rotors that tilt.
#[derive(Serialize)]
struct Reproduced<'a> {
    #[serde(flatten)]
    paper: &'a paper::reproduction::PaperReproduction,
    rotors: &'a rotor_models::RotorModels,
}

impl ReproduceArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let publication = self.publication.open(&self.out)?;
        let time = if self.quick { RunTime::QUICK } else { RunTime::FULL };
        let plan = paper::PaperPlan::new(self.seeds)?.within(time);
        // On standard error, and only if that is a terminal.
        let bar = progress::bar(plan.steps());
        let paper = plan.run(&|steps| bar.inc(steps))?;
        bar.finish_and_clear();
        let plan = rotor_models::RotorModelsPlan::new(self.seeds, self.drawn);
        let plan = plan.with_changes(self.changes).within(time);
        let bar = progress::bar(plan.work());
        let rotors = plan.run(&|| bar.inc(1))?;
        bar.finish_and_clear();
        let findings = Findings {
            files: vec![
                ("reproduce.md".to_owned(), paper.document().markdown()),
                ("rotors.md".to_owned(), rotors.document().markdown()),
            ],
            json: files::json_line(&Reproduced { paper: &paper, rotors: &rotors }),
            report: paper.report(
                (rotors.document(), rotors.drawn.len()),
                [paper.pictures()?, rotors.pictures()].concat(),
            ),
        };
        Ok(publication.publish(findings, &Request::without_scene("reproduce"))?)
    }
}
