//! `--log`: what other people's readers find in the logs of a run, and what is left of a run that is interrupted or
//! finds the disk full.

use serde_json::Value;

use crate::support::built_command::{folder, json, number, refuses, succeeds};
use crate::support::closeness::assert_between;
use crate::support::python::found;
use crate::support::started::{ended, names, signal, start, wait_until};

/// A sum of many numbers, in whatever order: equal to rounding.
#[track_caller]
fn assert_same_sum(a: &Value, b: &Value, what: &str) {
    let [a, b] = [a, b].map(|sum| sum.as_f64().expect("a number"));
    assert_between(a - b, -1e-9 * a.abs() - 1e-12, 1e-9 * a.abs() + 1e-12, what);
}

/// A move, logged in each format: the run and its JSON are those of a run without a log, the last truth and the last
/// estimate are those of the JSON, samples and frames are as many as the instruments make, and all formats agree.
#[test]
fn tool_other_readers_find_the_run_in_its_logs() {
    let folder = folder();
    let run = |further: &[&str]| {
        let arguments = ["position", "--to", "5", "--seed", "3", "--format", "json", "--log-every", "1"];
        json(folder.path(), &[&arguments[..], further].concat())
    };
    let outcome = json(folder.path(), &["position", "--to", "5", "--seed", "3", "--format", "json"]);
    let logs = ["run.mcap", "run.parquet", "run.csv"];
    for log in logs {
        assert_eq!(run(&["--log", log]), outcome, "{log}");
    }
    let found = found(folder.path(), &logs);
    let (mcap, topics) = (&found["run.mcap"], &found["run.mcap"]["topics"]);

    let duration_s = number(&outcome, "duration_s");
    let truth = &topics["/truth"];
    assert_eq!(truth["schema"], "micromotor.Truth");
    assert_eq!(truth["last"]["angle_deg"], outcome["final_angle_true_deg"]);
    assert_between(number(truth, "count"), 1e5 * duration_s - 0.5, 1e5 * duration_s + 0.5, "ticks");
    let units = number(&truth["last"], "angle_units") * 360.0 / 4_294_967_296.0;
    assert_between(units - number(&truth["last"], "angle_deg"), -1e-9, 1e-9, "degrees beside units");
    let samples = number(&topics["/vibrometer"], "count");
    assert_between(samples, 2e5 * duration_s - 2.0, 2e5 * duration_s + 2.0, "samples of 200 kHz");
    let frames = number(&topics["/camera"], "count");
    // Two frames may be on their way at the end.
    assert_between(frames, 1e4 * duration_s - 3.0, 1e4 * duration_s, "frames of 10 kHz");
    for topic in ["/camera/marks", "/innovation"] {
        assert_eq!(topics[topic]["count"], topics["/camera"]["count"], "{topic}");
    }
    let phases = number(&topics["/phase"], "count");
    assert!(phases >= 3.0 && topics["/phase"]["last"]["phase"] == "Holding", "{}", topics["/phase"]);
    let drives = number(&topics["/drive"], "count");
    assert!(drives > number(&outcome, "drive_switches"), "{drives}");
    assert!(number(&topics["/truth/impact"], "count") > 1.0);
    let error = number(&topics["/estimate"]["last"], "error_mdeg");
    assert!(error.abs() < 5.0 * number(&topics["/estimate"]["last"], "angle_sd_mdeg"), "{error}");

    assert_eq!(mcap["metadata"]["end"]["ended"], "whole");
    assert_eq!(mcap["metadata"]["host-sim"]["command"], "position");
    assert_eq!(found["run.parquet"]["metadata"]["filter"], outcome["filter"]);
    assert!(mcap["attachments"]["scene.toml"].as_str().is_some_and(|scene| scene.contains("to_deg = 5")));
    let result = mcap["attachments"]["result.json"].as_str().expect("text");
    assert_eq!(serde_json::from_str::<Value>(result).expect("JSON"), outcome);

    let column = |log: &str, name: &str, what: &str| found[log]["columns"][name][what].clone();
    for log in ["run.parquet", "run.csv"] {
        for (name, topic, field) in [
            ("vibrometer_m_s", "/vibrometer", "velocity_m_s"),
            ("camera_angle_deg", "/camera", "angle_deg"),
            ("truth_angle_deg", "/truth", "angle_deg"),
            ("estimate_angle_deg", "/estimate", "angle_deg"),
            ("estimate_angle_sd_mdeg", "/estimate", "angle_sd_mdeg"),
            ("marks_residual_m", "/camera/marks", "residual_m"),
        ] {
            assert_eq!(column(log, name, "count"), topics[topic]["count"], "{log} {name}");
            assert_same_sum(&column(log, name, "sum"), &topics[topic]["sums"][field], name);
        }
        assert_eq!(column(log, "phase", "last"), "Holding", "{log}");
    }
    for name in ["time_s", "impact_kick_rad_s", "innovation_mdeg", "drive_amplitude"] {
        assert_eq!(column("run.csv", name, "sum"), column("run.parquet", name, "sum"), "{name}");
    }
}

