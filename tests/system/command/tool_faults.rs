//! `faults`: parts are the whole, whatever the threads; a listed command repeats its run.

use serde_json::Value;

use crate::support::built_command::{folder, json_on_two, number, output_on, refuses, written};

/// Of six runs: one process on two threads, and three parts on one thread each, put together in another order.
#[test]
fn exact_parts_are_the_whole_and_commands_repeat_their_runs() {
    let folder = folder();
    let coarse = ["--set", "plant.step_s=1e-5"];
    let whole =
        json_on_two(folder.path(), &[&["faults", "--runs", "6", "--format", "json"], &coarse[..]].concat());
    let table = written(folder.path(), "out/faults/runs.csv");
    for part in ["1/3", "2/3", "3/3"] {
        let out = format!("part{}", &part[..1]);
        let flags = ["faults", "--runs", "6", "--shard", part, "--out", &out];
        output_on(1, folder.path(), &[&flags[..], &coarse[..]].concat());
    }
    let parts = ["part3/runs.csv", "part1/runs.csv", "part2/runs.csv"];
    let merge = ["faults", "--format", "json", "--out", "merged"];
    let merge = [&merge[..], &coarse, &["--merge"], &parts].concat();
    assert_eq!(json_on_two(folder.path(), &merge), whole);
    assert_eq!(written(folder.path(), "merged/runs.csv"), table);
    let merge =
        ["faults", "--out", "merged", "--merge", "part1/runs.csv", "part2/runs.csv", "part3/runs.csv"];
    refuses(
        folder.path(),
        &[&merge[..], &["--scene", "set_f_plant"]].concat(),
        &["part1/runs.csv is of another scene than this command: its digest is ", "; hint: "],
    );
    let all = &whole["all"];
    let endings = ["reached", "gave_up", "timed_out", "wrong"].map(|ending| number(all, ending));
    assert!((endings.iter().sum::<f64>() - 6.0).abs() < 0.5, "{all}");
    let filters = whole["filters"].as_array().expect("a row each");
    assert!(filters.len() == 3 && filters.iter().all(|row| row["runs"] == 2), "{filters:?}");

    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let (columns, run) = lines.next().zip(lines.next()).expect("a header and a run");
    let cell = |name: &str| {
        let place = columns.iter().position(|column| *column == name).unwrap_or_else(|| panic!("{name}"));
        run[place]
    };
    let filter = format!("estimator.filter={}", cell("filter"));
    let mut flags = vec!["position", "--format", "json", "--seed", cell("seed"), "--to", cell("target_deg")];
    flags.extend(["--set", &filter, "--set", "position.deadline_s=10"]);
    flags.extend(coarse);
    flags.extend(cell("faults").split(' ').flat_map(|word| ["--fault", word]));
    let repeated: Value = json_on_two(folder.path(), &flags);
    let expected: f64 = cell("error_mdeg").parse().expect("a number");
    assert!((number(&repeated, "final_error_mdeg") - expected).abs() < 1e-9, "{flags:?} {repeated}");
}

#[test]
fn tool_parts_that_are_none_are_refused() {
    let folder = folder();
    refuses(folder.path(), &["faults", "--shard", "3/2"], &["--shard = 3/2 is not I/N with I from 1 to N"]);
    std::fs::write(folder.path().join("other.csv"), "a,b\n1,2\n").expect("a file");
    refuses(folder.path(), &["faults", "--merge", "other.csv"], &["other.csv", "number"]);
}
