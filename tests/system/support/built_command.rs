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

/// The same with variables of the environment.
#[track_caller]
pub fn run_with(variables: &[(&str, &str)], folder: &Path, arguments: &[&str]) -> Output {
    let mut command = command();
    for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(name);
    }
    command.envs(variables.iter().copied()).args(arguments).current_dir(folder);
    command.output().expect("the command starts")
}

/// Standard output of a run on so many threads that succeeds.
#[track_caller]
pub fn output_on(threads: u32, folder: &Path, arguments: &[&str]) -> Vec<u8> {
    let mut command = command();
    command.env("RAYON_NUM_THREADS", threads.to_string());
    let output = command.args(arguments).current_dir(folder).output().expect("the command starts");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {complaint}");
    output.stdout
}

/// The JSON of a run on two threads that succeeds: one value and nothing else.
#[track_caller]
pub fn json_on_two(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_slice(&output_on(2, folder, arguments)).expect("one JSON value and nothing else")
}

/// A text that a run wrote.
#[track_caller]
pub fn written(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
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