/// A run of a thousand seconds is told to end, as Ctrl-C does, once a few megabytes are written: its log opens, and has
/// the run up to the time that it says. The log that was there stays.
#[test]
fn tool_an_interrupted_run_leaves_a_log_that_opens() {
    let folder = folder();
    let arguments = ["rate", "--duration", "1000", "--log", "run.mcap", "--out", "run.svg"];
    std::fs::write(folder.path().join("run.mcap"), "old").expect("a folder");
    let child = start(folder.path(), "", &arguments);
    let written = || {
        let entries = std::fs::read_dir(folder.path()).expect("a folder").flatten();
        entries.filter_map(|entry| entry.metadata().ok()).map(|metadata| metadata.len()).max().unwrap_or(0)
    };
    wait_until("a part of the log", || written() >= 4_000_000);
    signal(&child, "INT");
    let (code, complaint) = ended(child);
    assert_eq!(code, Some(130), "{complaint}");
    assert!(complaint.contains("interrupted; run.partial.mcap has the run up to "), "{complaint}");
    assert_eq!(names(folder.path()), ["run.mcap", "run.partial.mcap"]);
    assert_eq!(std::fs::read_to_string(folder.path().join("run.mcap")).expect("text"), "old");
    let found = &found(folder.path(), &["run.partial.mcap"])["run.partial.mcap"];
    assert_eq!(found["metadata"]["end"]["ended"], "interrupted");
    let truth = &found["topics"]["/truth"];
    let until_s = 1e-9 * number(&truth["last"], "log_time");
    let said = complaint.split("up to ").nth(1).and_then(|rest| rest.split(' ').next());
    let said_s: f64 = said.expect("a time").parse().expect("a number");
    assert_between(said_s - until_s, -5.1e-5, 1.6e-4, "said less last truth");
    assert!(until_s > 0.05 && number(truth, "count") > 500.0, "{until_s}");
}

