//! `host-sim filters`: every filter in every variant, what it costs and how far it is off; what the command writes and
//! refuses.

use std::sync::OnceLock;

use serde_json::Value;
use tempfile::TempDir;

use crate::support::built_command::{folder, json_on_two, number, refuses, written};
use crate::support::closeness::assert_between;

const ARGUMENTS: [&str; 10] =
    ["filters", "--host-only", "--plants", "2", "--seed", "11", "--out", "result", "--format", "json"];
const OPERATIONS: [&str; 3] = ["camera_frame", "vibrometer_sample", "prediction"];

/// Two motors on two threads, made once for all tests, and the folder that it wrote to.
fn two() -> &'static (TempDir, Vec<Value>) {
    static TWO: OnceLock<(TempDir, Vec<Value>)> = OnceLock::new();
    TWO.get_or_init(|| {
        let folder = folder();
        let rows = json_on_two(folder.path(), &ARGUMENTS)["rows"].as_array().expect("rows").clone();
        (folder, rows)
    })
}

#[track_caller]
fn row<'a>(rows: &'a [Value], filter: &str, precision: &str, rate_hz: f64, drive: &str) -> &'a Value {
    let is_it = |row: &&Value| {
        let rate = row["ldv_sample_rate_hz"].as_f64().expect("a rate");
        row["filter"] == filter
            && row["precision"] == precision
            && row["drive"] == drive
            && rate.total_cmp(&rate_hz).is_eq()
    };
    let mut found = rows.iter().filter(is_it);
    let row = found.next().unwrap_or_else(|| panic!("{filter} {precision} {rate_hz} {drive} in {rows:?}"));
    assert!(found.next().is_none(), "{filter} {precision} {rate_hz} {drive} twice");
    row
}

#[test]
fn tool_every_variant_has_its_error_and_its_cost() {
    let (_, rows) = two();
    for &filter in simulation::runs::filter::FILTERS {
        for drive in ["b", "c"] {
            for rate_hz in [200e3, 100e3, 50e3] {
                let [single, double] =
                    ["f32", "f64"].map(|precision| row(rows, filter, precision, rate_hz, drive));
                for row in [single, double] {
                    assert_eq!(
                        (&row["runs"], &row["instructions"]),
                        (&Value::from(2), &Value::Null),
                        "{row}"
                    );
                    let ns = &row["ns"];
                    for operation in OPERATIONS {
                        assert_between(number(ns, operation), 0.0, 1e6, row);
                    }
                    let [frame, sample, prediction] = OPERATIONS.map(|operation| number(ns, operation));
                    let tick = 0.1 * frame + 1e-5 * rate_hz * sample + prediction;
                    assert_between(number(ns, "tick") / tick, 1.0 - 1e-9, 1.0 + 1e-9, row);
                }
                // The same frames and samples: what differs is rounding, and where the twin decides - which pair, stick
                // or slip - what rounding decides.
                let ratio = number(single, "rms_angle_mdeg") / number(double, "rms_angle_mdeg");
                let most = if filter == "twin" { 1.15 } else { 1.03 };
                assert_between(ratio, 1.0 / most, most, single);
            }
        }
    }
    assert_eq!(rows.len(), simulation::runs::filter::FILTERS.len() * 2 * 3 * 2);
}

/// The camera alone does not care how often the vibrometer samples, and a filter that uses impacts is better off with
/// more samples.
#[test]
fn law_more_samples_help_who_listens() {
    let (_, rows) = two();
    let error = |filter, rate_hz| number(row(rows, filter, "f32", rate_hz, "b"), "rms_angle_mdeg");
    let ratio = error("constant_rate", 50e3) / error("constant_rate", 200e3);
    assert_between(ratio, 0.99, 1.01, "camera alone");
    assert!(error("impact_aided", 200e3) < 0.98 * error("impact_aided", 50e3));
    assert!(error("impact_aided", 200e3) < 0.7 * error("constant_rate", 200e3));
}

#[test]
fn tool_the_table_and_the_picture_are_written() {
    let (folder, rows) = two();
    assert_eq!(written(folder.path(), "result/table.csv").lines().count(), rows.len() + 1);
    let picture = written(folder.path(), "result/filters.svg");
    assert!(picture.starts_with("<svg") && picture.contains("impact aided"));
}

#[test]
fn tool_what_cannot_be_is_refused_before_the_computing() {
    let folder = folder();
    refuses(folder.path(), &["filters", "--motors", "0"], &["--motors"]);
    assert!(!folder.path().join("out").exists());
}
