//! `position`, `rate`, `positioning-trials` and `response-map`: the loop, and the map that it plans by.

use std::io::Write as _;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;

use super::beside::BesideArgs;
use super::count::Count;
use super::learning::{LearnArgs, NOT_REACHED};
use super::log_args::LogArgs;
use super::publication::{DrawingArgs, Findings, PublicationArgs};
use super::report::{ReportArgs, Request};
use super::shard::{ShardArgs, scene_digest};
use super::{Format, MapArgs, SceneArgs, progress, result_json};
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::report::files;
use crate::run_reports::position::{MoveCost, PictureTrace, ReportTrace};
use crate::run_reports::{position as position_report, rate as rate_report};
use crate::scene_files::COMMISSIONED_TILTING;
use crate::studies::beside::BesideScene;
use crate::studies::held_rates::{self, HeldRates};
use crate::studies::positioning_trials::{
    self, PositioningTrial, PositioningTrials, Strategy, StrategyTrials,
};
use crate::studies::response_map;
use crate::studies::shard::SceneDigest;
use analysis::response_map::ResponseMapCampaign;
use simulation::runs::clock_note::{MOVE_DEG_S, clock_note};
use simulation::runs::rate::PromisedRange;
use simulation::runs::record::Observer as _;
use simulation::runs::{RunError, position};
use simulation::scene::{SceneError, response_map_text};

#[derive(Debug, Default, Args)]
pub(super) struct PositionArgs {
    /// Target angle, clockwise positive
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    to: Option<String>,
    /// Distance from the target that counts as reached
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance: Option<String>,
    /// Print what the move will take, without moving
    #[arg(long, conflicts_with_all = ["out", "report", "log", "learn"])]
    plan: bool,
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    drawing: DrawingArgs,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    learning: LearnArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl PositionArgs {
    /// Shows a newcomer the hardest motor, moved by the map that commissioning has made of it, and says so.
    pub(super) fn first_run() -> Result<(), CommandError> {
        let motor = COMMISSIONED_TILTING;
        progress::note(&format!(
            "a motor that tilts and rubs on its pin, by the map that it was commissioned to: \
             `host-sim position --scene {motor} --map {motor}`"
        ));
        let args = Self {
            learning: LearnArgs::by(MapArgs::commissioned(motor)),
            scene: SceneArgs::named(motor),
            ..Self::default()
        };
        args.execute()
    }

    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.learning.map.provide(self.scene.load(
            "position",
            &[("position.to_deg", &self.to), ("position.tolerance_deg", &self.tolerance)],
        )?)?;
        let plan = position::plan(&scene)?;
        if self.plan {
            return Ok(files::print(&self.drawing.format().of(plan.to_string(), files::json_line(&plan)))?);
        }
        let note = position::note(&scene, plan.expected_s)?;
        let request = Request::of_scene("position", &scene).with_key_flags(&["--to", "--tolerance"]);
        let drawing = self.drawing.open("position.svg")?;
        let report = self.report.open()?;
        let mut log = self.log.open("position", &scene)?;
        let learning = self.learning.open()?;
        // Once nothing refuses the move any more: at its first tick.
        let mut notes = Some([Some(plan.note()), note, clock_note(&scene, MOVE_DEG_S)]);
        let mut learnt = None;
        let mut trace = PictureTrace::default();
        let mut beside = report.as_ref().map(|_| ReportTrace::default());
        let begun = Instant::now();
        let run = position::run_with(&scene, |closed_loop, moment| {
            notes.take().into_iter().flatten().flatten().for_each(|note| progress::note(&note));
            trace.take(moment);
            if learning.is_some() {
                learnt = Some(closed_loop.program().learnt());
            }
            if let Some(beside) = &mut beside {
                beside.observe(&closed_loop.record(moment))?;
            }
            log.observe_made(|| closed_loop.record(moment))
        })?;
        // The trace ends no run early.
        let ControlFlow::Continue(outcome) = run else { return Err(log.stopped().into()) };
        let cost = MoveCost { wall_s: begun.elapsed().as_secs_f64() };
        let json = result_json::of(&request, &[], &files::json_line(&outcome));
        let logged = log.finish(&json)?;
        let svg = position_report::svg(&outcome, &trace)?;
        if let (Some(report), Some(beside)) = (report, &beside) {
            let content = position_report::report(&scene, &plan, &outcome, (&trace, beside), cost);
            report.publish(&content, &request)?;
        }
        drawing.publish(&svg, &format!("{outcome}{logged}"), json)?;
        // Last: a move whose result cannot be written leaves the map as it was, and may be made again.
        if let Some(learning) = learning {
            learning.publish(&scene, learnt.filter(|_| outcome.stopped.is_none()).ok_or(NOT_REACHED))?;
        }
        Ok(())
    }
}

