//! `sweep` and `merge`: the same table for any threads, parts and interruptions; failed rows; refusals.
//!
//! Rows C2, C4, C5, C6 and S1 of the faults to survive: sizes beyond reason, interruptions, runs that fail, threads and
//! parts, parts made twice.

use std::path::Path;

use serde_json::Value;

use crate::support::built_command::{folder, json_on_two, number, output_on, refuses, run, written};
use crate::support::python::found;
use crate::support::started::{ended, names, signal, start, wait_until};

/// 12 points with two runs each, of 5 ms of motor time.
const SMALL: [&str; 14] = [
    "sweep",
    "--of",
    "simulate",
    "--over",
    "motor.friction=0.1..0.5:4",
    "--over",
    "simulate.drive=b,c,off",
    "--repeats",
    "2",
    "--figure",
    "rotor_rate_mean_rad_s",
    "--figure",
    "collision_frequency_hz",
    "--format=json",
];

/// Short runs in open loop.
const SHORT: [&str; 6] =
    ["--set", "simulate.duration_s=5e-3", "--set", "simulate.settle_s=1e-3", "--set", "simulate.step_s=2e-6"];

/// 4,000 rows of a millisecond or more.
const LONG: [&str; 11] = [
    "sweep",
    "--of=simulate",
    "--over=seed=1..4000:4000",
    "--figure=rotor_rate_mean_rad_s",
    "--set=simulate.duration_s=0.02",
    "--set=simulate.settle_s=1e-3",
    "--set=simulate.step_s=2e-6",
    "--format=json",
    "--quiet",
    "--out",
    "swept",
];

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// Rows and manifest of two folders have the same bytes.
#[track_caller]
fn assert_same_sweep(folder: &Path, one: &str, other: &str) {
    for file in ["rows.parquet", "manifest.json", "responses.svg", "tornado.svg"] {
        let [one, other] = [one, other].map(|of| bytes(folder, &format!("{of}/{file}")));
        assert!(one == other, "{file} differs");
    }
}

/// 1, 2 and 7 threads, one part and three, and a part that was made twice: the same bytes. The table is what the
/// command says, and another program reads it.
#[test]
fn exact_threads_and_parts_give_the_same_bytes() {
    let folder = folder();
    let of = |threads, further: &[&str]| {
        output_on(threads, folder.path(), &[&SMALL[..], &SHORT, further].concat())
    };
    for threads in [1, 2, 7] {
        of(threads, &["--out", &format!("on{threads}")]);
    }
    assert_same_sweep(folder.path(), "on1", "on2");
    assert_same_sweep(folder.path(), "on1", "on7");
    for (part, out) in [("3/3", "c"), ("1/3", "a"), ("2/3", "b"), ("2/3", "again")] {
        of(2, &["--shard", part, "--out", out]);
    }
    let merged =
        json_on_two(folder.path(), &["merge", "c", "b", "a", "again", "--out", "whole", "--format", "json"]);
    assert_same_sweep(folder.path(), "on1", "whole");
    assert_eq!((&merged["rows"], &merged["failed"]), (&24.into(), &0.into()));
    refuses(folder.path(), &["merge", "a", "c", "--out", "no"], &["part 2/3 is missing"]);
    // What merge has no flag for is not advised, and no part is to be written over.
    let there = "whole/manifest.json is there already; hint: --force writes over it";
    refuses(folder.path(), &["merge", "a", "b", "c", "--out", "whole"], &[there]);
    of(2, &["--seed", "7", "--shard", "1/3", "--out", "other"]);
    let other =
        "other is no part of the sweep in a: scene = seed = 7, not 1; hint: give one folder of each part";
    refuses(folder.path(), &["merge", "a", "other", "--out", "no"], &[other]);
    std::fs::copy(folder.path().join("c/rows.parquet"), folder.path().join("again/rows.parquet")).unwrap();
    refuses(folder.path(), &["merge", "a", "b", "c", "again", "--out", "no"], &["the same part and differ"]);

    let table = &found(folder.path(), &["whole/rows.parquet"])["whole/rows.parquet"];
    assert_eq!(table["rows"], 24);
    let last = |column: &str| table["columns"][column]["last"].clone();
    assert_eq!(
        (last("row"), last("point"), last("repeat"), last("seed")),
        (23.into(), 11.into(), 1.into(), 2.into())
    );
    assert_eq!((last("motor.friction"), last("simulate.drive")), (0.5.into(), "off".into()));
    // A stator at rest has no impacts: the result says null, and the cell is empty.
    assert_eq!(table["columns"]["collision_frequency_hz"]["count"], 16);
    let plan: Value = serde_json::from_str(&written(folder.path(), "whole/manifest.json")).expect("JSON");
    assert_eq!(
        (&plan["complete"], &plan["scene"]["simulate.duration_s"]),
        (&Value::Bool(true), &5e-3.into())
    );
    let facts = table["metadata"]["sweep"].as_str().expect("text");
    assert!(facts.contains("simulate.duration_s"), "{facts}");
}

