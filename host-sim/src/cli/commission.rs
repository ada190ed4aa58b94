//! `commission`: the response map of the motor in front of the controller, simulated or at a real board.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};
use controller::ResponseMap;

use super::count::Count;
use super::port_args::PortArgs;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::run::LiveView;
use super::shard::{ShardArgs, scene_digest};
use super::{MapArgs, SceneArgs, progress};
use crate::board::serial::{
    BoardTask, FrameSource, Keeping, ReportPeriod, SerialOutcome, SerialRun, TaskFigures,
};
use crate::cli::CommandError;
use crate::studies::commissioning::{self, CommissioningTrial, CommissioningTrials, CommissioningTrialsPlan};
use crate::studies::shard::{self, SceneDigest};
use simulation::runs::commission::{self, CommissionedMotor};
use simulation::scene::{Scene, SceneError, response_map_text};

/// Name of the map's file in the folder of `--out`.
const MAP_FILE: &str = "map.toml";

/// What `--merge` takes of a part of trials: the figures of the whole need every move.
const PART_FILE: &str = "trials.postcard";

/// Longest motor time, in tenths of a second.
const TENTHS_MAX: u64 = 600;

#[derive(Debug, Args)]
pub(super) struct CommissionArgs {
    /// Commission N drawn motors instead, and move each by the map of its own and by the one that it began with
    #[arg(long, value_name = "N", value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    #[arg(conflicts_with = "merge")]
    trials: Option<u64>,
    /// Moves of each motor by either map
    #[arg(long, value_name = "N", default_value = "1", requires = "trials")]
    #[arg(value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    moves: u64,
    #[command(flatten)]
    parts: ShardArgs,
    /// Folder for map.toml, which `position --map` takes, and commissioning.svg; of trials for
    /// commissioning-trials.svg and trials.csv
    #[arg(long, value_name = "DIR", default_value = "out/commission")]
    out: PathBuf,
    /// Commission the motor at the board at this serial port, for example /dev/ttyACM0
    #[arg(long, value_name = "PORT", value_hint = ValueHint::FilePath, conflicts_with = "trials")]
    port: Option<String>,
    /// Rate of the line
    #[arg(
        long,
        value_name = "N",
        default_value = "2000000",
        allow_negative_numbers = true,
        requires = "port"
    )]
    #[arg(value_parser = Count(1200..=12_000_000))]
    baud: u64,
    /// Where camera frames come from, as of `run`
    #[arg(long, value_name = "SOURCE", default_value = "plant", requires = "port")]
    camera: String,
    /// Let the board keep the map over a loss of power, with the description of its bench
    #[arg(long, requires = "port")]
    keep: bool,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl CommissionArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        self.check_parts()?;
        let scene = self.map.provide(self.scene.load("commission", &[])?)?;
        if self.trials.is_some() || self.parts.is_merge() {
            return self.many_motors(&scene);
        }
        let request = Request::of_scene("commission", &scene);
        let publication = self.publication.open(&self.out)?;
        let port = self.port.as_ref().map(|port| PortArgs::new(port, self.baud));
        let (motor, clock_error_us) = match &port {
            Some(port) => self.at_board(port, &scene)?,
            None => (simulated(&scene)?, 0),
        };
        let findings = Findings {
            files: motor.commissioned.map.iter().map(|map| (MAP_FILE.to_owned(), map_text(map))).collect(),
            json: commissioning::json(&motor),
            report: commissioning::report(&motor),
        };
        // What was measured of a motor that is not fit for use shows why.
        publication.publish(findings, &request)?;
        let map = motor.commissioned.map.map_err(CommandError::Unfit)?;
        // The map is written first: a board that does not keep it costs no measurement.
        if let Some(port) = port.filter(|_| self.keep) {
            port.keep(&scene.with_response_map(map), clock_error_us)?;
        }
        Ok(())
    }

    /// Refuses parts of what is not made in parts: one motor.
    fn check_parts(&self) -> Result<(), SceneError> {
        let hint = "--trials N commissions many motors, of which --shard takes a part".to_owned();
        let refused =
            |conflict: &str| SceneError::Conflict { conflict: conflict.to_owned(), hint: hint.clone() };
        if self.parts.is_part() && self.trials.is_none() {
            return Err(refused("--shard without --trials: one motor is not commissioned in parts"));
        }
        if self.parts.is_merge() && self.port.is_some() {
            return Err(refused("--merge with --port: the motor at a board is not commissioned in parts"));
        }
        Ok(())
    }

    /// The trials of many motors: those of this part, or of all parts together.
    fn many_motors(&self, scene: &Scene) -> Result<(), CommandError> {
        let digest = scene_digest("commission", [scene], &self.map)?;
        let number = |trial: &CommissioningTrial| trial.number;
        let merged = self.parts.merged_by(shard::unpacked, &digest, number)?;
        let merged = merged.map(CommissioningTrials::merged).transpose()?;
        let publication = self.publication.open(&self.out)?;
        let trials = match merged {
            Some(trials) => trials,
            None => self.run_trials(scene, &digest)?,
        };
        let findings = Findings {
            files: vec![("trials.csv".to_owned(), trials.csv()?)],
            json: trials.json(),
            report: trials.report(),
        };
        Ok(publication.publish(findings, &Request::of_scene("commission", scene))?)
    }

    /// Makes the trials of this part, and writes what `--merge` takes of it.
    fn run_trials(&self, scene: &Scene, digest: &SceneDigest) -> Result<CommissioningTrials, CommandError> {
        let (motors, part) = (self.trials.unwrap_or(1), self.parts.shard);
        let plan = CommissioningTrialsPlan { motors, moves: self.moves, part };
        let bar = progress::bar(plan.work());
        let trials = CommissioningTrials::run(scene, plan, &|| bar.inc(1))?;
        bar.finish_and_clear();
        self.parts.write_packed(&self.out.join(PART_FILE), digest, &trials.trials)?;
        Ok(trials)
    }

    /// The motor at the board at `port`, whose design, instruments and prior map are those of `scene`, and the error of
    /// the clock in us of which its filter was told.
    fn at_board(&self, port: &PortArgs, scene: &Scene) -> Result<(CommissionedMotor, u16), CommandError> {
        let (interrupted, source) = (port.watch()?, FrameSource::named(&self.camera));
        let mut view = LiveView::new(None);
        let run = SerialRun {
            port: &port.port,
            baud: port.baud(),
            scene,
            task: BoardTask::Commission,
            then: &[],
            keeping: Keeping::Untouched,
            source: &source,
            reports: ReportPeriod::needed(&source, false),
            interrupted: &interrupted,
        };
        let run = run.run(&mut view);
        view.end();
        let SerialOutcome { task, session, .. } = run?;
        match task {
            TaskFigures::Commission(figures) => Ok((figures.motor, session.description.clock_error_us)),
            TaskFigures::Move(_) | TaskFigures::Rate(_) => unreachable!("it was asked to commission"),
        }
    }
}

/// The motor that the scene's seed draws.
fn simulated(scene: &Scene) -> Result<CommissionedMotor, CommandError> {
    let bar = progress::bar(TENTHS_MAX);
    let motor = commission::run(scene, |_| bar.inc(1))?;
    bar.finish_and_clear();
    Ok(motor)
}

/// The text of the map's file, which says what it is of.
fn map_text(map: &ResponseMap) -> String {
    let text = response_map_text(map, Path::new(MAP_FILE));
    let rows = text.split_once('\n').map_or("", |(_, rows)| rows);
    format!("# The response map of one motor, measured by `host-sim commission`.\n{rows}")
}
