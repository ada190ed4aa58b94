//! The error of a result that cannot be laid out, written or read again.

use std::io;
use std::path::{Path, PathBuf};

/// Why a result could not be laid out, written or read again.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// A result that cannot be written.
    #[error("cannot write {}: {source}", path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A file that is there and was not to be written over.
    #[error("{} is there already", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// Standard output refused the result.
    #[error("cannot write to standard output: {0}")]
    StandardOutput(#[source] io::Error),
    /// A picture that could not be laid out.
    #[error("cannot draw the picture: {0}")]
    Drawing(String),
    /// A table that could not be written.
    #[error("cannot write the table: {0}")]
    Table(String),
    /// A table or a manifest that was read and is not what is expected there.
    #[error("cannot read {}: {why}", path.display())]
    Unexpected {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// Tables of parts that are not one whole.
    #[error("the parts are not one whole: {0}")]
    NotWhole(String),
    /// A part of a study of another scene.
    #[error("{} is of another scene than {other}: its digest is {found}, not {expected}", path.display())]
    OtherScene {
        /// The file.
        path: PathBuf,
        /// What it is put together with.
        other: String,
        /// The digest of its scene.
        found: String,
        /// The digest of the other.
        expected: String,
    },
    /// A template of a page and the values for it, which do not fit.
    #[error("the page {0}")]
    Page(String),
    /// A page that differs from what its command writes.
    #[error("{}:{line}: the page is not what its command writes today", path.display())]
    Outdated {
        /// The file.
        path: PathBuf,
        /// Line of the first difference, from 1.
        line: usize,
    },
    /// A page that is to be compared and cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

impl OutputError {
    /// The file `path` was read, and is not what is expected there.
    pub fn unexpected(path: &Path, why: impl std::fmt::Display) -> Self {
        Self::Unexpected { path: path.to_owned(), why: why.to_string() }
    }

    /// What to try instead, where there is something to try.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Outdated { .. } => Some("`host-sim results` writes it anew".to_owned()),
            Self::NotWhole(_) => Some(
                "--merge takes the table of each part of one study; `--shard I/N` makes part I".to_owned(),
            ),
            Self::OtherScene { .. } => Some(
                "--merge and all parts take the same --scene, --set, --fault and --seed, the same map and scenes beside"
                    .to_owned(),
            ),
            Self::Exists { .. } => Some("--force writes over it".to_owned()),
            _ => None,
        }
    }

    /// Whether the reader of standard output has closed it, which is no error of the command.
    pub fn is_broken_pipe(&self) -> bool {
        matches!(self, Self::StandardOutput(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }
}