#[derive(Debug, Args)]
pub(super) struct RateArgs {
    /// Rate in deg/s, clockwise positive
    #[arg(long, value_name = "RATE", allow_negative_numbers = true)]
    deg_s: Option<String>,
    /// Course of the rate: dwell, staircase (five steps), `both_ways` (turns both ways with rests) or sweep (a sine)
    #[arg(long, value_name = "PROFILE")]
    profile: Option<String>,
    /// Length of the run in s
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<String>,
    #[command(flatten)]
    beside: BesideArgs,
    #[command(flatten)]
    log: LogArgs,
    #[command(flatten)]
    drawing: DrawingArgs,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl RateArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.map.provide(self.scene.load(
            "rate",
            &[
                ("rate.deg_s", &self.deg_s),
                ("rate.profile", &self.profile),
                ("rate.duration_s", &self.duration),
            ],
        )?)?;
        let beside = self.beside.scenes("rate", &scene, |scene| self.map.provide(scene))?;
        let request =
            Request::of_scene("rate", &scene).with_key_flags(&["--deg-s", "--profile", "--duration"]);
        let drawing = self.drawing.open("rate.svg")?;
        let report_file = self.report.open()?;
        let mut points = Vec::new();
        let mut log = self.log.open("rate", &scene)?;
        // Once nothing refuses the rate any more: at its first tick.
        let promised = promised_range(&PromisedRange::of(&scene)?);
        let mut notes = Some([Some(promised), clock_note(&scene, scene.number("rate.deg_s"))]);
        let ended = held_rates::hold(
            &scene,
            |point| points.push(point),
            |run, moment| {
                notes.take().into_iter().flatten().flatten().for_each(|note| progress::note(&note));
                log.observe_made(|| run.record(moment))
            },
        )?;
        let ControlFlow::Continue(held) = ended else { return Err(log.stopped().into()) };
        let logged = log.finish(&result_json::of(&request, &[], &files::json_line(&held.outcome)))?;
        let svg = rate_report::svg(&held.outcome, &points)?;
        if let Some(file) = report_file {
            let wall_s = held.time_s_per_s * scene.number("rate.duration_s");
            file.publish(&rate_report::report(&scene, &held.outcome, &points, wall_s), &request)?;
        }
        let report = HeldRates::of_one(held, &beside)?;
        let json = result_json::of(&request, &[], &report.json());
        Ok(drawing.publish(&svg, &format!("{report}{logged}"), json)?)
    }
}

/// What is said before a rate is held.
pub(super) fn promised_range(promised: &PromisedRange) -> String {
    format!("note: by its map this motor reaches {promised}")
}

/// Bounds of the sample of positioning trials.
const MOTORS: Count = Count(1..=10_000_000);

