//! `sweep --slurm` and `sweep --hyperqueue`: a sweep as an array of jobs, a part in each.
//!
//! | file in the folder | content |
//! |---|---|
//! | `scene.toml` | what the scene sets |
//! | `sweep.sh` | one part: its number is the first argument, or that of the task of Slurm or `HyperQueue` |
//! | `merge.sh` | puts the parts together |
//! | `job.json` | the sweep and its number of parts, so that `--resume` submits the same parts again |
//! | `parts/1`, `parts/2`, ... | the parts, each a sweep with `--shard` and `--resume` |
//!
//! A part that is stopped, or whose node is lost, is queued again and goes on where it was. One that is done ends at
//! once.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use clap::Args;
use serde::Serialize;
use serde_json::{Value, json};

use super::count::Count;
use super::report::quoted;
use crate::cli::CommandError;
use crate::report::OutputError;
use crate::report::files::{self, OutputFolder};
use crate::studies::sweep::{SweepCost, SweepError, SweepPlan};
use crate::tool::{ToolError, run_within};

/// Tasks of an array of Slurm that no configuration refuses: `MaxArraySize` is 1001, and numbers begin at 0.
const SLURM_TASKS_MAX: u64 = 1000;
/// Tasks of an array of `HyperQueue`.
const HYPERQUEUE_TASKS_MAX: u64 = 100_000;

/// Time that a scheduler has to take a job.
const SUBMIT_LIMIT: Duration = Duration::from_secs(120);

/// File of the sweep and its number of parts.
const JOB_FILE: &str = "job.json";

/// How a sweep is spread over machines.
#[derive(Debug, Args)]
pub(super) struct ClusterArgs {
    /// Write the sweep as an array of Slurm jobs to the folder, submit it, and a job after it that merges the parts
    #[arg(long, conflicts_with_all = ["hyperqueue", "shard", "force"])]
    slurm: bool,
    /// Write the sweep as an array of `HyperQueue` tasks to the folder, and submit it
    #[arg(long, conflicts_with_all = ["shard", "force"])]
    hyperqueue: bool,
    /// Time in s that a part of an array shall take, by measured rows: it says how many parts there are
    #[arg(long, value_name = "S", default_value = "1800")]
    #[arg(value_parser = Count(1..=10_000_000), allow_negative_numbers = true)]
    part_time: u64,
    /// Processors of a part
    #[arg(long, value_name = "N", default_value = "1", value_parser = Count(1..=10_000), allow_negative_numbers = true)]
    cpus: u64,
}

/// A scheduler of jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scheduler {
    Slurm,
    HyperQueue,
}

/// What a sweep needs to be made in parts.
pub(super) struct SweepJob<'a> {
    /// The plan.
    pub plan: &'a SweepPlan,
    /// Words of the command that makes the sweep, without scene, part and folder.
    pub words: Vec<String>,
    /// What the scene sets, as a scene file.
    pub scene: String,
    /// The folder of the sweep.
    pub out: &'a Path,
    /// Whether the parts that are there go on.
    pub resume: bool,
}

/// What was submitted; JSON by its field names.
#[derive(Serialize)]
pub(super) struct Submission {
    folder: PathBuf,
    parts: u64,
    cost: SweepCost,
    /// What the scheduler said of the parts, and of the job that merges them.
    submitted: String,
    merge: Option<String>,
}

impl ClusterArgs {
    /// The scheduler that was asked for.
    pub(super) fn scheduler(&self) -> Option<Scheduler> {
        match (self.slurm, self.hyperqueue) {
            (true, _) => Some(Scheduler::Slurm),
            (_, true) => Some(Scheduler::HyperQueue),
            _ => None,
        }
    }

    /// Processors of a row.
    pub(super) fn cpus(&self) -> usize {
        usize::try_from(self.cpus).unwrap_or(1)
    }

    /// Writes the scripts of `job` and submits them.
    ///
    /// # Errors
    /// When the folder has another sweep, a file cannot be written, or the scheduler refuses a job.
    pub(super) fn submit(&self, scheduler: Scheduler, job: &SweepJob) -> Result<Submission, CommandError> {
        let described = job.plan.described();
        let earlier = earlier_parts(job.out, &described)?;
        if earlier.is_some() && !job.resume {
            return Err(SweepError::Begun { path: job.out.join(JOB_FILE) }.into());
        }
        let cost = job.plan.cost(self.cpus())?;
        let most = match scheduler {
            Scheduler::Slurm => SLURM_TASKS_MAX,
            Scheduler::HyperQueue => HYPERQUEUE_TASKS_MAX,
        };
        #[expect(clippy::cast_precision_loss, reason = "at most 1e7")]
        let parts = earlier.unwrap_or_else(|| cost.parts(self.part_time as f64, most));
        let folder = OutputFolder::create(job.out)?;
        let out = absolute(job.out)?;
        OutputFolder::create(&out.join("parts"))?;
        let file = |name: &str, text: String| (name.to_owned(), text);
        folder.publish(&[
            file("scene.toml", job.scene.clone()),
            file("sweep.sh", self.script_of_a_part(job, &out, parts)?),
            file("merge.sh", script_of_merging(&out)?),
            file(JOB_FILE, format!("{:#}\n", json!({"sweep": described, "parts": parts}))),
        ])?;
        let (submitted, merge) = match scheduler {
            Scheduler::Slurm => {
                let submitted = sbatch(&[], &out.join("sweep.sh"))?;
                let after = format!("--dependency=afterok:{submitted}");
                let merge = sbatch(&[&after], &out.join("merge.sh"))?;
                (submitted, Some(merge))
            }
            Scheduler::HyperQueue => (self.hq_submit(&out, parts)?, None),
        };
        Ok(Submission { folder: job.out.to_owned(), parts, cost, submitted, merge })
    }