/// A file may not grow beyond 3 MiB, as on a full disk: in each format the run ends with one line, and the log opens.
#[test]
fn tool_a_full_disk_leaves_a_log_that_opens() {
    let folder = folder();
    let logs = ["run.mcap", "run.parquet", "run.csv"];
    for log in logs {
        let arguments = ["rate", "--duration", "1000", "--log", log, "--out", "run.svg"];
        let (code, complaint) = ended(start(folder.path(), "ulimit -f 3072;", &arguments));
        assert_eq!(code, Some(2), "{complaint}");
        let words = ["the log stopped: ", &format!("{log} has the run up to "), "hint: free some space"];
        for word in words {
            assert!(complaint.contains(word), "{word} is not in {complaint}");
        }
    }
    let found = found(folder.path(), &logs);
    let truths = [
        &found["run.mcap"]["topics"]["/truth"]["count"],
        &found["run.parquet"]["columns"]["truth_angle_deg"]["count"],
        &found["run.csv"]["columns"]["truth_angle_deg"]["count"],
    ];
    for (truths, log) in truths.into_iter().zip(logs) {
        // 22 samples and frames of 10 to 60 bytes stand between two truths.
        assert!(truths.as_f64().is_some_and(|truths| truths > 200.0), "{log}: {truths}");
        let bytes = std::fs::metadata(folder.path().join(log)).expect("a file").len();
        assert!(bytes <= 3 << 20, "{log}: {bytes}");
    }
    assert_eq!(found["run.mcap"]["metadata"]["end"]["ended"], "no room");
    assert_eq!(found["run.parquet"]["metadata"]["ended"], "no room");
    assert_eq!(names(folder.path()), ["run.csv", "run.mcap", "run.parquet"]);
}

#[test]
fn tool_logs_are_refused_before_the_run() {
    let folder = folder();
    for (arguments, words) in [
        (
            &["--log", "run.txt"][..],
            &["run.txt does not say which kind", "hint: a name that ends in .mcap"][..],
        ),
        (&["--log", "nowhere/run.mcap"], &["nowhere/run.mcap", "its folder does not exist"]),
        (&["--log", "/dev/null.csv/run.csv"], &["/dev/null.csv/run.csv"]),
        (&["--log-every", "5"], &["--log"]),
        (&["--log", "run.csv", "--log-every", "0"], &["--log-every = 0", "1 to 1000000"]),
    ] {
        refuses(folder.path(), &[&["position", "--to", "2"], arguments].concat(), words);
    }
    assert!(names(folder.path()).iter().all(|name| name == "out"), "{:?}", names(folder.path()));
}

/// What is refused after the log was opened leaves no file, whatever the kind of the log.
#[test]
fn tool_a_run_that_is_refused_leaves_no_file() {
    let folder = folder();
    for log in ["a.mcap", "a.parquet", "a.csv"] {
        let record = ["record", "--schedule", "b:1@1 for 0.1", "--log", log];
        refuses(folder.path(), &record, &["more than 2000 Hz from motor.mode_b.frequency_hz"]);
        assert!(names(folder.path()).is_empty(), "{log}: {:?}", names(folder.path()));
    }
    let stator = ["record", "--model", "stator", "--set", "ldv.installed=no", "--log", "a.mcap"];
    refuses(folder.path(), &stator, &["measures nothing", "hint: "]);
    let hub = ["--set", "camera.marks=1", "--fault", "hub:rub:0.8", "--out", "a.svg", "--log", "a.mcap"];
    refuses(folder.path(), &[&["position"], &hub[..]].concat(), &["hint: "]);
    assert!(names(folder.path()).is_empty(), "{:?}", names(folder.path()));
}

/// A log does not take the place of what it is made from, by whatever name.
#[test]
fn tool_a_log_is_not_written_over_what_is_read() {
    let folder = folder();
    for log in ["run.mcap", "run.csv"] {
        succeeds(folder.path(), &["record", "--schedule", "b:1 for 0.005", "--log", log]);
    }
    let before = ["run.mcap", "run.csv"].map(|log| std::fs::read(folder.path().join(log)).expect("a log"));
    let words =
        |log: &str| [format!("--log {log} would be written over a file that is read"), "hint: ".into()];
    for (arguments, log) in [
        (&["replay", "run.mcap"][..], "./run.mcap"),
        (&["import", "--camera", "run.csv", "--camera-angle", "camera_angle_deg"], "run.csv"),
    ] {
        let words = words(log);
        refuses(
            folder.path(),
            &[arguments, &["--log", log]].concat(),
            &words.each_ref().map(|word| &word[..]),
        );
    }
    let after = ["run.mcap", "run.csv"].map(|log| std::fs::read(folder.path().join(log)).expect("a log"));
    assert!(before == after);
}

