//! `identify`: what short recordings tell, the scene that is written, what is advised, what is refused.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::awkward_tables::{self, CLOCK, TABLES};
use crate::support::built_command::{folder, json, number, refuses, succeeds, written};
use crate::support::closeness::assert_between;

/// Both modes and the rests after them.
const OF_MOTOR: &str = "b:1 for 0.06, off for 0.02, c:1 for 0.06, off for 0.02";
/// Mode B alone.
const RINGING: &str = "b:1 for 0.02, off for 0.012";

/// Long enough to tell something, hardly.
const SHORT: &str = "b:1 for 0.03";

/// Records the motor that seed 7 draws.
fn record(folder: &Path, log: &str, flags: &[&str]) {
    succeeds(folder, &[&["record", "--seed", "7", "--log", log], flags].concat());
}

fn identify(folder: &Path, flags: &[&str]) -> Value {
    json(folder, &[&["identify", "--motors", "100", "--format", "json", "--quiet"], flags].concat())
}

fn parameter<'a>(found: &'a Value, key: &str) -> &'a Value {
    let all = found["parameters"].as_array().expect("a list");
    all.iter().find(|parameter| parameter["key"] == key).unwrap_or_else(|| panic!("{key}: {found}"))
}

/// Each parameter that is told has an interval about its mean that is narrower than before, each other one none.
fn assert_well_formed(found: &Value) {
    for parameter in found["parameters"].as_array().expect("a list") {
        if parameter["told"] == true {
            let [low, high] = [0, 1].map(|end| parameter["interval"][end].as_f64().expect("an end"));
            let mean = number(parameter, "mean");
            assert!(low < mean && mean < high, "{parameter}");
            // The prior ends two standard deviations from its mean, which are 2.28 of what the cut leaves of them.
            let [from, until] = [-2.28, 2.28]
                .map(|sds| number(parameter, "prior_mean") + sds * number(parameter, "prior_sd"));
            assert!(from < low && high < until, "{parameter}");
            assert!(number(parameter, "expected_ratio") < 0.8, "{parameter}");
        } else {
            for field in ["mean", "sd", "interval"] {
                assert!(parameter[field].is_null(), "{parameter}");
            }
            let said = parameter["advice"].as_str().expect("a sentence");
            assert!(said.contains("is not told by these recordings"), "{parameter}");
        }
    }
}

/// Two recordings of a motor that tilts, and the scene that is written: `scene` and `position` take it.
#[test]
fn tool_what_is_identified_is_a_scene_that_commands_take() {
    let folder = folder();
    let path = folder.path();
    record(path, "run.mcap", &["--rotor", "tilting", "--schedule", OF_MOTOR]);
    record(path, "ring.mcap", &["--model", "stator", "--schedule", RINGING]);
    let found = identify(path, &["run.mcap", "ring.mcap", "--no-advice", "--out", "mine"]);
    assert_eq!(found["rotor"], "tilting");
    assert_well_formed(&found);
    let hz = parameter(&found, "motor.mode_b.frequency_hz");
    let shown = succeeds(path, &["scene", "mine/identified.toml", "--only-set", "--format", "json"]);
    let keys: Value = serde_json::from_str(&shown).expect("JSON");
    let value = |key: &str| {
        let keys = keys.as_array().expect("a list");
        keys.iter().find(|one| one["key"] == key).unwrap_or_else(|| panic!("{key}: {keys:?}"))["value"]
            .clone()
    };
    // Seven digits stand in the file.
    let stands = |key: &str, expected: f64| {
        let stands = value(key).as_f64().expect("a number");
        assert!((stands / expected - 1.0).abs() < 1e-6, "{key}: {stands} {expected}");
    };
    stands("motor.mode_b.frequency_hz", number(hz, "mean"));
    stands("plant.tolerance.motor.mode_b.frequency_hz", 2.0 * number(hz, "sd"));
    assert_eq!(value("plant.rotor"), "tilting");
    for name in ["posterior.svg", "fit.svg"] {
        assert!(written(path, &format!("mine/{name}")).starts_with("<svg"), "{name}");
    }
    // The map of the design is made first.
    let moved = ["position", "--scene", "mine/identified.toml", "--to", "2", "--quiet", "--format", "json"];
    let moved = json(path, &moved);
    assert!(moved["stopped"].is_null(), "{moved}");
}

