//! `host-sim instructions` against the counts that were reviewed, `instructions.m4.json` and `instructions.m7.json`.
//!
//! The emulator counts exactly, so with the compiler that the reviewed counts name they may differ by [`MARGIN`] only,
//! which is what the counting program's own layout moves. Another compiler makes other instructions of the same source:
//! then by [`OTHER_COMPILER_MARGIN`]. A test that fails prints all that differs, as a table for a pull request.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Output;

use serde_json::Value;

use crate::host_sim;

/// Instructions.
const MARGIN: f64 = 3.0;

/// Share of the reviewed count.
const OTHER_COMPILER_MARGIN: f64 = 0.1;

/// Head of the table of differences, in Markdown.
const TABLE_HEAD: &str = "\
| operation | mean, old | new | % | longest, old | new | % |
|---|---|---|---|---|---|---|
";

/// Records, each of an operation of its own.
fn records(array: Value) -> Vec<Value> {
    let Value::Array(records) = array else { panic!("no array: {array}") };
    for record in &records {
        let alike = |other: &&Value| other["operation"] == record["operation"];
        assert_eq!(records.iter().filter(alike).count(), 1, "{record}");
    }
    records
}

fn number(record: &Value, field: &str) -> f64 {
    record[field].as_f64().unwrap_or_else(|| panic!("{field} is a number in {record}"))
}

/// In which fields `counted` is too far from `reviewed`.
fn differences(counted: &Value, reviewed: &Value) -> Vec<String> {
    let same_compiler = counted["rustc"] == reviewed["rustc"];
    let count = (number(counted, "count") - number(reviewed, "count")).abs();
    let mut differences = Vec::new();
    if count > 0.0 {
        differences.push(format!("{counted} against {reviewed}: another number of samples"));
    }
    for field in ["mean", "max"] {
        let (now, before) = (number(counted, field), number(reviewed, field));
        let margin = if same_compiler { MARGIN } else { MARGIN.max(OTHER_COMPILER_MARGIN * before) };
        // Asked this way round, so that NaN is a difference.
        let close = (now - before).abs() <= margin;
        if !close {
            let operation = &reviewed["operation"];
            differences.push(format!("{operation}: {field} {now}, reviewed {before}, margin {margin:.2}"));
        }
    }
    differences
}

/// Every operation that differs, by however little, or is in one of both lists alone: what was reviewed, what is
/// counted, and by how much that is more.
fn table(counted: &[Value], reviewed: &[Value]) -> String {
    let mut table = TABLE_HEAD.to_owned();
    let find = |records: &[Value], operation: &Value| {
        records.iter().find(|record| record["operation"] == *operation).cloned().unwrap_or_default()
    };
    let new = counted.iter().filter(|record| find(reviewed, &record["operation"]).is_null());
    for operation in reviewed.iter().chain(new).map(|record| &record["operation"]) {
        let (old, new) = (find(reviewed, operation), find(counted, operation));
        let mut row = vec![operation.as_str().expect("a name").to_owned()];
        for field in ["mean", "max"] {
            let both = old[field].as_f64().zip(new[field].as_f64());
            row.extend([&old, &new].map(|record| {
                record[field].as_f64().map_or_else(|| "-".to_owned(), |number| number.to_string())
            }));
            let percent = both.map(|(old, new)| format!("{:+.1}", 100.0 * (new - old) / old));
            row.push(percent.unwrap_or_default());
        }
        if ["mean", "max", "count"].iter().any(|field| old[field] != new[field]) {
            let _ = writeln!(table, "| {} |", row.join(" | "));
        }
    }
    table
}

fn assert_reviewed(board: &str, reviewed: &str) {
    let arguments = ["instructions", "--board", board, "--format", "json"];
    let Output { status, stdout, stderr } = host_sim().args(arguments).output().expect("host-sim starts");
    assert!(status.success(), "{arguments:?}: {status}\n{}", String::from_utf8_lossy(&stderr));
    let mut result: Value = serde_json::from_slice(&stdout).expect("JSON and nothing else");
    assert_eq!((&result["command"], &result["board"]), (&Value::from("instructions"), &Value::from(board)));
    let counted = records(result["operations"].take());
    let reviewed = records(serde_json::from_str(reviewed).expect("JSON"));
    let first = &result["key_figures"][0];
    assert_eq!((&first["of"], &first["kind"]), (&counted[0]["operation"], &Value::from("single")));

    let operations = |records: &[Value]| -> Vec<Value> {
        records.iter().map(|record| record["operation"].clone()).collect()
    };
    let table = table(&counted, &reviewed);
    let accept = format!(
        "to accept what is counted now: \
         cargo run -- instructions --board {board} --out tests/qemu/instructions.{board}.json"
    );
    assert_eq!(
        operations(&counted),
        operations(&reviewed),
        "left: counted, right: reviewed; {accept}\n\n{table}"
    );
    let mut all = Vec::new();
    for (counted, reviewed) in counted.iter().zip(&reviewed) {
        assert_eq!((&counted["board"], &reviewed["board"]), (&Value::from(board), &Value::from(board)));
        all.extend(differences(counted, reviewed));
    }
    let compilers = (&counted[0]["rustc"], &reviewed[0]["rustc"]);
    assert!(
        all.is_empty(),
        "{}\ncompiled by {}, reviewed with {}: {MARGIN} instructions are allowed with the same compiler, \
         {} % with another\n{accept}\n\n{table}",
        all.join("\n"),
        compilers.0,
        compilers.1,
        100.0 * OTHER_COMPILER_MARGIN
    );
}

