//! `estimate` and `filters`: the filters against the truth, and what they cost.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};

use super::beside::BesideArgs;
use super::count::Count;
use super::microcontroller::count_instructions;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::shard::{ShardArgs, scene_digest};
use super::{MapArgs, SceneArgs, progress};
use crate::board::qemu::Board;
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::studies::beside::BesideScene;
use crate::studies::filter_costs;
use crate::studies::filter_errors::{ComparedMotor, FilterErrors, FilterErrorsPlan};
use crate::studies::shard;
use analysis::filter_errors::told::ToldPart;
use simulation::runs::RunError;

#[derive(Debug, Args)]
pub(super) struct EstimateArgs {
    /// Motors drawn within the tolerances, each run in both modes
    #[arg(long, alias = "plants", value_name = "N", default_value = "100", conflicts_with = "merge")]
    #[arg(value_parser = Count(1..=10_000), allow_negative_numbers = true)]
    motors: u64,
    /// Folder for estimate.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/estimate")]
    out: PathBuf,
    /// Filters beside that are told these parts of the truth: each alone, all but each, and all
    #[arg(long, value_name = "PART,...", value_delimiter = ',', num_args = 1..)]
    #[arg(value_parser = told_part(), conflicts_with = "merge")]
    told: Vec<ToldPart>,
    #[command(flatten)]
    parts: ShardArgs,
    #[command(flatten)]
    beside: BesideArgs,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

/// Reads a word of [`ToldPart`].
fn told_part() -> impl TypedValueParser<Value = ToldPart> {
    let words = ToldPart::ALL.map(|part| PossibleValue::new(part.name()).help(part.meaning()));
    PossibleValuesParser::new(words).try_map(|word| {
        ToldPart::ALL.into_iter().find(|part| part.name() == word).ok_or("no part of the truth")
    })
}

impl EstimateArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("estimate", &[])?;
        self.parts.refuse("--beside", self.beside.is_given())?;
        let request = Request::of_scene("estimate", &scene);
        let digest = scene_digest("estimate", [&scene], &MapArgs::default())?;
        let number = |motor: &ComparedMotor| motor.number;
        if let Some(motors) = self.parts.merged_by(shard::unpacked, &digest, number)? {
            let publication = self.publication.open(&self.out)?;
            return Ok(publication.publish(findings(&FilterErrors::of(&motors))?, &request)?);
        }
        let plan = FilterErrorsPlan::of_part(&scene, self.motors, self.parts.shard)?.with_told(&self.told)?;
        let beside = self.beside.scenes("estimate", &scene, Ok)?;
        let beside = BesideScene::run_each(&beside, |scene| {
            FilterErrorsPlan::new(scene, self.motors)?.with_told(&self.told)
        })?;
        let publication = self.publication.open(&self.out)?;
        let work = beside.iter().map(|other| other.found.milliseconds()).sum::<u64>() + plan.milliseconds();
        let bar = progress::bar(work);
        let progress = |milliseconds| bar.inc(milliseconds);
        let motors = plan.compared(&progress)?;
        let beside: Result<Vec<_>, RunError> =
            beside.into_iter().map(|other| other.and_then(|plan| plan.run(&progress))).collect();
        bar.finish_and_clear();
        self.parts.write_packed(&self.out.join(PART_FILE), &digest, &motors)?;
        Ok(publication.publish(findings(&FilterErrors::of(&motors).with_beside(beside?))?, &request)?)
    }
}

/// What `--merge` takes of a part: the quantiles of the whole need every error.
const PART_FILE: &str = "motors.postcard";

fn findings(estimation: &FilterErrors) -> Result<Findings, OutputError> {
    Ok(Findings {
        files: vec![("table.csv".to_owned(), estimation.csv()?)],
        json: estimation.json(),
        report: estimation.report(),
    })
}

#[derive(Debug, Args)]
pub(super) struct FiltersArgs {
    /// Motors drawn within the tolerances, each run in both modes
    #[arg(long, alias = "plants", value_name = "N", default_value = "20")]
    #[arg(value_parser = Count(1..=10_000), allow_negative_numbers = true)]
    motors: u64,
    /// Leave the microcontroller's instructions out: neither the cross compiler nor the emulator is needed then
    #[arg(long)]
    host_only: bool,
    /// Folder for filters.svg and table.csv
    #[arg(long, value_name = "DIR", default_value = "out/filters")]
    out: PathBuf,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl FiltersArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("filters", &[])?;
        let plan = filter_costs::FilterCostsPlan::new(&scene, self.motors, filter_costs::ROUNDS)?;
        let publication = self.publication.open(&self.out)?;
        let counts = if self.host_only { None } else { Some(count_instructions(None, Board::M4)?) };
        let bar = progress::bar(plan.recordings());
        let comparison = plan.run(counts.as_ref(), &|| bar.inc(1))?;
        bar.finish_and_clear();
        let findings = Findings {
            files: vec![("table.csv".to_owned(), comparison.csv()?)],
            json: comparison.json(),
            report: comparison.report(),
        };
        Ok(publication.publish(findings, &Request::of_scene("filters", &scene))?)
    }
}
