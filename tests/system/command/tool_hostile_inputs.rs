//! What users give by mistake, and how the command survives it: files, names and values.
//!
//! | row of the faults to survive | tests |
//! |---|---|
//! | C1: keys, types, units, files, names | here, `tool_command_line`, `tool_scene_files`, `tool_conventions` |
//! | C2: steps, masses, times, sizes | here, `tool_sweep` |
//! | C3: damaged logs | `tool_logs` |
//! | C4: Ctrl-C, kill, full disk, closed pipe, two writers | `tool_sweep`, `tool_logs`, `tool_command_line` |
//! | C5: runs that fail among many | `tool_sweep` |
//! | C6: threads and parts | `tool_sweep`, `tool_parts`, `tool_faults` |
//! | S1: parts killed, made twice, on another machine | `tool_sweep`, `tool_cluster` |

use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt as _;
use std::process::{Command, Output};

use crate::support::built_command::{folder, refuses, run, run_with, succeeds};

/// C1: names that are no text, and files as other systems write them.
#[test]
fn tool_names_and_files_of_other_systems_are_taken() {
    let folder = folder();
    let with_name = |before: &[&str], name: &[u8], after: &[&str]| -> Output {
        let mut command = Command::new(env!("CARGO_BIN_EXE_host-sim-under-test"));
        command.args(before).arg(OsStr::from_bytes(name)).args(after).current_dir(folder.path());
        command.output().expect("it starts")
    };
    // A mark of the byte order, and ends of lines as Windows has them.
    let scene = b"\xef\xbb\xbfseed = 3\r\n[motor]\r\nfriction = 0.2\r\n";
    std::fs::write(folder.path().join(OsStr::from_bytes(b"sc\xffne.toml")), scene).expect("a folder");
    let shown = with_name(&["scene"], b"sc\xffne.toml", &["--only-set"]);
    assert!(shown.status.success(), "{}", String::from_utf8_lossy(&shown.stderr));
    let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(shown.contains("seed = 3") && shown.contains("friction = 0.2"), "{shown}");
    let short = ["--duration", "0.02", "--settle", "0.001"];
    let made = with_name(&[&["simulate"], &short[..], &["--out"]].concat(), b"\xff.csv", &[]);
    assert!(made.status.success() && folder.path().join(OsStr::from_bytes(b"\xff.csv")).is_file());
    for name in [&b"now\xffere.toml"[..], b"now\xffere/\xff"] {
        let refused = with_name(&["simulate", "--scene"], name, &[]);
        let complaint = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{complaint}");
        assert!(complaint.lines().count() == 1 && !complaint.contains("panicked"), "{complaint}");
    }
}

/// C1: a mass in the unit of the paper, a frequency in kHz, a time in ms: the refusal has the bounds and their unit.
#[test]
fn tool_values_in_another_unit_are_refused_with_their_bounds() {
    let folder = folder();
    for (set, words) in [
        ("motor.rotor_mass_kg=60e3", "motor.rotor_mass_kg = 60e3 is outside its bounds 1e-9 to 1 kg"),
        ("motor.mode_b.frequency_hz=6.3e9", "motor.mode_b.frequency_hz = 6.3e9 is outside its bounds"),
        ("simulate.duration_s=2e9", "simulate.duration_s = 2e9 is outside its bounds 1e-4 to 100000 s"),
    ] {
        let (key, value) = set.split_once('=').expect("an assignment");
        let refused = run(folder.path(), &["simulate", "--set", set]);
        let complaint = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert_eq!(refused.status.code(), Some(2), "{complaint}");
        // The value may be written another way: 60000 for 60e3.
        let bounds = words.split("is outside").nth(1).expect("bounds");
        assert!(complaint.contains(key) && complaint.contains(bounds), "{value}: {complaint}");
    }
}

/// C2: a step that is too long for the fastest mode is told with one that is not, which says nothing; steps without
/// end, masses below zero and runs of no time are refused.
#[test]
fn tool_steps_masses_and_times_beyond_reason_are_told() {
    let folder = folder();
    let said = |step: &str| {
        let flags = ["simulate", "--duration", "0.6", "--step", step];
        let output = run_with(&[], folder.path(), &flags);
        assert!(output.status.success());
        String::from_utf8(output.stderr).expect("text")
    };
    let note = said("1e-3");
    assert!(note.contains("simulate.step_s = 0.001 s is too long for the fastest mode"), "{note}");
    let works = note.split("at most ").nth(1).and_then(|rest| rest.split(' ').next()).expect("a step");
    assert_eq!(said(works), "", "{works}");
    let refused =
        |flags: &[&str], words: &[&str]| refuses(folder.path(), &[&["simulate"], flags].concat(), words);
    refused(&["--step", "1e-9", "--duration", "1e5"], &["1e14 steps", "hint: steps of at least 1e-5 s"]);
    refused(&["--duration", "0"], &["simulate.duration_s = 0", "1e-4 to 100000 s"]);
    refused(&["--set", "motor.rotor_mass_kg=-1e-5"], &["motor.rotor_mass_kg = -1e-5", "1e-9 to 1 kg"]);
    succeeds(folder.path(), &["simulate", "--duration", "0.6", "--model", "stator", "--step", "1e-3"]);
}
