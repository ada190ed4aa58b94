//! `commission`: the response map of the motor in front of the controller.

use std::path::{Path, PathBuf};

use clap::Args;

use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::{MapArgs, SceneArgs, progress};
use crate::cli::CommandError;
use crate::studies::commissioning;
use simulation::runs::commission;
use simulation::scene::response_map_text;

/// Name of the map's file in the folder of `--out`.
const MAP_FILE: &str = "map.toml";

/// Longest motor time, in tenths of a second.
const TENTHS_MAX: u64 = 600;

#[derive(Debug, Args)]
pub(super) struct CommissionArgs {
    /// Folder for map.toml, which `position --map` takes, and commissioning.svg
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
        let bar = progress::bar(TENTHS_MAX);
        let motor = commission::run(&scene, |_| bar.inc(1))?;
        bar.finish_and_clear();
        let map = motor.commissioned.map.map_err(CommandError::Unfit)?;
        let findings = Findings {
            files: vec![(MAP_FILE.to_owned(), response_map_text(&map, Path::new(MAP_FILE)))],
            json: commissioning::json(&motor),
            report: commissioning::report(&motor),
        };
        Ok(publication.publish(findings, &request)?)
    }
}
