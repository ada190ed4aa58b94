//! `host-sim size`: the firmware fits its part, and its tasks can neither panic nor allocate nor fall back on software's double precision.

use serde_json::Value;

use crate::host_sim;

#[test]
fn tool_firmware_fits_and_its_tasks_call_nothing_forbidden() {
    let output = host_sim().args(["size", "--format", "json"]).output().expect("host-sim starts");
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaint}");
    let report: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    for program in report["programs"].as_array().expect("programs") {
        let number = |field: &str| program[field].as_u64().unwrap_or_else(|| panic!("{field} in {program}"));
        // Empty images, or tasks whose calls are not followed, would pass for small and harmless.
        assert!(number("flash_bytes") > 16 * 1024 && number("flash_bytes") <= 256 * 1024, "{program}");
        assert!(number("functions") > 10, "{program}");
        assert_eq!(program["forbidden"], Value::Array(vec![]), "{program}");
    }
    let pil = &report["programs"][1];
    let stacks = pil["stacks"].as_array().expect("a stack for each filter");
    let filters: Vec<&Value> = stacks.iter().map(|stack| &stack["filter"]).collect();
    assert_eq!(filters, ["constant_rate", "impact_aided", "twin"], "{pil}");
    let bytes = |of: &Value, field: &str| of[field].as_u64().unwrap_or_else(|| panic!("{field} in {of}"));
    for stack in stacks {
        let ram = bytes(pil, "static_bytes") + bytes(stack, "bytes");
        // A filter is some kB of variables, and a tick a kB of stack.
        assert!(bytes(stack, "bytes") > 1024 && ram > 16 * 1024 && ram <= 64 * 1024, "{pil}");
    }
}
