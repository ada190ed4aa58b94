//! The built command, as a user runs it: results, refusals, determinism.

use serde_json::Value;

use crate::support::built_command::{folder, json, number, refuses, run, succeeds};
use crate::support::closeness::assert_between;

/// The documented fields, with values that the model is known to give: bands of six standard deviations of a run of two
/// seconds.
#[test]
fn tool_simulate_reports_plausible_figures_as_json() {
    let folder = folder();
    let b = json(folder.path(), &["simulate", "--drive", "b", "--format", "json"]);
    assert_between(number(&b, "rotor_rate_mean_rad_s"), 11.0, 17.4, "mode B, rate");
    assert_between(number(&b, "impacts_per_s"), 210.0, 320.0, "mode B, impacts");
    assert_between(number(&b, "collision_frequency_hz"), 30.0, 140.0, "mode B, collisions");
    assert_between(number(&b, "collision_amplitude_m_s"), 3e-3, 15e-3, "mode B, collision amplitude");
    let c = json(folder.path(), &["simulate", "--drive", "c", "--format", "json"]);
    assert_between(number(&c, "rotor_rate_mean_rad_s"), -1.68, -1.38, "mode C, rate");
    assert_between(number(&c, "impacts_per_s"), 2150.0, 2500.0, "mode C, impacts");
    assert_between(number(&c, "collision_frequency_hz"), 300.0, 600.0, "mode C, collisions");
    assert_between(number(&c, "collision_amplitude_m_s"), 0.5e-3, 2.5e-3, "mode C, collision amplitude");
    for report in [&b, &c] {
        assert_between(number(report, "steps"), 2e6, 2e6, "2 s in steps of 1 us");
        assert_between(number(report, "rotor_rate_sd_rad_s"), 1e-6, 5.0, "scatter of the rate");
        assert_between(number(report, "wall_s"), 0.0, 60.0, "time taken");
    }
}

/// The drive off: nothing turns.
#[test]
fn tool_simulate_off_stands_still() {
    let folder = folder();
    let arguments = ["simulate", "--drive", "off", "--duration", "0.6", "--format", "json"];
    let report = json(folder.path(), &arguments);
    assert_between(number(&report, "rotor_rate_mean_rad_s"), -1e-5, 1e-5, "rate");
    assert_between(number(&report, "impacts_per_s"), 0.0, 0.0, "impacts faster than 1 mm/s");
}

/// A flag, a key and a scene file that say the same give the same run, and it differs from the default one.
#[test]
fn tool_flag_key_and_file_agree() {
    let folder = folder();
    std::fs::write(
        folder.path().join("scene.toml"),
        "seed = 5\n[simulate]\nduration_s = 0.6\ndrive = \"b\"\nprecision = \"f32\"\n\
         [motor]\nstator_mass_kg = 9.7e-6\n",
    )
    .expect("a writable folder");
    let bare = |arguments: &[&str]| {
        let mut report = json(folder.path(), arguments);
        report.as_object_mut().expect("an object").remove("wall_s");
        report
    };
    let words = |line: &str| -> Value { bare(&line.split(' ').collect::<Vec<_>>()) };
    let by_flags = words(
        "simulate --seed 5 --duration 0.6 --drive b --precision f32 --set motor.stator_mass_kg=9.7e-6 --format json",
    );
    let by_file = bare(&["simulate", "--scene", "scene.toml", "--format", "json"]);
    let by_keys = words(
        "simulate --set seed=5 --set simulate.duration_s=0.6 --set simulate.drive=b --set simulate.precision=f32 \
         --set motor.stator_mass_kg=9.7e-6 --format json",
    );
    assert_eq!(by_flags, by_file);
    assert_eq!(by_flags, by_keys);
    let other = bare(&["simulate", "--scene", "scene.toml", "--seed", "6", "--format", "json"]);
    assert_ne!(by_file["rotor_rate_mean_rad_s"], other["rotor_rate_mean_rad_s"], "another seed, another run");
}

