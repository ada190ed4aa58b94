//! The built `host-sim` command, run as a user runs it.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// The command as cargo built it beside these tests, from the same `main.rs`.
fn command() -> Command {
    Command::new(env!("CARGO_BIN_EXE_host-sim-under-test"))
}

/// Runs the command in a folder of its own.
#[track_caller]
pub fn run(folder: &Path, arguments: &[&str]) -> Output {
    command().args(arguments).current_dir(folder).output().expect("the command starts")
}

/// Runs the command on so many threads.
#[track_caller]
pub fn run_on(threads: u32, folder: &Path, arguments: &[&str]) -> Output {
    let mut command = command();
    command.env("RAYON_NUM_THREADS", threads.to_string());
    command.args(arguments).current_dir(folder).output().expect("the command starts")
}

pub fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Standard output of a run that succeeds and has nothing to complain about.
#[track_caller]
pub fn succeeds(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {complaint}");
    String::from_utf8(output.stdout).expect("text")
}

/// Exactly one JSON object.
#[track_caller]
pub fn json(folder: &Path, arguments: &[&str]) -> Value {
    let text = succeeds(folder, arguments);
    let value: Value = serde_json::from_str(&text).expect("one JSON value and nothing else");
    assert!(value.is_object(), "{text}");
    value
}

/// A refusal: exit code 2, nothing on standard output, one line on standard error that holds all of `words`.
#[track_caller]
pub fn refuses(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = run(folder, arguments);
    let complaint = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {complaint}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert_eq!(complaint.trim_end().lines().count(), 1, "{arguments:?}: {complaint}");
    for word in words {
        assert!(complaint.contains(word), "{arguments:?}: {word} is not in {complaint}");
    }
}

#[track_caller]
pub fn number(object: &Value, field: &str) -> f64 {
    object[field].as_f64().unwrap_or_else(|| panic!("{field} is a number in {object}"))
}
