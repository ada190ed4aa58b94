//! Why nothing was identified.

use std::path::PathBuf;

use crate::log::LogError;
use crate::report::OutputError;
use simulation::runs::RunError;
use simulation::scene::SceneError;

/// Why nothing was identified.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IdentificationError {
    /// No log was given.
    #[error("there is no recording to identify a motor from")]
    NoRecordings,
    /// A log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A motor that was drawn cannot be simulated.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A picture cannot be laid out.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A measurement, or a drive, that is no number.
    #[error("{}: {channel} has a message at {at_s:.6} s that is no number or no drive", path.display())]
    NotANumber {
        /// The log.
        path: PathBuf,
        /// The channel.
        channel: &'static str,
        /// When.
        at_s: f64,
    },
    /// No part of the recording lasts long enough.
    #[error("{} is too short or empty: no drive lasts 20 ms, and no time without drive 10 ms", path.display())]
    TooShort {
        /// The log.
        path: PathBuf,
    },
    /// A steady drive alone, of a stator without its rotor.
    #[error("{} is of a bare stator and has neither a ring-down nor a sweep", path.display())]
    NeitherRingDownNorSweep {
        /// The log.
        path: PathBuf,
    },
    /// One recording that was given twice: it would count as two.
    #[error("{} and {} are one file", paths[0].display(), paths[1].display())]
    Twice {
        /// Its two names.
        paths: [PathBuf; 2],
    },
    /// Recordings of motors of different designs.
    #[error("{} and {} are recordings of motors of different designs", paths[0].display(), paths[1].display())]
    OtherDesign {
        /// Two logs.
        paths: [PathBuf; 2],
    },
    /// Recordings of motors of one design that are not the same motor.
    #[error("{} and {} are recordings of two motors of one design", paths[0].display(), paths[1].display())]
    OtherMotor {
        /// Two logs.
        paths: [PathBuf; 2],
    },
}

impl From<SceneError> for IdentificationError {
    fn from(error: SceneError) -> Self {
        Self::Run(error.into())
    }
}

impl IdentificationError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::NoRecordings | Self::TooShort { .. } => Some(
                "`host-sim record --scene record_both_modes --log run.mcap` makes one that is long enough"
                    .to_owned(),
            ),
            Self::NeitherRingDownNorSweep { .. } => {
                Some("`host-sim record --scene record_ring_down --log ring.mcap` makes one".to_owned())
            }
            Self::Log(LogError::NotALog { .. }) => Some(
                "`record --log FILE.mcap` makes one, and `import` makes one of your own tables".to_owned(),
            ),
            Self::Log(error) => error.hint(),
            Self::Run(error) => error.hint(),
            Self::Output(error) => error.hint(),
            Self::NotANumber { .. } => Some("leave such samples out before they are imported".to_owned()),
            Self::Twice { .. } => Some("give each recording once".to_owned()),
            Self::OtherDesign { .. } => Some("give the recordings the same keys motor.".to_owned()),
            Self::OtherMotor { .. } => {
                Some("record both with the same seed and the same keys plant.".to_owned())
            }
        }
    }
}
