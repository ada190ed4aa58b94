//! `commission`: the response map of the motor in front of the controller.

use std::path::{Path, PathBuf};

use clap::Args;
use controller::ResponseMap;

use super::count::Count;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::{MapArgs, SceneArgs, progress};
use crate::cli::CommandError;
use crate::studies::commissioning::{self, CommissioningTrials};
use simulation::runs::commission;
use simulation::scene::response_map_text;

/// Name of the map's file in the folder of `--out`.
const MAP_FILE: &str = "map.toml";

/// Longest motor time, in tenths of a second.
const TENTHS_MAX: u64 = 600;

#[derive(Debug, Args)]
pub(super) struct CommissionArgs {
    /// Commission N drawn motors instead, and move each by the map of its own and by the one that it began with
    #[arg(long, value_name = "N", value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    trials: Option<u64>,
    /// Folder for map.toml, which `position --map` takes, and commissioning.svg; of trials for
    /// commissioning-trials.svg and trials.csv
    #[arg(long, value_name = "DIR", default_value = "out/commission")]
    out: PathBuf,
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
            let trials = CommissioningTrials::run(&scene, count, &|| bar.inc(1))?;
            bar.finish_and_clear();
            let findings = Findings {
                files: vec![("trials.csv".to_owned(), trials.csv()?)],
                json: trials.json(),
                report: trials.report(),
            };
            return Ok(publication.publish(findings, &request)?);
        }
        let bar = progress::bar(TENTHS_MAX);
        let motor = commission::run(&scene, |_| bar.inc(1))?;
        bar.finish_and_clear();
        let map = motor.commissioned.map.map_err(CommandError::Unfit)?;
        let findings = Findings {
            files: vec![(MAP_FILE.to_owned(), map_text(&map))],
            json: commissioning::json(&motor),
            report: commissioning::report(&motor),
        };
        Ok(publication.publish(findings, &request)?)
    }
}

/// The text of the map's file, which says what it is of.
fn map_text(map: &ResponseMap) -> String {
    let text = response_map_text(map, Path::new(MAP_FILE));
    let rows = text.split_once('\n').map_or("", |(_, rows)| rows);
    format!("# The response map of one motor, measured by `host-sim commission`.\n{rows}")
}
