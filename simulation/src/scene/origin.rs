//! Where the value of a key comes from.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use serde::Serialize;

/// Where the value of a key comes from.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(tag = "source", rename_all = "snake_case")]
pub enum Origin {
    /// Nothing sets it.
    #[default]
    Default,
    /// Nothing sets it, and it is as another key.
    As {
        /// The other key.
        other: &'static str,
    },
    /// Nothing sets this parameter of the true motor, which the seed draws around the design.
    Drawn {
        /// Key of the design's parameter.
        around: &'static str,
    },
    /// A line of a scene file.
    File {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
    },
    /// An assignment, `--set key=value`.
    Set,
    /// Another flag of the command.
    Flag,
    /// The program that uses the library.
    Program,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Default => f.write_str("default"),
            Self::As { other } => write!(f, "as {other}"),
            Self::Drawn { around } => write!(f, "drawn by the seed around {around}"),
            Self::File { path, line } => write!(f, "{}:{line}", path.display()),
            Self::Set => f.write_str("--set"),
            Self::Flag => f.write_str("flag"),
            Self::Program => f.write_str("program"),
        }
    }
}

/// The origin of each key that was set.
#[derive(Clone, Debug, Default)]
pub(super) struct Origins(pub BTreeMap<&'static str, Origin>);

/// Where a value comes from is no part of a scene's value.
impl PartialEq for Origins {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
