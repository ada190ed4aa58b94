//! `--report`: a run or a study as one HTML file, with what repeats it.

use std::io::Write as _;
use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::readers::Reader;
use crate::report::OutputError;
use crate::report::files::Output;
use crate::report::html::{HtmlReport, Repetition};
use simulation::scene::Scene;

/// Flags of every command whose values stand in the scene.
const SCENE_FLAGS: [&str; 4] = ["--scene", "--set", "--fault", "--seed"];

/// The flag of a command that writes a report.
#[derive(Debug, Default, Args)]
pub(super) struct ReportArgs {
    /// Write a report as one HTML file: pictures, figures, how sure they are, and how to repeat the run
    #[arg(long, value_name = "FILE.html", value_hint = ValueHint::FilePath)]
    report: Option<PathBuf>,
}

/// A report whose file can be written.
pub(super) struct ReportFile(Output);

/// What a command was asked: its report says how to repeat it, and its JSON what it was of.
#[derive(Clone, Copy)]
pub(super) struct Request<'a> {
    /// Name of the command.
    pub command: &'static str,
    /// Its scene; `None` if it takes none.
    pub scene: Option<&'a Scene>,
    /// The command that reads the scene: another one for a sweep; `None` for the scene of a log, which has every key.
    pub reader: Option<&'static str>,
    /// Its flags that are names of keys, each with a value.
    pub key_flags: &'static [&'static str],
}

impl<'a> Request<'a> {
    /// A command whose scene comes from `--scene`, `--set`, `--fault` and `--seed`.
    pub(super) fn of_scene(command: &'static str, scene: &'a Scene) -> Self {
        Self { command, scene: Some(scene), reader: Some(command), key_flags: &[] }
    }

    /// The same with flags of its own that are names of keys.
    pub(super) fn with_key_flags(self, key_flags: &'static [&'static str]) -> Self {
        Self { key_flags, ..self }
    }

    /// The same of a command that gives its scene to another.
    pub(super) fn read_by(self, reader: &'static str) -> Self {
        Self { reader: Some(reader), ..self }
    }

    /// A command that takes the scene of a log.
    pub(super) fn of_log(command: &'static str, scene: &'a Scene) -> Self {
        Self { command, scene: Some(scene), reader: None, key_flags: &[] }
    }

    /// A command that takes no scene.
    pub(super) fn without_scene(command: &'static str) -> Self {
        Self { command, scene: None, reader: None, key_flags: &[] }
    }

    /// Whether the command reads `key`.
    pub(super) fn reads(&self, key: &str) -> bool {
        self.scene.is_some() && self.reader.is_none_or(|reader| Reader::named(reader).reads(key))
    }
}

impl ReportArgs {
    /// Whether a report is to be written.
    pub(super) fn is_asked_for(&self) -> bool {
        self.report.is_some()
    }

    /// Opens the file, if a report is asked for.
    pub(super) fn open(&self) -> Result<Option<ReportFile>, OutputError> {
        self.report.as_deref().map(|path| Output::create(path).map(ReportFile)).transpose()
    }
}

impl ReportFile {
    /// Writes the report on what was asked.
    pub(super) fn publish(mut self, report: &HtmlReport, request: &Request) -> Result<(), OutputError> {
        let scene = request.scene.map(|scene| scene.text(&|key| request.reads(key), true));
        let given: Vec<String> = std::env::args().skip(1).collect();
        let page = report.page(&repetition(&given, request.command, scene, request.key_flags));
        self.0.write_all(page.as_bytes()).map_err(|source| self.0.unwritable(source))?;
        self.0.publish()
    }
}

/// What repeats the command `given`: without the flags that stand in its scene, and without the report.
fn repetition(given: &[String], command: &str, scene: Option<String>, flags: &[&str]) -> Repetition {
    let line = |words: &[String]| {
        let words = words.iter().map(|word| quoted(word));
        std::iter::once("host-sim".to_owned()).chain(words).collect::<Vec<_>>().join(" ")
    };
    let left_out =
        |word: &str| SCENE_FLAGS.iter().chain(flags).chain(&["--report"]).any(|flag| *flag == word);
    let mut kept: Vec<String> = Vec::new();
    let mut words = given.iter().skip_while(|word| *word != command).skip(1);
    while let Some(word) = words.next() {
        if left_out(word) {
            words.next();
        } else if !word.split_once('=').is_some_and(|(flag, _)| left_out(flag)) {
            kept.push(word.clone());
        }
    }
    let with_scene = [&[command, "--scene", "scene.toml"].map(str::to_owned)[..], &kept].concat();
    Repetition {
        given: line(given),
        with_scene: if scene.as_ref().is_none_or(String::is_empty) {
            String::new()
        } else {
            line(&with_scene)
        },
        scene,
    }
}

/// A word as a shell takes it.
pub(super) fn quoted(word: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./=:,@+%".contains(letter);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.to_owned();
    }
    // Fails only for a zero byte, which no argument has.
    shlex::try_quote(word).map_or_else(|_| String::new(), Into::into)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(given: &str, scene: &str) -> Repetition {
        repetition(&shlex::split(given).unwrap(), "position", Some(scene.to_owned()), &["--to"])
    }

    #[test]
    fn exact_what_the_scene_says_is_not_said_twice() {
        let found =
            of("position --to -37 --set 'a=b c' --seed=3 --map my.toml --report r.html -q", "seed = 3\n");
        assert_eq!(
            found.given,
            "host-sim position --to -37 --set 'a=b c' --seed=3 --map my.toml --report r.html -q"
        );
        assert_eq!(found.with_scene, "host-sim position --scene scene.toml --map my.toml -q");
        let found = of("position --report r.html", "");
        assert_eq!((found.with_scene.as_str(), found.scene.as_deref()), ("", Some("")));
    }
}
