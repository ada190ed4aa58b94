//! Why a study stopped.

use motor_model::OutOfBounds;

use super::step_accuracy::reference::tie_breaking::Stalled;
use crate::report::OutputError;
use crate::runs::RunError;
use crate::scene::SceneError;
use crate::tool::ToolError;

/// Why a study did not start, or did not end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StudyError {
    /// One of the runs stopped.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The result cannot be laid out or written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A program of a comparison gave no answer.
    #[error(transparent)]
    Tool(#[from] ToolError),
    /// The reference integrator gave up.
    #[error(transparent)]
    Stalled(#[from] Stalled),
}

impl StudyError {
    /// What to try instead, if anything.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Run(error) => error.hint(),
            Self::Output(error) => error.hint(),
            Self::Tool(error) => error.hint(),
            Self::Stalled(_) => None,
        }
    }

    /// The whole report, on one line.
    pub fn one_line(&self) -> String {
        crate::scene::one_line(self, self.hint())
    }
}

impl From<SceneError> for StudyError {
    fn from(error: SceneError) -> Self {
        RunError::from(error).into()
    }
}

impl From<OutOfBounds> for StudyError {
    fn from(error: OutOfBounds) -> Self {
        SceneError::from(error).into()
    }
}