/// A ring-down of one mode tells nothing of the other mode nor of the rotor. The recordings that would are named.
#[test]
fn tool_a_parameter_that_is_not_told_names_the_recording_that_would_tell_it() {
    let folder = folder();
    let path = folder.path();
    record(path, "ring.mcap", &["--model", "stator", "--schedule", RINGING]);
    let found = identify(path, &["ring.mcap"]);
    assert_well_formed(&found);
    assert_eq!(parameter(&found, "motor.mode_b.frequency_hz")["told"], true);
    let advised = |key: &str, recordings: &[&str]| {
        let parameter = parameter(&found, key);
        let recording = parameter["further_recording"].as_str().unwrap_or_else(|| panic!("{parameter}"));
        assert!(recordings.contains(&recording), "{parameter}");
        assert!(parameter["advice"].as_str().expect("a sentence").contains(recording), "{parameter}");
        assert_between(number(parameter, "further_ratio"), 0.0, 0.8, key);
        let command = parameter["further_command"].as_str().expect("a command");
        assert!(command.starts_with("record "), "{command}");
    };
    let of_stator = ["the ring-down of the bare stator", "a sweep of the bare stator"];
    let of_rotor = [
        "full drive in B and coasting",
        "full drive in C and coasting",
        "half drive in B and coasting",
        "half drive in C and coasting",
    ];
    advised("motor.mode_c.frequency_hz", &of_stator);
    advised("motor.mode_c.damping_ratio", &of_stator);
    advised("motor.vertical_damping_n_s_per_m", &of_rotor);
}

/// Tables that a laboratory made of a recording tell what its own log tells.
#[test]
fn tool_an_import_tells_what_the_log_tells() {
    let folder = folder();
    let path = folder.path();
    let one_mark = ["--set", "camera.marks=1", "--schedule", OF_MOTOR];
    for (log, every) in [("own.csv", "1"), ("own.mcap", "100")] {
        record(path, log, &[&one_mark[..], &["--log-every", every]].concat());
    }
    awkward_tables::write(path);
    let import = [&TABLES[..], &awkward_tables::corrections(CLOCK), &["--log", "imported.mcap"]];
    succeeds(path, &import.concat());
    let own = identify(path, &["own.mcap", "--no-advice"]);
    let imported = identify(path, &["imported.mcap", "--no-advice"]);
    assert_well_formed(&imported);
    let mut compared = 0;
    for one in own["parameters"].as_array().expect("a list").iter().filter(|one| one["told"] == true) {
        let key = one["key"].as_str().expect("a key");
        let other = parameter(&imported, key);
        // Each is known from 50 motors to a tenth, their ratio to 14 %: three of these.
        let ratio = number(other, "expected_ratio") / number(one, "expected_ratio");
        assert_between(ratio, 0.7, 1.43, key);
        if let Some(mean) = other["mean"].as_f64() {
            // The frames of 10 ms are missing in it, of 120 ms; all else is the same.
            let apart = number(one, "mean") - mean;
            assert!(apart.abs() < number(one, "sd"), "{key}: {one} {other}");
            compared += 1;
        }
    }
    assert!(compared > 0, "{own}");
    // Of independent statistics 95 % lie within two standard deviations. These hang together.
    let fit = imported["fit"].as_array().expect("a list");
    let off =
        |one: &Value| (number(one, "measured") - number(one, "predicted")) / number(one, "sd").max(1e-300);
    let within = fit.iter().filter(|one| off(one).abs() < 2.0).count();
    assert!(4 * within > 3 * fit.len(), "{within} of {}", fit.len());
}

