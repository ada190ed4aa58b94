//! `instruments`: moves under many cameras and vibrometers.

use std::path::PathBuf;

use clap::Args;

use super::count::Count;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::shard::{ShardArgs, scene_digest};
use super::{MapArgs, SceneArgs, progress};
use crate::cli::CommandError;
use crate::studies::instrument_grid::{GridMove, InstrumentGrid, InstrumentGridPlan, benches};
use crate::studies::shard;

#[derive(Debug, Args)]
pub(super) struct InstrumentsArgs {
    /// Motors drawn within the tolerances for each of the four targets, each tried on every bench
    #[arg(long, value_name = "N", default_value = "20", conflicts_with = "merge")]
    #[arg(value_parser = Count(1..=10_000), allow_negative_numbers = true)]
    motors: u64,
    /// Only benches whose name contains this
    #[arg(long, value_name = "TEXT", default_value = "", value_parser = part_of_a_name, conflicts_with = "merge")]
    only: String,
    #[command(flatten)]
    parts: ShardArgs,
    /// Folder for instruments.svg and moves.csv
    #[arg(long, value_name = "DIR", default_value = "out/instruments")]
    out: PathBuf,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

/// Refuses what is part of no bench's name.
fn part_of_a_name(text: &str) -> Result<String, String> {
    let benches = benches();
    if benches.iter().any(|bench| bench.name.contains(text)) {
        return Ok(text.to_owned());
    }
    let names: Vec<&str> = benches.iter().map(|bench| bench.name.as_str()).collect();
    Err(format!("no bench has that in its name: {}", names.join(", ")))
}

impl InstrumentsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("instruments", &[])?;
        let digest = scene_digest("instruments", [&scene], &MapArgs::default())?;
        let publication = self.publication.open(&self.out)?;
        let grid = if let Some(moves) = self.parts.merged(&digest, |made: &GridMove| made.number)? {
            InstrumentGrid { moves }
        } else {
            let plan = InstrumentGridPlan::new(&scene, self.motors, &self.only, self.parts.shard);
            let bar = progress::bar(plan.work());
            let grid = plan.run(&|| bar.inc(1))?;
            bar.finish_and_clear();
            grid
        };
        let findings = Findings {
            files: vec![("moves.csv".to_owned(), digest.marked(&shard::csv(&grid.moves)?)?)],
            json: grid.json(),
            report: grid.report(),
        };
        Ok(publication.publish(findings, &Request::of_scene("instruments", &scene))?)
    }
}
