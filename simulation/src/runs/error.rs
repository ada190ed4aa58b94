//! Why a run stopped.

use motor_model::OutOfBounds;

use crate::scene::SceneError;

/// Why a run did not start, or did not end.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The scene was refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// What takes the results of the run can take no more.
    #[error(transparent)]
    Output(Box<dyn std::error::Error + Send + Sync>),
    /// A number of the run is not finite.
    #[error("the run diverged: {quantity} is no longer finite after {time_s} s")]
    Diverged {
        /// What is not finite.
        quantity: &'static str,
        /// Simulated time.
        time_s: f64,
    },
    /// Events of the reference integrator follow each other without an advance in time.
    #[error("the reference integrator stands still: events without end at one instant")]
    Stalled,
}

impl RunError {
    /// What to try instead, if anything.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Scene(error) => error.hint(),
            Self::Diverged { .. } => {
                Some("a smaller simulate.step_s, or parameters nearer to nominal".to_owned())
            }
            Self::Output(_) | Self::Stalled => None,
        }
    }

    /// The whole report, on one line.
    pub fn one_line(&self) -> String {
        crate::scene::one_line(self, self.hint())
    }
}

impl From<OutOfBounds> for RunError {
    fn from(error: OutOfBounds) -> Self {
        SceneError::from(error).into()
    }
}
