//! What is shown of one run: its picture, its report as a page, its samples as a table.

pub mod open_loop;
pub(crate) mod parts;
pub mod position;
pub mod rate;

use simulation::runs::RunError;

use crate::report::OutputError;

/// A run stops when what takes its results can take no more.
impl From<OutputError> for RunError {
    fn from(error: OutputError) -> Self {
        Self::Output(Box::new(error))
    }
}

/// Why the results of a run were not taken, if that is why it stopped.
pub(crate) fn output_error(error: &RunError) -> Option<&OutputError> {
    match error {
        RunError::Output(error) => error.downcast_ref(),
        _ => None,
    }
}

/// What to try instead of a run that stopped, where there is something to say.
pub(crate) fn hint(error: &RunError) -> Option<String> {
    output_error(error).map_or_else(|| error.hint(), OutputError::hint)
}
