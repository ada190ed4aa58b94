//! `host-sim commission`: the map of a motor, what it is refused for, and many motors.

use controller::ResponseMap;
use controller::map_correction::{LearntFactors, MapCorrection};
use controller::response_map::Family;
use std::path::Path;

use host_sim::studies::positioning_trials::target;
use simulation::scene::parse_response_map;

use crate::support::built_command::{folder, json, number, output_on, refuses, run, succeeds, written};
use crate::support::closeness::assert_between;

/// A motor is commissioned within a minute of its time. Its map differs from the one that it began with, and a move by
/// it arrives.
#[test]
fn tool_commission_writes_a_map_that_position_takes() {
    let folder = folder();
    let more = ["--report", "report.html", "--format", "json"];
    let found = json(folder.path(), &[&["commission", "--seed", "3", "--out", "mine"][..], &more].concat());
    assert_between(number(&found, "time_s"), 1.0, 60.0, "motor time");
    assert_eq!(found["end"], "enough", "{found}");
    for resonance in found["resonances"].as_array().expect("resonances") {
        let off_hz = number(resonance, "found_hz") - number(resonance, "true_hz");
        // Four standard deviations: of two modes one motor in 8,000 exceeds them.
        assert!(off_hz.abs() < 4.0 * number(resonance, "sd_hz"), "{resonance}");
    }
    let text = written(folder.path(), "mine/map.toml");
    let map = parse_response_map(&text, Path::new("map.toml")).expect("a map");
    assert_ne!(map, *ResponseMap::table_1());
    let picture = written(folder.path(), "mine/commissioning.svg");
    assert!(picture.starts_with("<svg") && picture.contains("Cruises of mode B"), "{picture:.200}");
    let report = written(folder.path(), "report.html");
    for words in
        ["+- is one standard deviation", "windows: of 50 ms", "this motor mdeg", "burst to burst mdeg"]
    {
        assert!(report.contains(words), "{words}");
    }
    let moved = ["position", "--to", "5", "--seed", "3", "--map", "mine/map.toml", "--format", "json"];
    assert_eq!(json(folder.path(), &moved)["ok"], true);
    assert_eq!(written(folder.path(), "mine/map.toml"), text, "without --learn the map stays");
    check_learning(folder.path(), &map);
}

/// A move by `map` in mine/map.toml adds what it has learnt: the rows stay, a repeated burst is known better, and the
/// next move begins with it. A move that is given up leaves the file as it is.
fn check_learning(folder: &Path, map: &ResponseMap) {
    let moved = |to: &str, more: &[&str]| {
        let by = ["position", "--to", to, "--seed", "3", "--map", "mine/map.toml", "--learn"];
        json(folder, &[&by[..], &["--format", "json"], more].concat())
    };
    let kept = || {
        let text = written(folder, "mine/map.toml");
        parse_response_map(&text, Path::new("map.toml")).expect("a map").learnt().expect("factors")
    };
    let prior = LearntFactors::from(&MapCorrection::of(map));
    let by = ["position", "--to", "-0.05", "--seed", "3", "--map", "mine/map.toml", "--learn"];
    let notes = String::from_utf8(run(folder, &by).stderr).expect("text");
    assert!(notes.contains("note: mine/map.toml has what the move learnt of this motor"), "{notes}");
    let first = kept();
    let text = written(folder, "mine/map.toml");
    let of_motor = parse_response_map(&text, Path::new("map.toml")).expect("a map");
    assert_eq!(Ok(of_motor), map.with_learnt(first), "the rows are the same");
    let step = |factors: &LearntFactors| factors.bursts[Family::Step as usize];
    assert!(step(&first).variance < step(&prior).variance, "{first:?} {prior:?}");
    assert_eq!(moved("-0.03", &[])["ok"], true);
    assert!(
        step(&kept()).variance < step(&first).variance,
        "the second move began with what the first had learnt"
    );
    let before = written(folder, "mine/map.toml");
    let given_up = moved("5", &["--fault", "drive:dead"]);
    assert!(given_up["stopped"].is_string(), "{given_up}");
    assert_eq!(written(folder, "mine/map.toml"), before);
    check_learning_comes_last(folder);
    let gallery = ["position", "--scene", "set_f_plant", "--map", "set_f_plant", "--learn"];
    refuses(folder, &gallery, &["--learn", "set_f_plant is no file", "commission --out"]);
}

/// A result that cannot be printed leaves the map as it was. A reader that has closed standard output does not.
fn check_learning_comes_last(folder: &Path) {
    let before = written(folder, "mine/map.toml");
    let by = ["position", "--to", "-0.05", "--seed", "3", "--map", "mine/map.toml", "--learn"];
    for (output, code, learns) in [("> /dev/full", 2, false), ("| true", 0, true)] {
        let words = [&[env!("CARGO_BIN_EXE_host-sim-under-test")][..], &by].concat();
        let line = format!("set -o pipefail; {} {output}", shlex::try_join(words).expect("no zero byte"));
        let ended = std::process::Command::new("bash").args(["-c", &line]).current_dir(folder).output();
        let ended = ended.expect("bash");
        let notes = String::from_utf8(ended.stderr).expect("text");
        assert_eq!(ended.status.code(), Some(code), "{output}: {notes}");
        assert_eq!(written(folder, "mine/map.toml") != before, learns, "{output}: {notes}");
    }
}

