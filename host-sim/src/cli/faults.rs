//! `faults`: moves during which things go wrong.

use std::path::PathBuf;

use clap::Args;

use super::beside::BesideArgs;
use super::count::Count;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::shard::{ShardArgs, scene_digest};
use super::{MapArgs, SceneArgs, progress};
use crate::cli::CommandError;
use crate::studies::beside::{BesideScene, FIRST};
use crate::studies::fault_campaign::{FaultCampaign, FaultCampaignPlan, FaultRun};
use crate::studies::shard;

#[derive(Debug, Args)]
pub(super) struct FaultsArgs {
    /// Moves, each with a motor, a target, a filter and faults of its own; shared out among the scenes
    #[arg(long, value_name = "N", default_value = "100", conflicts_with = "merge")]
    #[arg(value_parser = Count(1..=100_000_000), allow_negative_numbers = true)]
    runs: u64,
    #[command(flatten)]
    parts: ShardArgs,
    #[command(flatten)]
    beside: BesideArgs,
    /// Folder for runs.csv
    #[arg(long, value_name = "DIR", default_value = "out/faults")]
    out: PathBuf,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl FaultsArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("faults", &[])?;
        let publication = self.publication.open(&self.out)?;
        let beside = self.beside.scenes("faults", &scene, Ok)?;
        let all = std::iter::once(&scene).chain(beside.iter().map(|beside| &beside.scene));
        let digest = scene_digest("faults", all, &self.map)?;
        let campaign = if let Some(runs) = self.parts.merged(&digest, |run: &FaultRun| run.number)? {
            FaultCampaign { runs }
        } else {
            let scene = self.map.provide(scene.clone())?;
            let beside = self.beside.scenes("faults", &scene, |scene| self.map.provide(scene))?;
            let first = BesideScene { name: FIRST.to_owned(), scene };
            let scenes = std::iter::once(first).chain(beside).collect();
            let plan = FaultCampaignPlan::new(scenes, self.runs, self.parts.shard);
            let bar = progress::bar(plan.work());
            let campaign = plan.run(&|| bar.inc(1))?;
            bar.finish_and_clear();
            campaign
        };
        let findings = Findings {
            files: vec![("runs.csv".to_owned(), digest.marked(&shard::csv(&campaign.runs)?)?)],
            json: campaign.json(),
            report: campaign.report(),
        };
        Ok(publication.publish(findings, &Request::of_scene("faults", &scene))?)
    }
}
