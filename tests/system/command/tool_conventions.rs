//! What every command keeps to: exit codes, one JSON value, quiet, colours on terminals alone, completions and manuals.

use std::process::Output;

use serde_json::Value;

use crate::support::built_command::{folder, json, refuses, run, run_with, succeeds};

fn complaint(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// 0 when it did what was asked, also when a move ended off its target; 2 when it could not.
#[test]
fn tool_exit_codes_are_those_of_the_help() {
    let folder = folder();
    let help = succeeds(folder.path(), &["--help"]);
    assert!(help.contains("Exit codes:\n  0  done") && help.contains("\n  2  refused"), "{help}");
    let dead = ["position", "--to", "1", "--fault", "drive:dead", "--format", "json"];
    assert_eq!(json(folder.path(), &dead)["ok"], false);
    for (arguments, code) in [
        (&["--version"][..], 0),
        (&["position", "--help"], 0),
        (&["keys", "rate"], 0),
        (&["fly"], 2),
        (&["position", "--fault", "camera:lots"], 2),
        (&["position", "--scene", "nowhere.toml"], 2),
        (&["position", "--tolerance", "1e-9"], 2),
        (&["simulate", "--out", "nowhere/run.csv"], 2),
        (&["results", "rate", "--quick", "--check", "--out", "nowhere"], 2),
    ] {
        assert_eq!(run(folder.path(), arguments).status.code(), Some(code), "{arguments:?}");
    }
}

#[test]
fn tool_fault_words_are_refused_with_their_column() {
    let folder = folder();
    let refused = |word: &str, words: &[&str]| refuses(folder.path(), &["position", "--fault", word], words);
    refused("camera:lots@1..2", &["camera:lots@1..2, column 8", "no fault of camera", "camera:lost"]);
    refused("drive:weak:7", &["column 12", "weak = 7", "0 to 1", "drive:weak:PART"]);
    refused("mark3:lost", &["mark3 is none", "camera.marks = 2"]);
    refuses(
        folder.path(),
        &["simulate", "--fault", "ldv:lost"],
        &["simulate does not read faults", "position"],
    );
    std::fs::write(folder.path().join("scene.toml"), "faults = [\n  \"ldv:lots\"\n]\n").expect("a folder");
    refuses(folder.path(), &["rate", "--scene", "scene.toml"], &["scene.toml:2:3", "ldv:lots, column 5"]);
    assert!(succeeds(folder.path(), &["keys", "--faults"]).contains("drive:weak:PART"));
}

/// Every command that prints a result knows `--format json`, and has examples in its help.
#[test]
fn tool_every_command_has_json_and_examples() {
    let folder = folder();
    let help = succeeds(folder.path(), &["--help"]);
    let commands: Vec<&str> = help
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|command| *command != "help")
        .collect();
    assert!(commands.contains(&"position") && commands.contains(&"man"), "{commands:?}");
    for command in commands {
        let help = succeeds(folder.path(), &[command, "--help"]);
        assert!(help.contains("Examples:\n") && help.contains(&format!("host-sim {command}")), "{help}");
        // A script of a shell is no result.
        assert!(help.contains("--format") || command == "completions", "{help}");
    }
    for arguments in [
        &["keys"][..],
        &["keys", "--faults"],
        &["scene", "set_f"],
        &["scenes"],
        &["scenes", "set_f"],
        &["init"],
        &["man", "--out", "man"],
        &["results", "faults", "--quick", "--out", "."],
    ] {
        let text = succeeds(folder.path(), &[arguments, &["--format", "json"]].concat());
        assert!(serde_json::from_str::<Value>(&text).is_ok(), "{arguments:?}: {text}");
    }
}

/// A note on standard error, which `--quiet` leaves out; the result is the same.
#[test]
fn tool_quiet_leaves_notes_out() {
    let folder = folder();
    // Mode C turns by some 90 degrees a second: a note says that this takes long.
    let arguments = ["position", "--to", "-800"];
    let loud = run(folder.path(), &arguments);
    let quiet = run(folder.path(), &[&arguments[..], &["--quiet"]].concat());
    assert!(!loud.stderr.is_empty());
    assert_eq!(complaint(&quiet), "");
    assert_eq!(loud.stdout, quiet.stdout);
}

/// Without a terminal there are no colours, nor with `NO_COLOR`, even where they are forced.
#[test]
fn tool_colours_are_for_terminals() {
    let folder = folder();
    let wrong = ["position", "--set", "position.to_degg=3"];
    let coloured = |variables: &[(&str, &str)]| {
        let refused = run_with(variables, folder.path(), &wrong);
        let help = run_with(variables, folder.path(), &["--help"]);
        let codes = |text: &[u8]| text.contains(&0x1b);
        (codes(&refused.stderr), codes(&help.stdout))
    };
    assert_eq!(coloured(&[]), (false, false));
    assert_eq!(coloured(&[("CLICOLOR_FORCE", "1")]), (true, true));
    assert_eq!(coloured(&[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")]), (false, false));
}

#[test]
fn tool_completions_and_manuals_know_every_command() {
    let folder = folder();
    for shell in ["bash", "zsh", "fish"] {
        let script = succeeds(folder.path(), &["completions", shell]);
        for word in ["positioning-trials", "--fault", "--only-set"] {
            let word = if shell == "fish" { word.trim_start_matches('-') } else { word };
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    succeeds(folder.path(), &["man", "--out", "man"]);
    let page = std::fs::read_to_string(folder.path().join("man/host-sim-position.1")).expect("a page");
    assert!(page.starts_with(".ie") && page.contains(".TH") && page.contains("Examples"), "{page}");
    assert!(succeeds(folder.path(), &["man"]).contains("Exit codes"));
    refuses(folder.path(), &["completions", "cmd"], &["cmd", "bash"]);
}
