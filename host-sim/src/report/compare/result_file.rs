//! A result as `--format json` writes it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::{Map, Value};

use crate::report::OutputError;
use crate::report::files;
use crate::report::key_figure::KeyFigure;

/// Why a file is no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResultFileError {
    /// It cannot be read.
    #[error(transparent)]
    Unreadable(#[from] OutputError),
    /// It is no JSON, or ends too early.
    #[error("{}:{line}:{column}: this is no JSON: {reason}", path.display())]
    NotJson {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What the parser says.
        reason: String,
    },
    /// It is JSON of something else.
    #[error("{}: this is no result of host-sim: {reason}", path.display())]
    NotAResult {
        /// The file.
        path: PathBuf,
        /// What it lacks.
        reason: String,
    },
}

impl ResultFileError {
    /// What to try instead.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Unreadable(_) => None,
            _ => Some("`--format json` of a command prints a result".to_owned()),
        }
    }
}

/// A result.
#[derive(Clone, Debug, Deserialize)]
pub struct ResultFile {
    /// Where it was read.
    #[serde(skip)]
    pub path: PathBuf,
    /// The command that made it.
    pub command: String,
    /// The version that made it.
    pub version: String,
    /// The keys of its scene that differ from their defaults.
    #[serde(default)]
    pub scene: BTreeMap<String, Value>,
    /// The figures by which it is judged.
    #[serde(default)]
    pub key_figures: Vec<KeyFigure>,
    /// Everything else.
    #[serde(flatten)]
    pub rest: Map<String, Value>,
}

impl ResultFile {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// When it cannot be read, or is no result.
    pub fn read(path: &Path) -> Result<Self, ResultFileError> {
        let bytes = files::read(path)?;
        Self::parse(&String::from_utf8_lossy(&bytes), path)
    }

    /// The result `text` of the file at `path`.
    ///
    /// # Errors
    /// When it is no result.
    pub fn parse(text: &str, path: &Path) -> Result<Self, ResultFileError> {
        let value: Value = serde_json::from_str(text).map_err(|error| ResultFileError::NotJson {
            path: path.to_owned(),
            line: error.line(),
            column: error.column(),
            reason: error.to_string().split(" at line").next().unwrap_or_default().to_owned(),
        })?;
        let not_a_result = |reason| ResultFileError::NotAResult { path: path.to_owned(), reason };
        let Value::Object(object) = &value else {
            return Err(not_a_result("it is no object".to_owned()));
        };
        if let Some(field) = ["command", "version"].into_iter().find(|field| !object.contains_key(*field)) {
            return Err(not_a_result(format!("it has no field `{field}`")));
        }
        let mut result: Self =
            serde_json::from_value(value).map_err(|error| not_a_result(error.to_string()))?;
        path.clone_into(&mut result.path);
        Ok(result)
    }

    /// Whether run k of both has the same seed.
    pub fn has_seeds_of(&self, other: &Self) -> bool {
        self.command == other.command && self.scene.get("seed") == other.scene.get("seed")
    }

    /// Every key of the scenes of both whose values differ, with both values.
    pub fn scene_differences(&self, other: &Self) -> Vec<[String; 3]> {
        let keys: std::collections::BTreeSet<&String> = self.scene.keys().chain(other.scene.keys()).collect();
        let of = |result: &Self, key: &String| {
            result.scene.get(key).map_or_else(|| "default".to_owned(), ToString::to_string)
        };
        let differing = keys.into_iter().filter(|key| self.scene.get(*key) != other.scene.get(*key));
        differing.map(|key| [key.clone(), of(self, key), of(other, key)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<ResultFile, ResultFileError> {
        ResultFile::parse(text, Path::new("r.json"))
    }

    #[test]
    fn exact_a_result_and_its_rest() {
        let result =
            parse("{\"command\":\"rate\",\"version\":\"1\",\"scene\":{\"seed\":3},\"ok\":true}").unwrap();
        assert_eq!((result.command.as_str(), result.rest.len()), ("rate", 1));
        let other = parse("{\"command\":\"rate\",\"version\":\"1\",\"scene\":{\"camera.marks\":3}}").unwrap();
        let differences = result.scene_differences(&other);
        assert_eq!(
            differences,
            [["camera.marks", "default", "3"], ["seed", "3", "default"]].map(|row| row.map(str::to_owned))
        );
    }

    #[test]
    fn exact_what_is_refused_and_why() {
        for (text, expected) in [
            ("", "r.json:1:0: this is no JSON"),
            ("{\"command\":\"rate\",\n\"ver", "r.json:2:4: this is no JSON"),
            ("[1]", "r.json: this is no result of host-sim: it is no object"),
            ("{\"version\":\"1\"}", "it has no field `command`"),
            ("{\"command\":1,\"version\":\"1\"}", "invalid type"),
            ("{\"command\":\"a\",\"version\":\"1\",\"key_figures\":[{\"of\":\"\"}]}", "missing field"),
        ] {
            let refused = parse(text).unwrap_err().to_string();
            assert!(refused.contains(expected), "{text}: {refused}");
        }
    }
}