/// A row is the command itself with the values of its point and the seed of its repeat.
#[test]
fn exact_a_row_is_what_the_command_prints() {
    let folder = folder();
    let target = ["--set", "position.to_deg=0.5", "--set", "plant.step_s=1e-5"];
    let sweep = [
        "sweep",
        "--over",
        "camera.noise_m=1e-6,4e-6",
        "--repeats",
        "2",
        "--out",
        "swept",
        "--format",
        "json",
    ];
    let figures = ["--figure", "final_error_mdeg", "--figure", "ok"];
    let swept = json_on_two(folder.path(), &[&sweep[..], &figures, &target].concat());
    let of = |noise: &str, seed: &str| {
        let set = format!("camera.noise_m={noise}");
        let flags = ["position", "--set", &set, "--seed", seed, "--format", "json"];
        number(&json_on_two(folder.path(), &[&flags[..], &target].concat()), "final_error_mdeg")
    };
    let found = &found(folder.path(), &["swept/rows.parquet"])["swept/rows.parquet"]["columns"];
    let errors = [of("1e-6", "1"), of("1e-6", "2"), of("4e-6", "1"), of("4e-6", "2")];
    assert_eq!(found["final_error_mdeg"]["last"], errors[3]);
    let sum = ((errors[0] + errors[1]) + errors[2]) + errors[3];
    assert_eq!(found["final_error_mdeg"]["sum"], sum);
    let (least, largest) = (&swept["figures"][0]["min"], &swept["figures"][0]["max"]);
    let least_of = errors.iter().copied().fold(f64::INFINITY, f64::min);
    let largest_of = errors.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    assert_eq!((least, largest), (&least_of.into(), &largest_of.into()));
}

/// Random and Sobol points follow from the seed and their numbers: parts of them are parts of the whole, and another
/// seed gives others.
#[test]
fn exact_drawn_points_follow_from_seed_and_number() {
    let folder = folder();
    for sampling in ["--random", "--sobol"] {
        let of = |further: &[&str]| {
            let flags = ["sweep", "--of", "simulate", "--over", "motor.friction=0.1..0.5", sampling, "5"];
            let over =
                ["--over", "motor.restitution=0.4..0.8", "--figure", "rotor_rate_mean_rad_s", "--force"];
            output_on(2, folder.path(), &[&flags[..], &over, &SHORT, further].concat());
        };
        of(&["--out", "whole"]);
        of(&["--out", "a", "--shard", "1/2"]);
        of(&["--out", "b", "--shard", "2/2"]);
        output_on(1, folder.path(), &["merge", "a", "b", "--out", "merged", "--force"]);
        assert_same_sweep(folder.path(), "whole", "merged");
        of(&["--out", "other", "--seed", "2"]);
        assert_ne!(bytes(folder.path(), "whole/rows.parquet"), bytes(folder.path(), "other/rows.parquet"));
    }
}

