//! `host-sim results`: pages written whole, with the figures that the studies' own commands give; what has changed is
//! told.

use serde_json::Value;

use crate::support::built_command::{folder, json_on_two, number, output_on, run, written};

/// A page after `results --quick`, and the JSON of the command that it tells of.
fn page_beside(page: &str, command: &[&str]) -> (String, Value) {
    let folder = folder();
    output_on(2, folder.path(), &["results", page, "--quick", "--out", "."]);
    let text = written(folder.path(), &format!("{page}.md"));
    (text, json_on_two(folder.path(), &[command, &["--format", "json"]].concat()))
}

/// No place is left, no line is longer than a page allows, and prose comes before tables.
fn assert_whole(page: &str) {
    assert!(page.starts_with("# ") && page.contains("**Verdict.**") && page.contains("**Loss"), "{page}");
    let prose = page.lines().filter(|line| !line.starts_with('|'));
    assert!(prose.clone().all(|line| line.chars().count() <= 118), "{page}");
    assert!(prose.clone().all(|line| !line.contains("{table")), "{page}");
    assert!(page.ends_with('\n') && !page.ends_with("\n\n"));
}

#[test]
fn tool_the_page_on_positioning_says_what_the_trials_say() {
    let (page, trials) =
        page_beside("positioning", &["positioning-trials", "--trials", "20", "--compare", "2"]);
    assert_whole(&page);
    let (p95, worst) = (number(&trials, "p95_mdeg"), number(&trials, "max_mdeg"));
    assert!(page.contains(&format!("{p95:.2} mdeg for 95 % of 20 moves")), "{p95}: {page}");
    assert!(page.contains(&format!("{worst:.2} mdeg at worst")), "{worst}: {page}");
    assert!(page.contains("| bang-bang on the estimate | 2 "), "{page}");
    let beside = |name: &str| page.lines().any(|line| line.starts_with(&format!("| {name} ")));
    assert!(beside("height only") && beside("set F"), "{page}");
}

#[test]
fn tool_the_page_on_calibration_says_what_the_calibrations_say() {
    let command = ["calibrate", "--runs", "2", "--duration", "6"];
    let (page, calibrations) = page_beside("calibration", &command);
    assert_whole(&page);
    let rms = number(&calibrations["over_runs"], "scale_factor_rms_ppm");
    assert!(page.contains(&format!("In 6 s the scale factor is found to {rms:.2} ppm rms")), "{rms}: {page}");
    let beside = |name: &str| page.lines().any(|line| line.starts_with(&format!("| {name} ")));
    assert!(beside("height only") && beside("set F"), "{page}");
    let (_, needed) =
        page.split_once("| cut short ").expect("the table of plans that are as long as is needed");
    let row: Vec<&str> = needed.lines().nth(2).expect("a row").split('|').map(str::trim).collect();
    // 20 s are too short for 10 ppm on set F.
    assert_eq!(row[1..6], ["set F", "1", "1", "20 to 20", "1"], "{page}");
}

/// A page without a change passes. A figure that differs is named by its place, and nothing is written.
#[test]
fn tool_a_page_that_has_changed_is_told() {
    let folder = folder();
    let write = ["results", "faults", "--quick", "--out", "."];
    let check = [&write[..], &["--check"]].concat();
    output_on(2, folder.path(), &write);
    output_on(1, folder.path(), &check);
    let path = folder.path().join("faults.md");
    let page = written(folder.path(), "faults.md");
    let changed = page.replacen("| mark:lost        | 1 ", "| mark:lost        | 2 ", 1);
    assert_ne!(changed, page);
    std::fs::write(&path, &changed).expect("a page");
    let refused = run(folder.path(), &check);
    let complaint = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{complaint}");
    let line =
        1 + changed.lines().position(|line| line.starts_with("| mark:lost        | 2 ")).expect("the row");
    let place = format!("faults.md:{line}:");
    assert!(complaint.contains(&place) && complaint.contains("hint"), "{complaint}");
    assert_eq!(written(folder.path(), "faults.md"), changed);
}