#[test]
fn tool_instructions_on_a_cortex_m4f_are_those_reviewed() {
    assert_reviewed("m4", include_str!("instructions.m4.json"));
}

#[test]
fn tool_instructions_on_a_cortex_m7_are_those_reviewed() {
    assert_reviewed("m7", include_str!("instructions.m7.json"));
}

/// The margins themselves: what they let pass and what they do not.
#[test]
fn exact_margins() {
    let record = |rustc: &str, mean: f64, max: u32| {
        let (operation, count) = ("a", 7);
        serde_json::json!({ "operation": operation, "rustc": rustc, "count": count, "mean": mean, "max": max })
    };
    let reviewed = record("1", 100.5, 1000);
    let differs = |counted: Value| differences(&counted, &reviewed).len();
    assert_eq!(differs(record("1", 103.5, 997)), 0);
    assert_eq!(differs(record("1", 103.51, 996)), 2);
    assert_eq!(differs(record("2", 110.5, 900)), 0);
    assert_eq!(differs(record("2", 110.6, 899)), 2);
    let mut fewer = reviewed.clone();
    fewer["count"] = 6.into();
    assert_eq!(differs(fewer), 1);
}

/// The table has what differs within the margins as well, what is new and what is gone, and nothing that is the same.
#[test]
fn exact_the_table_has_all_that_differs() {
    let record = |operation: &str, mean: f64, max: u32| {
        let count = 7;
        serde_json::json!({ "operation": operation, "count": count, "mean": mean, "max": max })
    };
    let reviewed = [record("a", 200.0, 400), record("same", 1.0, 1), record("gone", 2.5, 3)];
    let counted = [record("a", 190.0, 401), record("same", 1.0, 1), record("new", 10.0, 11)];
    let table = table(&counted, &reviewed);
    let rows = [
        "| a | 200 | 190 | -5.0 | 400 | 401 | +0.2 |",
        "| gone | 2.5 | - |  | 3 | - |  |",
        "| new | - | 10 |  | - | 11 |  |",
    ];
    assert!(table.lines().skip(2).eq(rows), "{table}");
}

/// Without an emulator, with a program that prints something else, and with a file that is no program: one line and
/// exit code 2.
#[test]
fn tool_instructions_that_cannot_be_counted_are_refused_in_one_line() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let no_program = folder.path().join("text.elf");
    std::fs::write(&no_program, "no program").expect("a file");
    let old = folder.path().join("counts.json");
    std::fs::write(&old, "old").expect("a file");
    let refusal = |path: Option<&str>, elf: &Path| {
        let mut command = host_sim();
        if let Some(path) = path {
            command.env("PATH", path);
        }
        command.args(["instructions", "--elf"]).arg(elf).arg("--out").arg(&old);
        let Output { status, stdout, stderr } = command.output().expect("host-sim starts");
        let complaint = String::from_utf8(stderr).expect("text");
        assert_eq!(status.code(), Some(2), "{complaint}");
        assert!(stdout.is_empty() && complaint.lines().count() == 1, "{complaint}");
        complaint
    };
    let no_emulator = refusal(Some("/nowhere"), &no_program);
    assert!(
        no_emulator.contains("cannot run qemu-system-arm") && no_emulator.contains("hint"),
        "{no_emulator}"
    );
    assert!(refusal(None, &folder.path().join("missing.elf")).contains("cannot read"));
    assert!(refusal(None, &no_program).contains("qemu-system-arm failed"));
    let complaint = refusal(None, Path::new(&crate::elf("parity")));
    assert!(complaint.contains("line 1 does not name the compiler"), "{complaint}");
    assert_eq!(std::fs::read_to_string(&old).expect("still there"), "old");
}