/// A motor that cannot be positioned is refused in one line, and no map is written. What was measured of it is: the
/// picture, the tables with the reason, and the report.
#[test]
fn tool_commission_refuses_a_motor_that_is_not_fit() {
    let folder = folder();
    for (fault, reason) in [
        ("drive:dead:c", "mode C is dead"),
        ("drive:swapped", "mode B turns the rotor counter-clockwise"),
        ("rotor:stuck", "neither mode turns the rotor"),
    ] {
        let arguments = ["commission", "--fault", fault, "--out", "mine", "--report", "report.html"];
        let output = run(folder.path(), &[&arguments[..], &["--format", "json"]].concat());
        assert_eq!(output.status.code(), Some(2), "{fault}");
        let complaint = String::from_utf8(output.stderr).expect("text");
        let is_one_line = complaint.trim_end().lines().count() == 1;
        assert!(
            is_one_line && complaint.contains("not fit for use") && complaint.contains(reason),
            "{complaint}"
        );
        let found: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert!(found["unfit"].as_str().expect("a reason").contains(reason), "{found}");
        assert!(found["cruises"].as_array().expect("rows").len() > 8, "{found}");
        assert!(!folder.path().join("mine/map.toml").exists(), "{fault}");
        assert!(written(folder.path(), "mine/commissioning.svg").starts_with("<svg"), "{fault}");
        assert!(written(folder.path(), "report.html").contains(reason), "{fault}");
    }
}

/// A motor without mode B is told so. By its map moves clockwise are refused with the way round, which arrives.
#[test]
fn tool_commission_tells_a_dead_mode() {
    let folder = folder();
    let arguments = ["commission", "--fault", "drive:dead:b", "--out", "mine", "--format", "json"];
    let found = json(folder.path(), &arguments);
    assert_eq!(found["findings"].to_string(), r#"[{"mode":"B","what":"dead"}]"#);
    let map = parse_response_map(&written(folder.path(), "mine/map.toml"), Path::new("map.toml"));
    let modes: Vec<String> =
        map.expect("a map").cruises().iter().map(|cruise| format!("{:?}", cruise.mode)).collect();
    assert!(!modes.is_empty() && modes.iter().all(|mode| mode == "C"), "{modes:?}");
    let moved = ["position", "--fault", "drive:dead:b", "--map", "mine/map.toml", "--to"];
    let words = ["mode B does not turn this motor", "--to -323"];
    refuses(folder.path(), &[&moved[..], &["37"]].concat(), &words);
    let round = [&moved[..], &["-323", "--format", "json"]].concat();
    assert_eq!(json(folder.path(), &round)["ok"], true);
}

/// Trials give the same bytes on one thread and on two. Motors that are refused are counted with the reason. Two moves
/// of each of two motors go to the targets of four trials of `positioning-trials`.
#[test]
fn tool_commission_trials_do_not_depend_on_the_threads() {
    let folder = folder();
    let arguments =
        "commission --trials 2 --moves 2 --seed 5 --fault drive:dead:c --out trials --format json";
    let arguments: Vec<&str> = arguments.split(' ').collect();
    let [one, two] = [1, 2].map(|threads| output_on(threads, folder.path(), &arguments));
    assert_eq!(one, two);
    let found: serde_json::Value = serde_json::from_slice(&one).expect("JSON");
    let refused = found["refused"].as_object().expect("reasons");
    assert!(refused.len() == 1 && refused.values().all(|count| *count == 2), "{found}");
    let rows = written(folder.path(), "trials/trials.csv");
    let mut rows = rows.lines().map(|row| row.split(',').collect::<Vec<_>>());
    let header = rows.next().expect("a header");
    let place = |name: &str| header.iter().position(|column| *column == name).expect("a column");
    let [seed, aim, by_own] = ["seed", "target_deg", "own_error_mdeg"].map(place);
    let moves: Vec<(u64, f64)> = rows
        .inspect(|row| assert_eq!(row[by_own], "", "a motor without a map made a move by it: {row:?}"))
        .map(|row| (row[seed].parse().expect("a seed"), row[aim].parse().expect("an angle")))
        .collect();
    assert_eq!(moves, [(5, 5), (5, 7), (6, 6), (6, 8)].map(|(seed, trial)| (seed, target(trial).1)));
    let help = succeeds(folder.path(), &["commission", "--help"]);
    assert!(help.contains("--trials") && help.contains("Examples:"), "{help}");
}