/// Same scene and seed, same bytes: report and CSV.
#[test]
fn tool_same_seed_same_bytes() {
    let folder = folder();
    let runs = ["first.csv", "second.csv"].map(|file| {
        let arguments = ["simulate", "--seed", "11", "--duration", "0.6", "--out", file, "--format", "json"];
        let text = succeeds(folder.path(), &arguments);
        let mut report: Value = serde_json::from_str(&text).expect("JSON");
        report.as_object_mut().expect("an object").remove("wall_s");
        let csv = std::fs::read(folder.path().join(file)).expect("the CSV is there");
        (report.to_string(), csv)
    });
    assert_eq!(runs[0], runs[1]);
    let csv = String::from_utf8(runs[0].1.clone()).expect("text");
    let header: Vec<&str> = csv.lines().next().expect("a header").split(',').collect();
    for column in ["time_s", "height_m", "velocity_m_s", "angle_deg", "rate_rad_s"] {
        assert!(header.contains(&column), "{header:?}");
    }
    for line in csv.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        assert_eq!(cells.len(), header.len());
        for (column, cell) in header.iter().zip(cells).filter(|(column, _)| **column != "drive") {
            let value: f64 = cell.parse().expect("a number");
            assert!(value.is_finite(), "{column} in {line}");
        }
    }
    // A row every 50 us.
    assert_between(f64::from(u32::try_from(csv.lines().count()).expect("few")), 11_900.0, 12_100.0, "rows");
}

#[test]
fn tool_refusals_name_key_value_bounds_and_the_nearest_key() {
    let folder = folder();
    let cases: &[(&[&str], &[&str])] = &[
        (&["--set", "motor.stator_mas_kg=1e-5"], &["motor.stator_mas_kg", "motor.stator_mass_kg"]),
        (&["--set", "motor.frictoin=0.4"], &["motor.frictoin", "motor.friction"]),
        (&["--set", "motor.restitution=1.5"], &["motor.restitution", "1.5", "0 to 1"]),
        (&["--set", "motor.stator_mass_kg=-1e-6"], &["motor.stator_mass_kg", "-1e-6", "1e-9 to 1"]),
        (&["--set", "motor.friction=NaN"], &["motor.friction", "NaN", "0 to 1e6"]),
        (&["--set", "motor.friction=inf"], &["motor.friction", "inf", "0 to 1e6"]),
        (&["--set", "motor.friction=much"], &["motor.friction", "much"]),
        (&["--set", "motor.friction"], &["motor.friction", "key=value"]),
        (&["--step", "0"], &["step_s", "0", "1e-9 to 0.001"]),
        (&["--step", "nan"], &["step_s", "nan"]),
        (&["--amplitude", "1.01"], &["amplitude", "1.01", "0 to 1"]),
        (&["--amplitude", "-0.5"], &["amplitude", "-0.5", "0 to 1"]),
        (&["--duration", "-1"], &["duration_s", "-1"]),
        (&["--seed", "-1"], &["seed", "-1"]),
        (&["--seed", "1.5"], &["seed", "1.5"]),
        (&["--drive", "d"], &["drive", "d", "b, c, off"]),
        (&["--friction", "none"], &["friction", "none", "paper, coulomb"]),
        (&["--settle", "5", "--duration", "1"], &["settle_s", "5", "duration_s"]),
        (&["--scene", "nowhere.toml"], &["nowhere.toml"]),
        (&["--scene", "."], &["."]),
    ];
    for (arguments, words) in cases {
        refuses(folder.path(), &[&["simulate"], *arguments].concat(), words);
    }
    let named = ["--only", "30 frames/day", "no bench", "30,000 frames/s alone"];
    refuses(folder.path(), &["instruments", "--only", "30 frames/day"], &named);
}

/// A key that a command would ignore or overwrite, in an argument and in a file: the refusal names who reads it.
#[test]
fn tool_keys_that_a_command_does_not_read_are_refused() {
    let folder = folder();
    for (command, set, words) in [
        (
            "simulate",
            "plant.friction=paper",
            &["simulate", "plant.friction", "position", "simulate.friction"][..],
        ),
        ("position", "rate.deg_s=5", &["position does not read rate.deg_s", "rate, pil, run read it"]),
        ("filters", "ldv.sample_rate_hz=100000", &["filters", "ldv.sample_rate_hz", "estimate"]),
        ("response-map", "plant.step_s=1e-6", &["response-map", "plant.step_s"]),
        ("positioning-trials", "position.to_deg=5", &["positioning-trials", "position.to_deg", "pil"]),
    ] {
        refuses(folder.path(), &[command, "--set", set], words);
        std::fs::write(
            folder.path().join("scene.toml"),
            format!("seed = 2\n{}\n", set.replace("=paper", "=\"paper\"")),
        )
        .expect("a writable folder");
        refuses(folder.path(), &[command, "--scene", "scene.toml"], &[words, &["scene.toml:2:"]].concat());
    }
    assert!(!folder.path().join("out").exists());
}

