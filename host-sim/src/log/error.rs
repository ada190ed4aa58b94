//! Why a log was not written or not read.

use std::io;
use std::path::{Path, PathBuf};

use super::import::error::ImportError;
use crate::report::OutputError;
use simulation::runs::RunError;
use simulation::scene::SceneError;

/// Why a log was not written or not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogError {
    /// The file cannot be opened, written or renamed.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The name does not say which kind of log is meant.
    #[error("the name {} does not say which kind of log is meant", path.display())]
    UnknownKind {
        /// The name.
        path: PathBuf,
    },
    /// The log would take the place of a file that is read.
    #[error("--log {} would be written over a file that is read", path.display())]
    OverInput {
        /// The name.
        path: PathBuf,
    },
    /// The disk is full, or the file has reached its largest size.
    #[error("the log stopped: {source}; {kept}")]
    Full {
        /// What is kept, and where.
        kept: Kept,
        /// The system's error.
        source: io::Error,
    },
    /// The run was interrupted.
    #[error("interrupted; {kept}")]
    Interrupted {
        /// What is kept, and where.
        kept: Kept,
    },
    /// The file is no log of this program.
    #[error("{} is no log of host-sim: {why}", path.display())]
    NotALog {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        why: String,
    },
    /// The log has channels of another version.
    #[error("{} has format {found:?}, written by host-sim {version}; this program reads format \"1\"", path.display())]
    OtherFormat {
        /// The file.
        path: PathBuf,
        /// The format that it states.
        found: String,
        /// The version of the program that wrote it.
        version: String,
    },
    /// A channel of a known name with messages of another type.
    #[error("channel {topic} of {} has messages {found:?}, and not {expected}", path.display())]
    OtherChannel {
        /// The file.
        path: PathBuf,
        /// The channel.
        topic: String,
        /// The type that it states.
        found: String,
        /// The type that it should have.
        expected: String,
    },
    /// The log is damaged.
    #[error("{} is damaged after {after_s:.4} s: {why}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The time of the last message before the damage.
        after_s: f64,
        /// What is wrong.
        why: String,
    },
    /// A recording cannot be imported.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// The observer of a replay ended it.
    #[error("the replay was ended")]
    Ended,
    /// The scene in the log, or what was set over it, is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The filter is refused.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The writer of the format refused something: a slip in the program.
    #[error("cannot write the log: {0}")]
    Format(String),
}

/// What is kept of a run that did not end.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// The file.
    pub path: PathBuf,
    /// The time up to which the run is in it.
    pub until_s: f64,
}

impl std::fmt::Display for Kept {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} has the run up to {:.4} s", self.path.display(), self.until_s)
    }
}

impl LogError {
    /// What to try instead, where there is something to say.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Output(error) => error.hint(),
            Self::UnknownKind { .. } => Some("a name that ends in .mcap, .parquet or .csv".to_owned()),
            Self::OverInput { .. } => Some("give the log another name".to_owned()),
            Self::Full { .. } => Some(
                "free some space, or write less: --log-every 100 keeps every hundredth tick of truth and estimate"
                    .to_owned(),
            ),
            Self::NotALog { .. } => Some("`position --log FILE.mcap` writes one".to_owned()),
            Self::OtherFormat { version, .. } => {
                Some(format!("host-sim {version} reads it, or make the log anew"))
            }
            Self::OtherChannel { topic, .. } => Some(format!("give the channel {topic} another name")),
            Self::Damaged { .. } => Some("without --strict it is read up to there".to_owned()),
            Self::Scene(error) => error.hint(),
            Self::Run(error) => error.hint(),
            Self::Import(error) => error.hint(),
            Self::Interrupted { .. } | Self::Format(_) | Self::Ended => None,
        }
    }

    /// The system's refusal to write the file at `path`.
    pub(super) fn unwritable(path: &Path, source: io::Error) -> Self {
        OutputError::Unwritable { path: path.to_owned(), source }.into()
    }
}

/// Whether the system says that there is no more room: a full disk, a full quota, the largest size of a file.
pub(super) fn is_no_room(error: &io::Error) -> bool {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge)
}