/// Killed, interrupted and out of room: what is done is kept, `--resume` makes the rest, and the bytes are those of a
/// sweep that nothing happened to.
#[test]
fn exact_what_stops_a_sweep_changes_no_byte() {
    let folder = folder();
    let journal = folder.path().join("swept/rows.partial.csv");
    let lines = || std::fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    let quiet_and = |further: &[&'static str]| [&LONG[..], further].concat();

    let child = start(folder.path(), "", &LONG);
    wait_until("a row", || lines() > 20);
    refuses(folder.path(), &quiet_and(&["--force"]), &["another sweep writes to swept", "hint"]);
    signal(&child, "KILL");
    child.wait_with_output().expect("it ends");
    let killed = lines();
    assert!((20..4000).contains(&killed), "{killed}");
    refuses(folder.path(), &LONG, &["swept/manifest.json is there already", "--resume", "--force"]);

    let child = start(folder.path(), "", &quiet_and(&["--resume"]));
    wait_until("further rows", || lines() > killed + 20);
    signal(&child, "INT");
    let (code, complaint) = ended(child);
    assert_eq!(code, Some(130), "{complaint}");
    let done = lines() - 1;
    assert!(complaint.contains(&format!("interrupted: {done} of 4000 rows are in swept")), "{complaint}");
    assert!(done < 4000);

    let kilobytes = std::fs::metadata(&journal).expect("a file").len() / 1024 + 2;
    let child = start(folder.path(), &format!("ulimit -f {kilobytes};"), &quiet_and(&["--resume"]));
    let (code, complaint) = ended(child);
    assert_eq!(code, Some(2), "{complaint}");
    assert!(complaint.contains("cannot write swept/rows.partial.csv"), "{complaint}");

    let other = [&LONG[..], &["--resume", "--seed", "7"]].concat();
    refuses(folder.path(), &other, &["swept has another sweep", "seed = 1, not 7"]);
    let resumed = json_on_two(folder.path(), &quiet_and(&["--resume"]));
    assert_eq!(resumed["rows"], 4000);
    let left = [".lock", "manifest.json", "responses.svg", "rows.parquet", "times.parquet", "tornado.svg"];
    assert_eq!(names(&folder.path().join("swept")), left);
    let whole = quiet_and(&["--resume", "--out", "whole"]);
    let whole: Vec<&str> = whole.into_iter().filter(|word| *word != "swept").collect();
    let place = whole.iter().position(|word| *word == "--out").expect("a flag");
    let whole = [&whole[..place], &whole[place + 1..]].concat();
    assert_eq!(json_on_two(folder.path(), &whole)["figures"], resumed["figures"]);
    assert_same_sweep(folder.path(), "swept", "whole");
    assert_eq!(json_on_two(folder.path(), &quiet_and(&["--resume"])), resumed, "done already");
}

/// A reader of standard output that closes it early is no error, and the tables are there.
#[test]
fn tool_a_closed_pipe_costs_no_row() {
    let folder = folder();
    let mut words = vec![env!("CARGO_BIN_EXE_host-sim-under-test")];
    words.extend(SMALL.iter().chain(&SHORT));
    let line = format!("set -o pipefail; {} | true", shlex::try_join(words).expect("no zero byte"));
    let status = std::process::Command::new("bash").args(["-c", &line]).current_dir(folder.path()).output();
    let output = status.expect("bash");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(folder.path().join("out/sweep/rows.parquet").is_file());
}

/// A figure that is one of two keys: all of its variance is by that key, and nothing by the other; its means over
/// slices are the slices. The report has the pictures and the tables behind them.
#[test]
fn exact_indices_of_a_figure_that_is_a_key() {
    let folder = folder();
    let sweep =
        ["sweep", "--of", "simulate", "--indices", "32", "--figure", "duration_s", "--format", "json"];
    let over = ["--over", "simulate.duration_s=4e-3..8e-3", "--over", "motor.friction=0.1..0.5"];
    let flags =
        ["--report", "sweep.html", "--set", "simulate.settle_s=1e-3", "--set", "simulate.step_s=2e-6"];
    let swept = json_on_two(folder.path(), &[&sweep[..], &over, &flags].concat());
    assert_eq!(swept["rows"], 4 * 32);
    let [duration, friction] = [&swept["indices"][0], &swept["indices"][1]];
    assert_eq!(
        (&duration["key"], &friction["key"]),
        (&"simulate.duration_s".into(), &"motor.friction".into())
    );
    for which in ["first", "total"] {
        assert_eq!(friction[which]["estimate"].as_f64().map(f64::abs), Some(0.0), "{friction}");
        let (low, high) = (number(&duration[which], "low"), number(&duration[which], "high"));
        assert!(low < 1.0 && 1.0 < high && high - low < 1.0, "{duration}");
    }
    let slices = swept["responses"][0]["slices"].as_array().expect("slices");
    assert!(slices.len() > 10, "{slices:?}");
    for slice in slices {
        // A slice is 0.25 ms wide.
        assert!((number(slice, "mean") - number(slice, "at")).abs() <= 1.25e-4, "{slice}");
    }
    let page = written(folder.path(), "sweep.html");
    for words in [
        "Which key decides",
        "Which key moves a figure most",
        "How figures follow keys",
        "simulate.duration_s",
    ] {
        assert!(page.contains(words), "{words}");
    }
    for picture in ["indices.svg", "tornado.svg", "responses.svg"] {
        assert!(written(folder.path(), &format!("out/sweep/{picture}")).starts_with("<svg"), "{picture}");
    }
}

/// Runs that are refused cost their own rows: each has its seed and its reason, the others have their figures, and the
/// summary counts them.
#[test]
fn exact_failed_rows_are_marked_and_counted() {
    let folder = folder();
    let sweep =
        ["sweep", "--of", "simulate", "--over", "simulate.settle_s=1e-3,2", "--over", "simulate.drive=b,c"];
    let flags = ["--figure", "rotor_rate_mean_rad_s", "--seed", "9", "--format", "json"];
    let short = ["--set", "simulate.duration_s=5e-3"];
    let swept = json_on_two(folder.path(), &[&sweep[..], &flags, &short].concat());
    assert_eq!((&swept["rows"], &swept["failed"]), (&4.into(), &2.into()));
    assert_eq!(swept["failures"]["refused"], 2);
    let manifest: Value = written(folder.path(), "out/sweep/manifest.json").parse().expect("JSON");
    assert_eq!(manifest["failures"], swept["failures"]);
    assert_eq!(swept["figures"][0]["rows"], 2);
    let failed = &swept["first_failures"][0];
    assert_eq!(
        (&failed["row"], &failed["seed"], &failed["failure"]),
        (&2.into(), &9.into(), &"refused".into())
    );
    assert!(failed["reason"].as_str().is_some_and(|why| why.contains("leaves nothing")), "{failed}");
    let table = &found(folder.path(), &["out/sweep/rows.parquet"])["out/sweep/rows.parquet"]["columns"];
    assert_eq!(table["failure"]["count"], 2);
    assert_eq!(table["rotor_rate_mean_rad_s"]["count"], 2);
}

/// A sweep that would take years is refused by the time of its first row, with the number of rows and the time; a part
/// of it that does not is begun.
#[test]
fn tool_sweeps_beyond_reason_are_refused_with_their_time() {
    let folder = folder();
    let sweep =
        ["sweep", "--of", "simulate", "--over", "motor.friction=0.1..0.5", "--random", "1000000000000"];
    let flags = ["--figure", "rotor_rate_mean_rad_s"];
    let words = ["1000000000000 rows would take ", " days on the ", "hint: --shard I/N makes a part"];
    refuses(folder.path(), &[&sweep[..], &flags, &SHORT].concat(), &words);
    let part = ["--shard", "7/1000000000000", "--format", "json"];
    let swept = json_on_two(folder.path(), &[&sweep[..], &flags, &SHORT, &part, &["--force"]].concat());
    assert_eq!(swept["rows"], 1);
    for (over, words) in [
        ("seed=1..1e5:4", &["seed = 1e5 is not a whole number"][..]),
        ("motor.friction=0.1..0.5", &["a grid needs a count of values of motor.friction", "--random"]),
    ] {
        refuses(folder.path(), &["sweep", "--of", "simulate", "--over", over, "--figure", "ok"], words);
    }
    let huge: Vec<String> = (0..4)
        .map(|key| {
            let key =
                ["motor.friction", "motor.restitution", "simulate.amplitude", "simulate.duration_s"][key];
            format!("{key}=0.1..0.5:1000000")
        })
        .collect();
    let mut flags = vec!["sweep", "--of", "simulate", "--figure", "ok"];
    flags.extend(huge.iter().flat_map(|over| ["--over", over]));
    refuses(folder.path(), &flags, &["more rows than can be counted"]);
}

#[test]
fn tool_figures_and_keys_are_refused_by_name() {
    let folder = folder();
    let refused = |further: &[&str], words: &[&str]| {
        refuses(folder.path(), &[&["sweep", "--of", "simulate"], &SHORT[..], further].concat(), words);
    };
    let over = ["--over", "motor.friction=0.1,0.2"];
    for (figure, words) in [
        (
            "rotor_rate_men_rad_s",
            &["has no figure rotor_rate_men_rad_s", "hint: it has rotor_rate_mean_rad_s"][..],
        ),
        ("drive", &["has no figure drive"]),
        ("wall_s", &["wall_s is a time of this machine", "times.parquet"]),
    ] {
        refused(&[&over[..], &["--figure", figure]].concat(), words);
    }
    refused(&over, &["one figure at least, by --figure", "rotor_rate_mean_rad_s"]);
    refused(&["--over", "motor.frictoin=0.1,0.2"], &["unknown key motor.frictoin", "motor.friction"]);
    refused(&["--over", "camera.noise_m=0,1e-6"], &["simulate does not read camera.noise_m", "position"]);
    refused(&["--over", "motor.restitution=0.1,7"], &["motor.restitution = 7 is outside its bounds"]);
    refused(&[&over[..], &over].concat(), &["motor.friction is swept twice"]);
    // Nothing of it is in the folder, so that the next try is not refused.
    let out = folder.path().join("out/sweep");
    assert!(!out.exists() || names(&out) == [".lock"], "{:?}", names(&out));
    assert_eq!(run(folder.path(), &["sweep"]).status.code(), Some(2));
}
