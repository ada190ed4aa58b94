//! `--shard` and `--merge`: a study in parts.

use std::ffi::OsStr;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::builder::TypedValueParser;
use clap::error::ErrorKind;
use clap::{Arg, Args, Command, Error};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::MapArgs;
use super::readers::Reader;
use crate::report::OutputError;
use crate::report::files::Output;
use crate::scene_files::read_response_map;
use crate::studies::shard::{self, Part, SceneDigest, Shard};
use simulation::scene::{Scene, SceneError, registry};

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
    #[arg(conflicts_with = "merge")]
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
        if !is_given || !(self.is_part() || self.is_merge()) {
            return Ok(());
        }
        Err(SceneError::Conflict {
            conflict: format!("{flag} is not made in parts"),
            hint: "make it in a run of its own, without --shard and --merge".to_owned(),
        })
    }

    /// The rows of the parts to be put together, by their `number`, of the scene with this digest; `None` if runs are
    /// to be made.
    ///
    /// # Errors
    /// When a file cannot be read, has other rows, or is of another scene.
    pub(super) fn merged<T: DeserializeOwned + PartialEq>(
        &self,
        digest: &SceneDigest,
        number: impl Fn(&T) -> u64,
    ) -> Result<Option<Vec<T>>, OutputError> {
        self.merged_by(shard::read, digest, number)
    }

    /// The same of files that `read` reads.
    ///
    /// # Errors
    /// That of `read`, and when a file is of another scene.
    pub(super) fn merged_by<T: PartialEq>(
        &self,
        read: impl Fn(&Path) -> Result<Part<T>, OutputError>,
        digest: &SceneDigest,
        number: impl Fn(&T) -> u64,
    ) -> Result<Option<Vec<T>>, OutputError> {
        if !self.is_merge() {
            return Ok(None);
        }
        let parts: Result<Vec<Part<T>>, OutputError> = self.merge.iter().map(|path| read(path)).collect();
        let parts = parts?;
        shard::refuse_other_scenes(&parts, digest)?;
        shard::merged(parts, number).map(Some)
    }

    /// Writes the rows of a part that a table cannot hold to the file `path`, which `--merge` takes; nothing if this is
    /// the whole.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(super) fn write_packed<T: Serialize>(
        &self,
        path: &Path,
        digest: &SceneDigest,
        rows: &[T],
    ) -> Result<(), OutputError> {
        if !self.is_part() {
            return Ok(());
        }
        let mut file = Output::create(path)?;
        file.write_all(&shard::packed(digest, rows)?).map_err(|source| file.unwritable(source))?;
        file.publish()
    }

    /// Whether this is one part of several.
    pub(super) fn is_part(&self) -> bool {
        self.shard != Shard::ALL
    }

    /// Whether parts are to be put together.
    pub(super) fn is_merge(&self) -> bool {
        !self.merge.is_empty()
    }
}

/// The digest of what `scenes` say to `command`, of the map that was given to it, and of the version of the program.
///
/// # Errors
/// When the file of the map is refused.
pub(super) fn scene_digest<'a>(
    command: &str,
    scenes: impl IntoIterator<Item = &'a Scene>,
    map: &MapArgs,
) -> Result<SceneDigest, SceneError> {
    let reader = Reader::named(command);
    let values = |scene: &'a Scene| {
        let read = registry().filter(|setting| reader.reads(setting.key));
        read.map(|setting| format!("{} = {}", setting.key, scene.value_json(setting.key)))
    };
    let map = map.map.as_deref().map(read_response_map).transpose()?;
    let about = [env!("CARGO_PKG_VERSION").to_owned(), format!("{map:?}")];
    Ok(SceneDigest::of(about.into_iter().chain(scenes.into_iter().flat_map(values))))
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;
    use clap::error::ErrorKind;

    use crate::cli::Cli;

    /// Parts that are put together have their runs: what asks for runs does nothing beside `--merge`.
    #[test]
    fn exact_what_asks_for_runs_is_refused_beside_a_merge() {
        for line in [
            "positioning-trials --merge a.csv b.csv --shard 1/2",
            "positioning-trials --merge a.csv b.csv --motors 3",
            "instruments --merge a.csv --motors 3",
            "instruments --merge a.csv --only camera",
            "faults --merge a.csv --runs 3",
            "calibrate --merge a.csv --runs 3",
            "calibrate --merge a.csv --motors 3",
            "estimate --merge a.csv --motors 3",
            "estimate --merge a.csv --told jump",
            "stator --merge a.csv --ensemble 3",
            "commission --merge a.csv --trials 3",
        ] {
            let words: Vec<&str> = std::iter::once("host-sim").chain(line.split(' ')).collect();
            let refusal = Cli::try_parse_from(&words).map(|_| ()).unwrap_err();
            assert_eq!(refusal.kind(), ErrorKind::ArgumentConflict, "{line}: {refusal}");
            let merged = words.iter().position(|word| *word == "a.csv").unwrap();
            assert!(Cli::try_parse_from(&words[..=merged]).is_ok(), "{line}");
        }
    }
}