#[derive(Debug, Args)]
pub(super) struct PositioningTrialsArgs {
    /// Motors drawn within the tolerances; each makes one move, which is one trial
    #[arg(long, alias = "trials", value_name = "N", default_value = "1000", conflicts_with = "merge")]
    #[arg(value_parser = MOTORS, allow_negative_numbers = true)]
    motors: u64,
    /// Distance from the target that counts as reached; 0.00035 if neither flag nor scene says another
    #[arg(long, value_name = "DEG", allow_negative_numbers = true)]
    tolerance: Option<String>,
    /// Run the simpler strategies and the other filters as well, each on this many motors
    #[arg(long, value_name = "N", value_parser = MOTORS, allow_negative_numbers = true)]
    compare: Option<u64>,
    #[command(flatten)]
    parts: ShardArgs,
    #[command(flatten)]
    beside: BesideArgs,
    /// Folder for positioning-trials.svg and trials.csv
    #[arg(long, value_name = "DIR", default_value = "out/positioning-trials")]
    out: PathBuf,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl PositioningTrialsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.map.provide(
            self.scene.load("positioning-trials", &[("position.tolerance_deg", &self.tolerance)])?,
        )?;
        let request = Request::of_scene("positioning-trials", &scene);
        self.parts.refuse("--compare", self.compare.is_some())?;
        self.parts.refuse("--beside", self.beside.is_given())?;
        // The tolerance of trials is another than that of a move, unless it is set.
        let mut asked = scene.clone();
        asked.set("position.tolerance_deg", &positioning_trials::tolerance_deg(&scene).to_string())?;
        let digest = scene_digest("positioning-trials", [&asked], &self.map)?;
        if let Some(trials) = self.parts.merged(&digest, |trial: &PositioningTrial| trial.number)? {
            let whole = PositioningTrials::alone(&scene, StrategyTrials::merged(&scene, trials));
            let publication = self.publication.open(&self.out)?;
            return Ok(publication.publish(Self::findings(&whole, &digest)?, &request)?);
        }
        let plan = positioning_trials::PositioningTrialsPlan::new(&scene, Strategy::Planned, self.motors)?;
        let plan = plan.part(self.parts.shard)?;
        let beside = self.beside.scenes("positioning-trials", &scene, |scene| self.map.provide(scene))?;
        let beside = BesideScene::run_each(&beside, |scene| {
            positioning_trials::PositioningTrialsPlan::new(scene, Strategy::Planned, self.motors)
        })?;
        let others = match self.compare {
            Some(motors) => positioning_trials::PositioningTrialsPlan::others(&scene, motors)?,
            None => Vec::new(),
        };
        let publication = self.publication.open(&self.out)?;
        let all = std::iter::once(&plan).chain(&others).chain(beside.iter().map(|other| &other.found));
        let work = all.map(positioning_trials::PositioningTrialsPlan::trials).sum();
        let bar = progress::bar(work);
        let progress = |trials| bar.inc(trials);
        let trials = plan.run(&progress)?;
        let others: Result<Vec<_>, RunError> = others.iter().map(|plan| plan.run(&progress)).collect();
        let beside: Result<Vec<_>, RunError> =
            beside.into_iter().map(|other| other.and_then(|plan| plan.run(&progress))).collect();
        let alone = PositioningTrials::alone(&scene, trials);
        let report = PositioningTrials { others: others?, beside: beside?, ..alone };
        bar.finish_and_clear();
        Ok(publication.publish(Self::findings(&report, &digest)?, &request)?)
    }

    fn findings(trials: &PositioningTrials, digest: &SceneDigest) -> Result<Findings, OutputError> {
        Ok(Findings {
            files: vec![("trials.csv".to_owned(), digest.marked(&trials.csv()?)?)],
            json: trials.json(),
            report: trials.report(),
        })
    }
}

#[derive(Debug, Args)]
pub(super) struct ResponseMapArgs {
    /// Motors drawn within the tolerances
    #[arg(long, value_name = "N", default_value = "200")]
    #[arg(value_parser = Count(2..=10_000), allow_negative_numbers = true)]
    motors: u64,
    /// Write the map as Rust source, as the controller keeps it
    #[arg(long, value_name = "FILE.rs")]
    write: Option<PathBuf>,
    /// Write the map as a file for `--map`: JSON if it ends in .json, TOML otherwise
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// How to print the result
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
    #[command(flatten)]
    scene: SceneArgs,
}

impl ResponseMapArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("response-map", &[])?;
        let file = self.write.as_deref().map(files::Output::create).transpose()?;
        let out = self.out.as_deref().map(files::Output::create).transpose()?;
        let campaign = ResponseMapCampaign::new(&scene, self.motors)?;
        let bar = progress::bar(campaign.work());
        let map = campaign.run(&|work| bar.inc(work));
        bar.finish_and_clear();
        if let Some(mut file) = file {
            file.write_all(response_map::source(&map).as_bytes())
                .map_err(|source| file.unwritable(source))?;
            file.publish()?;
        }
        if let Some((mut out, path)) = out.zip(self.out.as_deref()) {
            let value = map.value().map_err(|source| SceneError::NoResponseMap { source })?;
            let text = response_map_text(&value, path);
            out.write_all(text.as_bytes()).map_err(|source| out.unwritable(source))?;
            out.publish()?;
        }
        let json = result_json::of(&Request::of_scene("response-map", &scene), &[], &files::json_line(&map));
        Ok(files::print(&self.format.of(response_map::document(&map).text(), json))?)
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use clap::error::ErrorKind;

    use crate::cli::Cli;

    /// A plan moves nothing: there is nothing to draw, to log or to learn.
    #[test]
    fn exact_what_a_move_writes_is_refused_beside_a_plan() {
        let parsed = |further: &str| {
            let line = format!("host-sim position --to 5 --plan --format json {further}");
            Cli::try_parse_from(line.split_whitespace()).map(|_| ()).map_err(|refusal| refusal.kind())
        };
        for further in ["--report r.html", "--log r.mcap", "--out r.svg", "--map m.toml --learn"] {
            assert_eq!(parsed(further), Err(ErrorKind::ArgumentConflict), "{further}");
        }
        assert_eq!(parsed("--map m.toml"), Ok(()));
    }
}
