//! Why there is no stator.

use stator::solution::StatorError;

use crate::report::OutputError;

/// Why there is no stator, or why it is not shown.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StatorStudyError {
    /// The drawing is refused, CalculiX gave no result, or no stator meets the frequencies.
    #[error(transparent)]
    Stator(#[from] StatorError),
    /// Its result cannot be given out.
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl StatorStudyError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Stator(error) => error.hint().map(str::to_owned),
            Self::Output(error) => error.hint(),
        }
    }
}
