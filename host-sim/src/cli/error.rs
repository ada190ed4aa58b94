//! Every error of the command, as one line that names what is wrong and what to do.

use std::path::PathBuf;

use controller::commissioning::Unfit;
use controller::response_map::MapError;

use crate::board::BoardError;
use crate::board::serial::SerialError;
use crate::log::LogError;
use crate::report::OutputError;
use crate::report::compare::result_file::ResultFileError;
use crate::run_reports;
use crate::studies::identification::IdentificationError;
use crate::studies::stator::StatorStudyError;
use crate::studies::sweep::SweepError;
use crate::tool::ToolError;
use simulation::runs::RunError;

/// Why a command stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// The scene was refused, a run stopped, or its result cannot be given out.
    #[error(transparent)]
    Run(RunError),
    /// The firmware gave no result.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// No move was made on a real board, or it did not end.
    #[error("{error}{kept}")]
    Serial {
        /// Why.
        error: Box<SerialError>,
        /// What is kept of it, with a semicolon before it.
        kept: String,
    },
    /// The log of a run was not written or not read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A file that was to be compared is no result.
    #[error(transparent)]
    Result(#[from] ResultFileError),
    /// `compare` was to refuse a change, and found some.
    #[error("{count} {} beyond noise, or without a measure of chance", if *count == 1 { "change" } else { "changes" })]
    Changed {
        /// How many.
        count: usize,
    },
    /// A sweep was refused, or stopped.
    #[error(transparent)]
    Sweep(#[from] SweepError),
    /// A scheduler did not take a job.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// No motor was identified.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// A motor that was commissioned is not fit for use.
    #[error("the motor is not fit for use: {0}")]
    Unfit(Unfit),
    /// What was to be learnt has no file to be kept in.
    #[error("--learn: {} is no file", path.display())]
    NoMapFile {
        /// The value of `--map`.
        path: PathBuf,
    },
    /// What a board has learnt is that of no motor.
    #[error("the board has learnt what no motor has: {0}")]
    NotLearnt(MapError),
    /// A check of a board does not hold.
    #[error("the board's self-test fails: {}", failed.join(", "))]
    SelfTestFailed {
        /// What of.
        failed: Vec<&'static str>,
    },
    /// There is no stator.
    #[error(transparent)]
    Stator(#[from] StatorStudyError),
    /// Something that this command was built without.
    #[error("{what} is not built into this command")]
    LeftOut {
        /// What was asked for.
        what: &'static str,
        /// The feature of the crate that builds it in.
        feature: &'static str,
    },
}

impl<E: Into<RunError>> From<E> for CommandError {
    fn from(error: E) -> Self {
        Self::Run(error.into())
    }
}

impl From<SerialError> for CommandError {
    fn from(error: SerialError) -> Self {
        Self::Serial { error: Box::new(error), kept: String::new() }
    }
}

impl CommandError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Run(error) => run_reports::hint(error),
            Self::Board(error) => error.hint(),
            Self::Serial { error, .. } => error.hint(),
            Self::Log(error) => error.hint(),
            Self::Result(error) => error.hint(),
            Self::Changed { .. } => None,
            Self::Sweep(error) => error.hint(),
            Self::Tool(ToolError::NoTool { tool, .. }) => {
                Some(format!("{tool} is there where its cluster is"))
            }
            Self::Tool(error) => error.hint(),
            Self::Identification(error) => error.hint(),
            Self::Unfit(_) => {
                Some("`host-sim record` shows what the instruments deliver under each drive".to_owned())
            }
            Self::NoMapFile { .. } => Some(
                "`host-sim commission --out mine` writes mine/map.toml, a map that moves can add to"
                    .to_owned(),
            ),
            Self::NotLearnt(_) => {
                Some("the map is as it was; `host-sim self-test` looks at the board".to_owned())
            }
            Self::SelfTestFailed { .. } => Some("each line of the result that fails has its own".to_owned()),
            Self::Stator(error) => error.hint(),
            Self::LeftOut { feature, .. } => {
                Some(format!("build it with the feature: `cargo run --release --features {feature} -- ...`"))
            }
        }
    }

    /// The exit code: 130 for an interruption, as shells have it, 1 for a change that was to be refused, 2 otherwise.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Log(LogError::Interrupted { .. }) => 130,
            Self::Changed { .. } => 1,
            Self::Serial { error, .. } => error.exit_code(),
            Self::Sweep(error) => error.exit_code(),
            _ => 2,
        }
    }

    /// Whether the reader of standard output has closed it, which is no error of the command.
    pub fn is_broken_pipe(&self) -> bool {
        match self {
            Self::Run(error) | Self::Board(BoardError::Run(error)) => {
                run_reports::output_error(error).is_some_and(OutputError::is_broken_pipe)
            }
            _ => false,
        }
    }

    /// The whole report, on one line.
    pub fn one_line(&self) -> String {
        simulation::scene::one_line(self, self.hint())
    }
}
