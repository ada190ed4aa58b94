//! Every error of the command, as one line that names what is wrong and what to do.

use crate::board::BoardError;
use crate::report::OutputError;
use crate::runs::RunError;
use crate::scene::SceneError;
use crate::studies::StudyError;
use crate::tool::ToolError;

/// Why a command stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CommandError {
    /// The scene was refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A run stopped.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A study stopped.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The firmware gave no result.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// Another program gave no result.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// Something that this command was built without.
    #[error("{what} is not built into this command")]
    LeftOut {
        /// What was asked for.
        what: &'static str,
        /// The feature of the crate that builds it in.
        feature: &'static str,
    },
    /// The result cannot be given out.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl CommandError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Scene(error) => error.hint(),
            Self::Run(error) => error.hint(),
            Self::Study(error) => error.hint(),
            Self::Board(error) => error.hint(),
            Self::Tool(error) => error.hint(),
            Self::LeftOut { feature, .. } => {
                Some(format!("build it with the feature: `cargo run --release --features {feature} -- ...`"))
            }
            Self::Output(error) => error.hint(),
        }
    }

    /// Whether the reader of standard output has closed it, which is no error of the command.
    pub fn is_broken_pipe(&self) -> bool {
        match self {
            Self::Output(output)
            | Self::Run(RunError::Output(output))
            | Self::Study(StudyError::Output(output) | StudyError::Run(RunError::Output(output)))
            | Self::Board(BoardError::Output(output) | BoardError::Run(RunError::Output(output))) => {
                output.is_broken_pipe()
            }
            _ => false,
        }
    }

    /// The whole report, on one line.
    pub fn one_line(&self) -> String {
        crate::scene::one_line(self, self.hint())
    }
}