/// A log replayed with nothing changed computes every recorded estimate and innovation to the last bit, for a move with
/// faults of both instruments and for a rate of a rotor that tilts under commands that act later; its errors are those
/// recorded. A replay's own log replays the same.
#[test]
fn tool_a_replay_computes_the_recorded_bits() {
    let folder = folder();
    let faults = ["--fault", "camera:lost@0.03..0.05", "--fault", "ldv:inverted@0.06..", "--log", "a.mcap"];
    let of_move = [&["position", "--to", "10", "--format", "json"][..], &faults].concat();
    let later = ["--set", "board.latency_ticks=7", "--log", "b.mcap"];
    let of_rate = [&["rate", "--duration", "1", "--set", "plant.rotor=tilting"][..], &later].concat();
    let moved = json(folder.path(), &of_move);
    succeeds(folder.path(), &of_rate);
    for log in ["a.mcap", "b.mcap"] {
        let replayed = json(folder.path(), &["replay", log, "--strict", "--format", "json"]);
        assert_eq!(replayed["different"], 0, "{log}: {replayed}");
        assert!(number(&replayed, "same") > 1000.0, "{log}: {replayed}");
        assert_eq!(replayed["recorded"], replayed["replayed"], "{log}");
        assert_eq!(replayed["damage"], Value::Null);
        assert_eq!((&replayed["command"], &replayed["version"]), (&"replay".into(), &moved["version"]));
        let first = &replayed["key_figures"][0];
        assert_eq!(
            (&first["name"], &first["value"]),
            (&"error of the angle".into(), &replayed["replayed"]["rms_error_mdeg"])
        );
    }
    // A loop that decides in one of eight ticks is compared where it did.
    let slowly = ["--set", "board.decision_ticks=8", "--set", "board.latency_ticks=13", "--log", "d.mcap"];
    succeeds(folder.path(), &[&["position", "--to", "-3", "--log-every", "1"][..], &slowly].concat());
    let replayed = json(folder.path(), &["replay", "d.mcap", "--strict", "--format", "json"]);
    assert_eq!(replayed["different"], 0, "{replayed}");
    assert!(number(&replayed, "same") > 1000.0, "{replayed}");
    let again = json(folder.path(), &["replay", "a.mcap", "--log", "c.mcap", "--format", "json"]);
    assert_eq!(json(folder.path(), &["replay", "c.mcap", "--format", "json"])["different"], 0);
    assert_eq!(again["recorded"]["filter"], moved["filter"]);
    let simpler = ["replay", "a.mcap", "--filter", "constant_rate", "--format", "json"];
    let simpler = json(folder.path(), &simpler);
    assert_eq!(simpler["recorded"], again["recorded"]);
    assert!(number(&simpler, "different") > 1000.0 && simpler["replayed"]["filter"] == "constant_rate");
    assert_eq!(simpler["scene"]["estimator.filter"], "constant_rate");
    // Half the noise assumed: innovations are the larger beside what is predicted.
    let tuned = ["replay", "b.mcap", "--set", "estimator.assumed.camera.noise_m=0.2e-6", "--format", "json"];
    let tuned = json(folder.path(), &tuned);
    assert!(number(&tuned["replayed"], "nis") > 1.5 * number(&tuned["recorded"], "nis"), "{tuned}");
}

