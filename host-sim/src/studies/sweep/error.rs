//! Why a sweep is refused or stops.

use std::path::PathBuf;

use crate::report::OutputError;
use simulation::runs::RunError;
use simulation::scene::SceneError;

/// Why a sweep did not start, or did not end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SweepError {
    /// A key, a value or a whole scene was refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The first row did not run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A file cannot be written or read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// An axis that is not `KEY=MIN..MAX` or `KEY=A,B,C`.
    #[error("--over {text}: {why}")]
    Axis {
        /// The axis as given.
        text: String,
        /// What is wrong.
        why: String,
    },
    /// A plan that cannot be carried out.
    #[error("{why}")]
    Plan {
        /// What is wrong.
        why: String,
        /// What would work.
        hint: &'static str,
    },
    /// No figure was named.
    #[error("a sweep keeps one figure at least, by --figure")]
    Unnamed {
        /// Paths of figures of the command.
        some: Vec<String>,
    },
    /// The result has no number at this path.
    #[error("the result of {command} has no figure {path}")]
    NoFigure {
        /// The command.
        command: &'static str,
        /// The path as given.
        path: String,
        /// Paths that look like it, the most alike first.
        nearest: Vec<String>,
    },
    /// A figure that measures this machine.
    #[error("{path} is a time of this machine, and no two runs have the same")]
    MachineTime {
        /// The path as given.
        path: String,
    },
    /// More than a machine should be asked for.
    #[error("{rows} rows would take {days} days on the {threads} threads of this machine")]
    TooLong {
        /// Rows of this process.
        rows: u64,
        /// Time that they would take, by that of the first row.
        days: String,
        /// Threads.
        threads: usize,
    },
    /// Another process writes in the folder.
    #[error("another sweep writes to {}", folder.display())]
    Locked {
        /// The folder.
        folder: PathBuf,
    },
    /// The folder has a sweep that was not to be gone on with or replaced.
    #[error("{} is there already", path.display())]
    Begun {
        /// Its file.
        path: PathBuf,
    },
    /// The folder has another sweep.
    #[error("{} has another sweep: {difference}", folder.display())]
    OtherSweep {
        /// The folder.
        folder: PathBuf,
        /// The first thing that differs.
        difference: String,
    },
    /// Parts of two sweeps.
    #[error("{} is no part of the sweep in {}: {difference}", folder.display(), first.display())]
    OtherPart {
        /// The folder.
        folder: PathBuf,
        /// The folder of the first part.
        first: PathBuf,
        /// The first thing that differs.
        difference: String,
    },
    /// The folder has no finished part of a sweep.
    #[error("{} has no finished sweep: {why}", folder.display())]
    Unfinished {
        /// The folder.
        folder: PathBuf,
        /// What is missing.
        why: String,
    },
    /// Parts that do not make a whole.
    #[error("the parts are not a whole: {why}")]
    NotWhole {
        /// What is missing or too much.
        why: String,
    },
    /// A row in a file that cannot be read.
    #[error("{}: row {row} is damaged", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The row, from 0.
        row: u64,
    },
    /// The sweep was interrupted.
    #[error("interrupted: {done} of {rows} rows are in {}", folder.display())]
    Interrupted {
        /// Rows that are done.
        done: u64,
        /// Rows of this process.
        rows: u64,
        /// The folder.
        folder: PathBuf,
    },
}

impl SweepError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Scene(error) => error.hint(),
            Self::Run(error) => error.hint(),
            Self::Begun { .. } => Some("--resume goes on with it, --force writes over it".to_owned()),
            Self::Output(error) => error.hint(),
            Self::Axis { .. } => Some(
                "for example --over camera.noise_m=1e-7..1e-5:log, --over camera.marks=2,3,4 or, for a grid of 5 \
                 values, --over ldv.noise_m_s=0..1e-3:5"
                    .to_owned(),
            ),
            Self::Plan { hint, .. } => Some((*hint).to_owned()),
            Self::Unnamed { some } => Some(format!("it has {}", some.join(", "))),
            Self::NoFigure { nearest, .. } if nearest.is_empty() => None,
            Self::NoFigure { nearest, .. } => Some(format!("it has {}", nearest.join(", "))),
            Self::MachineTime { .. } => Some("times.parquet has the time of each row".to_owned()),
            Self::TooLong { .. } => {
                Some(
                    "--shard I/N makes a part, --slurm and --hyperqueue an array of them, --long runs it all the same"
                        .to_owned(),
                )
            }
            Self::Locked { .. } => Some("wait for it, or name another folder by --out".to_owned()),
            Self::OtherSweep { .. } => {
                Some("name another folder by --out; --force writes over this one".to_owned())
            }
            Self::Unfinished { .. } => Some("`sweep --resume` on that part finishes it".to_owned()),
            Self::OtherPart { .. } | Self::NotWhole { .. } => Some("give one folder of each part".to_owned()),
            Self::Damaged { .. } => Some("`sweep --force` makes its rows anew".to_owned()),
            Self::Interrupted { .. } => Some("the same command with --resume goes on".to_owned()),
        }
    }

    /// The exit code: 130 for an interruption, as shells have it, 2 otherwise.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Interrupted { .. }) { 130 } else { 2 }
    }
}
