//! `--shard` and `--merge`: a study in parts.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use clap::builder::TypedValueParser;
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, Error};
use serde::de::DeserializeOwned;

use crate::report::OutputError;
use crate::studies::shard::{self, Shard};
use simulation::scene::SceneError;

/// A shard as `I/N`, counted from 1.
#[derive(Clone, Debug)]
pub(super) struct ShardParser;

impl TypedValueParser for ShardParser {
    type Value = Shard;

    fn parse_ref(&self, command: &Command, _: Option<&Arg>, value: &OsStr) -> Result<Shard, Error> {
        let text = value.to_string_lossy();
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse::<u64>().ok()?, n.parse::<u64>().ok()?)));
        match parts {
            Some((i, n)) if 1 <= i && i <= n => Ok(Shard { index: i - 1, count: n }),
            _ => {
                let why = format!("--shard = {text} is not I/N with I from 1 to N");
                Err(Error::raw(ErrorKind::ValueValidation, why).with_cmd(command))
            }
        }
    }
}

/// The flags of a study that can be made in parts.
#[derive(Debug, Args)]
pub(super) struct ShardArgs {
    /// Make only the I-th of N parts of the runs; --merge puts the parts together
    #[arg(long, value_name = "I/N", default_value = "1/1", value_parser = ShardParser)]
    pub(super) shard: Shard,
    /// Make no runs: put together the tables of the parts
    #[arg(long, value_name = "FILE", num_args = 1..)]
    merge: Vec<PathBuf>,
}

impl ShardArgs {
    /// Refuses a flag that is given, and goes with neither a part nor a merge.
    ///
    /// # Errors
    /// When it is given beside one of them.
    pub(super) fn refuse(&self, flag: &str, is_given: bool) -> Result<(), SceneError> {
        if !is_given || (!self.is_part() && self.merge.is_empty()) {
            return Ok(());
        }
        Err(SceneError::Conflict {
            conflict: format!("{flag} is not made in parts"),
            hint: "make it in a run of its own, without --shard and --merge".to_owned(),
        })
    }

    /// The rows of the parts to be put together, by their `number`; `None` if runs are to be made.
    ///
    /// # Errors
    /// When a file cannot be read, or has other rows.
    pub(super) fn merged<T: DeserializeOwned + PartialEq>(
        &self,
        number: impl Fn(&T) -> u64,
    ) -> Result<Option<Vec<T>>, OutputError> {
        self.merged_by(shard::read, number)
    }

    /// The same of files that `read` reads.
    ///
    /// # Errors
    /// That of `read`.
    pub(super) fn merged_by<T: PartialEq>(
        &self,
        read: impl Fn(&Path) -> Result<Vec<T>, OutputError>,
        number: impl Fn(&T) -> u64,
    ) -> Result<Option<Vec<T>>, OutputError> {
        if self.merge.is_empty() {
            return Ok(None);
        }
        let parts: Result<Vec<Vec<T>>, OutputError> = self.merge.iter().map(|path| read(path)).collect();
        shard::merged(parts?, number).map(Some)
    }

    /// Whether this is one part of several.
    pub(super) fn is_part(&self) -> bool {
        self.shard != Shard::ALL
    }
}
