//! `host-sim accuracy`: what it computes, what it writes, what it refuses. Never how fast: that is for a user to see.

use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::built_command::{folder, json_on_two, number, output_on, written};
use crate::support::closeness::assert_between;

/// Tolerance of the adaptive integrators, 1e-9, over the 1.5 ms to the first impact.
const TOLERANCE_S: f64 = 1.5e-12;

/// A quick run on two threads, made once for all tests, and the folder that it wrote to.
fn quick() -> &'static (TempDir, Value) {
    static QUICK: OnceLock<(TempDir, Value)> = OnceLock::new();
    QUICK.get_or_init(|| {
        let folder = folder();
        let arguments = ["accuracy", "--quick", "--format", "json", "--out", "result"];
        let report = json_on_two(folder.path(), &arguments);
        (folder, report)
    })
}

fn rows<'a>(report: &'a Value, of: &str) -> &'a Vec<Value> {
    report[of].as_array().expect("a list")
}

/// The rows of the whole motor with these, from the fine to the coarse step.
fn curve<'a>(report: &'a Value, impacts: &str, precision: &str) -> Vec<&'a Value> {
    let all = rows(report, "rows").iter();
    let is_it =
        |row: &&Value| row["model"] == "whole" && row["impacts"] == impacts && row["precision"] == precision;
    all.filter(is_it).collect()
}

/// The row of an integrator on the ball on the plate.
fn peer<'a>(report: &'a Value, name: &str, step_s: f64) -> &'a Value {
    let is_it = |row: &&Value| row["name"] == name && (number(row, "step_s") / step_s - 1.0).abs() < 1e-9;
    rows(report, "peers").iter().find(is_it).unwrap_or_else(|| panic!("{name} at {step_s} in {report}"))
}

#[test]
fn tool_every_figure_is_there() {
    let (_, report) = quick();
    // Two rules, two precisions, six steps.
    assert_eq!(rows(report, "rows").len(), 2 * 2 * 6);
    for row in rows(report, "rows") {
        for mode in 0..2 {
            assert_between(number(&row["cost"][mode], "ns_per_step"), 0.1, 1e6, row);
            let flights = &row["flights"][mode];
            assert_between(number(flights, "flights") + number(flights, "missed"), 40.0, 40.0, row);
            assert_between(number(flights, "rate_rms_rad_s"), 0.0, 30.0, row);
        }
        for (condition, collides) in [(0, true), (1, true), (2, true), (3, false)] {
            let steady = &row["steady"][condition];
            assert_between(number(&steady["rate"], "half_width"), 0.0, 2.0, row);
            assert_eq!(steady["impacts"].is_object(), collides, "{row}");
            assert_eq!(steady["collision"].is_object(), collides, "{row}");
        }
        for burst in 0..4 {
            assert_between(number(&row["bursts"][burst], "relative").abs(), 0.0, 200.0, row);
        }
    }
}

/// The integrators of other crates, which `tests/soak.sh` builds into the command.
#[cfg(feature = "peers")]
#[test]
fn dual_integrators_of_other_crates_meet_the_plate_at_the_same_instant() {
    let (_, report) = quick();
    for name in ["diffsol 0.18 tsit45", "differential-equations 0.7 dopri5", "ode_solvers 0.6 dopri5"] {
        let peer = peer(report, name, 5e-6);
        assert_between(number(&peer["cost"], "ns_per_step"), 1.0, 1e6, peer);
        assert_between(number(peer, "first_impact_rms_s"), 0.0, TOLERANCE_S, peer);
    }
}

/// Each form of the rotor at each step in each mode, the finest step of the full form alone. The full form tilts as set
/// F does (`tests/system/command/tool_tilting_scenes.rs`: 31 mrad rms in mode B) and meets its pin; the one of height
/// alone has neither tilt nor hub.
#[test]
fn dual_forms_of_the_rotor_stand_beside_the_full_one() {
    let (_, report) = quick();
    let rows = rows(report, "tilting");
    assert_eq!(rows.len(), 2 * (1 + 3 * 2));
    for row in rows {
        assert_between(number(&row["cost"], "ns_per_step"), 0.1, 1e6, row);
        assert_eq!(row["tilt_rms_mrad"].is_object(), row["rotor"] != "height_only", "{row}");
        assert!(number(&row["impacts_per_s"], "mean") > 100.0, "{row}");
        if row["rotor"] == "tilting" && row["drive"] == "B" {
            assert_between(number(&row["tilt_rms_mrad"], "mean"), 25.0, 37.0, row);
            assert!(number(&row["hub_contacts_per_s"], "mean") > 300.0, "{row}");
        }
    }
    // What leaving out makes: without the pin's friction mode B turns several times as fast.
    let rate = |rotor: &str| {
        let of = |row: &&Value| row["rotor"] == rotor && row["drive"] == "B" && number(row, "step_s") > 5e-6;
        number(&rows.iter().find(of).expect("a row")["rate_rad_s"], "mean")
    };
    assert!(rate("height_only") > 2.0 * rate("tilting"), "{} {}", rate("height_only"), rate("tilting"));
}

