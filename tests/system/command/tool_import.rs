//! `import`: tables as a laboratory has them, and what a filter makes of the log.
//!
//! The tables are made of the log of a move (`support/awkward_tables.rs`).

use std::fs;

use serde_json::Value;

use crate::support::awkward_tables::{self, CLOCK, TABLES};
use crate::support::built_command::{folder, json, number, refuses, succeeds};
use crate::support::closeness::assert_between;

/// Without corrections each of them is asked for; with them the log's replay gives the estimates of the run, which a
/// filter judges by its innovations, and a wrong clock is judged worse.
#[test]
fn tool_a_recording_with_two_clocks_gaps_and_wrong_signs_is_imported() {
    let folder = folder();
    let path = folder.path();
    succeeds(path, &["position", "--to", "20", "--log", "own.csv", "--log-every", "1"]);
    let frames = awkward_tables::write(path);
    let looked = json(path, &[&TABLES[..], &["--format", "json"]].concat());
    let advice = looked["advice"].to_string();
    for flag in ["--camera-clock", "--camera-scale -1", "--vibrometer-offset"] {
        assert!(advice.contains(flag), "{flag}: {advice}");
    }
    let corrected = |clock: &str, log: &str| {
        let flags = ["--set", "camera.noise_m=7e-7", "--log", log, "--format", "json"];
        json(path, &[&TABLES[..], &awkward_tables::corrections(clock), &flags].concat())
    };
    let imported = corrected(CLOCK, "right.mcap");
    assert_eq!(imported["advice"], Value::Array(vec![]), "{imported}");
    assert_eq!(imported["sources"][0]["rows"].as_u64(), Some(frames), "{imported}");
    // The gap, and a frame to either side of it.
    assert_between(number(&imported["sources"][0], "longest_gap_s"), 0.01, 0.0102, "the gap in s");
    corrected("0.0105,35", "wrong.mcap");
    let replayed = |log: &str| json(path, &["replay", log, "--filter", "twin", "--format", "json"]);
    let (right, wrong) = (replayed("right.mcap"), replayed("wrong.mcap"));
    // Measurements alone: nothing is compared, and there is no truth.
    assert_eq!((right["same"].as_u64(), right["different"].as_u64()), (Some(0), Some(0)), "{right}");
    assert!(right["replayed"]["rms_error_mdeg"].is_null(), "{right}");
    let nis = |replayed: &Value| number(&replayed["replayed"], "nis");
    // 2 ms of a wrong clock are degrees at full speed.
    assert!(nis(&right) < nis(&wrong), "{} {}", nis(&right), nis(&wrong));
    assert_eq!(right["replayed"]["frames_used"].as_u64().unwrap() + 1, frames, "all but the first are used");

    // The estimate at the end is the end of the move.
    succeeds(path, &["replay", "right.mcap", "--filter", "twin", "--log", "again.csv"]);
    let last = |log: &str, column: &str| -> f64 {
        let text = fs::read_to_string(path.join(log)).unwrap();
        let place = text.lines().next().unwrap().split(',').position(|name| name == column).unwrap();
        let mut cells = text.lines().rev().map(|line| line.split(',').nth(place).unwrap());
        cells.find(|cell| !cell.is_empty()).unwrap().parse().unwrap()
    };
    let off_deg = last("again.csv", "estimate_angle_deg") - last("own.csv", "truth_angle_deg");
    assert_between(off_deg, -3e-3, 3e-3, "the last estimate less the last truth, in degrees");
}

/// The table of `--log run.csv` has the drive in rows of its own. Imported it is the drive that was recorded, and a
/// column that has no modes is refused.
#[test]
fn tool_a_log_as_a_table_is_imported_with_its_drive() {
    let folder = folder();
    let path = folder.path();
    let schedule = "off for 0.01, b:1 for 0.04, off for 0.02, c:1 for 0.03, off for 0.01";
    succeeds(path, &["record", "--schedule", schedule, "--log", "own.csv"]);
    let import =
        ["import", "--camera", "own.csv", "--camera-angle", "camera_angle_deg", "--drive", "own.csv"];
    let imported = json(path, &[&import[..], &["--log", "imported.csv", "--format", "json"]].concat());
    let drive = &imported["drive"];
    assert_between(number(drive, "mode_b_s"), 0.0398, 0.0402, "time in mode B");
    assert_between(number(drive, "mode_c_s"), 0.0298, 0.0302, "time in mode C");
    assert!(succeeds(path, &import).contains("s in mode B, 0.03"));
    let column = [&import[..], &["--drive-mode", "verdict"]].concat();
    refuses(path, &column, &["own.csv has no drive", "a mode in \"verdict\"", "hint: --drive-mode"]);
}

#[test]
fn tool_refusals_of_import_name_what_is_possible() {
    let folder = folder();
    let path = folder.path();
    fs::write(path.join("camera.csv"), "stamp,phi_deg\n1,2\n1.001,3\n").unwrap();
    for (arguments, said) in [
        (&["import"][..], "--camera FILE.csv, --vibrometer FILE.csv, or both"),
        (&["import", "--camera", "none.csv"], "cannot read none.csv"),
        (
            &["import", "--camera", "camera.csv"],
            "has no column \"angle_deg\"; hint: --camera-angle names one of stamp, phi_deg",
        ),
        (
            &["import", "--camera", "camera.csv", "--camera-time", "stamp", "--camera-angle", "phi_deg"],
            "hint: stamp:UNIT, with one of ms, us, ns, s",
        ),
        (
            &["import", "--camera", "camera.csv", "--camera-clock", "soon"],
            "--camera-clock = soon is not S or S,PPM",
        ),
        (&["import", "--camera-scale", "-1"], "--camera"),
    ] {
        refuses(path, arguments, &[said]);
    }
}