/// A sweep of a bare stator from a table with a column of frequencies.
#[test]
fn tool_an_imported_sweep_tells_its_frequency() {
    let folder = folder();
    let path = folder.path();
    let (design_hz, swept) = (6300.0, "b:0.2@6240..6360 for 0.06, off for 0.02");
    record(path, "own.csv", &["--model", "stator", "--schedule", swept]);
    let text = written(path, "own.csv");
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let columns = lines.next().expect("names");
    let place = |name: &str| columns.iter().position(|column| *column == name).expect("a column");
    let [time, mode, amplitude, offset] =
        ["time_s", "drive_mode", "drive_amplitude", "drive_frequency_offset_hz"].map(place);
    let mut drives = "t_ms,drive_mode,drive_amplitude,f_kHz\n".to_owned();
    for cells in lines.filter(|cells| !cells[mode].is_empty()) {
        let number = |place: usize| cells[place].parse::<f64>().unwrap_or(0.0);
        let (at_ms, khz) = (1e3 * number(time), 1e-3 * (design_hz + number(offset)));
        writeln!(drives, "{at_ms:.6},{},{},{khz:.6}", cells[mode], cells[amplitude]).expect("a text");
    }
    fs::write(path.join("drive.csv"), drives).expect("a folder");
    let import = [
        "import",
        "--model",
        "stator",
        "--vibrometer",
        "own.csv",
        "--vibrometer-velocity",
        "vibrometer_m_s",
        "--drive",
        "drive.csv",
        "--drive-time",
        "t_ms",
        "--drive-frequency",
        "f_kHz",
        "--log",
        "sweep.mcap",
    ];
    succeeds(path, &import);
    let found = identify(path, &["sweep.mcap", "--no-advice"]);
    let hz = parameter(&found, "motor.mode_b.frequency_hz");
    // The prior is wider than 10 Hz. A resonance of 80 Hz width, seen at 60 frequencies, is known to far below 1 Hz.
    assert!(number(hz, "sd") < 1.0, "{hz}");
    let statistics = found["fit"].as_array().expect("a list");
    assert!(statistics.iter().any(|one| one["name"] == "sweep 1 frequency"), "{found}");
    refuses(path, &[&import[..], &["--camera", "own.csv"]].concat(), &["--camera", "--model motor"]);
}

/// What is no recording of one motor is refused in one line with a hint.
#[test]
fn tool_what_is_no_recording_of_one_motor_is_refused() {
    let folder = folder();
    let path = folder.path();
    record(path, "ring.mcap", &["--model", "stator", "--schedule", RINGING]);
    record(path, "ring.csv", &["--model", "stator", "--schedule", RINGING]);
    record(path, "ring.parquet", &["--model", "stator", "--schedule", RINGING]);
    record(path, "steady.mcap", &["--model", "stator", "--schedule", "b:1 for 0.03"]);
    succeeds(path, &["record", "--seed", "8", "--schedule", SHORT, "--log", "eight.mcap"]);
    let other = ["--set", "motor.friction=0.3", "--schedule", SHORT];
    record(path, "other.mcap", &other);
    fs::write(path.join("empty.mcap"), "").expect("a folder");
    fs::write(path.join("head.mcap"), &fs::read(path.join("ring.mcap")).expect("a log")[..300])
        .expect("a folder");
    for (arguments, said) in [
        (&["none.mcap"][..], "none.mcap"),
        (&["ring.csv"], "`import` makes one"),
        (&["ring.parquet"], "`import` makes one"),
        (&["empty.mcap"], "`record --log FILE.mcap` makes one"),
        (&["head.mcap"], "head.mcap"),
        (&["steady.mcap"], "hint: `host-sim record --scene record_ring_down"),
        (&["ring.mcap", "eight.mcap"], "hint: record both with the same seed"),
        (&["ring.mcap", "other.mcap"], "hint: give the recordings the same keys motor."),
        (
            &["ring.mcap", "./ring.mcap"],
            "ring.mcap and ./ring.mcap are one file; hint: give each recording once",
        ),
        (&["ring.mcap", "--rotor", "rolling"], "tilting"),
        (&["ring.mcap", "--motors", "10"], "bounds 100"),
        (&["ring.mcap", "--prior-width", "0"], "0.1 to 10"),
        (&[], "hint: "),
    ] {
        refuses(path, &[&["identify"], arguments].concat(), &[said]);
    }
    assert!(!path.join("out").exists(), "nothing is written");
}

/// A log that breaks off is read up to there, and the result says where.
#[test]
fn tool_a_damaged_log_is_read_up_to_the_damage() {
    let folder = folder();
    let path = folder.path();
    record(path, "ring.mcap", &["--model", "stator", "--schedule", "(b:1 for 0.02, off for 0.012) x8"]);
    let whole = fs::read(path.join("ring.mcap")).expect("a log");
    fs::write(path.join("cut.mcap"), &whole[..whole.len() * 3 / 4]).expect("a folder");
    let found = identify(path, &["cut.mcap", "--no-advice"]);
    assert!(
        found["damage"][0].as_str().is_some_and(|said| said.contains("cut.mcap is damaged after 0.")),
        "{found}"
    );
    assert_eq!(parameter(&found, "motor.mode_b.frequency_hz")["told"], true);
    assert_eq!(identify(path, &["ring.mcap", "--no-advice"])["damage"], Value::Array(vec![]));
}