/// What went wrong stands in the explanation, when it did.
#[test]
fn tool_explain_says_what_went_wrong_and_when() {
    let folder = folder();
    let explained = |arguments: &[&str]| {
        let log = ["--to", "10", "--log", "run.mcap", "--format", "json"];
        json(folder.path(), &[&["position"][..], arguments, &log].concat());
        json(folder.path(), &["explain", "run.mcap", "--format", "json"])
    };
    let told = |explanation: &Value, words: &str, from_s: f64, until_s: f64| {
        let events = explanation["events"].as_array().expect("events");
        let there = events.iter().any(|event| {
            event["sentence"].as_str().is_some_and(|sentence| sentence.contains(words))
                && (from_s..until_s).contains(&number(event, "from_s"))
        });
        assert!(there, "{words}, {from_s} to {until_s} s: {explanation:#}");
    };
    let blind = explained(&["--fault", "camera:lost@0.02..0.04"]);
    told(&blind, "No frame had arrived", 0.02, 0.021);
    assert_eq!((&blind["command"], &blind["logged_command"]), (&"explain".into(), &"position".into()));
    assert_eq!(blind["scene"]["faults"][0], "camera:lost@0.02..0.04", "{:#}", blind["scene"]);
    assert_eq!(blind["key_figures"][1]["value"].as_f64(), blind["frames_refused"].as_f64());
    told(&blind, "cruise", 0.0, 0.02);
    told(&blind, "at the target", 0.02, 10.0);
    let wrong = explained(&["--fault", "camera:offset:30@0.02..0.03"]);
    told(&wrong, "standard deviations from what the filter predicts", 0.02, 0.0203);
    assert!(number(&wrong, "frames_refused") > 5.0, "{wrong:#}");
    let dead = explained(&["--fault", "drive:dead"]);
    told(&dead, "the controller gives up: neither mode turns the rotor", 0.0, 60.0);
    let text = succeeds(folder.path(), &["explain", "run.mcap"]);
    assert!(text.contains("the controller has given up, and the run ends"), "{text}");
}

/// A log that is cut is read up to there, and refused with `--strict`; what is no log of this program is refused.
#[test]
fn tool_damaged_logs_are_read_up_to_the_damage() {
    let folder = folder();
    json(folder.path(), &["position", "--to", "3", "--log", "run.mcap", "--format", "json"]);
    let whole = std::fs::read(folder.path().join("run.mcap")).expect("a log");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("a folder");
    // Two of its chunks of a megabyte are whole.
    write("cut.mcap", &whole[..whole.len().min(2_600_000)]);
    let mut changed = whole.clone();
    changed[1_500_000] ^= 1;
    write("changed.mcap", &changed);
    for (log, why) in [("cut.mcap", "ended in the middle"), ("changed.mcap", "CRC failed")] {
        let replayed = json(folder.path(), &["replay", log, "--format", "json"]);
        let damage = replayed["damage"].as_str().expect("damage");
        assert!(damage.contains(why) && damage.contains(log), "{damage}");
        assert_eq!(replayed["different"], 0, "{log}");
        assert!(number(&replayed, "same") > 100.0, "{log}");
        refuses(folder.path(), &["replay", log, "--strict"], &[log, "damaged after", why, "hint: without"]);
        refuses(folder.path(), &["explain", log, "--strict"], &[log, "damaged after", why]);
        assert!(succeeds(folder.path(), &["explain", log]).contains("the log breaks off here"));
    }
    write("text.mcap", b"time_s,angle_deg\n0,1\n");
    write("head.mcap", &whole[..40]);
    write("empty.mcap", b"");
    for (log, words) in [
        (
            "text.mcap",
            &["text.mcap is no log of host-sim", "does not begin as one", "hint: `position --log"][..],
        ),
        ("head.mcap", &["head.mcap is no log of host-sim", "ends before its head"]),
        ("empty.mcap", &["empty.mcap is no log of host-sim"]),
        ("nowhere.mcap", &["cannot read nowhere.mcap"]),
    ] {
        refuses(folder.path(), &["replay", log], words);
        refuses(folder.path(), &["explain", log], words);
    }
    refuses(
        folder.path(),
        &["replay", "run.mcap", "--set", "plant.step_s=1e-6"],
        &["replay does not read plant.step_s", "hint: it reads keys estimator. and motor."],
    );
}
