//! `commission`: the response map of the motor in front of the controller, simulated or at a real board.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};
use controller::ResponseMap;

use super::count::Count;
use super::port_args::PortArgs;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::run::LiveView;
use super::{MapArgs, SceneArgs, progress};
use crate::board::serial::{BoardTask, FrameSource, Keeping, SerialRun, TaskFigures};
use crate::cli::CommandError;
use crate::studies::commissioning::{self, CommissioningTrials};
use simulation::runs::commission::{self, CommissionedMotor};
use simulation::scene::{Scene, response_map_text};

/// Name of the map's file in the folder of `--out`.
const MAP_FILE: &str = "map.toml";

/// Longest motor time, in tenths of a second.
const TENTHS_MAX: u64 = 600;

#[derive(Debug, Args)]
pub(super) struct CommissionArgs {
    /// Commission N drawn motors instead, and move each by the map of its own and by the one that it began with
    #[arg(long, value_name = "N", value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    trials: Option<u64>,
    /// Moves of each motor by either map
    #[arg(long, value_name = "N", default_value = "1", requires = "trials")]
    #[arg(value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    moves: u64,
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
        let scene = self.map.provide(self.scene.load("commission", &[])?)?;
        let request = Request::of_scene("commission", &scene);
        let publication = self.publication.open(&self.out)?;
        if let Some(count) = self.trials {
            let bar = progress::bar(count);
            let trials = CommissioningTrials::run(&scene, count, self.moves, &|| bar.inc(1))?;
            bar.finish_and_clear();
            let findings = Findings {
                files: vec![("trials.csv".to_owned(), trials.csv()?)],
                json: trials.json(),
                report: trials.report(),
            };
            return Ok(publication.publish(findings, &request)?);
        }
        let port = self.port.as_ref().map(|port| PortArgs::new(port, self.baud));
        let motor = port.as_ref().map_or_else(|| simulated(&scene), |port| self.at_board(port, &scene))?;
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
            port.keep(&scene.with_response_map(map))?;
        }
        Ok(())
    }

    /// The motor at the board at `port`, whose design, instruments and prior map are those of `scene`.
    fn at_board(&self, port: &PortArgs, scene: &Scene) -> Result<CommissionedMotor, CommandError> {
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
            interrupted: &interrupted,
        };
        let run = run.run(&mut view);
        view.end();
        match run?.task {
            TaskFigures::Commission(figures) => Ok(figures.motor),
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