/// A first impact at the end of its step is late by some 0.6 steps, root mean square of what is spread evenly over one;
/// a located one is off by the sixth order of the step.
#[test]
fn tool_errors_fall_with_the_step() {
    let (_, report) = quick();
    for mode in 0..2 {
        let errors = |impacts| -> Vec<f64> {
            let of_row = |row: &&Value| number(&row["flights"][mode], "first_impact_rms_s");
            curve(report, impacts, "f64").iter().map(of_row).collect()
        };
        let located = errors("located");
        for pair in located.windows(2) {
            assert!(pair[0] < 0.2 * pair[1], "mode {mode}: {located:?}");
        }
        assert_between(errors("end_of_step")[0], 0.45e-6, 0.7e-6, "1 us");
        assert_between(located[0], 0.0, 1e-15, "1 us");
    }
    for impacts in ["located", "end_of_step"] {
        let worst = |row: &Value| {
            (0..4).map(|burst| number(&row["bursts"][burst], "relative").abs()).fold(0.0, f64::max)
        };
        let curve = curve(report, impacts, "f64");
        assert!(worst(curve[0]) < 0.1 * worst(curve[5]), "{impacts}");
    }
}

/// The targets that need no clock are kept or missed by what stands in the rows.
#[test]
fn tool_verdicts_say_met_or_missed() {
    let (_, report) = quick();
    let verdicts = rows(report, "verdicts");
    for (target, met) in [
        ("located f64 at 10 us: displacement of bursts within 2 %", Some(true)),
        ("located f32 at 20 us: displacement of bursts within 5 %", Some(true)),
        ("located f64 at 10 us: mean rate within 2 %", None),
        ("located f64 at 20 us: impacts per second within 5 %", None),
        ("located f64 at 10 us: a step of mode B takes at most 15 ns", None),
        ("located at 10 us: at equal error at least 10 times cheaper than end of step", None),
        ("ball on a plate, located f64 at 5 us: at least 400 times real time", None),
    ] {
        let verdict = verdicts.iter().find(|verdict| verdict["target"] == target);
        let verdict = verdict.unwrap_or_else(|| panic!("{target} in {verdicts:?}"));
        assert!(verdict["met"].is_boolean() && !verdict["found"].as_str().unwrap_or_default().is_empty());
        if let Some(met) = met {
            assert_eq!(verdict["met"], met, "{verdict}");
        }
    }
    // No step tried brings end-of-step impacts to the error of located ones in time.
    let cheaper = rows(report, "cheaper").iter().filter(|one| {
        one["error"].as_str().is_some_and(|error| error.starts_with("time of the next impact"))
    });
    assert_eq!(cheaper.map(|one| one["at_least"] == true).collect::<Vec<_>>(), [true, true]);
}

/// Nothing but what a clock says depends on the number of threads, nor on the run.
#[test]
fn law_threads_change_no_error() {
    let (_, on_two) = quick();
    let folder = folder();
    let on_one = output_on(1, folder.path(), &["accuracy", "--quick", "--format", "json"]);
    let on_one: Value = serde_json::from_slice(&on_one).expect("JSON");
    let errors = |report: &Value| -> Vec<Value> {
        let of_row = |row: &Value| {
            Value::from(["flights", "steady", "bursts"].map(|field| row[field].clone()).to_vec())
        };
        rows(report, "rows").iter().map(of_row).collect()
    };
    assert_eq!(errors(on_two), errors(&on_one));
    let rates = |report: &Value| -> Vec<Value> {
        rows(report, "tilting").iter().map(|row| row["rate_rad_s"].clone()).collect()
    };
    assert_eq!(rates(on_two), rates(&on_one));
    assert!(folder.path().join("out/accuracy/accuracy.svg").is_file());
}

/// Two implementations of two languages and a closed form, one first impact.
#[test]
fn dual_scipy_and_the_twin_meet_the_plate_at_the_same_instant() {
    let (_, report) = quick();
    let off_s = |name, step_s| number(peer(report, name, step_s), "first_impact_rms_s");
    for name in ["SciPy solve_ivp LSODA", "SciPy solve_ivp RK45"] {
        assert_between(off_s(name, 5e-6), 0.0, TOLERANCE_S, name);
    }
    assert_between(off_s("twin located, f64", 5e-6), 0.0, TOLERANCE_S, "twin");
}

#[test]
fn tool_the_table_and_the_picture_are_written() {
    let (folder, _) = quick();
    assert!(written(folder.path(), "result/accuracy.svg").starts_with("<svg"));
    assert_eq!(written(folder.path(), "result/table.csv").lines().count(), 1 + 2 * 24);
}