    /// One part. Slurm sends its signal to this script, which hands it on: the part then keeps what is done, and the
    /// script has it queued again.
    fn script_of_a_part(&self, job: &SweepJob, out: &Path, parts: u64) -> Result<String, CommandError> {
        let Self { cpus, part_time, .. } = self;
        // Twice the time that was measured, and five minutes.
        let minutes = part_time.div_ceil(30) + 5;
        let (program, here, out) =
            (path_text(&program()?), path_text(&absolute(Path::new("."))?), path_text(out));
        let words: Vec<String> = job.words.iter().map(|word| quoted(word)).collect();
        let words = words.join(" ");
        Ok(format!(
            r#"#!/bin/bash
#SBATCH --job-name=sweep
#SBATCH --array=1-{parts}
#SBATCH --cpus-per-task={cpus}
#SBATCH --time={minutes}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:TERM@60
#SBATCH --output={out}/parts/%a.log
# One of {parts} parts: its number is the first argument, or that of the task of Slurm or HyperQueue.
# Run again, a part goes on where it was.
set -uo pipefail
part=${{1:-${{SLURM_ARRAY_TASK_ID:-${{HQ_TASK_ID:?the number of a part}}}}}}
cd {here} || exit
export RAYON_NUM_THREADS={cpus}
{program} {words} --scene {out}/scene.toml \
    --shard "$part/{parts}" --resume --out {out}/parts/"$part" --quiet &
child=$!
trap 'kill -TERM "$child"' TERM
wait "$child"
code=$?
# A signal to this script ends the wait before the part.
while kill -0 "$child" 2>/dev/null; do
    wait "$child"
    code=$?
done
if ((code == 130)) && [[ -n ${{SLURM_ARRAY_JOB_ID:-}} ]] && ((${{SLURM_RESTART_COUNT:-0}} < 100)); then
    # The task alone: the number of one of the tasks is that of the whole array.
    scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
fi
exit "$code"
"#
        ))
    }

    /// Submits the parts to `HyperQueue`.
    fn hq_submit(&self, out: &Path, parts: u64) -> Result<String, ToolError> {
        let mut command = Command::new("hq");
        let log = out.join("parts/%{TASK_ID}.log");
        command.args([
            "submit",
            "--name=sweep",
            &format!("--array=1-{parts}"),
            &format!("--cpus={}", self.cpus),
        ]);
        command.arg("--stdout=none").arg(format!("--stderr={}", log.display()));
        command.args(["--", "bash"]).arg(out.join("sweep.sh"));
        run_within(&mut command, "hq", SUBMIT_LIMIT).map(|said| said.trim().to_owned())
    }
}

/// The parts of the sweep in a folder, if there is one.
fn earlier_parts(out: &Path, described: &Value) -> Result<Option<u64>, SweepError> {
    let path = out.join(JOB_FILE);
    if !path.exists() {
        return Ok(None);
    }
    let job: Value = serde_json::from_slice(&files::read(&path)?).unwrap_or_default();
    if job["sweep"] != *described {
        let difference = format!("{JOB_FILE} is of other keys, figures or points");
        return Err(SweepError::OtherSweep { folder: out.to_owned(), difference });
    }
    Ok(job["parts"].as_u64())
}

fn script_of_merging(out: &Path) -> Result<String, CommandError> {
    let (program, out) = (path_text(&program()?), path_text(out));
    Ok(format!(
        r"#!/bin/bash
#SBATCH --job-name=merge
#SBATCH --cpus-per-task=1
#SBATCH --time=60
#SBATCH --output={out}/merge.log
exec {program} merge {out}/parts/*/ --out {out} --force
"
    ))
}

/// Submits a script to Slurm; the number of its job.
fn sbatch(flags: &[&str], script: &Path) -> Result<String, ToolError> {
    let mut command = Command::new("sbatch");
    command.arg("--parsable").args(flags).arg(script);
    let said = run_within(&mut command, "sbatch", SUBMIT_LIMIT)?;
    // With several clusters the name of one follows.
    Ok(said.trim().split(';').next().unwrap_or_default().to_owned())
}

fn program() -> Result<PathBuf, CommandError> {
    let unreadable = |source| OutputError::Unreadable { path: PathBuf::from("host-sim"), source };
    Ok(std::env::current_exe().map_err(unreadable)?)
}

fn absolute(path: &Path) -> Result<PathBuf, CommandError> {
    Ok(std::path::absolute(path)
        .map_err(|source| OutputError::Unreadable { path: path.to_owned(), source })?)
}

/// A path as a shell takes it.
fn path_text(path: &Path) -> String {
    quoted(&path.to_string_lossy())
}

impl Submission {
    /// For people.
    pub(super) fn text(&self) -> String {
        let Self { folder, parts, cost, submitted, merge } = self;
        let folder = folder.display();
        let after = match merge {
            Some(merge) => {
                format!("merged by     {merge}, when all are done; the whole is then in {folder}\n")
            }
            None => {
                format!("merge         host-sim merge {folder}/parts/*/ --out {folder}, when all are done\n")
            }
        };
        format!(
            "rows          {}, of {:.3e} s each\nparts         {parts}, each runs again by {folder}/sweep.sh NUMBER\n\
             submitted     {submitted}\n{after}",
            cost.rows, cost.row_s
        )
    }
}