/// A flag that does not exist is refused by the parser of the command line, which takes a few lines for it.
#[test]
fn tool_unknown_flag_is_refused() {
    let folder = folder();
    for arguments in [&["simulate", "--durations", "1"][..], &["simulat"], &["simulate", "--format", "xml"]] {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty(), "{arguments:?}");
    }
}

#[test]
fn tool_malformed_scenes_are_refused_with_their_place() {
    let folder = folder();
    for (text, words) in [
        ("[simulate\nduration_s = 1\n", &["scene.toml:1"][..]),
        ("[motor]\nstator_mass_kg = \n", &["scene.toml:2"]),
        (
            "[motor]\n\nstator_mas_kg = 1e-5\n",
            &["scene.toml:3", "motor.stator_mas_kg", "motor.stator_mass_kg"],
        ),
        ("[motor]\nrestitution = 7\n", &["scene.toml:2", "motor.restitution", "7", "0 to 1"]),
        ("[motor]\nrestitution = nan\n", &["scene.toml:2", "motor.restitution"]),
        ("[motor]\nrestitution = [0.5]\n", &["scene.toml:2", "restitution"]),
        ("motor = 3\n", &["scene.toml:1", "motor"]),
    ] {
        std::fs::write(folder.path().join("scene.toml"), text).expect("a writable folder");
        refuses(folder.path(), &["simulate", "--scene", "scene.toml"], words);
    }
    std::fs::write(folder.path().join("scene.toml"), [0xFF, 0xFE, 0x00, 0x80]).expect("a writable folder");
    refuses(folder.path(), &["simulate", "--scene", "scene.toml"], &["scene.toml"]);
}

/// What stands under the name of a result stays there, to the byte, until a run has succeeded.
#[test]
fn tool_a_failing_run_leaves_the_output_alone() {
    let folder = folder();
    let path = folder.path().join("out.csv");
    std::fs::write(&path, "precious\n").expect("a writable folder");
    refuses(
        folder.path(),
        &["simulate", "--out", "out.csv", "--set", "motor.friction=-1"],
        &["motor.friction"],
    );
    refuses(folder.path(), &["simulate", "--out", "out.csv", "--settle", "9"], &["settle_s"]);
    assert_eq!(std::fs::read_to_string(&path).expect("still there"), "precious\n");
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").collect();
    assert_eq!(left.len(), 1, "nothing half-written beside it: {left:?}");
    succeeds(folder.path(), &["simulate", "--duration", "0.6", "--out", "out.csv"]);
    assert_ne!(std::fs::read_to_string(&path).expect("replaced"), "precious\n");
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").collect();
    assert_eq!(left.len(), 1, "nothing left over: {left:?}");
}

#[test]
fn tool_unwritable_output_is_refused_before_any_work() {
    let folder = folder();
    std::fs::create_dir(folder.path().join("taken")).expect("a writable folder");
    for out in ["nowhere/out.csv", "taken"] {
        // An hour of model time: refused at once, or the test would take minutes.
        refuses(folder.path(), &["simulate", "--duration", "3600", "--out", out], &[out]);
    }
}

/// The list of keys is complete enough to run from: each motor key is there with its default.
#[test]
fn tool_keys_lists_every_parameter() {
    let folder = folder();
    let table = succeeds(folder.path(), &["keys"]);
    for parameter in motor_model::Parameter::ALL {
        let key = parameter.spec().key;
        assert!(table.lines().any(|line| line.split_whitespace().next() == Some(key)), "{key}");
    }
    for key in ["seed", "simulate.drive", "simulate.step_s", "position.to_deg"] {
        assert!(table.lines().any(|line| line.split_whitespace().next() == Some(key)), "{key}");
    }
}
