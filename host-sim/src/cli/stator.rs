//! `stator`: the stator by finite elements, as drawn, fitted to frequencies, or many drawn at random.

use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueHint};

use super::count::Count;
use super::publication::{Findings, PublicationArgs};
use super::report::Request;
use super::shard::{ShardArgs, scene_digest};
use super::{MapArgs, SceneArgs, progress};
use crate::cli::CommandError;
use crate::studies::shard::{self, SceneDigest};
use crate::studies::stator::members::{self, Ensemble};
use crate::studies::stator::solver::Solver;
use crate::studies::stator::{SolvedStator, StatorStudyError, drawing, given_motor, wanted};
use simulation::scene::Scene;
use stator::ensemble::Member;

/// Where CalculiX is, and what it may take.
#[derive(Debug, Args)]
pub(super) struct SolverArgs {
    /// CalculiX: a program that is looked for, or a path
    #[arg(long, value_name = "PROGRAM", default_value = "ccx", value_hint = ValueHint::CommandName)]
    ccx: PathBuf,
    /// Longest time of one solution, in s
    #[arg(long, value_name = "S", default_value = "600")]
    #[arg(value_parser = Count(1..=86_400), allow_negative_numbers = true)]
    limit: u64,
    /// Folder that keeps solutions, so that the same stator is solved once; it may be removed at any time
    #[arg(long, value_name = "DIR", default_value = "out/stator/solved", value_hint = ValueHint::DirPath)]
    cache: PathBuf,
}

impl SolverArgs {
    fn solver(&self) -> Solver {
        Solver {
            program: self.ccx.clone(),
            limit: Duration::from_secs(self.limit),
            cache: Some(self.cache.clone()),
        }
    }
}

/// The flags of `stator`.
#[derive(Debug, Args)]
pub(super) struct StatorArgs {
    /// Find thickness and springs that meet the frequencies of the design: keys `motor.mode_a.frequency_hz`, b and c
    #[arg(long)]
    fit: bool,
    /// Draw N stators over what is not published, and fit each
    #[arg(long, value_name = "N", conflicts_with_all = ["fit", "merge"])]
    #[arg(value_parser = Count(1..=10_000), allow_negative_numbers = true)]
    ensemble: Option<u64>,
    #[command(flatten)]
    parts: ShardArgs,
    #[command(flatten)]
    solver: SolverArgs,
    /// Folder for pictures, for motor.toml and, of an ensemble, for members.csv, where a stator that cannot be solved
    /// is a row with its reason
    #[arg(long, value_name = "DIR", default_value = "out/stator")]
    out: PathBuf,
    #[command(flatten)]
    publication: PublicationArgs,
    #[command(flatten)]
    scene: SceneArgs,
}

impl StatorArgs {
    pub(super) fn execute(&self) -> Result<(), CommandError> {
        let scene = self.scene.load("stator", &[])?;
        let publication = self.publication.open(&self.out)?;
        let digest = scene_digest("stator", [&scene], &MapArgs::default())?;
        let merged = self.parts.merged(&digest, |member: &Member| member.number)?;
        let findings = match (merged, self.ensemble) {
            (Some(members), _) => of_ensemble(&Ensemble { members }, &digest)?,
            (None, Some(count)) => of_ensemble(&self.draw(&scene, count)?, &digest)?,
            (None, None) => {
                self.parts.refuse("one stator", true)?;
                self.one(&scene)?
            }
        };
        Ok(publication.publish(findings, &Request::of_scene("stator", &scene))?)
    }

    fn draw(&self, scene: &Scene, count: u64) -> Result<Ensemble, CommandError> {
        let numbers = members::numbers(self.parts.shard, count)?;
        let bar = progress::bar(numbers.len() as u64);
        let ensemble =
            Ensemble::run(&drawing(scene), &wanted(scene), &self.solver.solver(), numbers, &|| bar.inc(1))?;
        bar.finish_and_clear();
        Ok(ensemble)
    }

    fn one(&self, scene: &Scene) -> Result<Findings, CommandError> {
        let (drawing, solver) = (drawing(scene), self.solver.solver());
        let solved = if self.fit {
            let spinner = progress::bar(0);
            let fitted = SolvedStator::fitted(&drawing, &wanted(scene), &solver, &mut || spinner.inc(1));
            spinner.finish_and_clear();
            fitted
        } else {
            SolvedStator::as_drawn(&drawing, &solver)
        };
        let solved = solved.map_err(StatorStudyError::from)?.of_design(scene);
        Ok(Findings {
            files: vec![
                ("motor.toml".to_owned(), solved.motor_scene(&given_motor(scene))),
                ("drawing.toml".to_owned(), solved.drawing_scene()),
            ],
            json: solved.json(),
            report: solved.report(),
        })
    }
}

fn of_ensemble(ensemble: &Ensemble, digest: &SceneDigest) -> Result<Findings, CommandError> {
    Ok(Findings {
        files: vec![
            ("members.csv".to_owned(), digest.marked(&shard::csv(&ensemble.members)?)?),
            ("motor.toml".to_owned(), ensemble.motor_scene()),
        ],
        json: ensemble.json(),
        report: ensemble.report(),
    })
}
