//! `calibrate`: the gyroscope on the rotor.

use std::path::PathBuf;

use clap::Args;

use super::beside::BesideArgs;
use super::count::Count;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::shard::{ShardArgs, scene_digest};
use super::{MapArgs, SceneArgs, progress};
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::studies::beside::BesideScene;
use crate::studies::gyroscope_calibration::{
    CalibrationOutcome, CalibrationPlan, Calibrations, TurnPlan, with_pilot,
};
use crate::studies::shard::SceneDigest;
use simulation::runs::RunError;

#[derive(Debug, Args)]
pub(super) struct CalibrateArgs {
    /// Calibrations, each of another gyroscope
    #[arg(long, value_name = "N", default_value = "1", conflicts_with = "merge")]
    #[arg(value_parser = Count(1..=1_000_000), allow_negative_numbers = true)]
    runs: u64,
    /// Motors drawn within the tolerances; the gyroscopes are shared out among them, at most one motor a calibration
    #[arg(long, value_name = "N", default_value = "10", conflicts_with = "merge")]
    #[arg(value_parser = Count(1..=100_000), allow_negative_numbers = true)]
    motors: u64,
    /// Motor time of the plan in s, the longest where `calibrate.within_ppm` is set
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    duration: Option<String>,
    /// Folder for calibrate.svg and runs.csv
    #[arg(long, value_name = "DIR", default_value = "out/calibrate")]
    out: PathBuf,
    #[command(flatten)]
    parts: ShardArgs,
    #[command(flatten)]
    beside: BesideArgs,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    map: MapArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl CalibrateArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let settings = [("calibrate.duration_s", &self.duration)];
        let scene = self.map.provide(self.scene.load("calibrate", &settings)?)?;
        self.parts.refuse("--beside", self.beside.is_given())?;
        // The scenes beside have pilots of their own.
        let asked = with_pilot(&scene)?;
        let digest = scene_digest("calibrate", [&asked], &self.map)?;
        let request = Request::of_scene("calibrate", &asked).with_key_flags(&["--duration"]);
        if let Some(outcomes) = self.parts.merged(&digest, |outcome: &CalibrationOutcome| outcome.number)? {
            let publication = self.publication.open(&self.out)?;
            let whole = CalibrationPlan::merged(&scene, outcomes)?;
            return Ok(publication.publish(findings(&whole, &digest)?, &request)?);
        }
        let plan = CalibrationPlan::new(&scene, self.runs, self.motors)?.part(self.parts.shard)?;
        let beside = self.beside.scenes("calibrate", &scene, |scene| self.map.provide(scene))?;
        let beside =
            BesideScene::run_each(&beside, |scene| CalibrationPlan::new(scene, self.runs, self.motors))?;
        let publication = self.publication.open(&self.out)?;
        let motors = std::iter::once(&plan).chain(beside.iter().map(|other| &other.found));
        let motors = motors.map(CalibrationPlan::motors_of_part).sum();
        let bar = progress::bar(motors);
        let progress = || bar.inc(1);
        let told = |plan: &TurnPlan| bar.suspend(|| progress::note(&format!("note: {}", plan.forecast())));
        let mut calibrations = plan.run_told(&progress, &told)?;
        let beside: Result<Vec<_>, RunError> =
            beside.into_iter().map(|other| other.and_then(|plan| plan.run(&progress))).collect();
        calibrations.beside = beside?;
        bar.finish_and_clear();
        Ok(publication.publish(findings(&calibrations, &digest)?, &request)?)
    }
}

fn findings(calibrations: &Calibrations, digest: &SceneDigest) -> Result<Findings, OutputError> {
    Ok(Findings {
        files: vec![("runs.csv".to_owned(), digest.marked(&calibrations.csv()?)?)],
        json: calibrations.json(),
        report: calibrations.report(),
    })
}
